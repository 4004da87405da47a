//! A smooth law with memory: Bouc and Wen's hysteresis.

use gearlash::element::evolving::{Evolution, Evolving, Kinks, first_loading, from_rates};
use gearlash::element::number::Number;
use gearlash::element::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange, Response,
    Symbol,
};
use gearlash::serde::{Deserialize, Serialize};
use gearlash::typetag;

/// Bouc and Wen's hysteresis.
///
/// ```text
/// f = a q + (1 - a) z,    z' = v (1 - |z/Y|^n (1 - s + s sign(v z)))
/// ```
///
/// Y: deformation at which it yields, a: stiffness after yielding over that before, n: sharpness of the transition, s: shape. With
/// s = 1/2 it unloads along the elastic line. Rate-independent; loops that do not enclose z = 0 drift, which real joints do not.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(crate = "gearlash::serde", deny_unknown_fields)]
pub struct BoucWen {
    /// Y \[displacement\], > 0.
    pub yield_deformation: f64,
    /// a, 0 to 1.
    #[serde(default)]
    pub hardening: f64,
    /// n, >= 1. The series flow needs a whole number.
    #[serde(default = "one")]
    pub exponent: f64,
    /// s, 0.5 to 1: thermodynamically admissible shapes.
    #[serde(default = "half")]
    pub shape: f64,
}

fn one() -> f64 {
    1.0
}

fn half() -> f64 {
    0.5
}

gearlash::register_element! {
    tag: "bouc_wen",
    doc: "f = a q + (1 - a) z, z' = v (1 - |z/Y|^n (1 - s + s sign(v z))); Bouc and Wen's hysteresis",
    parameters: [
        { name: "yield_deformation", doc: "deformation Y at which it yields", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::Positive },
        { name: "hardening", doc: "stiffness after yielding over that before, 0 to 1", kind: ParameterKind::Number, dimension: Dimension::NONE, default: Some("0"), range: ParameterRange::NotNegative },
        { name: "exponent", doc: "sharpness n of the transition, >= 1", kind: ParameterKind::Number, dimension: Dimension::NONE, default: Some("1"), range: ParameterRange::Positive },
        { name: "shape", doc: "shape s of the loop, 0.5 to 1; at 0.5 it unloads along the elastic line", kind: ParameterKind::Number, dimension: Dimension::NONE, default: Some("0.5"), range: ParameterRange::Positive },
    ],
    example: "{type: bouc_wen, yield_deformation: 0.4, hardening: 0.1, exponent: 2, shape: 0.6}",
}

impl BoucWen {
    /// Force and rate of the memory.
    fn rates<N: Number>(&self, q: N, v: N, z: N) -> [N; 2] {
        let size = (z / self.yield_deformation).abs();
        let direction = (v.sign() * z.sign()) * self.shape + (1.0 - self.shape);
        let power = match self.exponent.fract() {
            0.0 => size.powi(self.exponent as i32),
            _ => size.powf(self.exponent),
        };
        let force = q * self.hardening + z * (1.0 - self.hardening);
        [force, v * (N::from(1.0) - power * direction)]
    }
}

impl Evolving for BoucWen {
    fn evolve(&self, at: [f64; 4]) -> Evolution {
        from_rates(at, |q, v, z| self.rates(q, v, z))
    }

    fn trace<'t>(&self, [q, v, _, z]: [Symbol<'t>; 4]) -> Result<[Symbol<'t>; 2], String> {
        Ok(self.rates(q, v, z))
    }

    fn kinks(&self) -> Kinks {
        Kinks {
            rate: vec![0.0],
            memory: vec![0.0],
            ..Kinks::default()
        }
    }
}

#[typetag::serde(name = "bouc_wen")]
impl Element for BoucWen {
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        first_loading(self, q, v, phase)
    }

    fn memory_count(&self) -> usize {
        1
    }

    fn evolving(&self) -> Option<&dyn Evolving> {
        Some(self)
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        let BoucWen {
            yield_deformation,
            hardening,
            exponent,
            shape,
        } = self;
        for (name, dimension, value) in [
            (
                "yield_deformation",
                Dimension::DISPLACEMENT,
                yield_deformation,
            ),
            ("hardening", Dimension::NONE, hardening),
            ("exponent", Dimension::NONE, exponent),
            ("shape", Dimension::NONE, shape),
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

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        let BoucWen {
            yield_deformation,
            hardening,
            exponent,
            shape,
        } = *self;
        let checks = [
            (
                "yield_deformation",
                yield_deformation,
                yield_deformation > 0.0,
                "> 0",
            ),
            (
                "hardening",
                hardening,
                (0.0..=1.0).contains(&hardening),
                "from 0 to 1",
            ),
            ("exponent", exponent, exponent >= 1.0, ">= 1"),
            (
                "shape",
                shape,
                (0.5..=1.0).contains(&shape),
                "from 0.5 to 1",
            ),
        ];
        let wrong = |(_, value, is_right, _): &&(_, f64, bool, _)| !is_right || !value.is_finite();
        match checks.iter().find(wrong) {
            Some((name, value, _, wanted)) => Err(InvalidParameter::new(*name, *value, *wanted)),
            None => Ok(()),
        }
    }
}
