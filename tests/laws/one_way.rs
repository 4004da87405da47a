//! The worked example of docs/plugins.md: a law with memory that is nobody's but the user's.

use gearlash::element::automaton::{Automaton, RegionForce};
use gearlash::element::conformance::check;
use gearlash::element::{Element, Parameter, Response};
use gearlash::solve::galerkin;
use gearlash::solve::integrate::{IntegrationEnd, IntegratorChoice, choose};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

#[path = "../../examples/custom_element/src/one_way_clutch.rs"]
mod one_way_clutch;
use one_way_clutch::OneWayClutch;

/// The same with another force in its regions than in `respond`.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Broken {
    law: OneWayClutch,
    bias: f64,
}

#[typetag::serde(name = "test_broken_one_way_clutch")]
impl Element for Broken {
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        self.law.eval(q, v, phase)
    }

    fn respond(&self, q: f64, v: f64, phase: f64, memory: &[f64]) -> Response {
        self.law.respond(q, v, phase, memory)
    }

    fn memory_count(&self) -> usize {
        self.law.memory_count()
    }

    fn project(&self, q: f64, memory: &mut [f64]) {
        self.law.project(q, memory);
    }

    fn automata(&self) -> Option<Vec<Automaton>> {
        let mut automata = self.law.automata()?;
        if let RegionForce::Affine { constant, .. } = &mut automata[0].regions[0].force {
            *constant = self.bias;
        }
        Some(automata)
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
    check(&OneWayClutch {}).unwrap();
    galerkin::conformance::check(&OneWayClutch {}).unwrap();
    let broken = |bias: f64| Broken {
        law: OneWayClutch {},
        bias,
    };
    check(&broken(0.0)).unwrap();
    let error = check(&broken(0.1)).unwrap_err().to_string();
    assert!(error.contains("the regions give"), "{error}");
}

/// Thrown forwards it locks for half an oscillation and then runs free for good.
#[test]
fn it_throws_back_and_overruns() {
    let one = |x| DMatrix::from_element(1, 1, x);
    let mounts = vec![Mount::new(Box::new(OneWayClutch {}) as Box<dyn Element>)];
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
