//! Events of a branch: none missed between two points, none invented, whatever the length of the steps.

mod common;

use common::{backlash, load};
use gearlash::solve::branch::Branch;
use gearlash::solve::events::EventKind;
use gearlash::solve::galerkin::GalerkinOptions;
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::system::System;
use nalgebra::{DMatrix, DVector};

/// Two coordinates of the paper: omega* = 1 and `second`, half gaps, amplitude of the alternating load.
fn pair(second: f64, gaps: [f64; 2], amplitude: f64, ratio: f64) -> System {
    let x = 0.5 * (second * second - 1.0);
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0 + x, x, x, 1.0 + x]);
    // 2 zeta kappa^(1/2): eigenvectors (1, -1) and (1, 1).
    let (sum, difference) = (0.5 * (second + 1.0), 0.5 * (second - 1.0));
    let root = DMatrix::from_row_slice(2, 2, &[sum, difference, difference, sum]);
    let loads = vec![load(2, 0, 0.5, amplitude), load(2, 1, 0.5, 0.0)];
    System::new(
        root * (2.0 * ratio),
        kappa,
        DMatrix::identity(2, 2),
        gaps.into_iter().map(backlash).collect(),
        loads,
    )
    .unwrap()
}

fn list(branch: &Branch) -> Vec<(EventKind, f64)> {
    branch.events.iter().map(|e| (e.kind, e.lambda)).collect()
}

#[test]
fn print_events() {
    let size = GalerkinOptions {
        harmonics: 12,
        samples: 1024,
    };
    for (second, gaps, amplitude, ratio, to) in [
        (3f64.sqrt(), [1.0, 0.1], 0.25, 0.05, 0.3),
        (3f64.sqrt(), [1.0, 0.5], 0.25, 0.05, 0.3),
        (3f64.sqrt(), [1.0, 0.0], 0.25, 0.05, 0.3),
        (1.36, [1.0, 0.1], 0.25, 0.05, 0.3),
        (1.36, [1.0, 0.5], 0.25, 0.05, 0.3),
        (1.355, [1.0, 1.0], 0.25, 0.0285, 0.5),
    ] {
        let system = pair(second, gaps, amplitude, ratio);
        let t = std::time::Instant::now();
        let long = common::balance(&system, (2.5, to), size, &[], 0.1);
        let t1 = t.elapsed();
        let short = common::balance(&system, (2.5, to), size, &[], 0.005);
        println!(
            "== {second} {gaps:?} {} {} {:?} {:?} in {t1:?} {:?}",
            long.points.len(),
            short.points.len(),
            long.end,
            short.end,
            t.elapsed()
        );
        let (l, s) = (&long.events, &short.events);
        println!("   {} {}", l.len(), s.len());
        for e in l.iter() {
            let near = s
                .iter()
                .filter(|f| f.kind == e.kind)
                .map(|f| (f.lambda - e.lambda).abs())
                .fold(9.0, f64::min);
            let n = s
                .iter()
                .filter(|f| f.kind == e.kind && (f.lambda - e.lambda).abs() < 1e-7)
                .count();
            println!(
                "{:?} {} loc {} width {:e} near {:e} {} after {}",
                e.kind,
                e.lambda,
                e.is_located(),
                e.bracket.1 - e.bracket.0,
                near,
                n,
                e.after_point
            );
        }
        for e in s.iter() {
            let near = l
                .iter()
                .filter(|f| f.kind == e.kind)
                .map(|f| (f.lambda - e.lambda).abs())
                .fold(9.0, f64::min);
            if near > 1e-7 {
                println!(
                    "  MISSED {:?} {} loc {} near {:e} after {}",
                    e.kind,
                    e.lambda,
                    e.is_located(),
                    near,
                    e.after_point
                );
            }
        }
    }
    let _ = list;
    let _ = DVector::<f64>::zeros(1);
    let _ = IntegratorChoice::Auto;
}
