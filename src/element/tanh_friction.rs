//! Dry friction, regularised.

use super::derivatives::from_force;
use super::number::Number;
use super::traced::Symbol;
use super::{Dimension, Element, Parameter, ParameterKind, ParameterRange, Response};
use serde::{Deserialize, Serialize};

/// Friction that grows from 0 to a constant force within a small velocity.
///
/// ```text
/// f = (F/K) tanh(v / v0)
/// ```
///
/// F: friction force, v0: regularisation, K: reference stiffness. Carries no static load: below F it creeps with
/// v = v0 artanh(load/F), it never sticks. Take v0 small against the velocities of interest; the smaller, the stiffer the
/// equation (a viscous damper F/v0 around v = 0).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TanhFriction {
    /// F \[force\], >= 0.
    pub force: f64,
    /// v0 \[displacement/time\], > 0.
    pub velocity: f64,
}

crate::register_element! {
    tag: "tanh_friction",
    doc: "f = (force/K) tanh(v/velocity); regularised dry friction: it creeps instead of sticking",
    parameters: [
        { name: "force", doc: "friction force", kind: ParameterKind::Number, dimension: Dimension::FORCE, default: None, range: ParameterRange::NotNegative },
        { name: "velocity", doc: "regularisation velocity: the force there is tanh(1) = 0.76 of its limit", kind: ParameterKind::Number, dimension: Dimension::VELOCITY, default: None, range: ParameterRange::Positive },
    ],
    example: "{type: tanh_friction, force: 0.3, velocity: 0.7}",
}

impl TanhFriction {
    #[inline]
    fn force<N: Number>(&self, v: N) -> N {
        (v / self.velocity).tanh() * self.force
    }
}

#[typetag::serde(name = "tanh_friction")]
impl Element for TanhFriction {
    #[inline]
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        from_force(q, v, |_, v| self.force(v))
    }

    fn trace<'t>(
        &self,
        _q: Symbol<'t>,
        v: Symbol<'t>,
        _phase: Symbol<'t>,
    ) -> Result<Symbol<'t>, String> {
        Ok(self.force(v))
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        visit(Parameter {
            name: "force",
            index: None,
            dimension: Dimension::FORCE,
            value: &mut self.force,
        });
        visit(Parameter {
            name: "velocity",
            index: None,
            dimension: Dimension::VELOCITY,
            value: &mut self.velocity,
        });
    }

    fn is_spring(&self) -> bool {
        false
    }

    fn is_passive(&self) -> bool {
        true
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }
}
