//! What is known of the error of every point of Galerkin branches.

use super::delivered::Delivered;
use super::verify::{self, Verification, recorded};
use super::{BranchSettings, Swept};
use crate::analysis::branch_table::{main, rms};
use crate::analysis::columns::{float, integer, text};
use crate::error::SolveError;
use crate::postprocess::measures::Meter;
use crate::report::{Column, Table};
use crate::solve::branch::{BranchPoint, confirm};
use crate::solve::family::Family;
use crate::solve::floquet::{Floquet, Spectrum};
use crate::solve::galerkin::accuracy::{Accuracy, Check, Estimate, Rms, relative};
use crate::solve::galerkin::adaptive::Sizes;
use crate::solve::orbit::{FourierOrbit, Orbit};
use crate::solve::residual::Size;
use crate::system::System;
use serde_json::{Value, json};

/// R.m.s. values below this share of the largest one count as large as that.
const HARDLY_MOVES: f64 = 1e-3;

/// Samples with which a corrected orbit is measured: its highest harmonic needs two.
const SAMPLES_PER_HARMONIC: usize = 8;

/// Values and errors of one point, nondimensional, by connection.
struct JudgedPoint {
    /// What judged: `flow`, whose orbits are exact, or `series`, with twice the harmonics.
    by: &'static str,
    rms: Vec<Rms>,
    errors: Vec<Rms>,
    /// Largest force, and its error.
    force: Vec<(f64, f64)>,
    /// Largest error of a multiplier, relative to its modulus or 1.
    multipliers: f64,
}

impl JudgedPoint {
    /// Largest relative error of an r.m.s. value.
    fn largest(&self) -> f64 {
        relative(&self.rms, &self.errors)
    }
}

/// What is known of one point.
struct PointErrors {
    branch: usize,
    point: usize,
    lambda: f64,
    harmonics: usize,
    judged: JudgedPoint,
    /// Largest relative error against the nearest place of the branch.
    along: f64,
    estimate: Estimate,
    check: Option<Check>,
}

/// The errors of all points.
#[derive(Default)]
pub(super) struct Accuracies(Vec<PointErrors>);

/// Whether a run judges its points.
pub(super) fn is_asked_for(settings: &BranchSettings) -> bool {
    settings.error_estimate || settings.convergence_check || settings.harmonics.are_chosen()
}

/// What judges the points of one branch.
struct Judge<'a> {
    swept: &'a Swept<'a>,
    meter: Meter,
    /// Samples of the meter.
    samples: usize,
    floquet: Floquet,
    has_multipliers: bool,
}

impl Judge<'_> {
    /// Against the flow's orbit.
    fn by_flow(&self, point: &BranchPoint, row: &verify::FlowRow) -> JudgedPoint {
        let of = |measure| recorded(self.swept, point, measure);
        let pairs = of("rms").into_iter().zip(of("rms_velocity"));
        let rms: Vec<Rms> = pairs
            .map(|(displacement, velocity)| Rms {
                displacement,
                velocity,
            })
            .collect();
        let errors = rms.iter().zip(&row.exactly).map(|(value, exact)| Rms {
            displacement: exact.rms - value.displacement,
            velocity: exact.rms_velocity - value.velocity,
        });
        let force = of("force_max").into_iter().zip(&row.exactly);
        JudgedPoint {
            by: "flow",
            errors: errors.collect(),
            force: force.map(|(f, exact)| (f, exact.force_max - f)).collect(),
            multipliers: row.multiplier_error,
            rms,
        }
    }

    /// Against the orbit of twice the harmonics.
    fn by_series(
        &mut self,
        point: &BranchPoint,
        estimate: &Estimate,
        (system, orbit): (&System, FourierOrbit),
    ) -> JudgedPoint {
        let corrected = &estimate.corrected;
        let is_known = estimate.errors.iter().all(|e| e.displacement.is_finite());
        let here = self.swept.here(point.lambda);
        let force = recorded(self.swept, point, "force_max");
        let (mut force, mut multipliers) = (
            force.into_iter().map(|f| (f, f64::NAN)).collect::<Vec<_>>(),
            f64::NAN,
        );
        if is_known {
            let needed = SAMPLES_PER_HARMONIC * corrected.harmonics();
            if needed > self.samples {
                self.samples = needed.next_power_of_two();
                self.meter = Meter::new(self.samples);
            }
            let measures = self
                .meter
                .measure(system, &Orbit::Fourier(corrected.clone()));
            let scaled = measures.iter().zip(&here.stiffening);
            for (force, (m, stiffening)) in force.iter_mut().zip(scaled) {
                force.1 = m.force_max * stiffening - force.0;
            }
            if self.has_multipliers {
                let mut of = |orbit: &FourierOrbit| {
                    self.floquet
                        .multipliers(system, orbit, &orbit.extrema(system))
                };
                multipliers = confirm::difference(&of(&orbit), &of(corrected));
            }
        }
        JudgedPoint {
            by: "series",
            rms: estimate.rms.clone(),
            errors: estimate.errors.clone(),
            force,
            multipliers,
        }
    }
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
        (branch, doublings): (usize, u32),
        (delivered, verification): (&Delivered, &Verification),
    ) -> Result<(), SolveError> {
        let subharmonic = delivered.subharmonic;
        let mut by_size: Option<(usize, Accuracy<F>)> = None;
        let samples = 2 * settings.size_for(subharmonic).samples;
        let mut judge = Judge {
            swept,
            meter: Meter::new(samples),
            samples,
            floquet: Floquet::default(),
            has_multipliers: settings.stability && swept.spectrum() == Spectrum::All,
        };
        for (point, accepted) in delivered.points.iter().enumerate() {
            if swept.setting.control.is_interrupted() {
                break;
            }
            let (u, lambda) = (&accepted.unknowns, accepted.lambda);
            let harmonics = swept.harmonics(u.len(), subharmonic);
            let larger = match &mut by_size {
                Some((size, larger)) if *size == harmonics => larger,
                other => {
                    let size = Size {
                        harmonics,
                        doublings,
                    };
                    let newton = settings.newton();
                    let made = match settings.error_estimate {
                        true => sizes.refined_judge(size, subharmonic, newton)?,
                        false => sizes.judge(size, subharmonic, newton)?,
                    };
                    &mut other.insert((harmonics, made)).1
                }
            };
            let check = settings.convergence_check.then(|| larger.check(u, lambda));
            let estimate = larger.estimate(u, lambda)?;
            let rows = verification.of_branch(branch);
            let flow = rows.filter(|r| r.point == point && r.is_same).last();
            let judged = match flow.filter(|r| !r.exactly.is_empty()) {
                Some(row) => judge.by_flow(accepted, row),
                None => judge.by_series(accepted, &estimate, larger.orbit(u, lambda)?),
            };
            self.0.push(PointErrors {
                branch,
                point,
                lambda,
                harmonics,
                along: match judged.by {
                    "flow" => along(swept, &delivered.points, point, &judged),
                    _ => estimate.along,
                },
                judged,
                estimate,
                check: check.transpose()?,
            });
        }
        Ok(())
    }

    /// One row per point.
    pub fn table(&self, settings: &BranchSettings, swept: &Swept<'_>) -> Table {
        let of = |f: &dyn Fn(&PointErrors) -> f64| self.0.iter().map(f).collect::<Vec<f64>>();
        let count =
            |f: &dyn Fn(&PointErrors) -> usize| self.0.iter().map(|r| f(r) as i64).collect();
        let mut columns = vec![
            integer("branch", count(&|r| r.branch)),
            integer("point", count(&|r| r.point)),
            float("omega", "", of(&|r| swept.excitation(r.lambda))),
            float("parameter", &swept.unit, of(&|r| swept.value(r.lambda))),
            integer("harmonics", count(&|r| r.harmonics)),
            float("relative_error", "", of(&|r| r.judged.largest())),
            float("branch_error", "", of(&|r| r.along)),
            float("sampling_error", "", of(&|r| r.estimate.sampling)),
            float("truncation", "", of(&|r| r.estimate.truncation)),
        ];
        for (k, (_, heading)) in rms(swept).into_iter().enumerate() {
            let error = |r: &PointErrors| r.judged.errors[k].displacement.abs();
            columns.push(heading.prefixed("error_").column(of(&error)));
        }
        for (k, name) in swept.setting.assembly.connections.iter().enumerate() {
            let error =
                |r: &PointErrors| (r.judged.errors[k].velocity / r.judged.rms[k].velocity).abs();
            let name = format!("error_rms_velocity.{name}");
            columns.push(float(name, "", of(&error)));
        }
        for (k, (_, heading)) in main(swept, "force_max").into_iter().enumerate() {
            let error = |r: &PointErrors| r.judged.force[k].1.abs();
            columns.push(heading.prefixed("error_").column(of(&error)));
        }
        columns.push(float(
            "error_multipliers",
            "",
            of(&|r| r.judged.multipliers),
        ));
        let by = self.0.iter().map(|r| r.judged.by.to_owned());
        columns.push(text("judged_by", by.collect()));
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
        let of = |f: &dyn Fn(&PointErrors) -> f64| self.0.iter().map(f).collect::<Vec<f64>>();
        let converged =
            |r: &PointErrors| r.check.as_ref().is_some_and(|c| c.outcome.is_converged());
        let converged = self.0.iter().map(|r| converged(r).into()).collect();
        let mut columns = vec![integer("check_converged", converged)];
        for (k, (_, heading)) in rms(swept).into_iter().enumerate() {
            let first = |r: &PointErrors| r.checked(k).map_or(f64::NAN, |c| c.first);
            columns.push(heading.prefixed("check_").column(of(&first)));
        }
        for (k, name) in swept.setting.assembly.connections.iter().enumerate() {
            let difference = |r: &PointErrors| r.checked(k).map_or(f64::NAN, |c| c.difference);
            let truncation = |r: &PointErrors| r.checked(k).map_or(f64::NAN, |c| c.truncation);
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

    /// Entries of the JSON file.
    pub fn as_value(&self, settings: &BranchSettings, swept: &Swept<'_>) -> Value {
        let (errors, worst) = (self.errors(), self.worst());
        let harmonics = || self.0.iter().map(|r| r.harmonics);
        let differences = self.0.iter().flat_map(|r| r.differences());
        json!({
            "points": self.0.len(),
            "relative_error_largest": errors.last(),
            "relative_error_median": errors.get(errors.len() / 2),
            "largest_at": worst.map(|r| swept.value(r.lambda)),
            "branch_error_largest": largest(self.0.iter().map(|r| r.along)),
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
            return "The error of no Galerkin point could be estimated.".into();
        };
        let harmonics = || self.0.iter().map(|r| r.harmonics);
        let (few, many) = (harmonics().min(), harmonics().max());
        let harmonics = match (few.unwrap_or(0), many.unwrap_or(0)) {
            (few, many) if few == many => format!("{few} harmonics"),
            (few, many) => format!("{few} to {many} harmonics"),
        };
        let checked: Vec<&PointErrors> = self.0.iter().filter(|r| r.check.is_some()).collect();
        let check = match largest(checked.iter().flat_map(|r| r.differences())) {
            Some(difference) => format!(
                "; with twice the harmonics, reported from the first half, they change by {difference:.1e} at most"
            ),
            None => String::new(),
        };
        let unknown = match self.0.len() - errors.len() {
            0 => String::new(),
            count => format!(
                "; unknown at {count} of {} points, where the series is far from convergence: use more `harmonics`",
                self.0.len()
            ),
        };
        format!(
            "Estimated relative errors of the r.m.s. values ({harmonics}): {last:.1e} at most, at {}, {:.1e} in the median{check}{unknown}.",
            swept.place(worst.lambda),
            errors[errors.len() / 2],
        )
    }

    /// Warning if the largest number of harmonics is insufficient: number of points and range of values.
    pub fn complaint(&self, settings: &BranchSettings, swept: &Swept<'_>) -> Option<String> {
        let resolution = settings.resolution()?;
        let fails = |r: &&PointErrors| r.along > resolution.tolerance;
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
            largest(self.0.iter().map(|r| r.along)).unwrap_or(f64::NAN),
            swept.place(low),
            swept.place(high),
        ))
    }

    /// Relative errors that are known, ascending.
    fn errors(&self) -> Vec<f64> {
        let errors = self.0.iter().map(|r| r.judged.largest());
        let mut list: Vec<f64> = errors.filter(|e| e.is_finite()).collect();
        list.sort_by(f64::total_cmp);
        list
    }

    fn worst(&self) -> Option<&PointErrors> {
        let known = self.0.iter().filter(|r| r.judged.largest().is_finite());
        known.max_by(|a, b| a.judged.largest().total_cmp(&b.judged.largest()))
    }
}

/// Error against the nearest place of the branch: the error at the same parameter less its part along the branch, which is all
/// of it beside a fold.
///
/// ```text
/// e - (e . t / t . t) t,    e = (errors of r.m.s. values, 0),    t = (their change along the branch, change of lambda)
/// ```
///
/// every value relative to its size, a frequency too.
fn along(swept: &Swept<'_>, points: &[BranchPoint], point: usize, judged: &JudgedPoint) -> f64 {
    let ends = [point.saturating_sub(1), (point + 1).min(points.len() - 1)];
    let largest = judged
        .rms
        .iter()
        .map(|r| r.displacement)
        .fold(0.0, f64::max);
    let lambda = match swept.written() {
        None => points[point].lambda.abs(),
        Some(_) => 1.0,
    };
    let sides = ends.map(|k| recorded(swept, &points[k], "rms"));
    let size = |k: usize| judged.rms[k].displacement.max(HARDLY_MOVES * largest);
    let mut e: Vec<f64> = (0..judged.rms.len())
        .map(|k| judged.errors[k].displacement / size(k))
        .collect();
    let mut t: Vec<f64> = (0..judged.rms.len())
        .map(|k| (sides[1][k] - sides[0][k]) / size(k))
        .collect();
    e.push(0.0);
    t.push((points[ends[1]].lambda - points[ends[0]].lambda) / lambda);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let share = dot(&e, &t) / dot(&t, &t).max(f64::MIN_POSITIVE);
    let rest = e.iter().zip(&t).map(|(e, t)| (e - share * t).abs());
    rest.fold(0.0, f64::max)
}

/// What the convergence check says of one connection.
struct CheckedConnection {
    /// R.m.s. from the first half of the harmonics.
    first: f64,
    /// Its difference from the judged value, relative.
    difference: f64,
    /// Share of the r.m.s. that the second half adds.
    truncation: f64,
}

impl PointErrors {
    fn checked(&self, connection: usize) -> Option<CheckedConnection> {
        let check = self.check.as_ref().filter(|c| c.outcome.is_converged())?;
        let all = check.rms[connection].displacement;
        let first = check.first[connection].displacement;
        let judged = self.estimate.rms[connection].displacement;
        Some(CheckedConnection {
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
