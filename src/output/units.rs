//! Units on axes: prefixes that keep numbers short, requested conversions.

use std::f64::consts::PI;

use crate::report::Panel;

/// Units that convert into each other: kind of quantity, name, size of one.
const UNITS: &[(&str, &str, f64)] = &[
    ("frequency", "rad/s", 1.0),
    ("frequency", "Hz", 2.0 * PI),
    ("frequency", "kHz", 2000.0 * PI),
    ("frequency", "rpm", 2.0 * PI / 60.0),
    ("time", "s", 1.0),
    ("time", "ms", 1e-3),
    ("time", "\u{b5}s", 1e-6),
    ("time", "min", 60.0),
    ("length", "m", 1.0),
    ("length", "mm", 1e-3),
    ("length", "\u{b5}m", 1e-6),
    ("length", "in", 0.0254),
    ("angle", "rad", 1.0),
    ("angle", "mrad", 1e-3),
    ("angle", "\u{b5}rad", 1e-6),
    ("angle", "deg", PI / 180.0),
    ("force", "N", 1.0),
    ("force", "kN", 1e3),
    ("torque", "N m", 1.0),
    ("torque", "kN m", 1e3),
    ("torque", "mN m", 1e-3),
    ("energy", "J", 1.0),
    ("energy", "mJ", 1e-3),
    ("energy", "\u{b5}J", 1e-6),
    ("inertia", "kg m^2", 1.0),
    ("inertia", "g m^2", 1e-3),
    ("inertia", "g mm^2", 1e-9),
];

/// Units that take a prefix by themselves, and whether large ones do.
const PREFIXED: &[(&str, bool)] = &[
    ("m", false),
    ("s", false),
    ("rad", false),
    ("m/s", false),
    ("rad/s", false),
    ("N", true),
    ("N m", true),
    ("J", true),
    ("W", true),
];
const PREFIXES: [(f64, &str); 6] = [
    (1e-9, "n"),
    (1e-6, "\u{b5}"),
    (1e-3, "m"),
    (1.0, ""),
    (1e3, "k"),
    (1e6, "M"),
];

/// Text of an axis in its parts: words, and the unit in brackets at their end, if there is one.
pub(super) fn split(label: &str) -> (&str, &str) {
    let inner = label
        .strip_suffix(']')
        .and_then(|rest| rest.rsplit_once(" ["));
    inner.unwrap_or((label, ""))
}

/// Unit with a prefix for numbers of this size, and the factor to it.
pub(super) fn prefixed(unit: &str, largest: f64) -> Option<(String, f64)> {
    let (_, may_grow) = PREFIXED.iter().find(|(name, _)| *name == unit)?;
    if !(largest > 0.0 && largest.is_finite()) || (0.1..1e4).contains(&largest) {
        return None;
    }
    let fits = |(size, _): &&(f64, &str)| largest / size >= 1.0 && (*may_grow || *size <= 1.0);
    let (size, prefix) = PREFIXES.iter().rev().find(fits)?;
    (*size != 1.0).then(|| (format!("{prefix}{unit}"), 1.0 / size))
}

/// A unit as it is read: exponents raised.
pub(super) fn pretty(unit: &str) -> String {
    unit.replace("^2", "\u{b2}").replace("^3", "\u{b3}")
}

/// Text of an axis and the factor of its numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scaled {
    pub label: String,
    pub factor: f64,
}

impl Scaled {
    fn new(words: &str, unit: &str, factor: f64) -> Scaled {
        let label = match unit {
            "" => words.to_string(),
            unit => format!("{words} [{}]", pretty(unit)),
        };
        Scaled { label, factor }
    }

    /// In a unit that suits numbers of this size.
    pub fn suiting(label: &str, largest: f64) -> Scaled {
        let (words, unit) = split(label);
        match prefixed(unit, largest) {
            Some((unit, factor)) => Scaled::new(words, &unit, factor),
            None => Scaled::new(words, unit, 1.0),
        }
    }

    /// The abscissa of a panel in the requested unit.
    ///
    /// # Errors
    /// A unit that its numbers cannot have, and which they can.
    pub fn abscissa(panel: &Panel) -> Result<Scaled, String> {
        let wanted = panel
            .x_unit
            .replace("um", "\u{b5}m")
            .replace("us", "\u{b5}s");
        let (wanted, ratio, shaft) = of_shaft(&wanted, panel)?;
        let (words, unit) = split(&panel.x_label);
        let (from, size) = match panel.x_frequency {
            Some(axis) => ("frequency", axis.size(axis.written)),
            None => match find(unit) {
                Some((kind, size)) => (kind, size),
                None => return Err(format!("`{words}` has no unit that converts")),
            },
        };
        let of_shaft = shaft.map(|name| format!("speed of {name}"));
        let words = match (&of_shaft, panel.x_frequency) {
            (Some(speed), _) => speed,
            (None, Some(_)) => "excitation frequency",
            (None, None) => words,
        };
        match find(wanted) {
            Some((kind, new)) if kind == from => Ok(Scaled::new(words, wanted, size * ratio / new)),
            _ => {
                let list = UNITS.iter().filter(|(kind, ..)| *kind == from);
                let list: Vec<&str> = list.map(|(_, name, _)| *name).collect();
                Err(format!(
                    "`{}` is no unit of `{words}`; wanted one of {}",
                    panel.x_unit,
                    list.join(", ")
                ))
            }
        }
    }
}

/// `rpm of gear_1`: the unit, the speed of the shaft over the frequency of the axis, and its name.
fn of_shaft<'u>(wanted: &'u str, panel: &Panel) -> Result<(&'u str, f64, Option<&'u str>), String> {
    let Some((unit, shaft)) = wanted.split_once(" of ") else {
        return Ok((wanted, 1.0, None));
    };
    let found = panel.shafts.iter().find(|(name, _)| name == shaft);
    match found.filter(|(_, ratio)| *ratio != 0.0) {
        Some((_, ratio)) => Ok((unit, ratio.abs(), Some(shaft))),
        None => {
            let turning = panel.shafts.iter().filter(|(_, ratio)| *ratio != 0.0);
            let names: Vec<&str> = turning.map(|(name, _)| name.as_str()).collect();
            Err(match names.is_empty() {
                true => format!("`{shaft}`: the axis is no speed of a model with a `reference`"),
                false => format!(
                    "no shaft called `{shaft}` turns; wanted one of {}",
                    names.join(", ")
                ),
            })
        }
    }
}

fn find(unit: &str) -> Option<(&'static str, f64)> {
    let found = UNITS.iter().find(|(_, name, _)| *name == unit);
    found.map(|(kind, _, size)| (*kind, *size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{FrequencyAxis, FrequencyUnit};

    #[test]
    fn small_numbers_get_a_prefix_and_large_lengths_do_not() {
        assert_eq!(prefixed("m", 5e-5), Some(("\u{b5}m".into(), 1.0 / 1e-6)));
        assert_eq!(prefixed("N", 2.5e4).unwrap().0, "kN");
        assert_eq!(prefixed("m", 1e5), None);
        assert_eq!(prefixed("m", 0.5), None);
        assert_eq!(prefixed("rad/s^2", 1e-6), None);
        assert_eq!(split("r.m.s. deformation [m]"), ("r.m.s. deformation", "m"));
        assert_eq!(split("nothing"), ("nothing", ""));
    }

    #[test]
    fn frequencies_convert_from_what_the_column_holds() {
        let panel = |unit: &str| Panel {
            x_label: "excitation frequency \u{3c9}/\u{3c9}c".into(),
            x_unit: unit.into(),
            x_frequency: Some(FrequencyAxis {
                written: FrequencyUnit::Nondimensional,
                shown: FrequencyUnit::Nondimensional,
                omega_c: PI,
            }),
            ..Panel::default()
        };
        let rpm = Scaled::abscissa(&panel("rpm")).unwrap();
        assert_eq!(
            (rpm.label.as_str(), rpm.factor.round()),
            ("excitation frequency [rpm]", 30.0)
        );
        assert!(
            Scaled::abscissa(&panel("mm"))
                .unwrap_err()
                .contains("rad/s, Hz")
        );
    }
}
