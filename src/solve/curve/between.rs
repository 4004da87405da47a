//! Points of a step besides its end: marks, borders of the ranges, and those without which a picture of the curve has angles.

use super::codimension::CurveEvent;
use super::defining::Defining;
use super::nature::Codimension;
use super::walker::{CurveItem, CurveWalker, point};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::continuation::{Continuation, PathPoint};

/// Width of a location, in steps.
const WIDTH: f64 = 1e-13;
/// Distance, in ranges, of the curve from the straight line between two of its points: less than a pixel.
const BULGE: f64 = 2e-4;
/// Points at most that a step gets for it.
const MOST: f64 = 16.0;
/// Places of a step at which its distance from the straight line is taken.
const PROBES: [f64; 3] = [0.25, 0.5, 0.75];

impl CurveWalker<'_> {
    /// What the last step of a path brings between its ends, in its order, with the events in it.
    pub(super) fn within(
        &self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        events: Vec<CurveEvent>,
    ) -> Result<Vec<CurveItem>, SolveError> {
        let mut turns: Vec<f64> = (events.iter())
            .filter(|e| matches!(e.kind, Codimension::TurningSecond | Codimension::Cusp))
            .map(|e| e.fraction)
            .collect();
        turns.insert(0, 0.0);
        turns.push(1.0);
        let mut items: Vec<(f64, CurveItem)> = Vec::new();
        for arc in turns.windows(2) {
            self.marks_in(problem, path, (arc[0], arc[1]), &mut items)?;
        }
        self.first_borders(problem, path, &mut items)?;
        self.bends(problem, path, &mut items)?;
        items.extend(
            events
                .into_iter()
                .map(|e| (e.fraction, CurveItem::Event(e))),
        );
        items.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(items.into_iter().map(|(_, item)| item).collect())
    }

    /// Points inside a step that bends in the plane of the two parameters.
    fn bends(
        &self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        items: &mut Vec<(f64, CurveItem)>,
    ) -> Result<(), SolveError> {
        let place = problem.first_parameter();
        let in_plane = |x: f64| {
            let (u, lambda) = path.interpolate(x);
            [u[place], lambda]
        };
        let (from, to) = (in_plane(0.0), in_plane(1.0));
        let bulge = |x: f64| {
            let gap = |k: usize| in_plane(x)[k] - from[k] - x * (to[k] - from[k]);
            let (a, b) = (gap(0), gap(1));
            let (along, across) = (to[0] - from[0], to[1] - from[1]);
            // Only what lies across the chord shows; where there is none, all of it.
            let length = (along * along + across * across).sqrt();
            let beside = (a * across - b * along).abs() / length;
            if length > BULGE { beside } else { a.hypot(b) }
        };
        let largest = PROBES.map(bulge).into_iter().fold(0.0, f64::max);
        let parts = (largest / BULGE).sqrt().ceil().min(MOST) as usize;
        for k in 1..parts {
            let x = k as f64 / parts as f64;
            let Some(found) = path.at_fraction(problem, x)? else {
                continue;
            };
            add(problem, (x, &found), None, items)?;
        }
        Ok(())
    }

    /// Marks and borders of the second parameter between two fractions between which it does not turn.
    fn marks_in(
        &self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        (low, high): (f64, f64),
        items: &mut Vec<(f64, CurveItem)>,
    ) -> Result<(), SolveError> {
        let mut end = |x: f64| match x {
            0.0 => Ok(Some(path.origin().lambda)),
            1.0 => Ok(Some(path.point().lambda)),
            x => Ok(path.at_fraction(problem, x)?.map(|p| p.lambda)),
        };
        let (Some(a), Some(b)) = (end(low)?, end(high)?) else {
            return Ok(());
        };
        let borders = [(0.0, None), (1.0, None)];
        let marks = self.options.marks.iter().enumerate();
        let marks = marks.map(|(k, share)| (*share, Some(k)));
        for (target, mark) in marks.chain(borders) {
            let is_passed = (a - target) * (b - target) < 0.0;
            let is_new = items.iter().all(|(_, item)| match item {
                CurveItem::Point(p) => p.spot.p[1] != target,
                CurveItem::Event(_) => true,
            });
            if !is_passed || (mark.is_none() && !is_new) {
                continue;
            }
            if let Some((fraction, found)) = path.at_lambda(problem, target, (low, high))? {
                add(problem, (fraction, &found), mark, items)?;
            }
        }
        Ok(())
    }

    /// Points on the borders of the first parameter.
    fn first_borders(
        &self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        items: &mut Vec<(f64, CurveItem)>,
    ) -> Result<(), SolveError> {
        let place = problem.first_parameter();
        for border in [0.0, 1.0] {
            let (a, b) = (
                path.origin().u[place] - border,
                path.point().u[place] - border,
            );
            let is_passed = a * b < 0.0;
            if !is_passed {
                continue;
            }
            let value = |x: f64| {
                let point = path.at_fraction(problem, x).map_err(Some)?.ok_or(None)?;
                Ok(point.u[place] - border)
            };
            let root = match roots::bracketed(value, (0.0, a), (1.0, b), WIDTH) {
                Ok(found) => found.root,
                Err(Some(error)) => return Err(error),
                Err(None) => continue,
            };
            if let Some(found) = path.at_fraction(problem, root)? {
                add(problem, (root, &found), None, items)?;
            }
        }
        Ok(())
    }
}

/// Adds a point of the path at a fraction of the step with its data, where it has any.
fn add(
    problem: &mut Defining<'_>,
    (fraction, found): (f64, &PathPoint),
    mark: Option<usize>,
    items: &mut Vec<(f64, CurveItem)>,
) -> Result<(), SolveError> {
    let spot = problem.spot(&found.u, found.lambda);
    let nature = problem.nature(&spot)?;
    items.extend(nature.map(|nature| (fraction, CurveItem::Point(point(&spot, &nature, mark)))));
    Ok(())
}
