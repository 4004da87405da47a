//! Multipliers that pass the unit circle between two places of a step.

use super::locate::{Found, Target};
use super::spectrum::{Motion, Passage, Pathway, Place, chart, is_real, margin};
use super::{EventKind, Look, Step};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::residual::Extent;
use num_complex::Complex;

/// Halvings of a stretch in which the multipliers move too far for one look.
const MAX_HALVINGS: usize = 7;
/// The same where a pair becomes real, or two real multipliers a pair, near the circle: what passes first, and as what, takes
/// a close look.
const MAX_HALVINGS_MIXED: usize = 24;
/// Width to which a passage is sought on the interpolant, as a share of its stretch.
const SKETCH: f64 = 1e-3;
/// Stretches shorter than this share of the step hold nothing.
const SHORTEST: f64 = 1e-9;

/// A stretch of the step inside which nothing grazes. At a grazing the multipliers vary like a one-sided square root: the
/// stretch is measured in an abscissa in which they are smooth up to its ends.
struct Stretch {
    low: f64,
    high: f64,
    grazes_low: bool,
    grazes_high: bool,
}

impl Stretch {
    fn abscissa(&self, x: f64) -> f64 {
        match (self.grazes_low, self.grazes_high) {
            (false, false) => x,
            (true, false) => (x - self.low).max(0.0).sqrt(),
            (false, true) => -(self.high - x).max(0.0).sqrt(),
            (true, true) => (1.0 - 2.0 * (x - self.low) / (self.high - self.low))
                .clamp(-1.0, 1.0)
                .acos(),
        }
    }

    fn fraction(&self, s: f64) -> f64 {
        match (self.grazes_low, self.grazes_high) {
            (false, false) => s,
            (true, false) => self.low + s * s,
            (false, true) => self.high - s * s,
            (true, true) => self.low + 0.5 * (self.high - self.low) * (1.0 - s.cos()),
        }
    }
}

/// One multiplier followed from place to place.
struct Follower {
    /// Abscissa and place in the chart, by abscissa.
    known: Vec<(f64, Complex<f64>)>,
}

impl Follower {
    fn new((a, b): (f64, f64), path: &Pathway) -> Follower {
        Follower {
            known: vec![(a, chart(path.from)), (b, chart(path.to))],
        }
    }

    /// The multiplier nearest to where the neighbouring places let expect it.
    fn pick(&mut self, s: f64, multipliers: &[Complex<f64>]) -> Option<Complex<f64>> {
        let after = self.known.partition_point(|k| k.0 < s);
        let (i, j) = match after {
            0 => (0, 1),
            k if k >= self.known.len() => (self.known.len() - 2, self.known.len() - 1),
            k => (k - 1, k),
        };
        let ((a, from), (b, to)) = (self.known[i], self.known[j]);
        let expected = if b > a {
            from + (to - from) * ((s - a) / (b - a))
        } else {
            from
        };
        let distance = |mu: &&Complex<f64>| (chart(**mu) - expected).norm_sqr();
        let found = *multipliers
            .iter()
            .min_by(|x, y| distance(x).total_cmp(&distance(y)))?;
        self.known.insert(after, (s, chart(found)));
        Some(found)
    }

    fn margin(&mut self, s: f64, multipliers: &[Complex<f64>]) -> f64 {
        self.pick(s, multipliers).map_or(f64::NAN, margin)
    }
}

impl Step<'_> {
    /// Scans the stretches between the grazings `knots`.
    pub(super) fn passages(
        &mut self,
        before: Option<&Look>,
        a: &Look,
        b: &Look,
        knots: Vec<Look>,
    ) -> Result<(), SolveError> {
        let places: Vec<&Look> = [a].into_iter().chain(&knots).chain([b]).collect();
        for (k, pair) in places.windows(2).enumerate() {
            let (low, high) = (pair[0].fraction, pair[1].fraction);
            let stretch = Stretch {
                low,
                high,
                grazes_low: k > 0,
                grazes_high: k < knots.len(),
            };
            if high - low > SHORTEST {
                let third = before.filter(|_| knots.is_empty());
                self.scan_passages(&stretch, (pair[0], pair[1]), third, 0)?;
            }
        }
        Ok(())
    }

    /// Halves the stretch until every multiplier is followed beyond doubt.
    fn scan_passages(
        &mut self,
        stretch: &Stretch,
        (a, b): (&Look, &Look),
        third: Option<&Look>,
        depth: usize,
    ) -> Result<(), SolveError> {
        let motion = Motion::between(&a.survey.multipliers, &b.survey.multipliers);
        let place = |look: &Look| stretch.abscissa(look.fraction);
        let (at_a, at_b) = (place(a), place(b));
        let is_mixed = motion.has_mixed();
        let deepest = if is_mixed {
            MAX_HALVINGS_MIXED
        } else {
            MAX_HALVINGS
        };
        if depth < deepest && self.looks_left > 0 {
            let (p, q) = (Place::new(at_a, a), Place::new(at_b, b));
            let beyond = third.map(|t| Place::new(place(t), t));
            let is_doubtful =
                is_mixed || motion.is_unclear() || motion.may_touch(&p, &q, beyond.as_ref());
            if is_doubtful {
                let middle = stretch.fraction(0.5 * (at_a + at_b));
                let m = self.look(middle, Extent::Stability)?;
                self.scan_passages(stretch, (a, &m), Some(b), depth + 1)?;
                return self.scan_passages(stretch, (&m, b), Some(a), depth + 1);
            }
        }
        for path in &motion.paths {
            let kind = path.passage();
            let is_first_of_pair = path.from.im > 0.0 || (is_real(path.from) && path.to.im > 0.0);
            let counts = match kind {
                Passage::None | Passage::PlusOne => false,
                Passage::MinusOne => true,
                Passage::Pair | Passage::Mixed => is_first_of_pair,
            };
            if counts {
                self.locate_passage(stretch, (a, b), path)?;
            }
        }
        Ok(())
    }

    fn locate_passage(
        &mut self,
        stretch: &Stretch,
        (a, b): (&Look, &Look),
        path: &Pathway,
    ) -> Result<(), SolveError> {
        let ends = (stretch.abscissa(a.fraction), stretch.abscissa(b.fraction));
        let mut follower = Follower::new(ends, path);
        let (low, high) = (margin(path.from), margin(path.to));
        let mut seen = vec![(a.fraction, low), (b.fraction, high)];
        let sketch = roots::bracketed(
            |s| {
                let fraction = stretch.fraction(s);
                let look = self.look(fraction, Extent::Stability)?;
                let value = follower.margin(s, &look.survey.multipliers);
                seen.push((fraction, value));
                Ok::<f64, SolveError>(value)
            },
            (ends.0, low),
            (ends.1, high),
            SKETCH * (ends.1 - ends.0),
        )?;
        let guess = stretch.fraction(sketch.root);
        let spare = b.fraction - a.fraction;
        let target = Target {
            limits: (
                (a.fraction - spare).max(stretch.low),
                (b.fraction + spare).min(stretch.high),
            ),
            guess,
            slope: slope_near(&mut seen, guess),
            extent: Some(Extent::Stability),
        };
        let mut kind = kind_of(path, None);
        let found = self.locate(&target, |x, _, survey| {
            let multipliers = survey.map_or(&[][..], |s| &s.multipliers);
            let mu = follower.pick(stretch.abscissa(x), multipliers);
            kind = kind_of(path, mu);
            mu.map_or(f64::NAN, margin)
        })?;
        let Some(kind) = kind else {
            return Ok(());
        };
        // Between two interpolated places the corrected path has the last word.
        let is_sure = a.fraction == stretch.low && b.fraction == stretch.high;
        if !matches!(found, Found::Nothing) || is_sure {
            self.report(kind, (a.lambda, b.lambda), guess, found);
        }
        Ok(())
    }
}

/// What passes; a passage of +1 shows as a fold or a branch point of the path and is none here.
fn kind_of(path: &Pathway, at_root: Option<Complex<f64>>) -> Option<EventKind> {
    match (path.passage(), at_root) {
        (Passage::MinusOne, _) => Some(EventKind::PeriodDoubling),
        (Passage::Pair, _) => Some(EventKind::NeimarkSacker),
        (Passage::Mixed, Some(mu)) if is_real(mu) && mu.re < 0.0 => Some(EventKind::PeriodDoubling),
        (Passage::Mixed, Some(mu)) if !is_real(mu) => Some(EventKind::NeimarkSacker),
        (Passage::Mixed, None) => Some(EventKind::NeimarkSacker),
        _ => None,
    }
}

/// Slope between the two places nearest to an abscissa.
pub(super) fn slope_near(seen: &mut [(f64, f64)], x: f64) -> f64 {
    seen.sort_by(|a, b| (a.0 - x).abs().total_cmp(&(b.0 - x).abs()));
    let (p, q) = (seen[0], seen[1]);
    (q.1 - p.1) / (q.0 - p.0)
}
