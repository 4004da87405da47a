//! Initial states as a user writes them.

use super::{Fault, Setting, columns, flow};
use crate::quantity::{Quantity, UnitDimension};
use crate::system::System;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// State at phase 0: relative coordinates r and their rates. Bare numbers are in the units of the report (nondimensional r and
/// dr/dT, or SI); quantities with a unit are converted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Initial {
    /// Relative coordinates; the static equilibrium when absent.
    pub q: Option<Vec<Quantity>>,
    /// Their rates; zero when absent.
    pub v: Option<Vec<Quantity>>,
}

/// Positions or rates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Position,
    Rate,
}

impl Initial {
    /// What is wrong with it; `key` is its own.
    pub fn check(&self, setting: &Setting<'_>, key: &str) -> Vec<Fault> {
        let mut faults = Vec::new();
        for (name, list, kind) in [("q", &self.q, Kind::Position), ("v", &self.v, Kind::Rate)] {
            if let Some(Err(list)) = list.as_ref().map(|l| numbers(setting, l, kind)) {
                let full = |(at, message): (String, String)| {
                    Fault::new(format!("{key}.{name}{at}"), message)
                };
                faults.extend(list.into_iter().map(full));
            }
        }
        faults
    }

    /// [q; v], nondimensional, 2n values.
    ///
    /// # Errors
    /// The first of the faults that `check` finds.
    pub fn state(
        &self,
        setting: &Setting<'_>,
        system: &System,
        key: &str,
    ) -> Result<(Vec<f64>, Option<String>), Fault> {
        if let Some(fault) = self.check(setting, key).into_iter().next() {
            return Err(fault);
        }
        let n = system.dof();
        let (mut state, mut warning) = flow::rest(system);
        if let Some(Ok(q)) = self.q.as_ref().map(|l| numbers(setting, l, Kind::Position)) {
            state[..n].copy_from_slice(&q);
            warning = None;
        }
        if let Some(Ok(v)) = self.v.as_ref().map(|l| numbers(setting, l, Kind::Rate)) {
            state[n..].copy_from_slice(&v);
        }
        Ok((state, warning))
    }

    /// The numbers alone, nondimensional: half widths of a box. What is absent is zero.
    ///
    /// # Errors
    /// The first of the faults that `check` finds.
    pub fn widths(&self, setting: &Setting<'_>, key: &str) -> Result<Vec<f64>, Fault> {
        if let Some(fault) = self.check(setting, key).into_iter().next() {
            return Err(fault);
        }
        let n = setting.assembly.system.dof();
        let part = |list: &Option<Vec<Quantity>>, kind| {
            let found = list.as_ref().and_then(|l| numbers(setting, l, kind).ok());
            found.unwrap_or_else(|| vec![0.0; n])
        };
        let mut all = part(&self.q, Kind::Position);
        all.extend(part(&self.v, Kind::Rate));
        Ok(all)
    }
}

/// Nondimensional values, one a coordinate; mistakes with the rest of their key.
fn numbers(
    setting: &Setting<'_>,
    list: &[Quantity],
    kind: Kind,
) -> Result<Vec<f64>, Vec<(String, String)>> {
    let names = &setting.assembly.coordinates;
    if list.len() != names.len() {
        let message = format!(
            "{} values for {} relative coordinates ({})",
            list.len(),
            names.len(),
            names.join(", ")
        );
        return Err(vec![(String::new(), message)]);
    }
    let (mut values, mut mistakes) = (Vec::new(), Vec::new());
    for (i, quantity) in list.iter().enumerate() {
        match number(setting, i, quantity, kind) {
            Ok(value) => values.push(value),
            Err(message) => mistakes.push((format!(".{i}"), message)),
        }
    }
    if mistakes.is_empty() {
        Ok(values)
    } else {
        Err(mistakes)
    }
}

/// A value of a coordinate or of its rate, nondimensional.
///
/// # Errors
/// A wrong unit.
pub(super) fn number(
    setting: &Setting<'_>,
    coordinate: usize,
    quantity: &Quantity,
    kind: Kind,
) -> Result<f64, String> {
    let Some(connection) = columns::connection_of(setting, coordinate) else {
        return match quantity.dimension {
            None => Ok(quantity.value),
            Some(_) => Err(format!(
                "`{}` has a unit, but a reduced model is nondimensional",
                quantity.text
            )),
        };
    };
    let scales = &setting.assembly.scales;
    let l = scales.displacement[connection];
    let is_angle = setting.model.units_of(connection).0 == "rad";
    let (wanted, scale) = match kind {
        Kind::Position if is_angle => (UnitDimension::ANGLE, l),
        Kind::Position => (UnitDimension::LENGTH, l),
        Kind::Rate if is_angle => (UnitDimension::FREQUENCY, l * scales.frequency),
        Kind::Rate => (UnitDimension::VELOCITY, l * scales.frequency),
    };
    if quantity.dimension.is_none() && !setting.is_si() {
        return Ok(quantity.value);
    }
    Ok(quantity.si(wanted)? / scale)
}
