//! Error of the series flow against its tolerance and the number of Taylor coefficients: the tables of `docs/flow.md`.
//!
//!     cargo run --release --example flow_accuracy
//!
//! One period of the gear pair of `benches/problems/P13.yaml`, from a state on its attractor, with two changes of contact. What
//! to look at: the error follows the tolerance, and more coefficients buy longer steps, not accuracy.

use gearlash::solve::integrate::{Exact, FlowObserver, Integrator, Segment, SeriesOptions};
use gearlash::study::Study;
use gearlash::system::System;
use std::f64::consts::TAU;
use std::path::Path;

/// Mesh frequency of the problem.
const FREQUENCY_HZ: f64 = 2500.0;
/// Periods before the one that is compared.
const TRANSIENT: usize = 200;

/// Counts steps.
#[derive(Default)]
struct Steps(usize);

impl FlowObserver for Steps {
    fn segment(&mut self, _segment: &Segment<'_>) {
        self.0 += 1;
    }
}

/// State after a period, and the steps it took.
fn period(system: &System, options: SeriesOptions, start: &[f64]) -> (Vec<f64>, usize) {
    let mut flow = Exact::with(system, options).expect("the pair has a series");
    let (mut state, mut steps) = (start.to_vec(), Steps::default());
    flow.advance(system, (0.0, TAU), &mut state, &mut steps);
    (state, steps.0)
}

fn main() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/problems/P13.yaml");
    let study = Study::load(&path, &[], &[]).expect("the problem is part of the project");
    let mut system = study.assembly.system.clone();
    system.set_excitation_frequency(TAU * FREQUENCY_HZ / study.assembly.scales.frequency);
    let closest = SeriesOptions {
        tolerance: 1e-15,
        ..SeriesOptions::default()
    };
    let mut start = vec![0.0; 2 * system.dof()];
    for _ in 0..TRANSIENT {
        start = period(&system, closest, &start).0;
    }
    let (wanted, _) = period(&system, closest, &start);
    let size = wanted.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    println!("| tolerance | 8 coefficients | 12 | 16 | 20 | 24 |");
    println!("|---|---|---|---|---|---|");
    for exponent in [4, 6, 8, 10, 12, 14] {
        let tolerance = 10.0_f64.powi(-exponent);
        let cell = |terms: usize| {
            let options = SeriesOptions {
                tolerance,
                terms,
                ..SeriesOptions::default()
            };
            let (state, steps) = period(&system, options, &start);
            let gaps = state.iter().zip(&wanted).map(|(a, b)| (a - b).abs());
            let error = gaps.fold(0.0, f64::max) / size;
            format!("{error:.0e} ({steps})")
        };
        let cells = [8, 12, 16, 20, 24].map(cell);
        println!("| 1e-{exponent} | {} |", cells.join(" | "));
    }
}
