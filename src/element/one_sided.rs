//! A stop on one side.

use super::backlash::{contact_caution, is_zero};
use super::derivatives::from_force;
use super::number::Number;
use super::traced::Symbol;
use super::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange, Response,
};
use serde::{Deserialize, Serialize};

/// Direction of motion that meets the stop.
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
    /// Damping c in contact [force time/displacement], >= 0: c v/K while the stop is touched.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub contact_damping: f64,
}

crate::register_element! {
    tag: "one_sided",
    doc: "f = max(q - gap, 0), mirrored for side: negative; a stop",
    parameters: [
        { name: "gap", doc: "distance to the stop", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::NotNegative },
        { name: "side", doc: "side of the stop", kind: ParameterKind::Choice(&["positive", "negative"]), dimension: Dimension::NONE, default: Some("positive") },
        { name: "contact_damping", doc: "viscous damping c v in contact only; the contact may pull", kind: ParameterKind::Number, dimension: Dimension::DAMPING, default: Some("0"), range: ParameterRange::NotNegative },
    ],
    example: "{type: one_sided, gap: 0.5}",
}

impl OneSided {
    #[inline]
    fn force<N: Number>(&self, q: N, v: N) -> N {
        let p = match self.side {
            Side::Positive if q > self.gap => q - self.gap,
            Side::Negative if q < -self.gap => q + self.gap,
            _ => return N::from(0.0),
        };
        match self.contact_damping {
            0.0 => p,
            c => p + v * c,
        }
    }
}

#[typetag::serde(name = "one_sided")]
impl Element for OneSided {
    #[inline]
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        from_force(q, v, |q, v| self.force(q, v))
    }

    fn trace<'t>(
        &self,
        q: Symbol<'t>,
        v: Symbol<'t>,
        _phase: Symbol<'t>,
    ) -> Result<Symbol<'t>, String> {
        Ok(self.force(q, v))
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        visit(Parameter {
            name: "gap",
            index: None,
            dimension: Dimension::DISPLACEMENT,
            value: &mut self.gap,
        });
        visit(Parameter {
            name: "contact_damping",
            index: None,
            dimension: Dimension::DAMPING,
            value: &mut self.contact_damping,
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
        self.contact_damping != 0.0
    }

    fn is_passive(&self) -> bool {
        true
    }

    fn is_discontinuous(&self) -> bool {
        self.contact_damping != 0.0
    }

    fn cautions(&self) -> Vec<String> {
        contact_caution(self.contact_damping)
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        super::not_negative("gap", self.gap)?;
        super::not_negative("contact_damping", self.contact_damping)
    }
}
