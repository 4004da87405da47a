//! Initial states as a user writes them.

use super::saved::SavedReference;
use super::{Fault, Setting, columns, flow};
use crate::quantity::{Quantity, UnitDimension};
use crate::system::System;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// State at phase 0: relative coordinates r and their rates. Bare numbers are in the units of the report (nondimensional r and
/// dr/dT, or SI); quantities with a unit are converted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Initial {
    /// Relative coordinates; default: the static equilibrium.
    pub q: Option<Vec<Quantity>>,
    /// Rates; default 0.
    pub v: Option<Vec<Quantity>>,
    /// Memory of the connections, in their order (of a slider: the deformation at which its spring is relaxed);
    /// default: the memory left by the static equilibrium. Values inconsistent with the deformation are replaced by
    /// the nearest consistent ones.
    pub memory: Option<Vec<Quantity>>,
    /// Folder of results of another run, relative to the working directory: the state is that of a point in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub results: Option<PathBuf>,
    /// Analysis of those results.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub analysis: Option<String>,
    /// Branch, curve, attractor or run of that point; 0 when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub branch: Option<i64>,
    /// Number of that point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point: Option<i64>,
}

/// Positions or rates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum InitialKind {
    Position,
    Rate,
    Memory,
}

impl Initial {
    /// Errors in it; `key` is its own.
    pub fn check(&self, setting: &Setting<'_>, key: &str) -> Vec<Fault> {
        let mut faults = Vec::new();
        if let Some(Err(message)) = self.saved(setting) {
            faults.push(Fault::new(format!("{key}.results"), message));
        }
        for (name, list, kind) in [
            ("q", &self.q, InitialKind::Position),
            ("v", &self.v, InitialKind::Rate),
            ("memory", &self.memory, InitialKind::Memory),
        ] {
            if let Some(Err(list)) = list.as_ref().map(|l| numbers(setting, l, kind)) {
                let full = |(at, message): (String, String)| {
                    Fault::new(format!("{key}.{name}{at}"), message)
                };
                faults.extend(list.into_iter().map(full));
            }
        }
        faults
    }

    /// [q; v; z], nondimensional.
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
        let (mut state, mut warning) = match self.saved(setting) {
            Some(Ok(state)) => (state, None),
            _ => flow::rest(system),
        };
        if let Some(Ok(q)) = self
            .q
            .as_ref()
            .map(|l| numbers(setting, l, InitialKind::Position))
        {
            state[..n].copy_from_slice(&q);
            warning = None;
        }
        if let Some(Ok(v)) = self
            .v
            .as_ref()
            .map(|l| numbers(setting, l, InitialKind::Rate))
        {
            state[n..2 * n].copy_from_slice(&v);
        }
        if let Some(Ok(z)) =
            (self.memory.as_ref()).map(|l| numbers(setting, l, InitialKind::Memory))
        {
            state[2 * n..].copy_from_slice(&z);
        }
        Ok((state, warning))
    }

    /// The state of a point of other results; `None` where none is named.
    fn saved(&self, setting: &Setting<'_>) -> Option<Result<Vec<f64>, String>> {
        let parts = (&self.results, &self.analysis, self.point);
        let (Some(folder), Some(analysis), Some(point)) = parts else {
            let is_absent = parts == (&None, &None, None);
            let message =
                "a saved point is a folder of `results`, an `analysis` in it and a `point`";
            return (!is_absent).then(|| Err(message.into()));
        };
        let wanted = SavedReference {
            folder,
            analysis,
            branch: self.branch.unwrap_or(0),
            point,
        };
        Some(wanted.read().and_then(|row| row.state(setting)))
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
        let part = |list: &Option<Vec<Quantity>>, kind, count: usize| {
            let found = list.as_ref().and_then(|l| numbers(setting, l, kind).ok());
            found.unwrap_or_else(|| vec![0.0; count])
        };
        let mut all = part(&self.q, InitialKind::Position, n);
        all.extend(part(&self.v, InitialKind::Rate, n));
        let memories = setting.assembly.system.memory_count();
        all.extend(part(&self.memory, InitialKind::Memory, memories));
        Ok(all)
    }
}

/// Nondimensional values, one per coordinate; errors with the rest of their key.
fn numbers(
    setting: &Setting<'_>,
    list: &[Quantity],
    kind: InitialKind,
) -> Result<Vec<f64>, Vec<(String, String)>> {
    let (what, names) = match kind {
        InitialKind::Memory => {
            let list = columns::memories(setting).into_iter();
            (
                "numbers that connections remember",
                list.map(|h| h.name).collect(),
            )
        }
        _ => ("relative coordinates", setting.assembly.coordinates.clone()),
    };
    if list.len() != names.len() {
        let message = format!(
            "{} values for {} {what} ({})",
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
    kind: InitialKind,
) -> Result<f64, String> {
    let connection = match kind {
        InitialKind::Memory => memory_owner(setting, coordinate),
        _ => columns::connection_of(setting, coordinate),
    };
    let Some(connection) = connection else {
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
        InitialKind::Position | InitialKind::Memory if is_angle => (UnitDimension::ANGLE, l),
        InitialKind::Position | InitialKind::Memory => (UnitDimension::LENGTH, l),
        InitialKind::Rate if is_angle => (UnitDimension::FREQUENCY, l * scales.frequency),
        InitialKind::Rate => (UnitDimension::VELOCITY, l * scales.frequency),
    };
    if quantity.dimension.is_none() && !setting.is_si() {
        return Ok(quantity.value);
    }
    Ok(quantity.si(wanted)? / scale)
}

/// The connection to which a place in the memory belongs; `None` in reduced systems, whose scale is 1.
fn memory_owner(setting: &Setting<'_>, place: usize) -> Option<usize> {
    setting.assembly.coupling.as_ref()?;
    let system = &setting.assembly.system;
    (0..system.element_count()).find(|e| system.memory_of(*e).contains(&place))
}
