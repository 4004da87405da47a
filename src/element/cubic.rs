//! The Duffing spring.

use super::derivatives::from_force;
use super::number::Number;
use super::traced::Symbol;
use super::{Dimension, Element, Parameter, ParameterKind, Response};
use serde::{Deserialize, Serialize};

/// f = q + cubic q^3. Hardening for cubic > 0; for cubic < 0 the force falls beyond |q| = (-3 cubic)^(-1/2), where the law
/// stops being a restoring spring.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cubic {
    /// Cubic coefficient [1/displacement^2].
    pub cubic: f64,
}

const PER_SQUARE: Dimension = Dimension {
    displacement: -4,
    time: 0,
    force: 0,
};

crate::register_element! {
    tag: "cubic",
    doc: "f = q + cubic q^3; a Duffing spring, hardening for cubic > 0",
    parameters: [
        { name: "cubic", doc: "cubic coefficient", kind: ParameterKind::Number, dimension: PER_SQUARE, default: None },
    ],
    example: "{type: cubic, cubic: 0.1}",
}

impl Cubic {
    #[inline]
    fn force<N: Number>(&self, q: N) -> N {
        q * (q * self.cubic * q + 1.0)
    }
}

#[typetag::serde(name = "cubic")]
impl Element for Cubic {
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        from_force(q, v, |q, _| self.force(q))
    }

    fn trace<'t>(
        &self,
        q: Symbol<'t>,
        _v: Symbol<'t>,
        _phase: Symbol<'t>,
    ) -> Result<Symbol<'t>, String> {
        Ok(self.force(q))
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        visit(Parameter {
            name: "cubic",
            index: None,
            dimension: PER_SQUARE,
            value: &mut self.cubic,
        });
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }
}
