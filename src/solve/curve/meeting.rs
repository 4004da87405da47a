//! The place at which a curve of bifurcations ends at a grazing.
//!
//! Beside a touching multipliers have infinite slope, so the follower of the curve stops short of it. The grazing curve goes through: on
//! the side that does not touch, the multipliers along it are smooth, and the end is where one of them passes the circle.

use super::defining::Spot;
use super::follow::NEWTON;
use super::seek::gaps;
use super::{CurveKind, Defining};
use crate::error::SolveError;
use crate::solve::continuation::{Continuation, ContinuationOptions, Section, Side, Started};

/// First step along the grazing curve, in ranges and sizes.
const FIRST: f64 = 1e-6;
/// Steps at most.
const SECANTS: usize = 16;
/// Step at which the place is found.
const LOCATED: f64 = 1e-12;
/// Largest distance of the place from the last point of the curve, in ranges: narrow ranges make small distances long.
const REACH: f64 = 0.05;
/// Settings of the path along the grazing curve, of which only the planes across it are used.
const PATH: ContinuationOptions = ContinuationOptions {
    range: (-2.0, 3.0),
    step: REACH,
    min_step: FIRST,
    max_step: REACH,
    max_points: 2,
    weight: 1.0,
    newton: NEWTON,
};

impl Defining<'_> {
    /// The end of a curve of bifurcations at the touching nearest to a spot of it; `None` where there is none near.
    ///
    /// # Errors
    /// An interruption.
    pub(super) fn meeting(&mut self, spot: &Spot) -> Result<Option<Spot>, SolveError> {
        let test = match self.kind {
            CurveKind::Fold | CurveKind::BranchPoint => 0,
            CurveKind::PeriodDoubling => 1,
            CurveKind::NeimarkSacker => 2,
            CurveKind::Grazing { .. } => return Ok(None),
        };
        let nearest = gaps(&mut self.shots, None, (spot.p, &spot.u))?;
        let Some((_, kind, tau)) = nearest.into_iter().next() else {
            return Ok(None);
        };
        let touching = Spot {
            extra: tau,
            ..spot.clone()
        };
        let own = (std::mem::replace(&mut self.kind, kind), self.borders.take());
        let found = self.passage(&touching, test);
        (self.kind, self.borders) = own;
        let found = match found {
            Err(SolveError::NoSystem { .. }) => None,
            found => found?,
        };
        let is_near = |found: &Spot| {
            let gaps = found.p.iter().zip(&spot.p).map(|(a, b)| (a - b).abs());
            gaps.fold(0.0, f64::max) < REACH
        };
        Ok(found.filter(is_near).map(|found| Spot {
            extra: spot.extra,
            ..found
        }))
    }

    /// The spot of the grazing curve nearest to a first one at which a test vanishes.
    fn passage(&mut self, first: &Spot, test: usize) -> Result<Option<Spot>, SolveError> {
        let begin = (self.unknowns(first), first.p[1]);
        let Started::Path(path) = Continuation::start_at(self, begin, Side::Forward, PATH)? else {
            return Ok(None);
        };
        let base = path.point();
        let direction = (base.tangent_u.clone(), base.tangent_lambda);
        let mut section = Section::new(self, (base.u.clone(), base.lambda), direction, PATH)?;
        let mut at = |this: &mut Self, s: f64| -> Result<Option<(Spot, f64)>, SolveError> {
            let Some(point) = section.at(this, s)? else {
                return Ok(None);
            };
            let spot = this.spot(&point.u, point.lambda);
            let nature = this.nature(&spot)?;
            let value = nature.map(|n| n.tests[test].1).filter(|x| x.is_finite());
            Ok(value.map(|value| (spot, value)))
        };
        let (mut a, mut b) = (0.0, FIRST);
        let (Some((_, mut at_a)), Some((_, mut at_b))) = (at(self, a)?, at(self, b)?) else {
            return Ok(None);
        };
        for _ in 0..SECANTS {
            let next = b - at_b * (b - a) / (at_b - at_a);
            if next.is_nan() || next.abs() > REACH {
                return Ok(None);
            }
            let Some((spot, at_next)) = at(self, next)? else {
                return Ok(None);
            };
            if (next - b).abs() < LOCATED || at_next == 0.0 {
                return Ok(Some(spot));
            }
            (a, at_a, b, at_b) = (b, at_b, next, at_next);
        }
        Ok(None)
    }
}
