//! P1 (Galerkin branch with stability and events), P3 (exact flow) and figure 9 inside one process: `cargo bench`.
//!
//! Whole processes: `/usr/bin/time -v target/release/gearlash run benches/problems/P1.yaml --jobs 1 --quiet`.

use divan::Bencher;
use gearlash::solve::integrate::{IntegratorChoice, choose};
use gearlash::study::Study;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::atomic::AtomicBool;

fn main() {
    divan::main();
}

fn load(name: &str) -> Study {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("benches/problems").join(name);
    Study::load(&path, &[], &[]).expect("the problem is part of the project")
}

/// Start, continuation, multipliers and located bifurcations of P1, without writing files.
#[divan::bench(sample_count = 20)]
fn p1_branch(bencher: Bencher) {
    let study = load("P1.yaml");
    bencher.bench(|| study.reports(&AtomicBool::new(false)).expect("P1 runs"));
}

/// A thousand excitation periods of P3.
#[divan::bench(sample_count = 20)]
fn p3_thousand_periods(bencher: Bencher) {
    let study = load("P3.yaml");
    let mut system = study.assembly.system.clone();
    system.set_excitation_frequency(1.2);
    let mut integrator = choose(&system, IntegratorChoice::Exact).expect("P3 is piecewise affine");
    let mut state = vec![0.0; 4];
    bencher.bench_local(|| {
        for _ in 0..1000 {
            integrator.advance(&system, (0.0, TAU), &mut state, &mut ());
        }
    });
}

/// Figure 9 as a sweep that follows the attractor and as independent runs on all cores, without writing files.
#[divan::bench(sample_count = 3)]
fn figure_9(bencher: Bencher) {
    let study = load("figure_9.yaml");
    bencher.bench(|| {
        study
            .reports(&AtomicBool::new(false))
            .expect("figure 9 runs")
    });
}
