//! Branch points placed by multipliers at a distance. At the branch point itself the corrector is singular: it leaves the root
//! of its tolerance, while on both sides of it the multipliers vary smoothly.

use super::turnings::StepTurning;
use super::{BifurcationEvent, EventKind, Step};
use crate::error::SolveError;
use crate::numeric::interpolation;
use crate::solve::continuation::PathPoint;
use crate::solve::residual::Extent;
use num_complex::Complex;

/// Distance of the nearer places from the branch point, as a share of the step; the farther ones are twice as far.
const DISTANCE: f64 = 4e-3;
/// The least of it.
const LEAST: f64 = 2e-4;
/// Change of the parameter, relative to it, that tells on which side of a branch point a place lies.
const ROUNDING: f64 = 1e-12;
/// Share of that distance by which the branch point may move.
const NEAR: f64 = 0.1;

impl Step<'_> {
    /// Moves the branch points of the step to where the multipliers around say that they are.
    pub(super) fn sharpen(&mut self) -> Result<(), SolveError> {
        for k in 0..self.found.len() {
            let event = &self.found[k];
            let is_known = event.point.is_some() && event.unstable.is_some();
            if event.kind != EventKind::BranchPoint || !is_known {
                continue;
            }
            let event = event.clone();
            if let Some((low, high)) = self.turn(&event)? {
                let guess = (event.fraction, StepTurning::Single);
                let fold = self.fold((low.0, &low.1), (high.0, &high.1), guess)?;
                self.found[k] = BifurcationEvent {
                    multiplicity: event.multiplicity,
                    unstable: event.unstable,
                    ..fold
                };
                continue;
            }
            let Some((fraction, point)) = self.sharpened(&event)? else {
                continue;
            };
            let lambda = point.lambda;
            self.found[k] = BifurcationEvent {
                lambda,
                method_lambda: lambda,
                bracket: (event.bracket.0.min(lambda), event.bracket.1.max(lambda)),
                fraction,
                point: Some(self.path.with_smooth_tangent(point, fraction)),
                ..event
            };
        }
        Ok(())
    }

    /// Places around a branch point between which the path turns: two folds in one step show in the signs at its ends as little as two
    /// branch points.
    fn turn(&mut self, event: &BifurcationEvent) -> Result<Option<(Beside, Beside)>, SolveError> {
        let center = event.fraction;
        let turns =
            |e: &&BifurcationEvent| matches!(e.kind, EventKind::Fold | EventKind::BranchPoint);
        let gaps = self
            .found
            .iter()
            .filter(turns)
            .map(|e| (e.fraction - center).abs());
        let room = gaps.filter(|gap| *gap > 0.0).fold(1.0, f64::min);
        let distance = DISTANCE
            .min(0.3 * room)
            .min(0.4 * center)
            .min(0.4 * (1.0 - center));
        let (from, to) = (center - distance, center + distance);
        let low = self.path.at_fraction(self.problem, from)?;
        let high = self.path.at_fraction(self.problem, to)?;
        let (Some(low), Some(high)) = (low, high) else {
            return Ok(None);
        };
        let ahead = [&low, &high].map(|place| place.lambda - event.lambda);
        let is_seen = ahead
            .iter()
            .all(|x| x.abs() > ROUNDING * event.lambda.abs());
        let turns = is_seen && ahead[0] * ahead[1] > 0.0;
        Ok(turns.then_some(((from, low), (to, high))))
    }

    /// The place of a branch point, interpolated between four around it; `None` where these do not tell.
    fn sharpened(&mut self, event: &BifurcationEvent) -> Result<Option<Beside>, SolveError> {
        let center = event.fraction;
        let distance = DISTANCE.min(0.4 * center).min(0.4 * (1.0 - center));
        let Some(point) = event.point.clone().filter(|_| distance >= LEAST) else {
            return Ok(None);
        };
        let nodes = [-2.0, -1.0, 1.0, 2.0].map(|k| center + k * distance);
        let mut values = [0.0; 4];
        let mut places = Vec::with_capacity(4);
        for (value, node) in values.iter_mut().zip(nodes) {
            let Some(place) = self.path.at_fraction(self.problem, node)? else {
                return Ok(None);
            };
            let survey = self
                .problem
                .survey(&place.u, place.lambda, Extent::Stability)?;
            *value = beyond_one(&survey.multipliers, event.multiplicity);
            places.push(place);
        }
        if !(values[0] * values[3] < 0.0 && values[1] * values[2] < 0.0) {
            return Ok(None);
        }
        let fraction = interpolation::root(&nodes, &values);
        if (fraction - center).abs() > NEAR * distance {
            return Ok(None);
        }
        let mut shares = [0.0; 4];
        interpolation::weights(&nodes, fraction, &mut shares);
        let mut sharp = PathPoint {
            lambda: 0.0,
            ..point
        };
        sharp.u.fill(0.0);
        for (share, place) in shares.iter().zip(&places) {
            sharp.u.axpy(*share, &place.u, 1.0);
            sharp.lambda += share * place.lambda;
        }
        Ok(Some((fraction, sharp)))
    }
}

/// Fraction of a step, and the point of the path there.
type Beside = (f64, PathPoint);

/// Sum of mu - 1 over the multipliers nearest to 1: smooth where they pass together.
pub(crate) fn beyond_one(list: &[Complex<f64>], count: usize) -> f64 {
    let mut offsets: Vec<Complex<f64>> = list.iter().map(|mu| mu - 1.0).collect();
    offsets.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    offsets.iter().take(count).map(|d| d.re).sum()
}
