//! Which initial state ends at which attractor.

mod grid;
mod report;
mod sort;

use super::cost::{Cost, Period};
use super::flow::{self, LabelKeys};
use super::{Analysis, Fault, Initial, Setting, columns, limits};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::solve::attractor::LabelOptions;
use crate::solve::attractor::basins::Patience;
use crate::solve::integrate::IntegratorChoice;
use grid::Grid;
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use sort::{BasinStart, Sorting};
use std::time::Instant;

/// Settings of `basins`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Basins {
    /// Excitation frequency.
    pub at: Quantity,
    /// Values of the varied coordinates, by column name, such as `q.mesh_1` and `v.mesh_1`.
    pub grid: IndexMap<String, BasinAxis>,
    /// All other coordinates at phase 0; default: the static equilibrium at rest.
    #[serde(default)]
    pub initial: Option<Initial>,
    /// Periods before the search for new attractors.
    #[serde(default = "defaults::transient")]
    pub transient: usize,
    /// Periods per record.
    #[serde(default = "defaults::periods")]
    pub periods: usize,
    /// Periods after which a start is undecided; default 4000, or `transient` + `periods` if that is more.
    #[serde(default)]
    pub limit: Option<usize>,
    /// Ranges of varied coordinates; the fraction of the starts inside that ends at each attractor is reported too.
    #[serde(rename = "box", default)]
    pub region: Option<IndexMap<String, (Quantity, Quantity)>>,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// Longest period of a label; default 256.
    #[serde(default)]
    pub longest_period: Option<usize>,
}

/// Values of one coordinate.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BasinAxis {
    /// First value.
    pub from: Quantity,
    /// Last value.
    pub to: Quantity,
    /// Number of values, evenly spaced, both ends included.
    pub points: usize,
}

mod defaults {
    pub fn transient() -> usize {
        200
    }
    pub fn periods() -> usize {
        100
    }
}

/// Periods after which a start is undecided.
const LIMIT: usize = 4000;
/// Starts at most.
const STARTS: usize = 100_000_000;
/// Iterates spent, per decision, on the search for attracting orbits among the points of a record.
const EFFORT: usize = 320;

#[typetag::serde(name = "basins")]
impl Analysis for Basins {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let initial = self.initial.clone().unwrap_or_default();
        let states = [("initial".to_string(), initial)];
        let mut faults = flow::check_motions(setting, &self.at, &states, self.integrator);
        faults.extend(self.check_lengths());
        faults.extend(self.label_keys().check());
        let grid = match Grid::new(setting, &self.grid) {
            Ok(grid) => grid,
            Err(list) => {
                faults.extend(list);
                return faults;
            }
        };
        if grid.starts() > STARTS {
            let message = format!("{} starts; at most {STARTS}", grid.starts());
            faults.push(Fault::new("grid", message));
        }
        faults.extend(grid.region(setting, self.region.as_ref()).err());
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let (Ok(frequency), Ok(grid)) =
            (setting.frequency(&self.at), Grid::new(setting, &self.grid))
        else {
            return Cost::default();
        };
        let period = Period::of(setting, frequency);
        let starts = grid.starts() as f64;
        // Most starts are caught before the transient is over.
        let seconds = starts * period.plain * self.transient as f64 / 4.0;
        Cost::table(starts, 1.0 + self.grid.len() as f64, "grid").lasting(seconds, "grid")
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let refused = |fault| columns::refused(setting, fault);
        let began = Instant::now();
        let mut faults = Vec::new();
        let grid = Grid::new(setting, &self.grid).map_err(|list| faults.extend(list));
        let Ok(grid) = grid else {
            return Err(refused(faults.remove(0)));
        };
        let region = grid
            .region(setting, self.region.as_ref())
            .map_err(refused)?;
        let start = ("initial", &self.initial.clone().unwrap_or_default());
        let motion = flow::PreparedMotion::new(setting, &self.at, start, self.integrator);
        let motion = motion.map_err(refused)?;
        let mut sorting = Sorting::new(setting, (BasinStart::of(&motion), &grid), self.patience());
        sorting.run();
        let mut report = report::assemble(self, setting, &sorting, &region);
        report.warnings.splice(0..0, motion.warning.clone());
        let seconds = began.elapsed().as_secs_f64();
        (report.summary).insert("timings".into(), json!({ "seconds": seconds }));
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let Ok(grid) = Grid::new(setting, &self.grid) else {
            return Vec::new();
        };
        report::empty(setting, &grid, self.region.is_some())
    }
}

impl Basins {
    fn limit(&self) -> usize {
        let least = self.transient.saturating_add(self.periods);
        self.limit.unwrap_or(LIMIT.max(least))
    }

    fn label_keys(&self) -> LabelKeys {
        LabelKeys {
            longest_period: self.longest_period,
            extend: None,
        }
    }

    fn patience(&self) -> Patience {
        Patience {
            transient: self.transient,
            periods: self.periods,
            limit: self.limit(),
            labels: LabelOptions {
                effort: EFFORT,
                ..self.label_keys().options()
            },
        }
    }

    fn check_lengths(&self) -> Vec<Fault> {
        let lengths = [
            ("transient", self.transient, 0),
            ("periods", self.periods, 10),
            ("limit", self.limit(), 1),
        ];
        let beyond = |(key, found, least)| limits::check(key, found, least, limits::PERIODS);
        let mut faults: Vec<Fault> = lengths.into_iter().filter_map(beyond).collect();
        let least = self.transient.saturating_add(self.periods);
        if faults.is_empty() && self.limit() < least {
            let message = format!(
                "{} must be at least `transient` + `periods` = {least}",
                self.limit()
            );
            faults.push(Fault::new("limit", message));
        }
        faults
    }
}
