//! Systems and helpers of the tests of DOPRI5.

#![allow(dead_code)] // every test binary uses a part of it

use crate::common::{backlash, floats, load};
use gearlash::element::{Backlash, Cubic, ImpactDampingLaw};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{
    Dopri5, Dopri5Options, FlowObserver, IntegrationEnd, Integrator, Segment, Switch,
};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;

/// Remembers what it is shown.
#[derive(Default)]
pub struct Log {
    pub switches: Vec<Switch>,
    pub segments: Vec<(f64, f64, Vec<f64>)>,
}

impl Log {
    pub fn segment_of<'a>(&self, tau: f64, width: f64, coefficients: &'a [f64]) -> Segment<'a> {
        Segment {
            tau,
            width,
            coefficients,
            count: 6,
        }
    }
}

impl FlowObserver for Log {
    fn segment(&mut self, s: &Segment<'_>) {
        self.segments
            .push((s.tau, s.width, s.coefficients.to_vec()));
    }
    fn switch(&mut self, switch: &Switch) {
        self.switches.push(*switch);
    }
}

pub fn tight() -> Dopri5Options {
    Dopri5Options {
        relative: 1e-12,
        absolute: 1e-14,
        ..Default::default()
    }
}

pub fn advance(
    system: &System,
    options: Dopri5Options,
    span: (f64, f64),
    state: &mut [f64],
) -> Log {
    let mut log = Log::default();
    let end = Dopri5::new(system, options).advance(system, span, state, &mut log);
    assert_eq!(end, IntegrationEnd::Reached);
    log
}

pub fn transition(
    system: &System,
    options: Dopri5Options,
    end: f64,
    state: &mut [f64],
) -> DMatrix<f64> {
    let mut phi = DMatrix::identity(state.len(), state.len());
    let mut integrator = Dopri5::new(system, options);
    let outcome = integrator.advance_with_variation(system, (0.0, end), state, &mut phi, &mut ());
    assert_eq!(outcome, IntegrationEnd::Reached);
    phi
}

/// One coordinate: x'' + gamma x' + kappa f(x) = load.
pub fn single(gamma: f64, mount: Mount, mean: f64, cos: f64) -> System {
    let one = |x| DMatrix::from_element(1, 1, x);
    System::new(
        one(gamma),
        one(1.0),
        one(1.0),
        vec![mount],
        vec![load(1, 0, mean, cos)],
    )
    .unwrap()
}

/// The system of an entry of `flow_one_period.json`. kappa^(1/2) = [[r + 1, r - 1], [r - 1, r + 1]] / 2.
pub fn flow_system(entry: &serde_json::Value) -> System {
    let x = if entry["case"] == 1 {
        1.0
    } else {
        0.5 * (1.36_f64.powi(2) - 1.0)
    };
    let (zeta, r) = (entry["zeta"].as_f64().unwrap(), (1.0 + 2.0 * x).sqrt());
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0 + x, x, x, 1.0 + x]);
    let (a, b) = (zeta * (r + 1.0), zeta * (r - 1.0));
    let gamma = DMatrix::from_row_slice(2, 2, &[a, b, b, a]);
    let mounts = floats(&entry["b"]).into_iter().map(backlash).collect();
    let loads = vec![load(2, 0, 0.5, 0.25), load(2, 1, 0.5, 0.0)];
    let mut system = System::new(gamma, kappa, DMatrix::identity(2, 2), mounts, loads).unwrap();
    system.set_excitation_frequency(entry["omega"].as_f64().unwrap());
    system
}

pub fn sine(mean: f64, order: usize, cos: f64, sin: f64) -> Periodic {
    Periodic::Fourier {
        mean,
        harmonics: vec![Harmonic { order, cos, sin }],
    }
}

pub fn impacting(half_gap: f64, law: ImpactDampingLaw) -> Mount {
    Mount::new(Box::new(Backlash {
        half_gap,
        impact_damping: 0.3,
        impact_damping_law: law,
        contact_damping: 0.0,
    }))
}

/// Two coordinates, three connections: W is not the identity.
pub fn loop_system(mounts: Vec<Mount>) -> System {
    let w = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.7, -0.6]);
    let kappa = DMatrix::from_row_slice(2, 3, &[2.0, 0.5, 0.6, 0.4, 1.5, -0.5]);
    let gamma = DMatrix::from_row_slice(2, 2, &[0.08, 0.01, 0.02, 0.06]);
    let loads = vec![load(2, 0, 0.3, 0.4), load(2, 1, 0.2, -0.3)];
    let mut system = System::new(gamma, kappa, w, mounts, loads).unwrap();
    system.set_excitation_frequency(0.83);
    system
}

pub fn awkward_mounts() -> Vec<Mount> {
    let mut a = impacting(0.2, ImpactDampingLaw::Dissipative);
    a.stiffness_variation = Some(Periodic::Rectangular {
        high: 1.2,
        low: 0.8,
        duty: 0.5,
        phase: 0.4,
        base_order: 3,
    });
    a.transmission_error = Some(sine(0.0, 4, 0.05, 0.02));
    let mut b = Mount::new(Box::new(Cubic { cubic: 0.4 }));
    b.stiffness_variation = Some(sine(1.0, 2, 0.2, 0.1));
    b.transmission_error = Some(Periodic::Table {
        values: vec![0.0, 0.03, -0.02, 0.05, -0.04],
        base_order: 2,
    });
    let mut c = impacting(0.1, ImpactDampingLaw::Literal);
    c.transmission_error = Some(sine(0.01, 1, 0.0, 0.1));
    vec![a, b, c]
}
