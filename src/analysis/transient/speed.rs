//! Times and speeds as a user writes them.

use crate::analysis::{Fault, Setting};
use crate::model::{self, Structure};
use crate::numeric::broken_line::BrokenLine;
use crate::quantity::{Quantity, UnitDimension};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Speed of the reference against time: linear between instants, constant before the first and after the last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpeedProfile {
    /// Pairs of time and speed, such as `[[0 s, 800 rpm], [5 s, 4000 rpm]]`. Bare numbers are s and rpm, in
    /// nondimensional reports T and omega/omega_c.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<(Quantity, Quantity)>,
    /// Table with a header row (CSV), relative to the model file, instead of `points`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Name of its column of instants; `time` when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// Name of its column of speeds; `speed` when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Unit of the speeds; rpm when absent, in nondimensional reports that of omega/omega_c.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Unit of the instants; s when absent, in nondimensional reports that of T.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_unit: Option<String>,
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
        if self.file.is_some() {
            return self.of_file(setting, key).map_err(|fault| vec![fault]);
        }
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
                "no points and no file: wanted at least one, such as [[0 s, 800 rpm], [5 s, 4000 rpm]]";
            vec![Fault::new(format!("{key}.points"), message)]
        })
    }

    /// Speeds as a table has them.
    fn of_file(&self, setting: &Setting<'_>, key: &str) -> Result<BrokenLine, Fault> {
        let fault = |tail: &str, message: String| Fault::new(format!("{key}.{tail}"), message);
        if !self.points.is_empty() {
            return Err(fault("points", "does not go with `file`".into()));
        }
        let Some(path) = self.path(setting, key) else {
            return Err(fault("file", "is missing".into()));
        };
        let names = [
            self.time.as_deref().unwrap_or("time"),
            self.column.as_deref().unwrap_or("speed"),
        ];
        let of = |unit: &Option<String>,
                  usual: &str,
                  read: &dyn Fn(&Quantity) -> Result<f64, String>| {
            let unit = match (unit, setting.is_si()) {
                (Some(unit), _) => unit,
                (None, true) => usual,
                (None, false) => "",
            };
            read(&Quantity::parse(&format!("1 {unit}"))?)
        };
        let per_time = of(&self.time_unit, "s", &|one| time(setting, one));
        let per_time = per_time.map_err(|message| fault("time_unit", message))?;
        let per_speed = of(&self.unit, "rpm", &|one| speed(setting, one));
        let per_speed = per_speed.map_err(|message| fault("unit", message))?;
        let said = |message: String| fault("file", format!("{}: {message}", path.display()));
        let columns = model::columns_of(&path, &names).map_err(said)?;
        let [times, speeds] = [&columns[0], &columns[1]];
        if let Some(k) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(said(format!(
                "row {}, column `{}`: found {}, wanted more than {}, the instant before",
                k + 3,
                names[0],
                times[k + 1],
                times[k]
            )));
        }
        let points = times
            .iter()
            .zip(speeds)
            .map(|(t, w)| (t * per_time, w * per_speed));
        BrokenLine::new(points.collect()).map_err(|_| said("no row below the header".into()))
    }

    /// The table beside the model file.
    pub fn path(&self, setting: &Setting<'_>, key: &str) -> Option<PathBuf> {
        let document = setting.model.document();
        let own = format!("analyses.{}.{key}.file", setting.name);
        let place = document.at(&own).and_then(|node| node.location.as_ref());
        let place = place.or(document.location.as_ref());
        let folder = place.and_then(|place| Path::new(&place.source.name).parent());
        Some(folder.unwrap_or(Path::new("")).join(self.file.as_ref()?))
    }
}
