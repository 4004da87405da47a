//! A slider behind a spring: elastic, then plastic.

use super::automaton::{
    Automaton, Direction, Guard, MemoryRate, Region, RegionForce, Reset, Surface,
};
use super::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange,
    PiecewiseLinear, Response,
};
use serde::{Deserialize, Serialize};

/// Jenkins element: a spring in series with a slider.
///
/// ```text
/// sticks: f = q - z, z' = 0, until |f| = F/K;    slips: f = sign(v) F/K, z = q - sign(v) F/K, until v = 0
/// ```
///
/// F: slip force, K: stiffness of the connection, z: deformation at which the spring is free. The force is a function of the
/// history; [`Element::eval`] is the first loading from z = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Jenkins {
    /// F \[force\], >= 0.
    pub slip_force: f64,
}

crate::register_element! {
    tag: "jenkins",
    doc: "a spring in series with a slider: f = q - z, limited to slip_force/K on both sides; z moves with q while it slips",
    parameters: [
        { name: "slip_force", doc: "force at which the slider slips", kind: ParameterKind::Number, dimension: Dimension::FORCE, default: None, range: ParameterRange::NotNegative },
    ],
    example: "{type: jenkins, slip_force: 0.3}",
}

/// Share of a deformation within which a slider is at its limit.
pub(super) const ROUNDING: f64 = 1e-14;

/// Number of the region of a slider in which it sticks; then come slipping up and slipping down.
const STICKS: usize = 0;
const SLIPS_UP: usize = 1;
const SLIPS_DOWN: usize = 2;

/// A slider on the whole deformation: stiffness of its spring, deformation of the spring at which it slips.
pub(super) fn slider(stiffness: f64, reach: f64) -> Automaton {
    let border = |direction: Direction, to: usize| Guard {
        surface: Surface::Deformation {
            level: direction.sign() * reach,
            gain: 1.0,
        },
        direction,
        to,
        reset: Reset::None,
    };
    let stick = Region {
        force: RegionForce::Affine {
            constant: 0.0,
            q: stiffness,
            v: 0.0,
            z: -stiffness,
        },
        memory: MemoryRate::Kept,
        guards: vec![
            border(Direction::Up, SLIPS_UP),
            border(Direction::Down, SLIPS_DOWN),
        ],
        contact: 0,
    };
    let slip = |direction: Direction, back: Direction, contact: i8| Region {
        force: RegionForce::line(direction.sign() * stiffness * reach, 0.0),
        memory: MemoryRate::Follows {
            offset: -direction.sign() * reach,
        },
        guards: vec![Guard {
            surface: Surface::Rate,
            direction: back,
            to: STICKS,
            reset: Reset::None,
        }],
        contact,
    };
    Automaton {
        regions: vec![
            stick,
            slip(Direction::Up, Direction::Down, 1),
            slip(Direction::Down, Direction::Up, 2),
        ],
        has_memory: true,
    }
}

/// q, cut at a reach on both sides: the first loading of a slider.
fn plastic(reach: f64) -> PiecewiseLinear {
    let (breakpoints, slopes) = match reach > 0.0 {
        true => (vec![-reach, reach], vec![0.0, 1.0, 0.0]),
        false => (Vec::new(), vec![0.0]),
    };
    PiecewiseLinear {
        breakpoints,
        slopes,
    }
}

#[typetag::serde(name = "jenkins")]
impl Element for Jenkins {
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        self.respond(q, v, phase, &[0.0])
    }

    fn respond(&self, q: f64, v: f64, _phase: f64, memory: &[f64]) -> Response {
        let stretch = q - memory[0];
        let reach = self.slip_force;
        let rounding = ROUNDING * (q.abs() + reach);
        let slips = stretch.abs() > reach + rounding
            || stretch.abs() >= reach - rounding && stretch * v > 0.0;
        Response {
            f: stretch.clamp(-reach, reach),
            df_dq: if slips { 0.0 } else { 1.0 },
            df_dv: 0.0,
        }
    }

    fn memory_count(&self) -> usize {
        1
    }

    fn slip_excess(&self, low: f64, high: f64) -> Vec<f64> {
        vec![high - low - 2.0 * self.slip_force]
    }

    fn project(&self, q: f64, memory: &mut [f64]) {
        memory[0] = memory[0].clamp(q - self.slip_force, q + self.slip_force);
    }

    fn automata(&self) -> Option<Vec<Automaton>> {
        Some(vec![slider(1.0, self.slip_force)])
    }

    fn first_loading(&self) -> Option<Box<dyn Element>> {
        Some(Box::new(plastic(self.slip_force)))
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        visit(Parameter {
            name: "slip_force",
            index: None,
            dimension: Dimension::FORCE,
            value: &mut self.slip_force,
        });
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        super::not_negative("slip_force", self.slip_force)
    }
}
