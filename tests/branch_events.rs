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
        for m in 1..2 {
            let go = |step: f64| {
                if m == 0 {
                    common::balance(&system, (2.5, to), size, &[], step)
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

#[test]
fn dig() {
    for (system, l, to) in [
        (
            pair(3f64.sqrt(), [1.0, 0.1], 0.25, 0.05),
            0.4602210617248143,
            0.3,
        ),
        (
            pair(1.355, [1.0, 1.0], 0.25, 0.0285),
            0.7466102465855683,
            0.5,
        ),
    ] {
        let s = common::shoot(&system, (2.5, to), &[], IntegratorChoice::Auto, 0.01);
        let b = common::shoot(&system, (2.5, to), &[], IntegratorChoice::Auto, 0.1);
        let e = s
            .events
            .iter()
            .find(|e| (e.lambda - l).abs() < 1e-8)
            .unwrap();
        let target = &s.points[e.after_point].unknowns;
        println!(
            "=== lambda {l} after {} of {}",
            e.after_point,
            s.points.len()
        );
        for p in &s.points[e.after_point - 2..e.after_point + 4] {
            println!(
                "   {} {:?}",
                p.lambda,
                p.multipliers
                    .iter()
                    .map(|m| (m.re, m.im))
                    .collect::<Vec<_>>()
            );
        }
        let near = (0..b.points.len())
            .min_by(|i, j| {
                (&b.points[*i].unknowns - target)
                    .norm()
                    .total_cmp(&(&b.points[*j].unknowns - target).norm())
            })
            .unwrap();
        println!("long near {near}");
        for k in near - 2..near + 4 {
            let p = &b.points[k];
            println!(
                "   {k} {} {:?} dist {}",
                p.lambda,
                p.multipliers
                    .iter()
                    .map(|m| (m.re, m.im))
                    .collect::<Vec<_>>(),
                (&p.unknowns - target).norm()
            );
            for e in &b.events {
                if e.after_point == k {
                    println!(
                        "  {:?} {} {} {:?} frac {}",
                        e.kind, e.lambda, e.after_point, e.bracket, e.fraction
                    );
                }
            }
        }
    }
}
