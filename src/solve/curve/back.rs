//! Whether the curve through a point behind a grazing comes from there.

use super::Defining;
use super::meeting::Meeting;
use super::walker::PATH;
use crate::error::SolveError;
use crate::solve::continuation::{Advance, Continuation, ContinuationOptions, PathPoint};

/// Longest step back, and the smallest one, in distances from the meeting.
const STEP: (f64, f64) = (0.125, 1e-3);
/// Steps at most until that distance is halved.
const MOST: usize = 24;
/// Distance, in ranges and sizes, at which the curve has come back; of a nearer point the share of its distance.
const BACK: (f64, f64) = (2e-4, 0.3);
/// Share of the first distance at which it has come back where the path ends: differences of the flow reach across a touching that is not
/// deep.
const ENDED: f64 = 0.3;

impl Defining<'_> {
    /// Whether the curve through a point behind a meeting leads back to it: another one that passes nearby turns away.
    pub(super) fn leads_back(
        &mut self,
        met: &Meeting,
        point: &PathPoint,
    ) -> Result<bool, SolveError> {
        let first = self.distance(met, point);
        let wanted = BACK.0.min(BACK.1 * first);
        let (mut point, mut distance) = (point.clone(), first);
        while distance > wanted {
            match self.nearer(met, &point)? {
                Nearer::Point(next) => point = *next,
                Nearer::Away => return Ok(false),
                Nearer::End(nearest) => return Ok(nearest < ENDED * first),
            }
            distance = self.distance(met, &point);
        }
        Ok(true)
    }

    /// Follows the curve from a point to half the distance from the meeting.
    fn nearer(&mut self, met: &Meeting, point: &PathPoint) -> Result<Nearer, SolveError> {
        let spot = self.spot(&point.u, point.lambda);
        self.follow_borders(&spot)?;
        let (first, way) = (self.distance(met, point), self.way(met, point));
        let away = way.0.dot(&point.tangent_u) + way.1 * point.tangent_lambda;
        let sign = if away > 0.0 { -1.0 } else { 1.0 };
        let begin = PathPoint {
            tangent_u: &point.tangent_u * sign,
            tangent_lambda: point.tangent_lambda * sign,
            // That of the borders before.
            orientation: 0,
            ..point.clone()
        };
        let settings = ContinuationOptions {
            step: STEP.0 * first,
            min_step: STEP.1 * first,
            max_step: STEP.0 * first,
            max_points: MOST,
            ..PATH
        };
        let ends = (begin.clone(), begin.clone());
        let mut path = Continuation::from_step(self, ends, begin, settings);
        let mut nearest = first;
        loop {
            let next = match path.advance(self) {
                Ok(Advance::Point(next)) => next.clone(),
                Ok(Advance::End(_)) | Err(SolveError::NoSystem { .. }) => {
                    return Ok(Nearer::End(nearest));
                }
                Err(error) => return Err(error),
            };
            let distance = self.distance(met, &next);
            if distance > nearest {
                return Ok(Nearer::Away);
            }
            if distance < 0.5 * first {
                return Ok(Nearer::Point(Box::new(next)));
            }
            nearest = distance;
        }
    }
}

/// What becomes of a curve that is followed towards a meeting.
enum Nearer {
    Point(Box<PathPoint>),
    /// It turns away.
    Away,
    /// It cannot be followed; its least distance.
    End(f64),
}
