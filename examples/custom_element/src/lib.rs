//! Laws of one's own: Hertzian contact of two round bodies, with clearance; Bouc and Wen's hysteresis; a one-way clutch.
//! `docs/plugins.md` explains them.

#![forbid(unsafe_code)]

mod bouc_wen;
mod one_way_clutch;

pub use bouc_wen::BoucWen;
pub use one_way_clutch::OneWayClutch;

use gearlash::element::derivatives::from_force;
use gearlash::element::number::Number;
use gearlash::element::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange, Response,
    Symbol,
};
use gearlash::serde::{Deserialize, Serialize};
use gearlash::typetag;

/// Hertzian contact with clearance.
///
///     F = sign(q) c (|q| - b)^(3/2) beyond the gap, 0 inside
///
/// b: half gap, c: contact coefficient [force/displacement^(3/2)]; f = F/K. Elastic, without adhesion, for approaches that are
/// small against the radii of the bodies.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(crate = "gearlash::serde", deny_unknown_fields)]
pub struct Hertz {
    /// Half of the total gap b \[displacement\], >= 0.
    #[serde(default)]
    pub half_gap: f64,
    /// c, > 0.
    pub coefficient: f64,
}

/// Exponents are counted in halves: force^1 displacement^(-3/2).
const COEFFICIENT: Dimension = Dimension {
    force: 2,
    displacement: -3,
    time: 0,
};

gearlash::register_element! {
    tag: "hertz",
    doc: "F = sign(q) c (|q| - b)^(3/2) beyond the gap, 0 inside; Hertzian contact with clearance",
    parameters: [
        { name: "half_gap", doc: "half of the total gap", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: Some("0"), range: ParameterRange::NotNegative },
        { name: "coefficient", doc: "contact coefficient c, such as 1e10 N/m^1.5", kind: ParameterKind::Number, dimension: COEFFICIENT, default: None, range: ParameterRange::Positive },
    ],
    example: "{type: hertz, half_gap: 0.5, coefficient: 1.2}",
}

impl Hertz {
    fn force<N: Number>(&self, q: N) -> N {
        let approach = (q.abs() - self.half_gap).max(0.0);
        approach.powf(1.5) * q.sign() * self.coefficient
    }
}

#[typetag::serde(name = "hertz")]
impl Element for Hertz {
    // `Dual` numbers provide the derivatives.
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        from_force(q, v, |q, _v| self.force(q))
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
        let Hertz {
            half_gap,
            coefficient,
        } = self;
        for (name, dimension, value) in [
            ("half_gap", Dimension::DISPLACEMENT, half_gap),
            ("coefficient", COEFFICIENT, coefficient),
        ] {
            visit(Parameter {
                name,
                index: None,
                dimension,
                value,
            });
        }
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn breakpoints(&self) -> Vec<f64> {
        match self.half_gap {
            0.0 => vec![0.0],
            b => vec![-b, b],
        }
    }

    fn flank(&self, q: f64) -> i8 {
        match q {
            _ if q > self.half_gap => 1,
            _ if q < -self.half_gap => -1,
            _ => 0,
        }
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        match (self.half_gap, self.coefficient) {
            (b, _) if !(b >= 0.0 && b.is_finite()) => {
                Err(InvalidParameter::new("half_gap", b, ">= 0"))
            }
            (_, c) if !(c > 0.0 && c.is_finite()) => {
                Err(InvalidParameter::new("coefficient", c, "> 0"))
            }
            _ => Ok(()),
        }
    }
}
