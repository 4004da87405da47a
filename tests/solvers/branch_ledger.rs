//! What a branch shows against what it lists, on a path with one unknown of which everything is known: folds that no step sees, multipliers
//! that pass +1 where nothing turns or crosses.

use crate::common::{backlash, load, trace_options};
use gearlash::error::SolveError;
use gearlash::numeric::jacobian::Jacobian;
use gearlash::solve::branch::{self, Begin, Branch, BranchPoint, Recorder};
use gearlash::solve::continuation::CrossingSide;
use gearlash::solve::events::EventKind;
use gearlash::solve::orbit::{FourierOrbit, Orbit};
use gearlash::solve::residual::{Extent, Linearisation, PeriodicResidual, Residual, Survey};
use gearlash::system::System;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use std::f64::consts::TAU;

/// The path lambda = f(u), with multipliers of lambda.
struct Scripted {
    system: System,
    /// f and its derivative.
    path: fn(f64) -> [f64; 2],
    multipliers: fn(f64) -> Vec<Complex<f64>>,
}

impl Scripted {
    fn new(path: fn(f64) -> [f64; 2], multipliers: fn(f64) -> Vec<Complex<f64>>) -> Scripted {
        let one = DMatrix::from_element(1, 1, 1.0);
        let loads = vec![load(1, 0, 0.5, 0.25)];
        let system = System::new(one.clone(), one.clone(), one, vec![backlash(1.0)], loads);
        Scripted {
            system: system.unwrap(),
            path,
            multipliers,
        }
    }
}

impl Residual for Scripted {
    fn dim(&self) -> usize {
        1
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let [value, slope] = (self.path)(u[0]);
        out.r[0] = lambda - value;
        out.dr_dlambda[0] = 1.0;
        out.magnitude = 1.0;
        let Jacobian::Dense(dr_du) = &mut out.dr_du else {
            panic!("one unknown");
        };
        dr_du[(0, 0)] = -slope;
        Ok(())
    }
}

impl PeriodicResidual for Scripted {
    fn system_at(&mut self, _lambda: f64) -> Result<&System, SolveError> {
        Ok(&self.system)
    }

    fn orbit(&mut self, u: &DVector<f64>, _lambda: f64) -> Result<Orbit, SolveError> {
        Ok(Orbit::Fourier(FourierOrbit {
            coefficients: vec![vec![u[0], 0.0, 0.0]],
            omega: 1.0,
            subharmonic: 1,
        }))
    }

    fn survey(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        extent: Extent,
    ) -> Result<Survey, SolveError> {
        Ok(Survey {
            orbit: self.orbit(u, lambda)?,
            extrema: vec![Vec::new()],
            breakpoints: vec![Vec::new()],
            multipliers: match extent {
                Extent::Motion => Vec::new(),
                Extent::Stability => (self.multipliers)(lambda),
            },
            exponents: None,
            neutral: 0,
            slips: Vec::new(),
        })
    }

    fn in_doubled_period(&self, half: &DVector<f64>) -> DVector<f64> {
        half.clone()
    }
}

struct Nothing;

impl Recorder for Nothing {
    fn record(&mut self, _: f64, _: &System, _: &Orbit, _: &mut Vec<f64>) {}

    fn accept(&mut self, point: &BranchPoint) -> bool {
        point.unknowns[0] < 4.0
    }
}

fn follow(mut problem: Scripted, (from, to): (f64, f64), step: f64) -> Branch {
    let mut options = trace_options(&problem.system, (from, to), &[], step);
    options.continuation.step = step;
    options.continuation.weight = 1.0;
    let begin = Begin::Inside(DVector::from_element(1, 0.0), 0.0, CrossingSide::Forward);
    let branch = branch::trace(&mut problem, begin, &options, &mut Nothing).unwrap();
    branch.unwrap()
}

/// Wave length of the path that turns twice in every wave.
const WAVE: f64 = 0.2;

/// f' = 0.1 at every multiple of the wave length, and less by 0.15 on average.
fn waves(u: f64) -> [f64; 2] {
    let phase = TAU * u / WAVE;
    [
        -0.05 * u + 0.15 * phase.sin() * WAVE / TAU,
        -0.05 + 0.15 * phase.cos(),
    ]
}

/// Two waves at a time: both ends of such a step point forwards and its middle does, but the parameter has gone back.
#[test]
fn folds_that_a_step_jumps_over_are_found_by_the_direction_of_the_parameter() {
    let quiet = |_: f64| vec![Complex::new(0.5, 0.0)];
    // Length of two waves along the tangent (1, 0.1) at the origin.
    let step = 2.0 * WAVE * (1.0 - 0.05 * 0.1) / 1.01_f64.sqrt();
    let branch = follow(Scripted::new(waves, quiet), (-1.0, 1.0), step);
    // The step as it was wanted did not explain itself: it was retried at a quarter of its length.
    let first = branch.points[1].unknowns[0];
    assert!((first - 0.5 * WAVE).abs() < 1e-9, "{first}");
    let folds: Vec<f64> = { branch.events.iter() }
        .filter(|e| e.kind == EventKind::Fold)
        .map(|e| e.point.as_ref().expect("located").u[0])
        .collect();
    let turn = WAVE / TAU * (1.0_f64 / 3.0).acos();
    let expected = (0..20).flat_map(|k| {
        let wave = WAVE * f64::from(k);
        [wave + turn, wave + WAVE - turn]
    });
    let last = branch.points.last().unwrap().unknowns[0];
    let expected: Vec<f64> = expected.filter(|u| *u < last).collect();
    assert_eq!(folds.len(), expected.len(), "{folds:?}");
    for (found, expected) in folds.iter().zip(&expected) {
        assert!((found - expected).abs() < 1e-7, "{found} {expected}");
    }
}

/// A multiplier that passes +1 where the path neither turns nor meets another one: the branch says where, and what passes.
#[test]
fn a_passage_of_one_without_a_cause_is_unresolved() {
    let passing = |lambda: f64| vec![Complex::new(0.4 + lambda, 0.0), Complex::new(0.1, 0.0)];
    let branch = follow(Scripted::new(|u| [u, 1.0], passing), (-0.1, 1.0), 0.1);
    let [event] = &branch.events[..] else {
        panic!("{:?}", branch.events);
    };
    assert_eq!(event.kind, EventKind::Unresolved);
    assert_eq!(event.unstable, Some((0, 1)));
    assert!(event.bracket.0 <= 0.6 && event.bracket.1 >= 0.6);
    assert!(event.bracket.1 - event.bracket.0 < 0.1 && !event.is_located());
}
