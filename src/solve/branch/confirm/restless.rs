//! Steps of a branch in which the flow's multipliers may pass the circle and come back unseen.

use super::{Confirmer, Station};
use crate::solve::branch::confirm::flow::FlowPoint;
use crate::solve::events::quiet::{MOST, MultiplierSample, Quiet};
use crate::solve::events::{EventKind, Verdict};
use crate::solve::family::Family;

/// Points on either side of a step through which multipliers are interpolated.
const AROUND: usize = 2;
/// Steps of one branch that are followed for this reason.
const MOST_STEPS: usize = 40;

impl<F: Family> Confirmer<'_, F> {
    /// Where all points are known: steps between two with the same count, in which the multipliers of the points around do not
    /// prove that none passes the circle, or in which an orbit grazes.
    pub(super) fn restless(&self) -> Vec<(usize, usize)> {
        if !self.is_small() || self.stations.iter().any(Option::is_none) {
            return Vec::new();
        }
        let mut quiet = Quiet::default();
        let lengths = self.arclengths();
        let first = usize::from(self.options.begins_at_crossing);
        let steps = first..self.states.len().saturating_sub(1);
        let is_restless = |k: &usize| self.is_restless(*k, &lengths, &mut quiet);
        let list = steps.filter(is_restless).map(|k| (k, k + 1));
        list.take(MOST_STEPS).collect()
    }

    /// Whether a step is wider than what is looked for.
    fn is_wide(&self, k: usize) -> bool {
        let [a, b] = [k, k + 1].map(|k| self.branch.points[k].lambda);
        (b - a).abs() > self.options.resolution.width(0.5 * (a + b))
    }

    fn is_restless(&self, k: usize, lengths: &[f64], quiet: &mut Quiet) -> bool {
        let (Some(a), Some(b)) = (self.known(k), self.known(k + 1)) else {
            return false;
        };
        let passes = |at: f64| (k as f64..=(k + 1) as f64).contains(&at);
        if !self.is_wide(k)
            || a.unstable() != b.unstable()
            || self.crossings.iter().any(|c| passes(c.at))
        {
            return false;
        }
        let mut numbers = vec![k, k + 1];
        for distance in 1..=AROUND {
            let before = k.checked_sub(distance).filter(|j| self.is_smooth(*j, k));
            let behind = Some(k + 1 + distance).filter(|j| self.is_smooth(k + 1, *j));
            numbers.extend([before, behind].into_iter().flatten());
        }
        numbers.truncate(MOST);
        let known = numbers.iter().filter_map(|j| Some((*j, self.known(*j)?)));
        let places = known.map(|(j, orbit)| MultiplierSample::new(lengths[j], &orbit.multipliers));
        let places: Vec<MultiplierSample<'_>> = places.collect();
        !self.is_smooth(k, k + 1) || !quiet.holds(&places)
    }

    fn known(&self, k: usize) -> Option<&FlowPoint> {
        self.stations.get(k)?.as_ref().and_then(Station::orbit)
    }

    /// Whether nothing grazes between two points, both of the branch.
    fn is_smooth(&self, from: usize, to: usize) -> bool {
        let mut events = self.branch.events.iter();
        let grazes = events.any(|e| {
            let is_grazing = matches!(e.kind, EventKind::Grazing { .. });
            is_grazing && e.verdict != Verdict::Refuted && (from..to).contains(&e.after_point)
        });
        to < self.states.len() && !grazes
    }

    /// Arclengths of the points from the first one.
    fn arclengths(&self) -> Vec<f64> {
        let mut length = 0.0;
        let mut list = Vec::with_capacity(self.states.len());
        for k in 0..self.states.len() {
            if k > 0 {
                length += self.flow.distance(self.place(k - 1), self.place(k));
            }
            list.push(length);
        }
        list
    }
}
