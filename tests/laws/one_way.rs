//! The worked example of docs/plugins.md: a law with memory that is nobody's but the user's.

use gearlash::element::automaton::{
    Automaton, Direction, Guard, MemoryRate, Region, RegionForce, Reset, Surface,
};
use gearlash::element::conformance::check;
use gearlash::element::{Element, Parameter, Response};
use gearlash::solve::integrate::{IntegrationEnd, IntegratorChoice, choose};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Locks forwards, overruns backwards.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct OneWayClutch {
    /// Force at the border, where the contract is broken.
    #[serde(default)]
    bias: f64,
}

fn guard(surface: Surface, direction: Direction, to: usize) -> Guard {
    Guard {
        surface,
        direction,
        to,
        reset: Reset::None,
    }
}

#[typetag::serde(name = "test_one_way_clutch")]
impl Element for OneWayClutch {
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        self.respond(q, v, phase, &[0.0])
    }

    fn respond(&self, q: f64, _v: f64, _phase: f64, memory: &[f64]) -> Response {
        let stretch = q - memory[0];
        Response {
            f: stretch.max(0.0),
            df_dq: if stretch > 0.0 { 1.0 } else { 0.0 },
            df_dv: 0.0,
        }
    }

    fn memory_count(&self) -> usize {
        1
    }

    fn project(&self, q: f64, memory: &mut [f64]) {
        memory[0] = memory[0].min(q);
    }

    fn automata(&self) -> Option<Vec<Automaton>> {
        let at = Surface::Deformation {
            level: 0.0,
            gain: 1.0,
        };
        let locked = Region {
            force: RegionForce::Affine {
                constant: self.bias,
                q: 1.0,
                v: 0.0,
                z: -1.0,
            },
            memory: MemoryRate::Kept,
            guards: vec![guard(at, Direction::Down, 1)],
            contact: 1,
        };
        let overrun = Region {
            force: RegionForce::line(0.0, 0.0),
            memory: MemoryRate::Follows { offset: 0.0 },
            guards: vec![guard(Surface::Rate, Direction::Up, 0)],
            contact: 0,
        };
        Some(vec![Automaton {
            regions: vec![locked, overrun],
            has_memory: true,
        }])
    }

    fn visit_parameters(&mut self, _visit: &mut dyn FnMut(Parameter<'_>)) {}

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }
}

#[test]
fn it_keeps_the_contract_and_a_wrong_force_is_noticed() {
    check(&OneWayClutch { bias: 0.0 }).unwrap();
    let error = check(&OneWayClutch { bias: 0.1 }).unwrap_err().to_string();
    assert!(error.contains("the regions give"), "{error}");
}

/// Thrown forwards it locks for half an oscillation and then runs free for good.
#[test]
fn it_throws_back_and_overruns() {
    let one = |x| DMatrix::from_element(1, 1, x);
    let mounts = vec![Mount::new(
        Box::new(OneWayClutch { bias: 0.0 }) as Box<dyn Element>
    )];
    let mut system = System::new(one(0.0), one(1.0), one(1.0), mounts, vec![]).unwrap();
    system.set_excitation_frequency(TAU / (PI + 2.0));
    let mut flow = choose(&system, IntegratorChoice::Exact).unwrap();
    let mut state = [0.0, 1.0, 0.0];
    let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
    assert_eq!(end, IntegrationEnd::Reached);
    let wanted = [-2.0, -1.0, -2.0];
    assert!(
        state
            .iter()
            .zip(&wanted)
            .all(|(a, b)| (a - b).abs() < 1e-12),
        "{state:?}"
    );
}
