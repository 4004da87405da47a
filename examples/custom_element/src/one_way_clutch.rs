//! A law with memory that is affine in every region: a one-way clutch as an automaton.

use gearlash::element::automaton::{
    Automaton, Direction, Guard, MemoryRate, Region, RegionForce, Reset, Surface,
};
use gearlash::element::{Element, Parameter, Response};
use gearlash::serde::{Deserialize, Serialize};
use gearlash::typetag;

/// Locks forwards, overruns backwards.
///
/// ```text
/// locked: f = q - z, z' = 0, until q = z;    overrun: f = 0, z = q, until v = 0
/// ```
///
/// Without friction in the overrun and without backlash when it engages.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(crate = "gearlash::serde", deny_unknown_fields)]
pub struct OneWayClutch {}

gearlash::register_element! {
    tag: "one_way_clutch",
    doc: "locked forwards: f = q - z; overruns backwards: f = 0, z follows q; a one-way clutch",
    parameters: [],
    example: "{type: one_way_clutch}",
}

const LOCKED: usize = 0;
const OVERRUN: usize = 1;

fn guard(surface: Surface, direction: Direction, to: usize) -> Guard {
    Guard {
        surface,
        direction,
        to,
        reset: Reset::None,
    }
}

#[typetag::serde(name = "one_way_clutch")]
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
        let at_z = Surface::Deformation {
            level: 0.0,
            gain: 1.0,
        };
        let locked = Region {
            force: RegionForce::Affine {
                constant: 0.0,
                q: 1.0,
                v: 0.0,
                z: -1.0,
            },
            memory: MemoryRate::Kept,
            guards: vec![guard(at_z, Direction::Down, OVERRUN)],
            contact: 1,
        };
        let overrun = Region {
            force: RegionForce::line(0.0, 0.0),
            memory: MemoryRate::Follows { offset: 0.0 },
            guards: vec![guard(Surface::Rate, Direction::Up, LOCKED)],
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
