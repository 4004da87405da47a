//! The best recurrences of a record, and whether an orbit is what they come back to.
//!
//! On an invariant curve their lags are denominators of the rotation number, and a slow motion towards a periodic orbit on the curve, or away
//! from one, looks like a rotation: but its returns shrink or grow. Returns also do so for a while where an orbit has just vanished.
//! Newton's iteration from the narrowest one tells.

use super::cycle::{Cycle, OrbitSearch};
use super::geometry::Cloud;
use super::lurking;
use super::map::Map;
use std::ops::Range;

/// The best recurrences of a record: better than those of all smaller lags.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BestReturns {
    /// Number of curves visited in turn.
    pub loops: usize,
    /// Iterates after which the points come back.
    lag: usize,
    /// Place of the narrowest return in the record.
    narrowest: usize,
    /// R.m.s. width in the second half of the record over that in the first half.
    widening: f64,
    /// Iterates between neighbours on the curve, whose distance the returns fill.
    neighbour: usize,
    /// That distance.
    gap: f64,
    /// Way that the returns go in the record, relative to it.
    coverage: f64,
}

/// Recurrence below which a record is a cycle, relative to its extent.
const EXACT: f64 = 1e-7;
/// Widening of returns that come back to no orbit.
const STEADY: (f64, f64) = (0.95, 1.05);
/// Way of the returns, relative to the distance that they fill, on which they would have met an orbit.
const COVERED: f64 = 0.5;
/// Places between neighbours at which an orbit is looked for where they would not.
const PLACES: usize = 4;
/// Newton iterations spent on an orbit from each.
const ITERATIONS: usize = 8;
/// How near an orbit on the curve passes the record, relative to its extent.
pub(super) const ON_CURVE: f64 = 0.03;

/// What the best returns of a record say of the curve on which it seems to lie.
pub(super) enum ReturnsVerdict {
    /// No orbit is on it.
    Rotation,
    /// An orbit is on it, which attracts, or it is not known.
    Open(Option<Cycle>),
}

impl BestReturns {
    /// Of the last points, `largest` at most; `None` of a cycle.
    ///
    /// Recurrences that are better than all of smaller lags lie at multiples of the number of curves, and the last two of them, being
    /// successive denominators of the rotation number's continued fraction times it, have no other common divisor. The last one fills the
    /// distance of the one before.
    pub fn of(cloud: &Cloud<'_>, largest: usize) -> Option<BestReturns> {
        let count = cloud.count().min(largest);
        let first = cloud.count() - count;
        let mut records: Vec<(usize, f64)> = Vec::new();
        for n in 1..=count / 2 {
            let least = records.last().map_or(f64::INFINITY, |record| record.1);
            let mut worst = 0.0_f64;
            for k in 0..count - n {
                worst = worst.max(cloud.lag(first + k, n));
                if worst >= least {
                    break;
                }
            }
            if worst < least {
                records.push((n, worst));
            }
        }
        let (lag, width) = records.pop()?;
        // What repeats exactly is a cycle.
        if width <= EXACT * cloud.extent() {
            return None;
        }
        let widths = |range: Range<usize>| range.map(|k| cloud.lag(first + k, lag));
        let square = |range: Range<usize>| {
            let pairs = range.len() as f64;
            widths(range).map(|width| width.powi(2)).sum::<f64>() / pairs
        };
        let pairs = count - lag;
        let order = widths(0..pairs).enumerate();
        let narrowest = order.min_by(|a, b| a.1.total_cmp(&b.1))?.0;
        let before = records.pop();
        let gap = before.map_or(cloud.extent(), |(_, wider)| wider);
        Some(BestReturns {
            loops: before.map_or(1, |(before, _)| divisor(lag, before)),
            lag,
            narrowest: first + narrowest,
            widening: (square(pairs / 2..pairs) / square(0..pairs / 2)).sqrt(),
            neighbour: before.map_or(0, |(before, _)| before),
            gap,
            coverage: count as f64 / lag as f64 * width / gap,
        })
    }

    /// Whether a record that seems to lie on a curve comes to no orbit there.
    pub fn verdict(&self, map: &mut dyn Map, cloud: &Cloud<'_>, longest: usize) -> ReturnsVerdict {
        if (STEADY.0..=STEADY.1).contains(&self.widening) {
            return ReturnsVerdict::Rotation;
        }
        if !map.has_variation() {
            return ReturnsVerdict::Open(None);
        }
        let starts = self.starts(cloud);
        let budget = ITERATIONS * self.lag * starts.len();
        let mut search = OrbitSearch::new(map, cloud, budget);
        match self.orbit(&mut search, cloud, &starts) {
            None => ReturnsVerdict::Rotation,
            Some(points) => {
                let cycle = search.attracting(&points[..cloud.size], self.lag);
                ReturnsVerdict::Open(cycle.filter(|cycle| cycle.period <= longest))
            }
        }
    }

    /// Where an orbit is looked for: at the narrowest return, and between it and its neighbour, where the returns have not been.
    fn starts(&self, cloud: &Cloud<'_>) -> Vec<Vec<f64>> {
        let from = cloud.point(self.narrowest);
        let places = match self.coverage < COVERED {
            true => PLACES,
            false => 1,
        };
        let other = self.narrowest + self.neighbour;
        let other = match other < cloud.count() {
            true => other,
            false => self.narrowest - self.neighbour,
        };
        let between = |share: f64| {
            let parts = from.iter().zip(cloud.point(other));
            parts.map(|(a, b)| a + share * (b - a)).collect()
        };
        let shares = (0..places).map(|k| k as f64 / places as f64);
        shares.map(between).collect()
    }

    /// The points of an orbit near the record to which Newton's iteration leads.
    fn orbit(
        &self,
        search: &mut OrbitSearch<'_>,
        cloud: &Cloud<'_>,
        starts: &[Vec<f64>],
    ) -> Option<Vec<f64>> {
        // Between neighbours that have not moved there is no point of the record.
        let reach = ON_CURVE.max(self.gap / cloud.extent());
        starts.iter().find_map(|start| {
            let points = search.any(start, self.lag)?;
            lurking::is_within_reach(&points, cloud, reach).then_some(points)
        })
    }
}

fn divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_divisors() {
        assert_eq!(divisor(26, 10), 2);
        assert_eq!(divisor(7, 5), 1);
        assert_eq!(divisor(21, 14), 7);
    }
}
