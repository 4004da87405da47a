//! Tori followed both ways from the first one.

use super::road::TorusRoad;
use super::{Torus, start};
use crate::analysis::Setting;
use crate::analysis::bifurcation_curve::CurveAxis;
use crate::error::{Error, SolveError};
use crate::interrupt::Interrupt;
use crate::postprocess::measures::Meter;
use crate::solve::continuation::{CrossingSide, PathEnd};
use crate::solve::curve::Shots;
use crate::solve::orbit::Orbit;
use crate::solve::torus::{
    TorusArm, TorusEnd, TorusOptions, TorusPoint, TorusProblem, follow, locking,
};
use crate::system::System;
use std::time::{Duration, Instant};

/// A torus with its measures.
pub(super) struct TorusRow {
    pub point: TorusPoint,
    /// R.m.s. of every deformation, without the mean.
    pub rms: Vec<f64>,
    /// States at phase 0, if requested.
    pub curve: Vec<f64>,
    /// Excitation periods per map, and their duration.
    pub nu: usize,
}

/// What became of the start.
pub(super) struct TracedTorus {
    pub rows: Vec<TorusRow>,
    pub ends: Vec<TorusEnd>,
    pub failure: Option<String>,
    pub integrator: &'static str,
}

/// Follows tori from the start to both ends of the range.
pub(super) fn run(
    keys: &Torus,
    setting: &Setting<'_>,
    (axis, at): (&CurveAxis, f64),
    marks: &[f64],
) -> Result<TracedTorus, Error> {
    let options = TorusOptions {
        step: (keys.step, keys.max_step),
        min_step: keys.min_step,
        max_points: keys.max_tori,
        tolerance: keys.tolerance,
        most: keys.most_points,
        marks: marks.to_vec(),
    };
    let first = match start::first(keys, setting, (axis, at), &options) {
        Err(Error::Solve(SolveError::Interrupted)) => Err("interrupted".to_string()),
        first => first?,
    };
    let (mut problem, first, nu) = match first {
        Ok(first) => first,
        Err(reason) => return Ok(lost(reason)),
    };
    let mut keep_going = |count: usize| {
        let words = format!("{count} tori");
        setting.control.progress(setting.name, 0.0, &words);
        !setting.control.is_interrupted()
    };
    // A torus at an end of the range has one way to go; one that is born, the way on which it lies.
    let sides = match (
        first.lambda <= 1e-9,
        first.lambda >= 1.0 - 1e-9,
        &keys.start.analysis,
    ) {
        (true, ..) => vec![CrossingSide::Forward],
        (_, true, _) => vec![CrossingSide::Backward],
        _ => vec![CrossingSide::Backward, CrossingSide::Forward],
    };
    let (mut arms, mut is_stopped) = (Vec::new(), false);
    for side in sides {
        problem.refer_to(&first);
        match follow(&mut problem, &first, side, &options, &mut keep_going) {
            Ok(Some(mut arm)) => {
                match explained(keys, setting, (axis, at, nu), (&mut problem, &arm)) {
                    Ok(end) => arm.end = end,
                    Err(SolveError::Interrupted) => {}
                    Err(error) => return Err(Error::Solve(error)),
                }
                arms.push((side, arm));
            }
            Ok(None) => return Ok(lost("the first torus cannot be corrected".into())),
            Err(SolveError::Interrupted) => {
                is_stopped = true;
                break;
            }
            Err(error) => return Err(Error::Solve(error)),
        }
    }
    let mut points: Vec<TorusPoint> = Vec::new();
    let mut ends: Vec<TorusEnd> = arms.iter().map(|(_, arm)| arm.end.clone()).collect();
    ends.extend(is_stopped.then_some(TorusEnd::Path(PathEnd::Interrupted)));
    for (side, arm) in arms {
        match side {
            CrossingSide::Backward => points.extend(arm.points.into_iter().rev()),
            // Both begin at the first one.
            CrossingSide::Forward => {
                points.extend(arm.points.into_iter().skip(usize::from(!points.is_empty())))
            }
        }
    }
    let rows = rows(setting, &mut problem, (points, nu), keys.curve);
    Ok(TracedTorus {
        rows: rows.map_err(Error::Solve)?,
        ends,
        failure: None,
        integrator: problem.into_shots().integrator(),
    })
}

/// The end of an arm; where smoothness is lost, a locking is looked for as its cause.
fn explained(
    keys: &Torus,
    setting: &Setting<'_>,
    (axis, at, nu): (&CurveAxis, f64, usize),
    (problem, arm): (&mut TorusProblem<'_>, &TorusArm),
) -> Result<TorusEnd, SolveError> {
    if arm.end != TorusEnd::BreakUp {
        return Ok(arm.end.clone());
    }
    let mut repeated = |maps: usize, lambda: f64| {
        let road = TorusRoad::new(setting, axis.clone(), at, nu * maps);
        Shots::new(Box::new(road), [lambda, 0.0], keys.integrator)
    };
    let found = locking(problem, &arm.points, &mut repeated)?;
    Ok(found.map_or(TorusEnd::BreakUp, TorusEnd::Folded))
}

fn lost(reason: String) -> TracedTorus {
    TracedTorus {
        rows: Vec::new(),
        ends: Vec::new(),
        failure: Some(reason),
        integrator: "",
    }
}

/// Time in which tori are measured after an interruption; the measures of the others stay empty.
const LAST: Duration = Duration::from_millis(700);

/// All tori with their measures. An interruption ends the path, not the measures of what was found before.
fn rows(
    setting: &Setting<'_>,
    problem: &mut TorusProblem<'_>,
    (points, nu): (Vec<TorusPoint>, usize),
    keeps_curve: bool,
) -> Result<Vec<TorusRow>, SolveError> {
    let (mut list, mut stopped) = (Vec::with_capacity(points.len()), None);
    let elements = setting.assembly.system.element_count();
    for point in points {
        if stopped.is_none() && setting.control.is_interrupted() {
            stopped = Some(Instant::now());
        }
        let is_late = stopped.is_some_and(|at| at.elapsed() > LAST);
        list.push(match is_late {
            true => TorusRow {
                rms: vec![f64::NAN; elements],
                curve: Vec::new(),
                nu,
                point,
            },
            false => Interrupt::default().scope(|| row(problem, (point, nu), keeps_curve))?,
        });
    }
    Ok(list)
}

/// The measures of a torus: means over all angles and over time.
fn row(
    problem: &mut TorusProblem<'_>,
    (point, nu): (TorusPoint, usize),
    keeps_curve: bool,
) -> Result<TorusRow, SolveError> {
    let torus = &point.torus;
    problem.refer_to(torus);
    let orbits = problem.orbits(torus)?;
    let system: System = problem.system(torus.lambda)?.clone();
    let mut meter = Meter::new(16);
    let mut state = vec![0.0; 2 * system.dof()];
    let (mut sums, mut curve) = (vec![(0.0, 0.0); system.element_count()], Vec::new());
    let count = orbits.len() as f64;
    for orbit in orbits {
        let orbit = Orbit::Segments(orbit);
        for (sum, own) in sums.iter_mut().zip(meter.measure(&system, &orbit)) {
            sum.0 += own.mean / count;
            sum.1 += (own.rms * own.rms + own.mean * own.mean) / count;
        }
        if keeps_curve {
            orbit.state(0.0, &mut state);
            curve.extend_from_slice(&state);
        }
    }
    let rms = sums
        .iter()
        .map(|(mean, square)| (square - mean * mean).max(0.0).sqrt());
    Ok(TorusRow {
        rms: rms.collect(),
        curve,
        nu,
        point,
    })
}
