//! Points of Galerkin branches taken through the flow: how many digits the two methods share.

use super::guarded::Guarded;
use super::{BranchSettings, Swept};
use crate::analysis::branch_table::rms;
use crate::analysis::columns::{float, integer, text};
use crate::error::SolveError;
use crate::postprocess::measures::Meter;
use crate::report::Table;
use crate::solve::branch::BranchPoint;
use crate::solve::continuation::{ContinuationOptions, Section};
use crate::solve::family::Family;
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

/// What the flow has where a point stands.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Found {
    /// An orbit, after so many iterations of the corrector.
    Orbit(usize),
    /// None at this parameter: the exact branch turns back at this one, the Galerkin branch a little later.
    BeyondFold(f64),
    /// None that the corrector reaches.
    Nothing,
}

/// What the flow said about one point.
struct Row {
    branch: usize,
    point: usize,
    lambda: f64,
    found: Found,
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
        let system = galerkin.system_at(first.lambda)?;
        let (nu, first_size) = (system.subharmonic(), system.dof() as f64);
        let family = swept.family_for(nu)?;
        let shooting = Shooting::new(family, first.lambda, settings.integrator)?;
        self.integrator = shooting.integrator();
        let corrector = Newton::new(&shooting.structure(), newton);
        let meter = Meter::new(settings.size_for(nu).samples);
        let mut options = settings.continuation(swept.range, 0.5 / first_size);
        options.newton = newton;
        let mut check = Check {
            galerkin,
            shooting,
            corrector,
            meter,
            options,
            points,
        };
        let chosen = (0..points.len()).step_by(settings.verify.stride());
        for point in chosen {
            if swept.setting.control.is_interrupted() {
                break;
            }
            let (found, digits, rms) = check.point(point)?;
            self.rows.push(Row {
                branch,
                point,
                lambda: points[point].lambda,
                found,
                digits,
                rms,
            });
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
            integer("converged", count(&|r| r.is_converged().into())),
            integer("iterations", count(&|r| r.iterations())),
            float("digits", "", of(&|r| r.digits)),
            text("reason", self.rows.iter().map(Row::reason).collect()),
            float(
                "exact_fold",
                &swept.unit,
                of(&|r| r.fold().map_or(f64::NAN, |x| swept.value(x))),
            ),
        ];
        for (k, (_, heading)) in rms(swept).into_iter().enumerate() {
            columns.push(heading.column(of(&|r| r.rms[k])));
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
            "beyond_fold": self.beyond_fold().count(),
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
        let beyond = match self.beyond_fold().count() {
            0 => String::new(),
            count => {
                let gaps = self
                    .beyond_fold()
                    .map(|(lambda, fold)| (lambda - fold).abs());
                let largest = gaps.fold(0.0, f64::max);
                format!(
                    "; {count} points lie beyond a fold of the exact branch, by {largest:.1e} of the continued parameter at most, where there is no orbit"
                )
            }
        };
        let failed = match total - converged - self.beyond_fold().count() {
            0 => String::new(),
            failed => format!("; from {failed} points the flow leads to no orbit"),
        };
        format!(
            "{total} points of Galerkin branches verified by the flow: {shared}{beyond}{failed}."
        )
    }

    /// Parameters of the points beyond a fold, with those of the folds.
    fn beyond_fold(&self) -> impl Iterator<Item = (f64, f64)> {
        self.rows.iter().filter_map(|r| Some((r.lambda, r.fold()?)))
    }

    fn converged(&self) -> usize {
        self.rows.iter().filter(|r| r.is_converged()).count()
    }

    /// Least and median digits.
    fn quantiles(&self) -> (Option<f64>, Option<f64>) {
        let converged = self.rows.iter().filter(|r| r.is_converged());
        let mut list: Vec<f64> = converged.map(|r| r.digits).collect();
        list.sort_by(f64::total_cmp);
        (list.first().copied(), list.get(list.len() / 2).copied())
    }
}

impl Row {
    fn is_converged(&self) -> bool {
        matches!(self.found, Found::Orbit(_))
    }

    fn iterations(&self) -> usize {
        match self.found {
            Found::Orbit(iterations) => iterations,
            _ => 0,
        }
    }

    fn fold(&self) -> Option<f64> {
        match self.found {
            Found::BeyondFold(fold) => Some(fold),
            _ => None,
        }
    }

    fn reason(&self) -> String {
        let word = match self.found {
            Found::Orbit(_) => "",
            Found::BeyondFold(_) => "beyond_fold",
            Found::Nothing => "no_orbit",
        };
        word.into()
    }
}

/// One branch on its way through the flow.
struct Check<'a, F: Family> {
    galerkin: &'a mut dyn PeriodicResidual,
    shooting: Shooting<F>,
    corrector: Newton,
    meter: Meter,
    options: ContinuationOptions,
    points: &'a [BranchPoint],
}

impl<F: Family> Check<'_, F> {
    /// What the flow has at a point, shared digits and its r.m.s. deformations.
    fn point(&mut self, point: usize) -> Result<(Found, f64, Vec<f64>), SolveError> {
        let lambda = self.points[point].lambda;
        let (mut u, _) = self.state(point)?;
        let outcome = self.corrector.solve(&mut self.shooting, &mut u, lambda)?;
        if !outcome.is_converged() {
            let count = self.shooting.system_at(lambda)?.element_count();
            let found = self.fold(point)?.map_or(Found::Nothing, Found::BeyondFold);
            return Ok((found, f64::NAN, vec![f64::NAN; count]));
        }
        let series = self.galerkin.orbit(&self.points[point].unknowns, lambda)?;
        let flow = self.shooting.orbit(&u, lambda)?;
        let system = self.shooting.system_at(lambda)?;
        let mut rms = |orbit: &_| -> Vec<f64> {
            let measures = self.meter.measure(system, orbit);
            measures.iter().map(|m| m.rms).collect()
        };
        let (flow, series) = (rms(&flow), rms(&series));
        let found = Found::Orbit(outcome.iterations);
        Ok((found, digits(&flow, &series), flow))
    }

    /// State of a Galerkin point at phase 0, and its parameter.
    fn state(&mut self, point: usize) -> Result<(DVector<f64>, f64), SolveError> {
        let BranchPoint {
            lambda, unknowns, ..
        } = &self.points[point];
        let mut state = DVector::zeros(self.shooting.dim());
        let orbit = self.galerkin.orbit(unknowns, *lambda)?;
        orbit.state(0.0, state.as_mut_slice());
        Ok((state, *lambda))
    }

    /// Where the exact branch turns back before it reaches a point: sought across the direction of the Galerkin branch.
    fn fold(&mut self, point: usize) -> Result<Option<f64>, SolveError> {
        let place = self.state(point)?;
        let before = self.state(point.saturating_sub(1))?;
        let behind = self.state((point + 1).min(self.points.len() - 1))?;
        let (lambda, direction) = (place.1, (behind.0 - before.0, behind.1 - before.1));
        if direction.0.amax() == 0.0 {
            return Ok(None);
        }
        let shooting = &mut Guarded(&mut self.shooting);
        let mut section = Section::new(shooting, place, direction, self.options)?;
        let turn = section.turn(shooting)?;
        let beyond = turn.filter(|(fold, side)| (lambda - fold.lambda) * side < 0.0);
        Ok(beyond.map(|(fold, _)| fold.lambda))
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
