//! Figure 11 of Rook & Singh (1995) with zeta = 0.05 against periodic solutions computed by an independent program.

mod common;

use gearlash::numeric::trigonometric::mean_square;
use gearlash::solve::branch::{self, Branch, Recorder, TraceOptions};
use gearlash::solve::continuation::ContinuationOptions;
use gearlash::solve::events::EventKind;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::newton::NewtonOptions;
use gearlash::solve::orbit::Orbit;
use gearlash::solve::start::{self, Start, StartMode};
use gearlash::system::System;

struct Rms;
impl Recorder for Rms {
    fn record(&mut self, _system: &System, orbit: &Orbit, values: &mut Vec<f64>) {
        values.extend(orbit.coefficients.iter().map(|a| mean_square(a).sqrt()));
    }
}

fn trace(harmonics: usize, marks: Vec<f64>) -> Branch {
    let system = common::system(&common::reference("fig11_case1")["system"]);
    let size = GalerkinOptions {
        harmonics,
        samples: GalerkinOptions::default_samples(harmonics, 1),
    };
    let newton = NewtonOptions::default();
    let Start::Found { u, .. } = start::find(&system, 2.5, size, StartMode::Auto, newton).unwrap()
    else {
        panic!("no start")
    };
    let mut problem = Galerkin::new(FrequencyFamily::new(system), 2.5, size).unwrap();
    let continuation = ContinuationOptions {
        range: (2.5, 0.77),
        step: 0.02,
        min_step: 1e-8,
        max_step: 0.1,
        max_points: 10_000,
        weight: 0.5,
        newton,
    };
    let options = TraceOptions {
        continuation,
        marks,
        stability: true,
    };
    branch::trace(&mut problem, u, &options, &mut Rms)
        .unwrap()
        .unwrap()
}

#[test]
fn explore() {
    let data = common::reference("fig11_case1");
    let solutions: Vec<_> = data["solutions"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|s| !s.is_null())
        .collect();
    let mut marks: Vec<f64> = solutions
        .iter()
        .map(|s| s["omega"].as_f64().unwrap())
        .collect();
    marks.dedup();
    for h in [12, 40] {
        let t = std::time::Instant::now();
        let branch = trace(h, marks.clone());
        println!(
            "H {h} points {} {:?} {:?}",
            branch.points.len(),
            branch.end,
            t.elapsed()
        );
        let its: usize = branch.points.iter().map(|p| p.newton.iterations).sum();
        println!("its {}", its as f64 / branch.points.len() as f64);
        for s in &solutions {
            let omega = s["omega"].as_f64().unwrap();
            let rms = common::floats(&s["q_rms"]);
            let best = branch
                .points
                .iter()
                .filter(|p| p.is_mark && (p.frequency - omega).abs() < 1e-9)
                .map(|p| {
                    let e = p
                        .recorded
                        .iter()
                        .zip(&rms)
                        .map(|(a, b)| (a / b - 1.0).abs())
                        .fold(0.0, f64::max);
                    (e, p.multipliers[0])
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            println!(
                "{omega} {:?} {:?} {:?}",
                s["multipliers"][0], best, s["stable"]
            );
        }
        for e in &branch.events {
            println!("{:?}", e);
        }
        let n = branch
            .events
            .iter()
            .filter(|e| e.kind == EventKind::Fold)
            .count();
        println!("{n} folds");
    }
    for b in data["bifurcations"].as_array().unwrap() {
        println!("{} {} nu {}", b["kind"], b["parameter"], b["nu"]);
    }
}
