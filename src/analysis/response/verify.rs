//! Points of Galerkin branches taken through the flow: how many digits the two methods share.

use super::{BranchSettings, Swept};
use crate::analysis::branch_table::{Recorded, recorded_columns};
use crate::analysis::columns::{float, integer};
use crate::error::SolveError;
use crate::postprocess::measures::Meter;
use crate::report::Table;
use crate::solve::branch::BranchPoint;
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::residual::{PeriodicResidual, Residual};
use crate::solve::shooting::Shooting;
use nalgebra::DVector;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::borrow::Cow;

/// Which points to verify.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Verify {
    /// None.
    #[default]
    None,
    /// Every k-th point, the first one among them; `true` stands for every point.
    Every(usize),
}

impl Verify {
    /// Whether any point is verified.
    pub(super) fn is_asked_for(self) -> bool {
        self != Verify::None
    }

    fn stride(self) -> usize {
        match self {
            Verify::None => usize::MAX,
            Verify::Every(stride) => stride.max(1),
        }
    }
}

/// Digits that agree when nothing differs.
const ALL_DIGITS: f64 = 16.0;

/// What the flow said about one point.
struct Row {
    branch: usize,
    point: usize,
    lambda: f64,
    /// Iterations of the corrector; `None` when it found no orbit.
    iterations: Option<usize>,
    digits: f64,
    /// R.m.s. deformations along the flow, nondimensional.
    rms: Vec<f64>,
}

/// The verified points of all branches.
pub(super) struct Verification {
    rows: Vec<Row>,
    integrator: &'static str,
}

impl Verification {
    /// No points yet.
    pub fn new() -> Verification {
        Verification {
            rows: Vec::new(),
            integrator: "",
        }
    }

    /// Takes points of one branch through the flow: shooting from the state of the Galerkin orbit at phase 0.
    ///
    /// # Errors
    /// The flow cannot take the system.
    pub fn add(
        &mut self,
        (settings, swept): (&BranchSettings, &Swept<'_>),
        galerkin: &mut dyn PeriodicResidual,
        branch: usize,
        points: &[BranchPoint],
        newton: NewtonOptions,
    ) -> Result<(), SolveError> {
        let Some(first) = points.first() else {
            return Ok(());
        };
        let mut shooting = Shooting::new(swept.family()?, first.lambda, settings.integrator)?;
        self.integrator = shooting.integrator();
        let mut corrector = Newton::new(&shooting.structure(), newton);
        let mut meter = Meter::new(settings.size().samples);
        let chosen = points.iter().enumerate().step_by(settings.verify.stride());
        for (point, accepted) in chosen {
            if swept.setting.control.is_interrupted() {
                break;
            }
            let lambda = accepted.lambda;
            let series = galerkin.orbit(&accepted.unknowns, lambda)?;
            let mut state = vec![0.0; shooting.dim()];
            series.state(0.0, &mut state);
            let mut u = DVector::from_vec(state);
            let outcome = corrector.solve(&mut shooting, &mut u, lambda)?;
            let mut row = Row {
                branch,
                point,
                lambda,
                iterations: None,
                digits: f64::NAN,
                rms: vec![f64::NAN; swept.setting.assembly.connections.len()],
            };
            if outcome.is_converged() {
                let flow = shooting.orbit(&u, lambda)?;
                let system = shooting.system_at(lambda)?;
                let mut rms = |orbit: &_| -> Vec<f64> {
                    let measures = meter.measure(system, orbit);
                    measures.iter().map(|m| m.rms).collect()
                };
                row.iterations = Some(outcome.iterations);
                (row.digits, row.rms) = {
                    let (flow, series) = (rms(&flow), rms(&series));
                    (digits(&flow, &series), flow)
                };
            }
            self.rows.push(row);
        }
        Ok(())
    }

    /// One row a verified point.
    pub fn table(&self, swept: &Swept<'_>) -> Table {
        let of = |f: &dyn Fn(&Row) -> f64| self.rows.iter().map(f).collect::<Vec<f64>>();
        let count = |f: &dyn Fn(&Row) -> usize| self.rows.iter().map(|r| f(r) as i64).collect();
        let mut columns = vec![
            integer("branch", count(&|r| r.branch)),
            integer("point", count(&|r| r.point)),
            float("omega", "", of(&|r| swept.excitation(r.lambda))),
            float("parameter", &swept.unit, of(&|r| swept.value(r.lambda))),
            integer("converged", count(&|r| r.iterations.is_some().into())),
            integer("iterations", count(&|r| r.iterations.unwrap_or(0))),
            float("digits", "", of(&|r| r.digits)),
        ];
        let recorded = recorded_columns(swept.setting).into_iter();
        let rms = recorded.filter(|c| c.name.starts_with("rms."));
        for (k, Recorded { name, unit, factor }) in rms.enumerate() {
            columns.push(float(name, unit, of(&|r| r.rms[k] * factor)));
        }
        Table {
            name: "verify".into(),
            columns,
        }
    }

    /// What the JSON file says.
    pub fn as_value(&self) -> Value {
        let (least, median) = self.quantiles();
        json!({
            "integrator": self.integrator,
            "points": self.rows.len(),
            "converged": self.converged(),
            "digits_least": least,
            "digits_median": median,
            "message": self.message(),
        })
    }

    /// The same for people.
    pub fn message(&self) -> String {
        let (total, converged) = (self.rows.len(), self.converged());
        let shared = match self.quantiles() {
            (Some(least), Some(median)) => format!(
                "the two methods share {least:.1} digits of the r.m.s. deformations at least, {median:.1} in the median"
            ),
            _ => "no point could be compared".into(),
        };
        let failed = match total - converged {
            0 => String::new(),
            failed => format!("; from {failed} points the flow leads to no orbit"),
        };
        format!("{total} points of Galerkin branches verified by the flow: {shared}{failed}.")
    }

    fn converged(&self) -> usize {
        self.rows.iter().filter(|r| r.iterations.is_some()).count()
    }

    /// Least and median digits.
    fn quantiles(&self) -> (Option<f64>, Option<f64>) {
        let converged = self.rows.iter().filter(|r| r.iterations.is_some());
        let mut list: Vec<f64> = converged.map(|r| r.digits).collect();
        list.sort_by(f64::total_cmp);
        (list.first().copied(), list.get(list.len() / 2).copied())
    }
}

/// -lg of the largest relative difference; a connection that moves in neither has none.
fn digits(exact: &[f64], other: &[f64]) -> f64 {
    let gap = |(x, y): (&f64, &f64)| (x - y).abs() / x.max(*y).max(f64::MIN_POSITIVE);
    let largest = exact.iter().zip(other).map(gap).fold(0.0, f64::max);
    (-largest.log10()).min(ALL_DIGITS)
}

impl JsonSchema for Verify {
    fn schema_name() -> Cow<'static, str> {
        "Verify".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "boolean" }, { "type": "integer", "minimum": 1 }] })
    }
}

impl Serialize for Verify {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Verify::None => serializer.serialize_bool(false),
            Verify::Every(1) => serializer.serialize_bool(true),
            Verify::Every(stride) => serializer.serialize_u64(*stride as u64),
        }
    }
}

impl<'de> Deserialize<'de> for Verify {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(
            untagged,
            expecting = "false, true, or k for every k-th point (at least 1)"
        )]
        enum Written {
            Flag(bool),
            Stride(std::num::NonZeroUsize),
        }
        Ok(match Written::deserialize(deserializer)? {
            Written::Flag(false) => Verify::None,
            Written::Flag(true) => Verify::Every(1),
            Written::Stride(stride) => Verify::Every(stride.get()),
        })
    }
}
