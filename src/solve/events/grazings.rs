//! Extrema of deformations that touch a breakpoint between two places of a step.

use super::locate::{RootTarget, SearchResult};
use super::passages::slope_near;
use super::touch::{Extremum, Heights, Matched, turn};
use super::{EventKind, Look, Step};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::residual::{Extent, Survey};
use std::rc::Rc;

/// Halvings of a stretch in which the extrema move too far for one look.
const MAX_HALVINGS: usize = 6;
/// Width to which a grazing is sought on the interpolant, as a share of its stretch.
const SKETCH: f64 = 1e-4;
/// Distance of a located extremum from the breakpoint, relative to its largest at the ends: above it, two extrema were mistaken
/// for one another.
const TOUCHES: f64 = 1e-3;

/// Extrema of one kind of one connection, and one breakpoint of its law.
#[derive(Clone, Copy)]
struct ExtremumWatch {
    connection: usize,
    breakpoint: usize,
    is_maximum: bool,
}

impl ExtremumWatch {
    fn heights(&self, fraction: f64, survey: &Survey) -> Heights {
        match survey.breakpoints[self.connection].get(self.breakpoint) {
            Some(level) => {
                let extrema = &survey.extrema[self.connection];
                Heights::new(fraction, extrema, self.is_maximum, *level)
            }
            // A gap that closes along the branch takes its breakpoints with it.
            None => Heights::new(fraction, &[], self.is_maximum, 0.0),
        }
    }

    fn kind(&self) -> EventKind {
        EventKind::Grazing {
            connection: self.connection,
            breakpoint: self.breakpoint,
        }
    }
}

/// One extremum followed from place to place.
struct ExtremumFollower {
    /// Fraction and phase, by fraction; phases are not reduced to one period.
    known: Vec<(f64, f64)>,
}

impl ExtremumFollower {
    /// Height over the breakpoint of the extremum nearest to where the neighbouring places let expect it.
    fn over(&mut self, heights: &Heights) -> f64 {
        let after = self.known.partition_point(|k| k.0 < heights.x);
        let last = self.known.len() - 1;
        let (i, j) = (after.clamp(1, last) - 1, after.clamp(1, last));
        let ((a, from), (b, to)) = (self.known[i], self.known[j]);
        let expected = from + (to - from) * ((heights.x - a) / (b - a));
        let Some(extremum) = heights.nearest(expected) else {
            return f64::NAN;
        };
        let tau = expected + turn(expected, extremum.tau);
        self.known.insert(after, (heights.x, tau));
        heights.over(extremum)
    }
}

impl Step<'_> {
    /// Locates the grazings of a step and returns what is known there, in the order of the path.
    pub(super) fn grazings(
        &mut self,
        before: Option<&Look>,
        a: &Look,
        b: &Look,
    ) -> Result<Vec<Look>, SolveError> {
        let mut knots = Vec::new();
        let counts: Vec<usize> = a.survey.breakpoints.iter().map(Vec::len).collect();
        for (connection, count) in counts.into_iter().enumerate() {
            for (breakpoint, is_maximum) in (0..count).flat_map(|k| [(k, false), (k, true)]) {
                let watch = ExtremumWatch {
                    connection,
                    breakpoint,
                    is_maximum,
                };
                self.scan_touches(&watch, (a, b), before, 0, &mut knots)?;
            }
        }
        knots.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        Ok(knots)
    }

    /// Halves the stretch until every extremum is followed beyond doubt.
    fn scan_touches(
        &mut self,
        watch: &ExtremumWatch,
        (a, b): (&Look, &Look),
        third: Option<&Look>,
        depth: usize,
        knots: &mut Vec<Look>,
    ) -> Result<(), SolveError> {
        let heights = |look: &Look| watch.heights(look.fraction, &look.survey);
        let (at_a, at_b) = (heights(a), heights(b));
        let matched = Matched::between(&at_a, &at_b);
        if depth < MAX_HALVINGS && self.looks_left > 0 {
            let is_doubtful = matched.is_unclear()
                || matched.single_above != [0, 0]
                || third.is_some_and(|t| matched.may_touch(&heights(t)));
            if is_doubtful {
                let m = self.look_for_touch(0.5 * (a.fraction + b.fraction))?;
                self.scan_touches(watch, (a, &m), Some(b), depth + 1, knots)?;
                return self.scan_touches(watch, (&m, b), Some(a), depth + 1, knots);
            }
        }
        for pair in matched.pairs.iter().filter(|pair| matched.passes(pair)) {
            let ends = (at_a.over(&pair.0), at_b.over(&pair.1));
            self.locate_touch(watch, (a, b), pair, ends, knots)?;
        }
        Ok(())
    }

    /// A look that all extrema share.
    fn look_for_touch(&mut self, fraction: f64) -> Result<Rc<Look>, SolveError> {
        if let Some(known) = self.touches.iter().find(|look| look.fraction == fraction) {
            return Ok(known.clone());
        }
        let look = Rc::new(self.look(fraction, Extent::Motion)?);
        self.touches.push(look.clone());
        Ok(look)
    }

    fn locate_touch(
        &mut self,
        watch: &ExtremumWatch,
        (a, b): (&Look, &Look),
        (from, to): &(Extremum, Extremum),
        ends: (f64, f64),
        knots: &mut Vec<Look>,
    ) -> Result<(), SolveError> {
        let last = from.tau + turn(from.tau, to.tau);
        let mut follower = ExtremumFollower {
            known: vec![(a.fraction, from.tau), (b.fraction, last)],
        };
        let (low, high) = ((a.fraction, ends.0), (b.fraction, ends.1));
        let mut seen = vec![low, high];
        let guess = roots::bracketed(
            |x| {
                let look = self.look(x, Extent::Motion)?;
                let value = follower.over(&watch.heights(x, &look.survey));
                seen.push((x, value));
                Ok::<f64, SolveError>(value)
            },
            low,
            high,
            SKETCH * (b.fraction - a.fraction),
        )?
        .root;
        let is_whole = a.fraction == 0.0 && b.fraction == 1.0;
        let target = RootTarget {
            limits: (0.0, 1.0),
            guess,
            slope: slope_near(&mut seen, guess),
            extent: Some(self.extent),
            values: is_whole.then_some((low, high)),
        };
        let found = self.locate(&target, |x, _, survey| {
            survey.map_or(f64::NAN, |s| follower.over(&watch.heights(x, s)))
        })?;
        match found {
            SearchResult::Root(root) => {
                if root.value.abs() > TOUCHES * ends.0.abs().max(ends.1.abs()) {
                    return Ok(());
                }
                if let Some(survey) = root.survey.clone() {
                    knots.push(Look {
                        fraction: root.fraction,
                        lambda: root.point.lambda,
                        survey,
                    });
                }
                self.report(
                    watch.kind(),
                    (a.lambda, b.lambda),
                    guess,
                    SearchResult::Root(root),
                );
            }
            // Between two interpolated places the corrected path has the last word.
            SearchResult::Nothing if !is_whole => {}
            found => self.report(watch.kind(), (a.lambda, b.lambda), guess, found),
        }
        Ok(())
    }
}
