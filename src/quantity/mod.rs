//! Quantities such as `50 um`, `300 rpm`, `1e4 N m/rad`, in SI units with a checked dimension.
//!
//! A bare number is SI. Decimal units convert without rounding twice: `5 um` is the double nearest to 5e-6.

mod dimension;
mod pattern;
mod serde_impl;
mod unit;

pub use dimension::UnitDimension;
pub use pattern::{NUMBER_PATTERN, QUANTITY, pattern};
pub use unit::symbols;

use crate::error::Diagnostic;
use crate::yaml::{Node, Value, scalar};
use std::f64::consts::PI;

/// A number with or without a unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Value in SI base units; as written for bare numbers.
    pub value: f64,
    /// Dimension of the unit; `None` for a bare number.
    pub dimension: Option<UnitDimension>,
    /// The text as written.
    pub text: String,
}

impl Quantity {
    /// The quantity of a text.
    ///
    /// # Errors
    /// Errors in the number or the unit; also infinite values and NaN.
    pub fn parse(text: &str) -> Result<Quantity, String> {
        let text = text.trim();
        let finite = |value: f64| {
            if value.is_finite() {
                Ok(value)
            } else {
                Err(format!("`{}` is not a finite number", shown(text)))
            }
        };
        if let Some(number) = scalar::number(text) {
            return Ok(Quantity {
                value: finite(number.as_f64())?,
                dimension: None,
                text: text.to_owned(),
            });
        }
        let Some(end) = scalar::decimal_length(text) else {
            return Err(format!(
                "`{}` is neither a number nor a number with a unit",
                shown(text)
            ));
        };
        let (number, rest) = text.split_at(end);
        if rest.starts_with(['_', ',']) {
            return Err(format!(
                "`{}` is not a number; write digits without separators, such as 1000 or 1e3",
                shown(text)
            ));
        }
        let unit = unit::parse(rest)?;
        Ok(Quantity {
            value: finite(convert(number, &unit))?,
            dimension: Some(unit.dimension),
            text: text.to_owned(),
        })
    }

    /// Value in SI units of the wanted dimension; a bare number is taken as it is.
    ///
    /// # Errors
    /// Found and expected dimensions, if they do not agree (see [`UnitDimension::fits`]).
    pub fn si(&self, wanted: UnitDimension) -> Result<f64, String> {
        match self.dimension {
            Some(found) if !found.fits(wanted) => {
                let example = match wanted.example() {
                    _ if wanted == UnitDimension::FREQUENCY && found == RATE => {
                        "; 1/s may mean rad/s or Hz: use one of these".to_owned()
                    }
                    Some(example) => format!(", for example `{example}`"),
                    None => String::new(),
                };
                Err(format!(
                    "`{}` is {}; wanted {}{example}",
                    shown(&self.text),
                    found.describe(),
                    wanted.describe()
                ))
            }
            _ => Ok(self.value),
        }
    }

    /// The quantity of a scalar node, quoted or not; `path` is the dotted path of the node.
    ///
    /// # Errors
    /// If it is not a scalar or not a quantity.
    pub fn from_node(node: &Node, path: &str) -> Result<Quantity, Diagnostic> {
        match &node.value {
            Value::Scalar { text, .. } if !node.is_null() => {
                Quantity::parse(text).map_err(|message| Diagnostic::at(node, path, message))
            }
            _ => Err(Diagnostic::at(
                node,
                path,
                format!("found {}, wanted a number or a quantity", node.describe()),
            )),
        }
    }
}

impl Default for Quantity {
    /// The bare number 0.
    fn default() -> Quantity {
        Quantity::from(0.0)
    }
}

/// A bare number: SI units, or nondimensional.
impl From<f64> for Quantity {
    fn from(value: f64) -> Quantity {
        Quantity {
            value,
            dimension: None,
            text: format!("{value:?}"),
        }
    }
}

/// A frequency in Hz.
pub fn hertz(value: f64) -> Quantity {
    frequency(value, "Hz", 2.0 * PI)
}

/// A frequency in revolutions per minute.
pub fn rpm(value: f64) -> Quantity {
    frequency(value, "rpm", PI / 30.0)
}

/// A frequency in rad/s.
pub fn radians_per_second(value: f64) -> Quantity {
    frequency(value, "rad/s", 1.0)
}

/// A frequency as if it were written, so that programs and model files compute with the same number.
fn frequency(value: f64, unit: &str, factor: f64) -> Quantity {
    let text = format!("{value:?} {unit}");
    Quantity::parse(&text).unwrap_or(Quantity {
        value: value * factor,
        dimension: Some(UnitDimension::FREQUENCY),
        text,
    })
}

const RATE: UnitDimension = UnitDimension::new(0, 0, -1, 0);

/// Value of a scalar node in SI units of the wanted dimension; `path` is the dotted path of the node.
///
/// # Errors
/// If it is not a quantity or has the wrong dimension.
pub fn read(node: &Node, path: &str, wanted: UnitDimension) -> Result<f64, Diagnostic> {
    Quantity::from_node(node, path)?
        .si(wanted)
        .map_err(|message| Diagnostic::at(node, path, message))
}

/// A decimal number in a unit, in SI base units: the decimal part exactly, then pi and the denominator.
fn convert(number: &str, unit: &unit::Unit) -> f64 {
    let value = scaled(number, unit.numerator, unit.exponent);
    value * PI.powi(unit.pi) / unit.denominator as f64 * unit.root
}

/// number x factor x 10^exponent, correctly rounded where the digits fit into 128 bits.
fn scaled(number: &str, factor: u128, exponent: i32) -> f64 {
    let (mantissa, own) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let (sign, whole) = match whole.strip_prefix('-') {
        Some(digits) => ("-", digits),
        None => ("", whole.strip_prefix('+').unwrap_or(whole)),
    };
    let digits: Option<u128> = format!("{whole}{fraction}").parse().ok();
    let product = digits.and_then(|digits| digits.checked_mul(factor));
    let own: Option<i64> = own.parse().ok();
    // The length of a number's text is below 2^24: no overflow.
    let shift = own.map(|own| own.saturating_add(i64::from(exponent)) - fraction.len() as i64);
    let exact = match (product, shift) {
        (Some(product), Some(shift)) => format!("{sign}{product}e{shift}").parse().ok(),
        _ => None,
    };
    let rounded = || {
        let number: f64 = number.parse().unwrap_or(f64::NAN);
        number * factor as f64 * 10f64.powi(exponent)
    };
    exact.unwrap_or_else(rounded)
}

/// A text short enough for a message.
fn shown(text: &str) -> String {
    let mut short: String = text.chars().take(40).collect();
    if text.chars().nth(40).is_some() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::UnitDimension as D;
    use super::*;
    use std::f64::consts::TAU;

    fn si(text: &str, wanted: D) -> Result<f64, String> {
        Quantity::parse(text)?.si(wanted)
    }

    #[test]
    fn decimal_units_convert_to_the_nearest_double() {
        for (text, wanted, value) in [
            ("50 um", D::LENGTH, 5e-5),
            ("5 um", D::LENGTH, 5e-6),
            ("5µm", D::LENGTH, 5e-6),
            ("0.1 mm", D::LENGTH, 1e-4),
            ("-1.5e3 mm", D::LENGTH, -1.5),
            ("1 in", D::LENGTH, 0.0254),
            ("3 ft", D::LENGTH, 0.9144),
            ("1.0e-3 kg m^2", D::INERTIA, 1e-3),
            ("5 g mm^2", D::INERTIA, 5e-9),
            ("2 kg cm²", D::INERTIA, 2e-4),
            ("3 kg⋅m²", D::INERTIA, 3.0),
            ("4 N m s rad⁻¹", D::TORSIONAL_DAMPING, 4.0),
            ("2 mil", D::LENGTH, 5.08e-5),
            ("16 oz", D::MASS, 0.453_592_37),
            ("16 ozf", D::FORCE, 4.448_221_615_260_5),
            ("5 MN/m", D::STIFFNESS, 5e6),
            ("2 lbf ft", D::MOMENT, 2.711_635_896_662_800_5),
            ("1 lbf in s^2", D::INERTIA, 0.112_984_829_027_616_7),
            ("100 N m", D::MOMENT, 100.0),
            ("100 N*m", D::MOMENT, 100.0),
            ("100 N.m", D::MOMENT, 100.0),
            ("100Nm", D::MOMENT, 100.0),
            ("12 lbf in", D::MOMENT, 1.3558179483314004),
            ("2.4e8 N/m", D::STIFFNESS, 2.4e8),
            ("240 N/um", D::STIFFNESS, 2.4e8),
            ("1e4 N m/rad", D::TORSIONAL_STIFFNESS, 1e4),
            ("1e4 N m", D::TORSIONAL_STIFFNESS, 1e4),
            ("2 N s/m", D::DAMPING, 2.0),
            ("2 N/(m/s)", D::DAMPING, 2.0),
            ("1 N m s rad^-1", D::TORSIONAL_DAMPING, 1.0),
            ("3 ms", D::TIME, 3e-3),
            ("1/m^2", D::new(0, -2, 0, 0), 1.0),
            ("4 1/mm^2", D::new(0, -2, 0, 0), 4e6),
            ("36 km/h", D::VELOCITY, 10.0),
            ("1 kgf", D::FORCE, 9.80665),
            ("150 rad/s", D::FREQUENCY, 150.0),
            ("5 rad", D::NUMBER, 5.0),
            ("4e-05", D::LENGTH, 4e-5),
            ("0x10", D::LENGTH, 16.0),
        ] {
            assert_eq!(si(text, wanted), Ok(value), "{text}");
        }
    }

    #[test]
    fn angles_and_frequencies() {
        for (text, wanted, value) in [
            ("180 deg", D::ANGLE, PI),
            ("30 deg", D::ANGLE, PI / 6.0),
            ("60 arcmin", D::ANGLE, PI / 180.0),
            ("25 Hz", D::FREQUENCY, TAU * 25.0),
            ("3000 rpm", D::FREQUENCY, 100.0 * PI),
            ("3 krpm", D::FREQUENCY, 100.0 * PI),
            ("90°", D::ANGLE, PI / 2.0),
            ("1 N m/deg", D::TORSIONAL_STIFFNESS, 180.0 / PI),
            ("50 rev/s", D::FREQUENCY, 100.0 * PI),
            ("0.01 m/m", D::ANGLE, 0.01),
        ] {
            // One rounding each for the product with pi and the division.
            let found = si(text, wanted).unwrap();
            assert!((found / value - 1.0).abs() < 4e-16, "{text}: {found}");
        }
    }

    #[test]
    fn half_powers() {
        let contact = D::of_law(-3, 0, 2, D::LENGTH);
        assert_eq!(contact.unit(), "N/m^1.5");
        for (text, value) in [
            ("1e10 N/m^1.5", 1e10),
            ("1e10 N/m^(3/2)", 1e10),
            ("1e10 N m^-1.5", 1e10),
            ("1e10 N m^(-3/2)", 1e10),
            ("1e10 N/(m m^0.5)", 1e10),
            ("316.22776601683795 N/mm^1.5", 1e7),
            ("1 kN/um^1.5", 1e12),
        ] {
            let found = si(text, contact).unwrap();
            assert!((found / value - 1.0).abs() < 4e-16, "{text}: {found}");
        }
        assert_eq!(si("4 (mm^2)^0.5", D::LENGTH), Ok(4e-3));
        assert_eq!(si("4 mm^1.0", D::LENGTH), Ok(4e-3));
        assert_eq!(si("3 m^2.kg", D::INERTIA), Ok(3.0));
        for text in [
            "1 m^0.25",
            "1 (m^0.5)^0.5",
            "1 m^(1/3)",
            "1 m^(1/0)",
            "1 m^(1.5",
        ] {
            assert!(Quantity::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn wrong_dimensions_say_what_was_found_and_wanted() {
        assert_eq!(
            si("5 N", D::LENGTH).unwrap_err(),
            "`5 N` is a force [N]; wanted a length [m], for example `50 um`"
        );
        for (text, wanted) in [
            ("1 N m/rad", D::MOMENT),
            ("1 N/m", D::TORSIONAL_STIFFNESS),
            ("25 1/s", D::FREQUENCY),
            ("25 Hz", D::TIME),
            ("1 rad", D::LENGTH),
            ("5 um", D::ANGLE),
        ] {
            assert!(si(text, wanted).is_err(), "{text}");
        }
        let text = si("5 kg m^3", D::LENGTH).unwrap_err();
        assert!(text.contains("a quantity in kg m^3"), "{text}");
    }

    #[test]
    fn mistakes_are_explained() {
        for (text, part) in [
            ("5 uum", "did you mean `um`?"),
            ("5 KN", "did you mean `kN`?"),
            ("5 RPM", "did you mean `rpm`?"),
            ("5 furlong", "known are"),
            ("5 inches", "did you mean `in`?"),
            ("5 kgm^2", "write `kg m`"),
            ("5 Nms/rad", "write `Nm s`"),
            ("5 m⁻", "whole number"),
            ("5 %", "unknown unit `%`"),
            ("5 m2", "`^`"),
            ("5 N/m s", "two ways"),
            ("5 N*", "missing after `*`"),
            ("5 *N", "missing before"),
            ("5 (N m", "not closed"),
            ("5 m^x", "whole number"),
            ("5 m^99", "too many"),
            ("5 in^9 in^9 in^9", "too many"),
            ("1_000", "separators"),
            ("1,5 mm", "separators"),
            ("abc", "neither"),
            ("", "neither"),
            (".inf", "finite"),
            (".nan", "finite"),
            ("1e400 mm", "finite"),
            ("1e999", "finite"),
            ("5 m)", "no meaning"),
        ] {
            let message = Quantity::parse(text).unwrap_err();
            assert!(message.contains(part), "{text}: {message}");
        }
    }

    #[test]
    fn long_numbers_and_extreme_exponents() {
        let long = format!("0.{}5 um", "0".repeat(300));
        assert_eq!(si(&long, D::LENGTH), Ok(5e-307));
        let digits = format!("{} um", "3".repeat(60));
        assert!(si(&digits, D::LENGTH).unwrap() > 3e53);
        assert_eq!(si("1e-99999999999999999999 mm", D::LENGTH), Ok(0.0));
        assert_eq!(
            si("-0 mm", D::LENGTH).unwrap().to_bits(),
            (-0.0f64).to_bits()
        );
    }

    #[test]
    fn dimensions_of_laws() {
        assert_eq!(D::of_law(2, 0, 0, D::LENGTH), D::LENGTH);
        assert_eq!(D::of_law(-2, 2, 0, D::ANGLE), D::new(0, 0, 1, -1));
        assert_eq!(D::of_law(0, 0, 2, D::ANGLE), D::MOMENT);
        assert_eq!(D::of_law(-4, 0, 0, D::LENGTH), D::new(0, -2, 0, 0));
        assert_eq!(D::of_law(-1, 0, 0, D::LENGTH).unit(), "1/m^(1/2)");
        assert_eq!(D::FORCE.unit(), "N");
        assert_eq!(D::FORCE.power(2).unit(), "kg^2 m^2/s^4");
    }
}
