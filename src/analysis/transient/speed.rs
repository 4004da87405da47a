//! Times and speeds as a user writes them.

use crate::analysis::{Fault, Setting};
use crate::model::Structure;
use crate::numeric::broken_line::BrokenLine;
use crate::quantity::{Quantity, UnitDimension};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Speed of the reference against time: linear between instants, constant before the first and after the last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpeedProfile {
    /// Pairs of time and speed, such as `[[0 s, 800 rpm], [5 s, 4000 rpm]]`. Bare numbers are s and rpm, in
    /// nondimensional reports T and omega/omega_c.
    pub points: Vec<(Quantity, Quantity)>,
}

/// A time in omega_c t; a bare number is in s, in nondimensional reports T itself.
///
/// # Errors
/// A wrong unit, or one in a reduced model.
pub fn time(setting: &Setting<'_>, quantity: &Quantity) -> Result<f64, String> {
    let is_reduced = matches!(setting.model.structure, Structure::Reduced(_));
    match quantity.dimension {
        Some(_) if is_reduced => Err(format!(
            "`{}` has a unit, but a reduced model is nondimensional; give T = omega_c t",
            quantity.text
        )),
        None if !setting.is_si() => Ok(quantity.value),
        _ => Ok(quantity.si(UnitDimension::TIME)? * setting.assembly.scales.frequency),
    }
}

/// A speed of the reference over omega_c, of any sign.
fn speed(setting: &Setting<'_>, quantity: &Quantity) -> Result<f64, String> {
    let w_c = setting.assembly.scales.frequency;
    match (quantity.dimension, &setting.model.structure) {
        (None, _) if !setting.is_si() => Ok(quantity.value),
        (None, _) => Ok(quantity.value * TAU / 60.0 / w_c),
        (Some(_), Structure::Reduced(_)) => Err(format!(
            "`{}` has a unit, but a reduced model is nondimensional; give omega/omega_c",
            quantity.text
        )),
        (Some(_), _) => Ok(quantity.si(UnitDimension::FREQUENCY)? / w_c),
    }
}

impl SpeedProfile {
    /// Speed over omega_c against omega_c t; `key` is its own.
    ///
    /// # Errors
    /// Faults of single numbers, instants that do not ascend.
    pub fn line(&self, setting: &Setting<'_>, key: &str) -> Result<BrokenLine, Vec<Fault>> {
        let (mut points, mut faults) = (Vec::new(), Vec::new());
        for (k, (t, w)) in self.points.iter().enumerate() {
            let place = |i: usize| format!("{key}.points.{k}.{i}");
            let t = time(setting, t).map_err(|m| faults.push(Fault::new(place(0), m)));
            let w = speed(setting, w).map_err(|m| faults.push(Fault::new(place(1), m)));
            if let (Ok(t), Ok(w)) = (t, w) {
                points.push((t, w));
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        if let Some(k) = points.windows(2).position(|pair| pair[1].0 <= pair[0].0) {
            let place = format!("{key}.points.{}", k + 1);
            let message = "instants must ascend: the speed of a shaft does not jump";
            return Err(vec![Fault::new(place, message)]);
        }
        BrokenLine::new(points).map_err(|_| {
            let message =
                "no points: wanted at least one, such as [[0 s, 800 rpm], [5 s, 4000 rpm]]";
            vec![Fault::new(format!("{key}.points"), message)]
        })
    }
}
