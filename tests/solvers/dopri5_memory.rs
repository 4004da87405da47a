//! DOPRI5 with sliders: a second opinion for the exact flow, and values of an independent program.

use crate::common::{load, reference};
use crate::memory_flow::{state, system};
use gearlash::element::{Backlash, Clutch, Element, ImpactDampingLaw, Jenkins, Stage};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{
    FlowObserver, IntegrationEnd, IntegratorChoice, Switch, SwitchKind, choose,
};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

#[derive(Default)]
struct Log(Vec<Switch>);

impl FlowObserver for Log {
    fn switch(&mut self, switch: &Switch) {
        self.0.push(*switch);
    }
}

fn gap(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
}

/// One period with Phi by an integrator.
fn period(
    system: &System,
    start: &[f64],
    choice: IntegratorChoice,
) -> (Vec<f64>, DMatrix<f64>, Vec<Switch>) {
    let mut flow = choose(system, choice).unwrap();
    let (mut end, mut log) = (start.to_vec(), Log::default());
    let mut phi = DMatrix::identity(start.len(), start.len());
    let ended = flow.advance_with_variation(system, (0.0, TAU), &mut end, &mut phi, &mut log);
    assert_eq!(ended, IntegrationEnd::Reached);
    (end, phi, log.0)
}

/// Both integrators agree: states, transition matrices, instants of stick and slip.
fn compare(name: &str, system: &System, start: &[f64]) {
    let exact = period(system, start, IntegratorChoice::Auto);
    let other = period(system, start, IntegratorChoice::Dopri5);
    let size = exact.0.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    let apart = gap(&exact.0, &other.0) / size;
    assert!(apart < 2e-8, "{name}: {apart:e}");
    let phi = (&exact.1 - &other.1).amax() / exact.1.amax().max(1.0);
    assert!(phi < 1e-6, "{name}: {phi:e}\n{}{}", exact.1, other.1);
    let sliders = |list: &[Switch]| -> Vec<Switch> {
        let own = list.iter().filter(|s| s.kind == SwitchKind::Memory);
        own.copied().collect()
    };
    let (a, b) = (sliders(&exact.2), sliders(&other.2));
    assert_eq!(a.len(), b.len(), "{name}\n{a:?}\n{b:?}");
    for (x, y) in a.iter().zip(&b) {
        let same = (x.connection, x.from, x.to) == (y.connection, y.from, y.to);
        assert!(same && (x.tau - y.tau).abs() < 1e-6, "{name}: {x:?} {y:?}");
    }
}

#[test]
fn orbits_of_an_independent_program() {
    let mut compared = 0;
    for record in reference("memory")["orbits"].as_array().unwrap() {
        let system = system(record);
        if system
            .mounts()
            .iter()
            .any(|m| m.element.least_impact().is_some())
        {
            assert!(choose(&system, IntegratorChoice::Dopri5).is_err());
            continue;
        }
        let start = state(record);
        let name = record["name"].as_str().unwrap();
        let (end, ..) = period(&system, &start, IntegratorChoice::Dopri5);
        assert!(gap(&start, &end) < 1e-7, "{name}: {start:?} {end:?}");
        compare(name, &system, &start);
        compared += 1;
    }
    assert!(compared >= 4);
}

/// A clutch with two stages, a slider on a deformation with transmission error and varying stiffness, and a clearance.
#[test]
fn a_train_with_clutch_slider_and_clearance() {
    let stage = |to: Option<f64>, stiffness, hysteresis, hysteresis_stiffness| Stage {
        to,
        stiffness,
        hysteresis,
        hysteresis_stiffness,
    };
    for everywhere in [false, true] {
        let stages = vec![
            stage(Some(0.4), 0.2, 0.1, Some(0.8)),
            stage(None, 1.0, 0.4, Some(1.5)),
        ];
        let clutch = Clutch {
            drive: stages.clone(),
            coast: stages,
            everywhere,
        };
        let backlash = Backlash {
            half_gap: 0.2,
            impact_damping: 0.0,
            impact_damping_law: ImpactDampingLaw::Dissipative,
            contact_damping: 0.0,
        };
        let laws: [Box<dyn Element>; 3] = [
            Box::new(clutch),
            Box::new(backlash),
            Box::new(Jenkins { slip_force: 0.15 }),
        ];
        let mut mounts: Vec<Mount> = laws.into_iter().map(Mount::new).collect();
        let harmonics = vec![Harmonic {
            order: 2,
            cos: 0.03,
            sin: -0.02,
        }];
        mounts[2].transmission_error = Some(Periodic::Fourier {
            mean: 0.0,
            harmonics,
        });
        let map = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
        let kappa = DMatrix::from_row_slice(2, 3, &[1.2, -0.5, -0.2, -0.4, 1.4, 0.6]);
        let gamma = DMatrix::from_row_slice(2, 2, &[0.06, 0.0, 0.0, 0.07]);
        let loads = vec![load(2, 0, 0.1, 0.7), load(2, 1, 0.1, 0.3)];
        let mut system = System::new(gamma, kappa, map, mounts, loads).unwrap();
        for frequency in [0.55, 0.9, 1.6] {
            system.set_excitation_frequency(frequency);
            for q in [-0.6, 0.05, 0.5] {
                let start = [q, 0.1 - q, 0.3, -0.2, 0.0, 0.0, 0.05];
                let name = format!("{everywhere} {frequency} {q}");
                compare(&name, &system, &start[..system.state_size()]);
            }
        }
    }
}
