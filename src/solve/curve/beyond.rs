//! How a curve of bifurcations goes on behind a grazing.
//!
//! At a touching of depth d the derivative of the map changes as the square root of d where the force is continuous. With s, the way along
//! the grazing curve from the place where the two meet, and the test that vanishes along the curve of bifurcations:
//!
//! ```text
//! untouched:  a s + b d = 0  (d < 0: the clearance),    touched:  a s + c sqrt(d) = 0
//! ```
//!
//! On the untouched side the curve comes to the grazing curve at an angle; on the touched side it leaves along its tangent, to one of its two
//! sides. Where the derivative jumps or grows without bound there may be nothing behind.

use super::defining::Spot;
use super::meeting::Meeting;
use super::passing::Counts;
use super::walker::PATH;
use super::{CurveKind, Defining};
use crate::error::SolveError;
use crate::solve::continuation::{PathPoint, Section};
use nalgebra::DVector;

/// Distances behind the meeting at which the curve is looked for, in ranges and sizes: differences of the flow reach across a touching that
/// is less deep than their step.
const REACHES: [f64; 6] = [1e-2, 3e-3, 3e-2, 1e-3, 3e-4, 1e-4];
/// First depths on the touched side, in squares of the reach: the corrector comes to the right one from below.
const DEPTHS: [f64; 4] = [1e-1, 1e-3, 1.0, 10.0];
/// First clearance on the untouched side, in reaches.
const CLEAR: f64 = 1e-2;
/// Distance of a point from the meeting, in reaches: at least and at most.
const APART: (f64, f64) = (0.2, 30.0);
/// Distance of the point at half the reach, in that of the other one, at most.
const NEARER: f64 = 0.9;

/// Side of a grazing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GrazingSide {
    /// The orbits do not touch.
    Clear,
    /// They do.
    Touched,
}

impl GrazingSide {
    /// Of orbits with some passages, beside one that does not touch: those that touch pass the breakpoint twice more. `None` where others
    /// have come or gone.
    pub fn of(passages: &Counts, clear: &Counts, kind: CurveKind) -> Option<GrazingSide> {
        if passages == clear {
            return Some(GrazingSide::Clear);
        }
        let CurveKind::Grazing {
            connection,
            breakpoint,
        } = kind
        else {
            return None;
        };
        let is_own = |c: &&(usize, usize, usize)| (c.0, c.1) == (connection, breakpoint);
        let count = |list: &Counts| list.iter().find(is_own).map_or(0, |c| c.2);
        let others =
            |list: &Counts| -> Counts { list.iter().filter(|c| !is_own(c)).copied().collect() };
        let is_touched = count(passages) == count(clear) + 2 && others(passages) == others(clear);
        is_touched.then_some(GrazingSide::Touched)
    }
}

/// Where the curve is looked for: a plane at a distance along a direction from a place.
struct Landing {
    base: Spot,
    direction: (DVector<f64>, f64),
    distance: f64,
}

impl Defining<'_> {
    /// Passages of the orbit at a meeting that does not touch; `None` where a curve is not followed beyond it.
    pub(super) fn clear_passages(&mut self, met: &Meeting) -> Result<Option<Counts>, SolveError> {
        if met.repeats > 1 || self.kind == CurveKind::BranchPoint {
            return Ok(None);
        }
        let touching = met.touching();
        let nature = self.as_grazing((met.kind, 1), |own| own.nature(&touching))?;
        Ok(nature.map(|nature| nature.passages.counts()))
    }

    /// The meeting and the first point of the curve on a side of it, with tangents that lead away; `None` where nothing is found there.
    ///
    /// # Errors
    /// An interruption.
    pub(super) fn behind(
        &mut self,
        met: &Meeting,
        (side, clear): (GrazingSide, &Counts),
    ) -> Result<Option<[PathPoint; 2]>, SolveError> {
        let borders = self.borders.clone();
        for reach in REACHES {
            for way in [1.0, -1.0] {
                for choice in 0..DEPTHS.len() {
                    let place = (way * reach, choice);
                    let found = self.landed((met, side, clear), place);
                    let found = self.or_none(found)?;
                    let Some((point, far)) = found else { continue };
                    let half = self.landed((met, side, clear), (0.5 * way * reach, choice));
                    let half = self.or_none(half)?;
                    let is_nearer = half.is_some_and(|(_, near)| near < NEARER * far);
                    if is_nearer && self.leads_back(met, &point)? {
                        self.borders = borders;
                        return Ok(Some(self.leading_away((met, side), point)));
                    }
                }
            }
        }
        self.borders = borders;
        Ok(None)
    }

    /// Beyond the model there is nothing.
    fn or_none<T>(&self, found: Result<Option<T>, SolveError>) -> Result<Option<T>, SolveError> {
        match found {
            Err(SolveError::NoSystem { .. }) => Ok(None),
            found => found,
        }
    }

    /// A point of the curve on a side of the meeting, and its distance from that.
    fn landed(
        &mut self,
        (met, side, clear): (&Meeting, GrazingSide, &Counts),
        place: (f64, usize),
    ) -> Result<Option<(PathPoint, f64)>, SolveError> {
        let landing = match side {
            GrazingSide::Touched => self.touched(met, place)?,
            GrazingSide::Clear => self.cleared(met, place)?,
        };
        let Some(landing) = landing else {
            return Ok(None);
        };
        self.follow_borders(&landing.base)?;
        let begin = (self.unknowns(&landing.base), landing.base.p[1]);
        let mut section = Section::new(self, begin, landing.direction, PATH)?;
        let Some(point) = section.at(self, landing.distance)? else {
            return Ok(None);
        };
        let spot = self.spot(&point.u, point.lambda);
        let Some((_, passages)) = self.transition(&spot)? else {
            return Ok(None);
        };
        let distance = self.distance(met, &point);
        let reach = place.0.abs();
        let is_apart = (APART.0 * reach..=APART.1 * reach).contains(&distance);
        let is_there = GrazingSide::of(&passages.counts(), clear, met.kind) == Some(side);
        Ok((is_apart && is_there).then_some((point, distance)))
    }

    /// A place on the touched side: a point of the grazing curve with the state moved into the touching.
    fn touched(
        &mut self,
        met: &Meeting,
        (s, depth): (f64, usize),
    ) -> Result<Option<Landing>, SolveError> {
        let depth = DEPTHS[depth] * s * s;
        let along = (met.point.tangent_u.clone(), met.point.tangent_lambda);
        let touching = met.touching();
        let base = self.as_grazing((met.kind, met.repeats), |own| {
            let begin = (own.unknowns(&touching), touching.p[1]);
            let mut section = Section::new(own, begin, along, PATH)?;
            let Some(point) = section.at(own, s)? else {
                return Ok(None);
            };
            let spot = own.spot(&point.u, point.lambda);
            own.beside(&spot, -depth).map(Some)
        })?;
        let extra = met.spot.extra;
        Ok(base.map(|base| Landing {
            base: Spot { extra, ..base },
            direction: self.along(met),
            distance: 0.0,
        }))
    }

    /// A place on the untouched side, from which the curve is looked for at another value of a parameter.
    fn cleared(
        &mut self,
        met: &Meeting,
        (s, choice): (f64, usize),
    ) -> Result<Option<Landing>, SolveError> {
        let touching = met.touching();
        let clear = CLEAR * s.abs() * [1.0, 0.0][choice / 2];
        let base = self.as_grazing((met.kind, met.repeats), |own| {
            own.untouched(&touching, clear)
        })?;
        let mut direction = (DVector::zeros(self.dimension()), 0.0);
        match choice % 2 {
            0 => direction.1 = 1.0,
            _ => direction.0[self.first_parameter()] = 1.0,
        }
        let extra = met.spot.extra;
        Ok(Some(Landing {
            base: Spot { extra, ..base },
            direction,
            distance: s,
        }))
    }

    /// Unknowns.
    fn dimension(&self) -> usize {
        self.shots.size() + 1 + self.kind.extras()
    }

    /// Tangent of the grazing curve in the unknowns of the own one.
    fn along(&self, met: &Meeting) -> (DVector<f64>, f64) {
        let common = self.first_parameter() + 1;
        let mut along = DVector::zeros(self.dimension());
        let tangent = met.point.tangent_u.rows(0, common);
        along.rows_mut(0, common).copy_from(&tangent);
        (along, met.point.tangent_lambda)
    }

    /// From the meeting to a point.
    pub(super) fn way(&self, met: &Meeting, point: &PathPoint) -> (DVector<f64>, f64) {
        let from = self.unknowns(&met.spot);
        (&point.u - from, point.lambda - met.spot.p[1])
    }

    /// Distance of a point from the meeting.
    pub(super) fn distance(&self, met: &Meeting, point: &PathPoint) -> f64 {
        let (u, lambda) = self.way(met, point);
        u.norm().hypot(lambda)
    }

    /// Both ends of the first step, with tangents that lead away from the meeting.
    fn leading_away(
        &self,
        (met, side): (&Meeting, GrazingSide),
        mut point: PathPoint,
    ) -> [PathPoint; 2] {
        let chord = self.way(met, &point);
        let forwards = |(u, lambda): &(DVector<f64>, f64)| u.dot(&chord.0) + lambda * chord.1;
        if forwards(&(point.tangent_u.clone(), point.tangent_lambda)) < 0.0 {
            point.tangent_u.neg_mut();
            point.tangent_lambda = -point.tangent_lambda;
            point.orientation = -point.orientation;
        }
        let mut tangent = match side {
            GrazingSide::Touched => self.along(met),
            GrazingSide::Clear => chord.clone(),
        };
        let length = (tangent.0.norm_squared() + tangent.1 * tangent.1).sqrt();
        let sign = forwards(&tangent).signum() / length;
        tangent = (tangent.0 * sign, tangent.1 * sign);
        let meeting = PathPoint {
            u: self.unknowns(&met.spot),
            lambda: met.spot.p[1],
            tangent_u: tangent.0,
            tangent_lambda: tangent.1,
            orientation: point.orientation,
            newton: met.point.newton,
        };
        [meeting, point]
    }
}
