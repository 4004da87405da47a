//! A joint pressed against its flanks: backlash with a force that has to be overcome first.

use super::derivatives::from_force;
use super::number::Number;
use super::traced::Symbol;
use super::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange, Response,
};
use serde::{Deserialize, Serialize};

/// Backlash with a preload on both flanks.
///
/// ```text
/// f = q - b + F0/K for q > b, 0 inside, q + b - F0/K for q < -b
/// ```
///
/// b: half gap, F0: preload (a force), K: reference stiffness. The force jumps by F0 at the flanks. With b = 0 the joint is
/// always in contact and has to be torn off its middle: f = q + sign(q) F0/K.
///
/// While the load on the joint is within the jump it rests on the flank: the exact flow holds it there as a constraint and finds
/// its force from the equation of motion. DOPRI5, which follows forces only, ends with that reason.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preloaded {
    /// Half of the total gap b \[displacement\], >= 0.
    pub half_gap: f64,
    /// F0 \[force\], >= 0.
    pub preload: f64,
}

crate::register_element! {
    tag: "preloaded",
    doc: "backlash with a preload: f = q - b + F0/K for q > b, 0 inside, q + b - F0/K for q < -b; jumps at the flanks",
    parameters: [
        { name: "half_gap", doc: "half of the total backlash", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::NotNegative },
        { name: "preload", doc: "force F0 on both flanks", kind: ParameterKind::Number, dimension: Dimension::FORCE, default: None, range: ParameterRange::NotNegative },
    ],
    example: "{type: preloaded, half_gap: 0.6, preload: 0.2}",
}

impl Preloaded {
    #[inline]
    fn force<N: Number>(&self, q: N) -> N {
        let p = match self.half_gap {
            0.0 => q,
            b => q - q.clamp(-b, b),
        };
        p + p.sign() * self.preload
    }
}

#[typetag::serde(name = "preloaded")]
impl Element for Preloaded {
    #[inline]
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
            name: "half_gap",
            index: None,
            dimension: Dimension::DISPLACEMENT,
            value: &mut self.half_gap,
        });
        visit(Parameter {
            name: "preload",
            index: None,
            dimension: Dimension::FORCE,
            value: &mut self.preload,
        });
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn breakpoints(&self) -> Vec<f64> {
        if self.half_gap > 0.0 {
            vec![-self.half_gap, self.half_gap]
        } else if self.preload > 0.0 {
            vec![0.0]
        } else {
            Vec::new()
        }
    }

    fn flank(&self, q: f64) -> i8 {
        let is_always_closed = self.half_gap == 0.0;
        if q > self.half_gap || (is_always_closed && self.preload == 0.0) {
            1
        } else if q < -self.half_gap {
            -1
        } else {
            i8::from(is_always_closed)
        }
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }

    fn is_discontinuous(&self) -> bool {
        self.preload != 0.0
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        super::not_negative("half_gap", self.half_gap)?;
        super::not_negative("preload", self.preload)
    }
}
