//! Many runs of another analysis over a grid, a list or a random sample of parameters, one row per run.
//!
//! A run is a function of its number alone: `space` turns the number into values without knowing the others, `plan` turns
//! values into a model and a row, `collect` turns a report into cells. Whoever runs a study (floor 6) may therefore do so in
//! any order, on any number of threads or machines, and go on after an interruption.

mod collect;
mod direction;
mod figures;
mod permutation;
mod place;
mod plan;
mod report;
mod sample;
mod settings;
mod space;
mod statistics;
mod watch;

pub use collect::{Collected, Reduce};
pub use plan::{COMPLETE, Plan, StudyRow, Worker};
pub use report::Tally;
pub use sample::{Distribution, Sample, SamplingMethod, Shape};
pub use settings::{Axis, Given, Spacing};

use super::cost::Cost;
use super::{Analysis, Fault, Link, Setting, columns};
use crate::error::Error;
use crate::interrupt;
use crate::report::{Report, Table};
use indexmap::IndexMap;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of `parameter_study`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ParameterStudy {
    /// Values by path; every combination runs, the last path changes fastest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<IndexMap<String, Axis>>,
    /// Rows of values by path; every row runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub list: Option<Vec<IndexMap<String, Given>>>,
    /// Random values by path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample: Option<Sample>,
    /// Further numbers of the model that follow a path, such as `{gear_1.drag: {gear_2.drag: "0.4*x"}}`.
    #[serde(default, skip_serializing_if = "Link::is_empty")]
    pub link: Link,
    /// Analysis to run: the name of another analysis of the file, or an analysis in place, `{type: .., ..}`.
    pub analysis: serde_json::Value,
    /// Quantities taken from the tables of each run, by the name of their column.
    pub collect: IndexMap<String, Collected>,
}

/// Runs that a report in memory may hold; longer studies are written row by row.
const MOST_IN_MEMORY: u64 = 1_000_000;

#[typetag::serde(name = "parameter_study")]
impl Analysis for ParameterStudy {
    /// The analysis inside says it.
    fn takes_functions_of_time(&self) -> bool {
        true
    }

    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        match Plan::new(self, setting) {
            Ok(plan) => plan.check_values(),
            Err(faults) => faults,
        }
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let Ok(plan) = Plan::new(self, setting) else {
            return Cost::default();
        };
        let one = plan.cost_of_a_run();
        let runs = plan.runs() as f64;
        // A row and its journal line take a little time even where the run takes none.
        one.lasting(
            runs * (one.seconds + 2e-5),
            if runs > 1.0 { "runs" } else { one.time_key },
        )
    }

    /// All runs in memory, which suits programs with a thousand of them; the command line writes them as they end.
    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let refused = |fault: Fault| columns::refused(setting, fault);
        let first = |faults: Vec<Fault>| {
            let fault = faults.into_iter().next();
            refused(fault.unwrap_or_else(|| Fault::new("", "cannot be run")))
        };
        let plan = Plan::new(self, setting).map_err(first)?;
        if plan.runs() > MOST_IN_MEMORY {
            let message = format!("{} runs are too many for memory", plan.runs());
            return Err(refused(Fault::new("", message)));
        }
        let flag = interrupt::current();
        let rows: Vec<Option<StudyRow>> = (0..plan.runs())
            .into_par_iter()
            .map_init(
                || plan.worker(),
                |worker, run| flag.scope(|| worker.run(run)),
            )
            .collect();
        let mut table = Table {
            name: String::new(),
            columns: plan.columns().to_vec(),
        };
        let mut tally = Tally {
            runs: plan.runs(),
            stride: 1,
            ..Tally::default()
        };
        for row in rows.into_iter().flatten() {
            tally.finished += 1;
            tally.failed += u64::from(!row.is_complete);
            tally.warned += u64::from(row.has_warnings);
            for (column, cell) in table.columns.iter_mut().zip(row.cells) {
                column.values.push(cell);
            }
        }
        Ok(self.report(table, &tally))
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let plan = Plan::new(self, setting);
        let main = plan.map(|plan| Table {
            name: String::new(),
            columns: plan.columns().to_vec(),
        });
        main.into_iter().collect()
    }

    fn study(&self) -> Option<&ParameterStudy> {
        Some(self)
    }
}
