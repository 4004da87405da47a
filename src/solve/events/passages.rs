//! Multipliers that pass the unit circle between two places of a step.

use super::locate::{Found, Target};
use super::spectrum::{Motion, Passage, Place, is_real};
use super::{EventKind, Look, Step};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::residual::Extent;
use num_complex::Complex;

/// Halvings of a stretch in which the multipliers move too far for one look.
const MAX_HALVINGS: usize = 7;
/// The same where more than one thing passes, or a pair becomes real near the circle: what passes first, and as what, takes a
/// close look.
const MAX_HALVINGS_CROWDED: usize = 16;
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

/// What passes the circle in a stretch, as far as the matching tells.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    doublings: usize,
    pairs: usize,
    /// Multipliers that pass and change between real and complex on the way.
    mixed: usize,
}

impl Tally {
    fn of(motion: &Motion) -> Tally {
        let mut tally = Tally::default();
        for path in &motion.paths {
            match path.passage() {
                // A passage of +1 shows as a fold or a branch point of the path.
                Passage::None | Passage::PlusOne => {}
                Passage::MinusOne => tally.doublings += 1,
                Passage::Pair => tally.pairs += usize::from(path.from.im > 0.0),
                Passage::Mixed => tally.mixed += 1,
            }
        }
        tally
    }

    /// Whether a test function may have more than one root. A single multiplier that passes and changes its kind is no
    /// trouble: it shows in the functions that it turns round.
    fn is_crowded(&self) -> bool {
        self.doublings + self.mixed > 1 || self.pairs + self.mixed > 1
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
        let tally = Tally::of(&motion);
        let place = |look: &Look| stretch.abscissa(look.fraction);
        let (at_a, at_b) = (place(a), place(b));
        let deepest = match tally.is_crowded() {
            true => MAX_HALVINGS_CROWDED,
            false => MAX_HALVINGS,
        };
        if depth < deepest && self.looks_left > 0 {
            let (p, q) = (Place::new(at_a, a), Place::new(at_b, b));
            let beyond = third.map(|t| Place::new(place(t), t));
            let is_doubtful = tally.is_crowded()
                || motion.is_unclear()
                || motion.may_touch(&p, &q, beyond.as_ref());
            if is_doubtful {
                let middle = stretch.fraction(0.5 * (at_a + at_b));
                let m = self.look(middle, Extent::Stability)?;
                self.scan_passages(stretch, (a, &m), Some(b), depth + 1)?;
                return self.scan_passages(stretch, (&m, b), Some(a), depth + 1);
            }
        }
        let changes = |test: Test| {
            test.value(&a.survey.multipliers) * test.value(&b.survey.multipliers) < 0.0
        };
        for (test, together, count) in [
            (
                Test::Doubling,
                Test::Doublings(tally.doublings),
                tally.doublings,
            ),
            (Test::Pairing, Test::Pairings(tally.pairs), tally.pairs),
        ] {
            if changes(test) && count + tally.mixed > 0 {
                self.locate_passage(stretch, (a, b), test)?;
            } else if count > 1 && changes(together) {
                self.locate_passage(stretch, (a, b), together)?;
            } else if count > 0 {
                self.report(test.kind(), (a.lambda, b.lambda), a.fraction, Found::Lost);
            }
        }
        Ok(())
    }

    fn locate_passage(
        &mut self,
        stretch: &Stretch,
        (a, b): (&Look, &Look),
        test: Test,
    ) -> Result<(), SolveError> {
        let ends = (stretch.abscissa(a.fraction), stretch.abscissa(b.fraction));
        let values = [a, b].map(|look| test.value(&look.survey.multipliers));
        let mut seen = vec![(a.fraction, values[0]), (b.fraction, values[1])];
        let sketch = roots::bracketed(
            |s| {
                let fraction = stretch.fraction(s);
                let look = self.look(fraction, Extent::Stability)?;
                let value = test.value(&look.survey.multipliers);
                seen.push((fraction, value));
                Ok::<f64, SolveError>(value)
            },
            (ends.0, values[0]),
            (ends.1, values[1]),
            SKETCH * (ends.1 - ends.0),
        )?;
        let guess = stretch.fraction(sketch.root);
        let is_whole = a.fraction == stretch.low && b.fraction == stretch.high;
        let target = Target {
            limits: (stretch.low, stretch.high),
            guess,
            slope: slope_near(&mut seen, guess),
            extent: Some(Extent::Stability),
            values: is_whole.then_some(((a.fraction, values[0]), (b.fraction, values[1]))),
        };
        let found = self.locate(&target, |_, _, survey| {
            survey.map_or(f64::NAN, |s| test.value(&s.multipliers))
        })?;
        let largest = values[0].abs().max(values[1].abs());
        let is_event = match &found {
            Found::Root(root) => root.survey.as_ref().is_some_and(|s| {
                root.value.abs() < VANISHES * largest && test.holds(&s.multipliers)
            }),
            // Between two interpolated places the corrected path has the last word.
            Found::Nothing => is_whole,
            Found::Lost => true,
        };
        if is_event {
            self.report(test.kind(), (a.lambda, b.lambda), guess, found);
        }
        Ok(())
    }
}

/// Functions of all multipliers together that change their sign where some pass the circle: smooth also where two of them meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Test {
    /// det(Phi + I) = product of (mu_i + 1).
    Doubling,
    /// Product of (1 - mu_i mu_j) over all pairs i < j: small multipliers that are not listed do not change its sign.
    Pairing,
    /// Mean of mu + 1 over so many multipliers nearest to -1: where equal ones pass together, as those of equal parts in a
    /// symmetric system do, the product keeps its sign.
    Doublings(usize),
    /// Mean of |mu| - 1 over so many complex pairs nearest to the circle, for the same reason.
    Pairings(usize),
}

/// Value of a test function at a root, relative to its largest at the ends: above it the function jumps there.
const VANISHES: f64 = 1e-3;

impl Test {
    /// Value, every factor divided by its largest possible size.
    fn value(self, multipliers: &[Complex<f64>]) -> f64 {
        let product: Complex<f64> = match self {
            Test::Doubling => multipliers
                .iter()
                .map(|mu| (mu + 1.0) / (1.0 + mu.norm()))
                .product(),
            Test::Pairing => pairs(multipliers)
                .map(|(mu, nu)| (1.0 - mu * nu) / (1.0 + mu.norm() * nu.norm()))
                .product(),
            Test::Doublings(count) => {
                let gaps = multipliers.iter().map(|mu| mu + 1.0);
                return mean_of_smallest(gaps.map(|z| (z.norm(), z.re)), count);
            }
            Test::Pairings(count) => {
                let upper = multipliers
                    .iter()
                    .filter(|mu| !is_real(**mu) && mu.im > 0.0);
                let gaps = upper.map(|mu| mu.norm() - 1.0);
                return mean_of_smallest(gaps.map(|x| (x.abs(), x)), count);
            }
        };
        product.re
    }

    /// Whether the multipliers at a root are those of the event: two real ones whose product is 1 are a neutral saddle.
    fn holds(self, multipliers: &[Complex<f64>]) -> bool {
        let gap = |p: &(Complex<f64>, Complex<f64>)| (p.0 * p.1 - 1.0).norm();
        let nearest = || pairs(multipliers).min_by(|p, q| gap(p).total_cmp(&gap(q)));
        match self {
            Test::Doubling | Test::Doublings(_) | Test::Pairings(_) => true,
            Test::Pairing => nearest().is_some_and(|(mu, _)| !is_real(mu)),
        }
    }

    fn kind(self) -> EventKind {
        match self {
            Test::Doubling | Test::Doublings(_) => EventKind::PeriodDoubling,
            Test::Pairing | Test::Pairings(_) => EventKind::NeimarkSacker,
        }
    }
}

/// Mean of the values with the smallest sizes, of (size, value).
fn mean_of_smallest(list: impl Iterator<Item = (f64, f64)>, count: usize) -> f64 {
    let mut list: Vec<(f64, f64)> = list.collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    list.truncate(count);
    list.iter().map(|x| x.1).sum::<f64>() / list.len() as f64
}

fn pairs(list: &[Complex<f64>]) -> impl Iterator<Item = (Complex<f64>, Complex<f64>)> {
    let later = |i: usize| list[i + 1..].iter().copied();
    (0..list.len()).flat_map(move |i| later(i).map(move |nu| (list[i], nu)))
}

/// Slope between the two places nearest to an abscissa.
pub(super) fn slope_near(seen: &mut [(f64, f64)], x: f64) -> f64 {
    seen.sort_by(|a, b| (a.0 - x).abs().total_cmp(&(b.0 - x).abs()));
    let (p, q) = (seen[0], seen[1]);
    (q.1 - p.1) / (q.0 - p.0)
}
