//! Points of other runs: their states and parameters, from the tables in a folder of results.

use super::parameter::VariedParameter;
use super::{Setting, columns};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A point saved by another run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SavedPoint {
    /// Folder of results of another run, relative to the working directory.
    pub results: PathBuf,
    /// Analysis of those results.
    pub analysis: String,
    /// Branch, curve, attractor or run of the point; 0 when absent.
    #[serde(default)]
    pub branch: i64,
    /// Number of the point.
    pub point: i64,
}

impl SavedPoint {
    /// The point with its state.
    ///
    /// # Errors
    /// No such folder, analysis or point.
    pub(super) fn read(&self) -> Result<Saved, String> {
        let wanted = SavedReference {
            folder: &self.results,
            analysis: &self.analysis,
            branch: self.branch,
            point: self.point,
        };
        wanted.read()
    }
}

/// Reference to a point of saved results.
#[derive(Debug, Clone, Copy)]
pub(super) struct SavedReference<'a> {
    pub folder: &'a Path,
    pub analysis: &'a str,
    /// Branch, curve, run or attractor.
    pub branch: i64,
    pub point: i64,
}

/// A row of a table by the names of its columns; cells that are not numbers are left out.
type SavedRow = HashMap<String, f64>;

/// A point with the numbers that its run varied.
#[derive(Debug, Clone, Default)]
pub(super) struct Saved {
    row: SavedRow,
    /// Columns of varied numbers, and what these are called.
    varied: Vec<(&'static str, String)>,
}

/// Columns that number branches, and points on them.
const BRANCHES: [&str; 4] = ["curve", "branch", "attractor", "run"];
/// Largest table that is read.
const MOST_BYTES: u64 = 1 << 30;

impl SavedReference<'_> {
    /// The point with its state: from the main table, completed by the first row of its orbit and by the table of points.
    ///
    /// # Errors
    /// No such folder, analysis or point.
    pub fn read(self) -> Result<Saved, String> {
        let name = self.analysis;
        let is_name = name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
        if name.is_empty() || !is_name {
            return Err(format!("`{name}` is no name of an analysis"));
        }
        let main = self.folder.join(format!("{name}.csv"));
        if !main.is_file() {
            return Err(format!("there is no file {}", main.display()));
        }
        let mut saved = Saved {
            row: self.row(&main)?,
            varied: self.varied()?,
        };
        for table in ["orbits", "points"] {
            let file = self.folder.join(format!("{name}.{table}.csv"));
            if file.is_file()
                && let Ok(more) = self.row(&file)
            {
                for (key, value) in more {
                    saved.row.entry(key).or_insert(value);
                }
            }
        }
        Ok(saved)
    }

    /// Columns of the numbers that the run varied, with their names.
    fn varied(self) -> Result<Vec<(&'static str, String)>, String> {
        let file = self.folder.join(format!("{}.json", self.analysis));
        let told = |what: String| format!("{}: {what}", file.display());
        is_readable(&file)?;
        let text = std::fs::read_to_string(&file).map_err(|e| told(e.to_string()))?;
        let all: Value = serde_json::from_str(&text).map_err(|e| told(e.to_string()))?;
        let one = [&all["parameter"], &all["options"]["parameter"]];
        let one = one.into_iter().find_map(Value::as_str);
        let two = all["options"]["parameters"].as_array();
        let two = two.into_iter().flatten().filter_map(Value::as_str);
        let two = ["parameter_1", "parameter_2"].into_iter().zip(two);
        let list = one.map(|name| ("parameter", name)).into_iter().chain(two);
        Ok(list.map(|(key, name)| (key, name.to_owned())).collect())
    }

    /// The first row of a table with the number of the point.
    fn row(self, file: &Path) -> Result<SavedRow, String> {
        let told = |what: String| format!("{}: {what}", file.display());
        is_readable(file)?;
        let mut reader = csv::Reader::from_path(file).map_err(|e| told(e.to_string()))?;
        let headers = reader.headers().map_err(|e| told(e.to_string()))?.clone();
        for record in reader.records() {
            let record = record.map_err(|e| told(e.to_string()))?;
            let cells = headers.iter().zip(&record);
            let numbers = cells.filter_map(|(h, c)| Some((h.to_string(), c.parse::<f64>().ok()?)));
            let row: SavedRow = numbers.collect();
            let branch = BRANCHES.iter().find_map(|name| row.get(*name));
            let is_branch = branch.is_none_or(|b| *b == self.branch as f64);
            if is_branch && row.get("point") == Some(&(self.point as f64)) {
                return Ok(row);
            }
        }
        Err(told(format!(
            "no point {} of branch {}",
            self.point, self.branch
        )))
    }
}

/// Whether a file is there and not too long.
fn is_readable(file: &Path) -> Result<(), String> {
    let told = |what: String| format!("{}: {what}", file.display());
    let length = std::fs::metadata(file).map_err(|e| told(e.to_string()))?;
    match length.len() {
        length if length > MOST_BYTES => Err(told(format!(
            "{length} bytes; at most {MOST_BYTES} are read"
        ))),
        _ => Ok(()),
    }
}

impl Saved {
    /// A number of the row.
    fn get(&self, column: &str) -> Option<f64> {
        self.row.get(column).copied()
    }

    /// Value of a parameter: omega/omega_c, or SI base units. A number that the run did not vary is as in the model.
    ///
    /// # Errors
    /// The results do not have it.
    pub fn value(&self, setting: &Setting<'_>, parameter: &VariedParameter) -> Result<f64, String> {
        let is_own = |name: &str| {
            let found = VariedParameter::find(setting, name);
            found.is_ok_and(|found| found.name() == parameter.name())
        };
        let varied = self.varied.iter().find(|(_, name)| is_own(name));
        let varied = varied.and_then(|(column, _)| self.get(column));
        let value = match (parameter, varied) {
            (VariedParameter::Frequency(_), Some(value)) if setting.is_si() => {
                Some(value / setting.assembly.scales.frequency)
            }
            (_, Some(value)) => Some(value),
            (VariedParameter::Frequency(_), None) => self.get("omega"),
            (VariedParameter::Number(knob), None) => Some(setting.model.get(knob)),
        };
        value.ok_or_else(|| format!("the results have no value of {}", parameter.name()))
    }

    /// The state at phase 0, nondimensional.
    ///
    /// # Errors
    /// The first coordinate that the tables do not have.
    pub fn state(&self, setting: &Setting<'_>) -> Result<Vec<f64>, String> {
        let value = |heading: crate::measure::ColumnHeading| {
            let value = self.get(&heading.name).map(|x| x / heading.factor);
            value.ok_or_else(|| {
                format!(
                    "the results have no column {} (states are kept by curves, and by responses with `orbits`)",
                    heading.name
                )
            })
        };
        columns::states(setting).into_iter().map(value).collect()
    }
}
