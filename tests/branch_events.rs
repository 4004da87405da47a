//! Events of a branch: none missed between two points, none invented, whatever the length of the steps.

mod common;

use common::{backlash, load};
use gearlash::solve::branch::Branch;
use gearlash::solve::events::EventKind;
use gearlash::solve::galerkin::GalerkinOptions;
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::system::System;
use nalgebra::DMatrix;

/// Two coordinates of the paper: omega* = 1 and `second`, half gaps, amplitude of the alternating load, damping ratio.
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

fn compare(long: &Branch, short: &Branch) {
    for (x, y, w) in [(long, short, "phantom?"), (short, long, "missed")] {
        for e in &x.events {
            let n = y
                .events
                .iter()
                .filter(|f| f.kind == e.kind && (f.lambda - e.lambda).abs() < 1e-8)
                .count();
            if n != 1 {
                println!(
                    "   {w} {:?} {} loc {} n {n} after {}",
                    e.kind,
                    e.lambda,
                    e.is_located(),
                    e.after_point
                );
            }
        }
    }
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
        for m in 0..1 {
            let go = |step: f64| {
                if m == 0 {
                    common::balance_exactly(&system, (2.5, to), 12, &[], step)
                } else {
                    common::shoot(&system, (2.5, to), &[], IntegratorChoice::Auto, step)
                }
            };
            let t = std::time::Instant::now();
            let long = go(0.1);
            let t1 = t.elapsed();
            let short = go(0.01);
            println!(
                "== method {m} {second} {gaps:?} points {} {} {:?} {:?} in {t1:?} {:?} events {} {}",
                long.points.len(),
                short.points.len(),
                long.end,
                short.end,
                t.elapsed(),
                long.events.len(),
                short.events.len()
            );
            compare(&long, &short);
        }
    }
    let _ = EventKind::Fold;
}
