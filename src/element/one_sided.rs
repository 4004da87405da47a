//! A stop on one side.

use super::derivatives::from_force;
use super::number::Number;
use super::tape::Symbol;
use super::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange, Response,
};
use serde::{Deserialize, Serialize};

/// Which direction of motion meets the stop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Contact for q > gap.
    #[default]
    Positive,
    /// Contact for q < -gap.
    Negative,
}

/// A stop: f = max(q - gap, 0), mirrored for the negative side. No mass and no damping of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OneSided {
    /// Distance from q = 0 to the stop \[displacement\], >= 0.
    pub gap: f64,
    /// Side of the stop.
    #[serde(default)]
    pub side: Side,
}

crate::register_element! {
    tag: "one_sided",
    doc: "f = max(q - gap, 0), mirrored for side: negative; a stop",
    parameters: [
        { name: "gap", doc: "distance to the stop", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::NotNegative },
        { name: "side", doc: "side of the stop", kind: ParameterKind::Choice(&["positive", "negative"]), dimension: Dimension::NONE, default: Some("positive") },
    ],
    example: "{type: one_sided, gap: 0.5}",
}

impl OneSided {
    #[inline]
    fn force<N: Number>(&self, q: N) -> N {
        match self.side {
            Side::Positive if q > self.gap => q - self.gap,
            Side::Negative if q < -self.gap => q + self.gap,
            _ => N::from(0.0),
        }
    }
}

#[typetag::serde(name = "one_sided")]
impl Element for OneSided {
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
            name: "gap",
            index: None,
            dimension: Dimension::DISPLACEMENT,
            value: &mut self.gap,
        });
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn breakpoints(&self) -> Vec<f64> {
        match self.side {
            Side::Positive => vec![self.gap],
            Side::Negative => vec![-self.gap],
        }
    }

    fn flank(&self, q: f64) -> i8 {
        match self.side {
            Side::Positive if q > self.gap => 1,
            Side::Negative if q < -self.gap => -1,
            _ => 0,
        }
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        super::not_negative("gap", self.gap)
    }
}
