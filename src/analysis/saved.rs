//! Points of other runs: their states and parameters, from the tables in a folder of results.

use super::{Setting, columns};
use std::collections::HashMap;
use std::path::Path;

/// Reference to a point of saved results.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub folder: &'a Path,
    pub analysis: &'a str,
    /// Branch, curve, run or attractor.
    pub branch: i64,
    pub point: i64,
}

/// A row of a table by the names of its columns; cells that are not numbers are left out.
#[derive(Debug, Clone, Default)]
pub(super) struct Saved(HashMap<String, f64>);

/// Columns that number branches, and points on them.
const BRANCHES: [&str; 4] = ["curve", "branch", "attractor", "run"];
/// Largest table that is read.
const MOST_BYTES: u64 = 1 << 30;

impl Wanted<'_> {
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
        let mut saved = self.row(&main)?;
        for table in ["orbits", "points"] {
            let file = self.folder.join(format!("{name}.{table}.csv"));
            if file.is_file()
                && let Ok(more) = self.row(&file)
            {
                for (key, value) in more.0 {
                    saved.0.entry(key).or_insert(value);
                }
            }
        }
        Ok(saved)
    }

    /// The first row of a table with the number of the point.
    fn row(self, file: &Path) -> Result<Saved, String> {
        let told = |what: String| format!("{}: {what}", file.display());
        let length = std::fs::metadata(file)
            .map_err(|e| told(e.to_string()))?
            .len();
        if length > MOST_BYTES {
            return Err(told(format!(
                "{length} bytes; at most {MOST_BYTES} are read"
            )));
        }
        let mut reader = csv::Reader::from_path(file).map_err(|e| told(e.to_string()))?;
        let headers = reader.headers().map_err(|e| told(e.to_string()))?.clone();
        for record in reader.records() {
            let record = record.map_err(|e| told(e.to_string()))?;
            let cells = headers.iter().zip(&record);
            let numbers = cells.filter_map(|(h, c)| Some((h.to_string(), c.parse::<f64>().ok()?)));
            let row = Saved(numbers.collect());
            let branch = BRANCHES.iter().find_map(|name| row.get(name));
            let is_branch = branch.is_none_or(|b| b == self.branch as f64);
            if is_branch && row.get("point") == Some(self.point as f64) {
                return Ok(row);
            }
        }
        Err(told(format!(
            "no point {} of branch {}",
            self.point, self.branch
        )))
    }
}

impl Saved {
    /// A number of the row.
    pub fn get(&self, column: &str) -> Option<f64> {
        self.0.get(column).copied()
    }

    /// The state at phase 0, nondimensional.
    ///
    /// # Errors
    /// The first coordinate that the tables do not have.
    pub fn state(&self, setting: &Setting<'_>) -> Result<Vec<f64>, String> {
        let value = |heading: crate::measure::Heading| {
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
