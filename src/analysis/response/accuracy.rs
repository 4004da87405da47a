//! What is known of the error of every point of Galerkin branches.

use super::{BranchSettings, Swept};
use crate::analysis::branch_table::rms;
use crate::analysis::columns::{float, integer};
use crate::error::SolveError;
use crate::report::{Column, Table};
use crate::solve::branch::BranchPoint;
use crate::solve::family::Family;
use crate::solve::galerkin::accuracy::{Accuracy, Check, Estimate};
use crate::solve::galerkin::adaptive::Sizes;
use crate::solve::residual::Size;
use serde_json::{Value, json};

/// What is known of one point.
struct Row {
    branch: usize,
    point: usize,
    lambda: f64,
    harmonics: usize,
    estimate: Estimate,
    check: Option<Check>,
}

/// The errors of all points.
#[derive(Default)]
pub(super) struct Accuracies(Vec<Row>);

/// Whether a run judges its points.
pub(super) fn is_asked_for(settings: &BranchSettings) -> bool {
    settings.error_estimate || settings.convergence_check || settings.harmonics.are_chosen()
}

impl Accuracies {
    /// Judges the points of one branch; `doublings` of the samples where they were finest.
    ///
    /// # Errors
    /// The larger problem cannot be made.
    pub fn add<F: Family>(
        &mut self,
        (settings, swept): (&BranchSettings, &Swept<'_>),
        sizes: Sizes<'_, F>,
        (branch, subharmonic, doublings): (usize, usize, u32),
        points: &[BranchPoint],
    ) -> Result<(), SolveError> {
        let dof = swept.setting.assembly.system.dof();
        let mut judge: Option<(usize, Accuracy<F>)> = None;
        for (point, accepted) in points.iter().enumerate() {
            if swept.setting.control.is_interrupted() {
                break;
            }
            let (u, lambda) = (&accepted.unknowns, accepted.lambda);
            let harmonics = u.len() / dof / 2 / subharmonic;
            let judge = match &mut judge {
                Some((size, judge)) if *size == harmonics => judge,
                other => {
                    let size = Size {
                        harmonics,
                        doublings,
                    };
                    let made = sizes.judge(size, subharmonic, settings.newton())?;
                    &mut other.insert((harmonics, made)).1
                }
            };
            let check = settings.convergence_check.then(|| judge.check(u, lambda));
            self.0.push(Row {
                branch,
                point,
                lambda,
                harmonics,
                estimate: judge.estimate(u, lambda)?,
                check: check.transpose()?,
            });
        }
        Ok(())
    }

    /// One row a point.
    pub fn table(&self, settings: &BranchSettings, swept: &Swept<'_>) -> Table {
        let of = |f: &dyn Fn(&Row) -> f64| self.0.iter().map(f).collect::<Vec<f64>>();
        let count = |f: &dyn Fn(&Row) -> usize| self.0.iter().map(|r| f(r) as i64).collect();
        let mut columns = vec![
            integer("branch", count(&|r| r.branch)),
            integer("point", count(&|r| r.point)),
            float("omega", "", of(&|r| swept.excitation(r.lambda))),
            float("parameter", &swept.unit, of(&|r| swept.value(r.lambda))),
            integer("harmonics", count(&|r| r.harmonics)),
            float("relative_error", "", of(&|r| r.estimate.largest())),
            float("branch_error", "", of(&|r| r.estimate.along)),
            float("sampling_error", "", of(&|r| r.estimate.sampling)),
            float("truncation", "", of(&|r| r.estimate.truncation)),
        ];
        for (k, (_, heading)) in rms(swept).into_iter().enumerate() {
            let error = |r: &Row| r.estimate.errors[k].displacement.abs();
            columns.push(heading.prefixed("error_").column(of(&error)));
        }
        for (k, name) in swept.setting.assembly.connections.iter().enumerate() {
            let error =
                |r: &Row| (r.estimate.errors[k].velocity / r.estimate.rms[k].velocity).abs();
            let name = format!("error_rms_velocity.{name}");
            columns.push(float(name, "", of(&error)));
        }
        if settings.convergence_check {
            columns.extend(self.check_columns(swept));
        }
        Table {
            name: "accuracy".into(),
            columns,
        }
    }

    /// What the convergence check says.
    fn check_columns(&self, swept: &Swept<'_>) -> Vec<Column> {
        let of = |f: &dyn Fn(&Row) -> f64| self.0.iter().map(f).collect::<Vec<f64>>();
        let converged = |r: &Row| r.check.as_ref().is_some_and(|c| c.outcome.is_converged());
        let converged = self.0.iter().map(|r| converged(r).into()).collect();
        let mut columns = vec![integer("check_converged", converged)];
        for (k, (_, heading)) in rms(swept).into_iter().enumerate() {
            let first = |r: &Row| r.checked(k).map_or(f64::NAN, |c| c.first);
            columns.push(heading.prefixed("check_").column(of(&first)));
        }
        for (k, name) in swept.setting.assembly.connections.iter().enumerate() {
            let difference = |r: &Row| r.checked(k).map_or(f64::NAN, |c| c.difference);
            let truncation = |r: &Row| r.checked(k).map_or(f64::NAN, |c| c.truncation);
            columns.push(float(
                format!("check_difference.{name}"),
                "",
                of(&difference),
            ));
            columns.push(float(
                format!("check_truncation.{name}"),
                "",
                of(&truncation),
            ));
        }
        columns
    }

    /// What the JSON file says.
    pub fn as_value(&self, settings: &BranchSettings, swept: &Swept<'_>) -> Value {
        let (errors, worst) = (self.errors(), self.worst());
        let harmonics = || self.0.iter().map(|r| r.harmonics);
        let differences = self.0.iter().flat_map(|r| r.differences());
        json!({
            "points": self.0.len(),
            "relative_error_largest": errors.last(),
            "relative_error_median": errors.get(errors.len() / 2),
            "largest_at": worst.map(|r| swept.value(r.lambda)),
            "branch_error_largest": largest(self.0.iter().map(|r| r.estimate.along)),
            "sampling_error_largest": largest(self.0.iter().map(|r| r.estimate.sampling)),
            "truncation_largest": largest(self.0.iter().map(|r| r.estimate.truncation)),
            "harmonics_least": harmonics().min(),
            "harmonics_most": harmonics().max(),
            "check_difference_largest": settings.convergence_check.then(|| largest(differences)),
            "message": self.message(swept),
        })
    }

    /// The same for people.
    pub fn message(&self, swept: &Swept<'_>) -> String {
        let (errors, worst) = (self.errors(), self.worst());
        let (Some(last), Some(worst)) = (errors.last(), worst) else {
            return "No point of a Galerkin branch could be judged.".into();
        };
        let harmonics = || self.0.iter().map(|r| r.harmonics);
        let (few, many) = (harmonics().min(), harmonics().max());
        let harmonics = match (few.unwrap_or(0), many.unwrap_or(0)) {
            (few, many) if few == many => format!("{few} harmonics"),
            (few, many) => format!("{few} to {many} harmonics"),
        };
        let checked: Vec<&Row> = self.0.iter().filter(|r| r.check.is_some()).collect();
        let check = match largest(checked.iter().flat_map(|r| r.differences())) {
            Some(difference) => format!(
                "; with twice the harmonics, reported from the first half, they change by {difference:.1e} at most"
            ),
            None => String::new(),
        };
        format!(
            "Estimated relative errors of the r.m.s. values ({harmonics}): {last:.1e} at most, at {}, {:.1e} in the median{check}.",
            swept.place(worst.lambda),
            errors[errors.len() / 2],
        )
    }

    /// What is said where the most harmonics do not suffice: how many points, and between which values.
    pub fn complaint(&self, settings: &BranchSettings, swept: &Swept<'_>) -> Option<String> {
        let resolution = settings.resolution()?;
        let fails = |r: &&Row| r.estimate.along > resolution.tolerance;
        let failing: Vec<f64> = self.0.iter().filter(fails).map(|r| r.lambda).collect();
        let low = failing.iter().copied().reduce(f64::min)?;
        let high = failing.iter().copied().reduce(f64::max)?;
        let sampled = largest(self.0.iter().map(|r| r.estimate.sampling));
        let wanting = match sampled.is_some_and(|e| e > resolution.tolerance) {
            true => "the samples".into(),
            false => format!("at most {} harmonics", resolution.most),
        };
        Some(format!(
            "{} of {} points have an estimated error above {:e}, up to {:.1e}, between {} and {}: {wanting} do not suffice there",
            failing.len(),
            self.0.len(),
            resolution.tolerance,
            largest(self.0.iter().map(|r| r.estimate.along)).unwrap_or(f64::NAN),
            swept.place(low),
            swept.place(high),
        ))
    }

    /// Relative errors that are known, ascending.
    fn errors(&self) -> Vec<f64> {
        let errors = self.0.iter().map(|r| r.estimate.largest());
        let mut list: Vec<f64> = errors.filter(|e| e.is_finite()).collect();
        list.sort_by(f64::total_cmp);
        list
    }

    fn worst(&self) -> Option<&Row> {
        let known = self.0.iter().filter(|r| r.estimate.largest().is_finite());
        known.max_by(|a, b| a.estimate.largest().total_cmp(&b.estimate.largest()))
    }
}

/// What the convergence check says of one connection.
struct Checked {
    /// R.m.s. from the first half of the harmonics.
    first: f64,
    /// Its difference from the judged value, relative.
    difference: f64,
    /// Share of the r.m.s. that the second half adds.
    truncation: f64,
}

impl Row {
    fn checked(&self, connection: usize) -> Option<Checked> {
        let check = self.check.as_ref().filter(|c| c.outcome.is_converged())?;
        let all = check.rms[connection].displacement;
        let first = check.first[connection].displacement;
        let judged = self.estimate.rms[connection].displacement;
        Some(Checked {
            first,
            difference: ((judged - first) / first).abs(),
            truncation: 1.0 - first / all,
        })
    }

    fn differences(&self) -> impl Iterator<Item = f64> {
        let connections = 0..self.estimate.rms.len();
        let checked = connections.filter_map(|k| self.checked(k));
        checked.map(|c| c.difference)
    }
}

fn largest(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.filter(|x| x.is_finite()).reduce(f64::max)
}
