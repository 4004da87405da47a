//! The clutch: loops within its stages, no friction of the main stage at idle, and what cannot be a clutch.

use gearlash::element::conformance::check;
use gearlash::element::{Clutch, Element, Jenkins, Stage};
use gearlash::numeric::periodic::Periodic;
use gearlash::solve::galerkin;
use gearlash::solve::integrate::{FlowObserver, IntegratorChoice, Segment, choose};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

fn stage(to: Option<f64>, stiffness: f64, hysteresis: f64, flank: f64) -> Stage {
    Stage {
        to,
        stiffness,
        hysteresis,
        hysteresis_stiffness: Some(flank),
    }
}

fn clutch(everywhere: bool) -> Clutch {
    let stages = vec![
        stage(Some(0.5), 0.1, 0.04, 0.5),
        stage(Some(1.4), 1.0, 0.3, 3.0),
        stage(None, 2.0, 0.1, 1.5),
    ];
    Clutch {
        drive: stages.clone(),
        coast: stages,
        everywhere,
    }
}

#[test]
fn it_keeps_the_contract() {
    check(&clutch(false)).unwrap();
    check(&clutch(true)).unwrap();
    galerkin::conformance::check(&clutch(false)).unwrap();
    galerkin::conformance::check(&clutch(true)).unwrap();
    galerkin::conformance::check(&Jenkins { slip_force: 0.4 }).unwrap();
    let mut uneven = clutch(false);
    uneven.coast = vec![
        stage(Some(0.9), 0.05, 0.04, 0.5),
        stage(None, 0.7, 0.2, 2.0),
    ];
    check(&uneven).unwrap();
    assert_eq!(
        (clutch(false).memory_count(), uneven.memory_count()),
        (3, 4)
    );
}

/// Forces along a path of deformations, the memory followed step by step by moving it to what fits.
fn path(law: &Clutch, places: &[f64]) -> Vec<f64> {
    let mut memory = vec![0.0; law.memory_count()];
    let steps = 2000;
    let mut forces = Vec::new();
    let mut here = 0.0;
    for place in places {
        for k in 1..=steps {
            let q = here + (place - here) * f64::from(k) / f64::from(steps);
            law.project(q, &mut memory);
        }
        here = *place;
        forces.push(law.respond(here, 0.0, 0.0, &memory).f);
    }
    forces
}

#[test]
fn idle_knows_nothing_of_the_main_stage() {
    // Between -0.4 and 0.4 the loop is that of the idle stage: its height is its hysteresis.
    let idle = path(&clutch(false), &[0.4, -0.4, 0.0, 0.4, 0.0]);
    assert!((idle[2] - idle[4] - 0.04).abs() < 1e-12, "{idle:?}");
    // Everywhere: the frictions of all stages add up, as far as their flanks are passed.
    let all = path(&clutch(true), &[0.4, -0.4, 0.0, 0.4, 0.0]);
    assert!((all[2] - all[4] - 0.44).abs() < 1e-12, "{all:?}");
    // After a visit of the main stage its slider keeps half its hysteresis: an offset, no loop.
    let after = path(&clutch(false), &[1.2, 0.4, -0.4, 0.0, 0.4, 0.0]);
    assert!((after[3] - after[5] - 0.04).abs() < 1e-12);
    assert!((after[5] - idle[4] + 0.15).abs() < 1e-12, "{after:?}");
}

#[derive(Default)]
struct Work(Vec<(f64, f64)>);

impl FlowObserver for Work {
    fn segment(&mut self, segment: &Segment<'_>) {
        for k in 0..8 {
            let mut state = vec![0.0; 5];
            segment.state(f64::from(k) / 8.0, 1.0, &mut state);
            self.0.push((state[0], state[2]));
        }
    }
}

/// The flow's memories stay where the law allows them, and everything ends at rest where damping and friction leave it.
#[test]
fn a_released_clutch_comes_to_rest_within_its_friction() {
    let law = clutch(false);
    let one = |x| DMatrix::from_element(1, 1, x);
    let load = LoadSource {
        direction: DVector::from_element(1, 1.0),
        series: Periodic::Fourier {
            mean: 0.05,
            harmonics: vec![],
        },
        kind: LoadKind::Value,
    };
    let mounts = vec![Mount::new(Box::new(law.clone()) as Box<dyn Element>)];
    let mut system = System::new(one(0.05), one(1.0), one(1.0), mounts, vec![load]).unwrap();
    system.set_excitation_frequency(TAU / 400.0);
    let mut flow = choose(&system, IntegratorChoice::Exact).unwrap();
    let mut state = vec![2.0, 0.0, 0.0, 0.0, 0.0];
    let mut seen = Work::default();
    flow.advance(&system, (0.0, TAU), &mut state, &mut seen);
    let mut memory = state[2..].to_vec();
    law.project(state[0], &mut memory);
    assert!(
        memory
            .iter()
            .zip(&state[2..])
            .all(|(a, b)| (a - b).abs() < 1e-12)
    );
    let force = law.respond(state[0], 0.0, 0.0, &state[2..]).f;
    assert!(
        state[1].abs() < 1e-3 && (force - 0.05).abs() < 1e-3,
        "{state:?} {force}"
    );
    assert!(seen.0.len() > 100);
}

#[test]
fn stages_that_are_none_are_refused() {
    let mut law = clutch(false);
    law.drive[1].to = Some(0.3);
    law.coast = law.drive.clone();
    let message = law.validate().unwrap_err().to_string();
    assert!(
        message.contains("stages[1].to = 0.3") && message.contains("ascend"),
        "{message}"
    );
    law.drive[1].to = None;
    law.coast = law.drive.clone();
    assert!(
        law.validate()
            .unwrap_err()
            .to_string()
            .contains("stages[1].to")
    );
    let mut law = clutch(false);
    law.coast[0].hysteresis = 0.1;
    assert!(
        law.validate()
            .unwrap_err()
            .to_string()
            .contains("one slider for both sides")
    );
    let mut law = clutch(false);
    law.drive[2].hysteresis = -1.0;
    law.coast = law.drive.clone();
    assert!(
        law.validate()
            .unwrap_err()
            .to_string()
            .contains("stages[2].hysteresis")
    );
}
