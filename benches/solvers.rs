//! P1 (residual, branch with stability and events), P3 (exact flow), P13 (series flow), P11 (stiff stops), P4 (Newton step against length),
//! P5 (analyses of trains in SI units against the same equations as `reduced`), P8 (ensembles) and figure 9 inside one process: `cargo bench`.
//!
//! Whole processes: `/usr/bin/time -v target/release/gearlash run benches/problems/P1.yaml --jobs 1 --quiet`.

use divan::Bencher;
use gearlash::element::{Backlash, Linear};
use gearlash::numeric::factors::Factors;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::ensemble::{Ensemble, Next};
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::{IntegratorChoice, choose};
use gearlash::solve::residual::{Linearisation, Residual};
use gearlash::study::Study;
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
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

/// Residual and Jacobian of P1 about a motion that crosses both gaps: forces sampled, and integrated in closed form.
#[divan::bench(args = ["sampled", "exact"], sample_count = 100)]
fn p1_residual(bencher: Bencher, quadrature: &str) {
    let size = GalerkinOptions {
        harmonics: 12,
        samples: 256,
    };
    let system = load("P1.yaml").assembly.system;
    let problem = Galerkin::new(FrequencyFamily::new(system), 0.8, size).expect("12 harmonics");
    let mut problem = match quadrature {
        "exact" => problem
            .with_exact_quadrature(0.8)
            .expect("backlash is piecewise affine"),
        _ => problem,
    };
    let mut at = Linearisation::of(&problem);
    let u = DVector::from_fn(problem.dim(), |k, _| match k % 25 {
        0 => 0.8,
        1 | 2 => 1.0,
        order => 0.5 / (order * order) as f64,
    });
    bencher.bench_local(|| problem.linearise(&u, 0.8, &mut at).expect("finite"));
}

/// P4: P2's chain with a number of connections, damping 0.05 kappa, meshes or linear.
fn chain(n: usize, is_mesh: impl Fn(usize) -> bool) -> System {
    let kappa = DMatrix::from_fn(n, n, |i: usize, j| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    });
    let law = Backlash {
        half_gap: 0.5,
        impact_damping: 0.0,
        impact_damping_law: Default::default(),
        contact_damping: 0.0,
    };
    let load = |i: usize| LoadSource {
        direction: DVector::from_fn(n, |k, _| if k == i { 1.0 } else { 0.0 }),
        series: Periodic::Fourier {
            mean: 0.3,
            harmonics: vec![Harmonic {
                order: 1,
                cos: if i == 0 { 0.3 } else { 0.0 },
                sin: 0.0,
            }],
        },
        kind: LoadKind::Value,
    };
    let mount = |k: usize| match is_mesh(k) {
        true => Mount::new(Box::new(law)),
        false => Mount::new(Box::new(Linear {})),
    };
    let mounts = (0..n).map(mount).collect();
    let loads = (0..n).map(load).collect();
    System::new(&kappa * 0.05, kappa, DMatrix::identity(n, n), mounts, loads)
        .expect("the shapes fit")
}

/// P4: residual, Jacobian, factorisation and solution of one Newton step about a motion of this amplitude around 1.
fn newton_step(bencher: Bencher, system: System, amplitude: f64) {
    let size = GalerkinOptions {
        harmonics: 7,
        samples: 128,
    };
    let mut problem =
        Galerkin::new(FrequencyFamily::new(system), 1.0, size).expect("the chain has harmonics");
    let mut at = Linearisation::of(&problem);
    let mut factors = Factors::new(&problem.structure());
    let value = |k: usize| match k % 15 {
        0 => 1.0,
        1 => amplitude,
        _ => 0.0,
    };
    let u = DVector::from_fn(problem.dim(), |k, _| value(k));
    let mut step = u.clone();
    bencher.bench_local(|| {
        problem.linearise(&u, 1.0, &mut at).expect("finite");
        step.copy_from(&at.r);
        factors.factorise(&at.dr_du) && factors.solve(&at.dr_du, &mut step)
    });
}

#[divan::bench(args = [10, 20, 50, 100, 200], sample_count = 50)]
fn p4_newton_step_in_contact(bencher: Bencher, n: usize) {
    newton_step(bencher, chain(n, |_| true), 0.1);
}

/// Every mesh lifts off: every block of the Jacobian is full.
#[divan::bench(args = [10, 20, 50, 100, 200], sample_count = 50)]
fn p4_newton_step_separating(bencher: Bencher, n: usize) {
    newton_step(bencher, chain(n, |_| true), 1.0);
}

/// Every tenth connection is a mesh that lifts off, the others are linear and condensed.
#[divan::bench(args = [10, 20, 50, 100, 200], sample_count = 50)]
fn p4_newton_step_few_meshes(bencher: Bencher, n: usize) {
    newton_step(bencher, chain(n, |k| k % 10 == 5), 1.0);
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

/// P13: a thousand periods of the everyday gear pair, with mesh stiffness that varies and with impact damping.
#[divan::bench(args = ["varying", "impact"], sample_count = 20)]
fn p13_thousand_periods(bencher: Bencher, law: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/problems/P13.yaml");
    let damped = [
        "connections.mesh.element.impact_damping=0.15 s/m".to_string(),
        "connections.mesh.stiffness_variation={mean: 1}".to_string(),
    ];
    let set: &[String] = if law == "impact" { &damped } else { &[] };
    let study = Study::load(&root, set, &[]).expect("the problem is part of the project");
    let mut system = study.assembly.system.clone();
    system.set_excitation_frequency(TAU * 2500.0 / study.assembly.scales.frequency);
    let mut integrator = choose(&system, IntegratorChoice::Series).expect("the pair has a series");
    let mut state = vec![0.0; 2 * system.dof()];
    bencher.bench_local(|| {
        for _ in 0..1000 {
            integrator.advance(&system, (0.0, TAU), &mut state, &mut ());
        }
    });
}

/// P11: two branches of at most a hundred points each past a stop so many times stiffer than its shaft.
#[divan::bench(args = ["1e4", "1e6", "1e9"], sample_count = 5)]
fn p11_stiff_stop(bencher: Bencher, ratio: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/problems/P11.yaml");
    let set = [format!("connections.stop.stiffness={ratio} N/m")];
    let study = Study::load(&root, &set, &[]).expect("the problem is part of the project");
    bencher.bench(|| study.reports(&AtomicBool::new(false)).expect("P11 runs"));
}

/// P8: 256 starts of P3, a hundred periods each, together and one at a time.
#[divan::bench(args = ["together", "alone"], sample_count = 5)]
fn p8_ensemble(bencher: Bencher, order: &str) {
    let mut system = load("P3.yaml").assembly.system;
    system.set_excitation_frequency(1.2);
    let share = |k: usize| ((k + 1) as f64 * 0.618_033_988_749_895).fract();
    let starts: Vec<f64> = (0..4 * 256).map(|k| 6.0 * share(k) - 3.0).collect();
    // Fewer than three starts in a call follow one after the other.
    let length = if order == "together" { starts.len() } else { 4 };
    let ensemble = Ensemble::new(&system, IntegratorChoice::Exact);
    let mut ensemble = ensemble.expect("P3 is piecewise affine");
    bencher.bench_local(|| {
        for starts in starts.chunks(length) {
            ensemble.run(&system, starts, 100, &mut |_| Next::GoOn);
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
