//! Backlash: two flanks with a gap between them.

use super::derivatives::from_force;
use super::number::Number;
use super::traced::Symbol;
use super::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange, Response,
};
use serde::{Deserialize, Serialize};

/// Action of impact damping on the flank q < -b.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImpactDampingLaw {
    /// f = p (1 + beta sign(p) v): takes energy out on both flanks.
    #[default]
    Dissipative,
    /// f = p (1 + beta v), as printed in Rook & Singh (1995), eq. (1): puts energy in on the flank q < -b.
    Literal,
}

/// Backlash with impact damping.
///
/// ```text
/// p(q) = q - b for q > b, 0 inside, q + b for q < -b
/// f = p (1 + beta sign(p) v) + c v    (dissipative)    or    p (1 + beta v) + c v    (literal), c v in contact only
/// ```
///
/// b is HALF the total backlash. Not physical where 1 + beta sign(p) v < 0 (literal: 1 + beta v < 0): the contact pulls. With contact
/// damping c the force jumps by c v as contact is made, and the contact pulls just before it is lost.
///
/// Rook & Singh (1995), eq. (1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BacklashKeys", into = "BacklashKeys")]
pub struct Backlash {
    /// Half of the total gap b \[displacement\], >= 0; 0 means always in contact.
    pub half_gap: f64,
    /// Impact damping beta [time/displacement], >= 0.
    pub impact_damping: f64,
    /// Behaviour of the damping on the back flank.
    pub impact_damping_law: ImpactDampingLaw,
    /// Damping c in contact [force time/displacement], >= 0: c v/K while a flank is touched.
    pub contact_damping: f64,
}

impl Backlash {
    /// Backlash with half of the total gap b [m; rad for shafts] and no impact damping.
    pub fn half_gap(half_gap: f64) -> Backlash {
        Backlash {
            half_gap,
            impact_damping: 0.0,
            impact_damping_law: ImpactDampingLaw::Dissipative,
            contact_damping: 0.0,
        }
    }

    /// Sets the impact damping beta [s/m; s/rad for shafts].
    #[must_use]
    pub fn impact_damping(self, impact_damping: f64) -> Backlash {
        Backlash {
            impact_damping,
            ..self
        }
    }
}

/// The parameters as a user writes them: the half gap or the whole gap.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BacklashKeys {
    #[serde(skip_serializing_if = "Option::is_none")]
    half_gap: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gap: Option<f64>,
    #[serde(default)]
    impact_damping: f64,
    #[serde(default)]
    impact_damping_law: ImpactDampingLaw,
    #[serde(default, skip_serializing_if = "is_zero")]
    contact_damping: f64,
}

pub(super) fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl TryFrom<BacklashKeys> for Backlash {
    type Error = String;

    fn try_from(written: BacklashKeys) -> Result<Self, String> {
        let half_gap = match (written.half_gap, written.gap) {
            (Some(half), None) => half,
            (None, Some(gap)) => 0.5 * gap,
            (None, None) => {
                return Err(
                    "one of half_gap or gap (the total backlash, 2 half_gap) is required".into(),
                );
            }
            (Some(_), Some(_)) => {
                return Err("half_gap and gap exclude each other (gap = 2 half_gap)".into());
            }
        };
        let BacklashKeys {
            impact_damping,
            impact_damping_law,
            contact_damping,
            ..
        } = written;
        Ok(Backlash {
            half_gap,
            impact_damping,
            impact_damping_law,
            contact_damping,
        })
    }
}

impl From<Backlash> for BacklashKeys {
    fn from(law: Backlash) -> BacklashKeys {
        let Backlash {
            half_gap,
            impact_damping,
            impact_damping_law,
            contact_damping,
        } = law;
        BacklashKeys {
            half_gap: Some(half_gap),
            gap: None,
            impact_damping,
            impact_damping_law,
            contact_damping,
        }
    }
}

crate::register_element! {
    tag: "backlash",
    doc: "two flanks with a gap: f = p (1 + beta sign(p) v), p = q - b for q > b, 0 inside, q + b for q < -b",
    parameters: [
        { name: "half_gap", doc: "half of the total backlash", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::NotNegative, one_of: ["half_gap", "gap"] },
        { name: "gap", doc: "total backlash, 2 half_gap", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::NotNegative, one_of: ["half_gap", "gap"] },
        { name: "impact_damping", doc: "impact damping beta", kind: ParameterKind::Number, dimension: Dimension::INVERSE_VELOCITY, default: Some("0"), range: ParameterRange::NotNegative },
        { name: "impact_damping_law", doc: "dissipative on both flanks, or literal as in eq. (1) of the paper, which adds energy on the back flank", kind: ParameterKind::Choice(&["dissipative", "literal"]), dimension: Dimension::NONE, default: Some("dissipative") },
        { name: "contact_damping", doc: "viscous damping c v in contact only; the contact may pull", kind: ParameterKind::Number, dimension: Dimension::DAMPING, default: Some("0"), range: ParameterRange::NotNegative },
    ],
    example: "{type: backlash, half_gap: 1.0, impact_damping: 0.05}",
}

impl Backlash {
    #[inline]
    fn force<N: Number>(&self, q: N, v: N) -> N {
        let p = match self.half_gap {
            0.0 => q,
            b => q - q.clamp(-b, b),
        };
        let b = self.half_gap;
        let touches = b == 0.0 || q > b || q < -b;
        match self.contact_damping {
            c if c != 0.0 && touches => self.impact(p, v) + v * c,
            _ => self.impact(p, v),
        }
    }

    /// The force of a flank without contact damping.
    #[inline]
    fn impact<N: Number>(&self, p: N, v: N) -> N {
        if self.impact_damping == 0.0 {
            return p;
        }
        let beta = match self.impact_damping_law {
            ImpactDampingLaw::Dissipative => p.sign() * self.impact_damping,
            ImpactDampingLaw::Literal => N::from(self.impact_damping),
        };
        p * (beta * v + 1.0)
    }
}

#[typetag::serde(name = "backlash")]
impl Element for Backlash {
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
            name: "half_gap",
            index: None,
            dimension: Dimension::DISPLACEMENT,
            value: &mut self.half_gap,
        });
        visit(Parameter {
            name: "impact_damping",
            index: None,
            dimension: Dimension::INVERSE_VELOCITY,
            value: &mut self.impact_damping,
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
        if self.half_gap > 0.0 {
            vec![-self.half_gap, self.half_gap]
        } else if self.impact_damping != 0.0
            && self.impact_damping_law == ImpactDampingLaw::Dissipative
        {
            vec![0.0]
        } else {
            Vec::new()
        }
    }

    fn flank(&self, q: f64) -> i8 {
        if self.half_gap == 0.0 || q > self.half_gap {
            1
        } else if q < -self.half_gap {
            -1
        } else {
            0
        }
    }

    fn is_piecewise_affine(&self) -> bool {
        self.impact_damping == 0.0
    }

    fn depends_on_velocity(&self) -> bool {
        self.impact_damping != 0.0 || self.contact_damping != 0.0
    }

    fn is_discontinuous(&self) -> bool {
        self.contact_damping != 0.0 && self.half_gap > 0.0
    }

    fn cautions(&self) -> Vec<String> {
        contact_caution(self.contact_damping)
    }

    fn is_passive(&self) -> bool {
        self.impact_damping == 0.0 || self.impact_damping_law == ImpactDampingLaw::Dissipative
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        super::not_negative("half_gap", self.half_gap)?;
        super::not_negative("impact_damping", self.impact_damping)?;
        super::not_negative("contact_damping", self.contact_damping)
    }
}

/// What contact damping does just before contact is lost.
pub(super) fn contact_caution(damping: f64) -> Vec<String> {
    match damping > 0.0 {
        true => vec!["contact_damping: the contact pulls just before it is lost".into()],
        false => Vec::new(),
    }
}
