//! The place at which a curve of bifurcations ends at a grazing.
//!
//! Beside a touching multipliers have infinite slope, so the follower of the curve stops short of it. The grazing curve goes through: on
//! the side that does not touch, the multipliers along it are smooth, and the end is where one of them passes the circle.

use super::defining::Spot;
use super::seek::gaps;
use super::walker::PATH;
use super::{CurveKind, Defining};
use crate::error::SolveError;
use crate::solve::continuation::{Continuation, CrossingSide, PathPoint, Section, Started};
use crate::solve::floquet;

/// First step along the grazing curve, in ranges and sizes.
const FIRST: f64 = 1e-5;
/// Steps at most, and the longest one: the whole range.
const SECANTS: (usize, f64) = (24, 1.0);
/// Step at which the place is found; and one below which a step that is no shorter than half of the one before is rounding.
const LOCATED: (f64, f64) = (1e-12, 1e-9);
/// Halvings of a step that leads nowhere.
const HALVINGS: usize = 5;
/// Extrema nearest to a breakpoint that are tried.
const EXTREMA: usize = 2;
/// Largest distance of the orbit at the place from that of the last point, in sizes, over the square root of the gap that is left there: on
/// the touched side the curve comes to the grazing curve along its tangent, so that its distance is as that square root.
const REACH: f64 = 10.0;
/// A place on a grazing curve with its point of the path, and the test there.
type Tested = ((Spot, PathPoint), f64);

/// A place at which a curve of bifurcations comes to a grazing.
#[derive(Debug, Clone)]
pub(super) struct Meeting {
    /// The place, with the number that the curve has besides.
    pub spot: Spot,
    /// The grazing, and the phase of the touching.
    pub kind: CurveKind,
    pub tau: f64,
    /// The point of the grazing curve, with its tangent.
    pub point: PathPoint,
    /// How often the orbit repeats itself in the response period.
    pub repeats: usize,
}

impl Meeting {
    /// The place on the grazing curve.
    pub fn touching(&self) -> Spot {
        Spot {
            extra: self.tau,
            ..self.spot.clone()
        }
    }
}

impl Defining<'_> {
    /// What is done with the grazing curve of that kind in place of the own one.
    pub(super) fn as_grazing<T>(
        &mut self,
        (kind, repeats): (CurveKind, usize),
        work: impl FnOnce(&mut Self) -> Result<T, SolveError>,
    ) -> Result<T, SolveError> {
        let own = (std::mem::replace(&mut self.kind, kind), self.borders.take());
        self.shots.set_repeats(repeats);
        let found = work(self);
        self.shots.set_repeats(1);
        (self.kind, self.borders) = own;
        found
    }

    /// The end of a curve of bifurcations at the touching nearest to a spot of it; `None` where there is none near.
    ///
    /// # Errors
    /// An interruption.
    pub(super) fn meeting(&mut self, spot: &Spot) -> Result<Option<Meeting>, SolveError> {
        self.meeting_of(spot, None)
    }

    /// The same of one connection.
    ///
    /// # Errors
    /// An interruption.
    pub(super) fn meeting_of(
        &mut self,
        spot: &Spot,
        connection: Option<usize>,
    ) -> Result<Option<Meeting>, SolveError> {
        let test = match self.kind {
            CurveKind::Fold | CurveKind::BranchPoint => 0,
            CurveKind::PeriodDoubling => 1,
            CurveKind::NeimarkSacker => 2,
            CurveKind::Grazing { .. } => return Ok(None),
        };
        let nearest = gaps(&mut self.shots, connection, (spot.p, &spot.u))?;
        let repeats = self.shots.repeats(spot.p, &spot.u)?;
        for (gap, kind, tau) in nearest.into_iter().take(EXTREMA) {
            let touching = Spot {
                extra: tau,
                ..spot.clone()
            };
            let found = match self.as_grazing((kind, repeats), |own| own.passage(&touching, test)) {
                Err(SolveError::NoSystem { .. }) => None,
                found => found?,
            };
            let reach = REACH * (gap * self.size).sqrt();
            let is_near = |found: &Spot| {
                let mut gaps = found.u.iter().zip(&spot.u).map(|(a, b)| (a - b).abs());
                gaps.all(|gap| gap <= reach)
            };
            if let Some((found, point)) = found.filter(|(found, _)| is_near(found)) {
                let tau = found.extra;
                let extra = match test {
                    2 => self.cosine(&found)?.unwrap_or(spot.extra),
                    _ => spot.extra,
                };
                return Ok(Some(Meeting {
                    spot: Spot { extra, ..found },
                    kind,
                    tau,
                    point,
                    repeats,
                }));
            }
        }
        Ok(None)
    }

    /// cos theta of the pair of multipliers that is nearest to the circle.
    fn cosine(&mut self, spot: &Spot) -> Result<Option<f64>, SolveError> {
        let Some((phi, _)) = self.transition(spot)? else {
            return Ok(None);
        };
        let list = floquet::multipliers(&phi).into_iter();
        let gap = |mu: &num_complex::Complex<f64>| (mu.norm() - 1.0).abs();
        let pairs = list.filter(|mu| mu.im > 0.0);
        let nearest = pairs.min_by(|a, b| gap(a).total_cmp(&gap(b)));
        Ok(nearest.map(|mu| mu.re / mu.norm()))
    }

    /// The spot of the grazing curve nearest to a first one at which a test vanishes.
    fn passage(
        &mut self,
        first: &Spot,
        test: usize,
    ) -> Result<Option<(Spot, PathPoint)>, SolveError> {
        let begin = (self.unknowns(first), first.p[1]);
        let Started::Path(path) = Continuation::start_at(self, begin, CrossingSide::Forward, PATH)?
        else {
            return Ok(None);
        };
        let base = path.point();
        let direction = (base.tangent_u.clone(), base.tangent_lambda);
        let mut section = Section::new(self, (base.u.clone(), base.lambda), direction, PATH)?;
        let mut at = |this: &mut Self, s: f64| -> Result<Option<Tested>, SolveError> {
            let Some(point) = section.at(this, s)? else {
                return Ok(None);
            };
            let spot = this.spot(&point.u, point.lambda);
            let nature = this.nature(&spot)?;
            let value = nature.map(|n| n.tests[test].1).filter(|x| x.is_finite());
            Ok(value.map(|value| ((spot, point), value)))
        };
        let (mut a, mut b) = (0.0, FIRST);
        let (Some((_, mut at_a)), Some((_, mut at_b))) = (at(self, a)?, at(self, b)?) else {
            return Ok(None);
        };
        for _ in 0..SECANTS.0 {
            let next = b - at_b * (b - a) / (at_b - at_a);
            if next.is_nan() || next.abs() > SECANTS.1 {
                return Ok(None);
            }
            let (mut next, mut there) = (next, at(self, next)?);
            for _ in 0..HALVINGS {
                if there.is_none() {
                    next = 0.5 * (b + next);
                    there = at(self, next)?;
                }
            }
            let Some((found, at_next)) = there else {
                return Ok(None);
            };
            let (before, step) = ((b - a).abs(), (next - b).abs());
            let is_rounding = step < LOCATED.1 && step > 0.5 * before;
            if step < LOCATED.0 || is_rounding || at_next == 0.0 {
                return Ok(Some(found));
            }
            (a, at_a, b, at_b) = (b, at_b, next, at_next);
        }
        Ok(None)
    }
}
