//! Which connections move, how far and around what: the settings as nondimensional numbers.

use super::{EffectiveFrequencies, Mean};
use crate::analysis::{Fault, Setting, limits};
use crate::error::did_you_mean;
use crate::quantity::{Quantity, UnitDimension};

/// Mean of one connection, nondimensional.
#[derive(Debug, Clone, Copy)]
pub(super) enum HeldQuantity {
    Displacement(f64),
    Force(f64),
}

/// One connection that moves, nondimensional.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving {
    pub connection: usize,
    /// First and last amplitude.
    pub amplitude: [f64; 2],
    pub held: HeldQuantity,
}

impl EffectiveFrequencies {
    /// The connections that move, or everything wrong with the settings.
    pub(super) fn moving(&self, setting: &Setting<'_>) -> Result<Vec<Moving>, Vec<Fault>> {
        let names = &setting.assembly.connections;
        let mut faults = Vec::new();
        faults.extend(limits::check("points", self.points, 2, limits::POINTS));
        let means = match (&self.mean_displacement, &self.mean_force) {
            (Some(mean), None) => Some(("mean_displacement", mean)),
            (None, Some(mean)) => Some(("mean_force", mean)),
            (found, _) => {
                let both = "mean_displacement and mean_force exclude each other";
                let none = "one of mean_displacement or mean_force is required";
                let message = if found.is_some() { both } else { none };
                faults.push(Fault::new("", message));
                None
            }
        };
        let named = self.vary.iter().flatten().enumerate();
        faults.extend(named.filter_map(|(k, name)| unknown(names, &format!("vary.{k}"), name)));
        if let Some((key, Mean::Each(map))) = means {
            let keys = map.keys();
            faults.extend(keys.filter_map(|name| unknown(names, &format!("{key}.{name}"), name)));
        }
        let moves = |name: &String| self.vary.as_ref().is_none_or(|list| list.contains(name));
        let mut list = Vec::new();
        for (connection, _) in names.iter().enumerate().filter(|(_, name)| moves(name)) {
            match self.one(setting, connection, means) {
                Ok(moving) => list.extend(moving),
                Err(more) => more.into_iter().for_each(|fault| {
                    // The same error in every connection is one error.
                    if !faults.contains(&fault) {
                        faults.push(fault);
                    }
                }),
            }
        }
        faults.extend(one_axis(setting, &list, &self.amplitude));
        if faults.is_empty() {
            Ok(list)
        } else {
            Err(faults)
        }
    }

    fn one(
        &self,
        setting: &Setting<'_>,
        connection: usize,
        means: Option<(&'static str, &Mean)>,
    ) -> Result<Option<Moving>, Vec<Fault>> {
        let mut faults = Vec::new();
        let mut number = |key: String, quantity: &Quantity, kind| {
            let value = nondimensional(setting, connection, quantity, kind);
            value
                .map_err(|message| faults.push(Fault::new(key, message)))
                .ok()
        };
        let [from, to] = [0, 1].map(|k| {
            let (key, written) = (format!("amplitude.{k}"), &self.amplitude[k]);
            number(key, written, NumberKind::Amplitude)
        });
        let name = &setting.assembly.connections[connection];
        let held = match means {
            None => None,
            Some((key, mean)) => {
                let (path, written) = match mean {
                    Mean::All(quantity) => (key.to_string(), Some(quantity)),
                    Mean::Each(map) => (format!("{key}.{name}"), map.get(name)),
                };
                let (kind, held): (_, fn(f64) -> HeldQuantity) = match key {
                    "mean_force" => (NumberKind::Force, HeldQuantity::Force),
                    _ => (NumberKind::Displacement, HeldQuantity::Displacement),
                };
                match written {
                    Some(quantity) => number(path, quantity, kind).map(held),
                    None => {
                        let message = format!("{name} moves but has no value");
                        faults.push(Fault::new(key, message));
                        None
                    }
                }
            }
        };
        if !faults.is_empty() {
            return Err(faults);
        }
        let complete = from.zip(to).zip(held);
        Ok(complete.map(|((from, to), held)| Moving {
            connection,
            amplitude: [from, to],
            held,
        }))
    }
}

fn unknown(names: &[String], key: &str, name: &String) -> Option<Fault> {
    let message = || {
        let hint = did_you_mean(name, names);
        format!("no connection is called `{name}`; {hint}")
    };
    (!names.contains(name)).then(|| Fault::new(key, message()))
}

/// Dimension of a written number.
#[derive(Clone, Copy, PartialEq)]
enum NumberKind {
    Amplitude,
    Displacement,
    Force,
}

/// A written number over l (forces: over K l).
fn nondimensional(
    setting: &Setting<'_>,
    connection: usize,
    quantity: &Quantity,
    kind: NumberKind,
) -> Result<f64, String> {
    let scales = &setting.assembly.scales;
    let (l, k) = (
        scales.displacement[connection],
        scales.stiffness[connection],
    );
    let (unit, force) = setting.model.units_of(connection);
    let (wanted, scale) = match (kind, unit) {
        (NumberKind::Force, _) if force == "N m" => (UnitDimension::MOMENT, k * l),
        (NumberKind::Force, _) => (UnitDimension::FORCE, k * l),
        (_, "rad") => (UnitDimension::ANGLE, l),
        _ => (UnitDimension::LENGTH, l),
    };
    let value = match quantity.dimension {
        None if !setting.is_si() => quantity.value,
        Some(_) if unit.is_empty() => {
            return Err(format!(
                "`{}` has a unit, but a reduced model is nondimensional",
                quantity.text
            ));
        }
        _ => {
            let name = &setting.assembly.connections[connection];
            let value = quantity.si(wanted).map_err(|e| format!("{name}: {e}"))?;
            value / scale
        }
    };
    if kind == NumberKind::Amplitude && value < 0.0 {
        return Err(format!("{} must be >= 0", quantity.text));
    }
    Ok(value)
}

/// One column of amplitudes has to hold for all connections.
fn one_axis(setting: &Setting<'_>, moving: &[Moving], written: &[Quantity; 2]) -> Option<Fault> {
    let (first, rest) = moving.split_first()?;
    let unit = |m: &Moving| setting.model.units_of(m.connection).0;
    let name = |m: &Moving| &setting.assembly.connections[m.connection];
    if setting.is_si() {
        let other = rest.iter().find(|m| unit(m) != unit(first))?;
        let message = format!(
            "{} is measured in {}, {} in {}; name connections of one unit in `vary`",
            name(first),
            unit(first),
            name(other),
            unit(other)
        );
        return Some(Fault::new("amplitude", message));
    }
    let scale = |m: &Moving| setting.assembly.scales.displacement[m.connection];
    let other = rest.iter().find(|m| scale(m) != scale(first))?;
    let message = format!(
        "a length is not the same number for {} and {}, whose displacement scales differ; give bare numbers (over the scale of \
         each), or name connections of one scale in `vary`",
        name(first),
        name(other)
    );
    let has_unit = written.iter().any(|q| q.dimension.is_some());
    has_unit.then(|| Fault::new("amplitude", message))
}
