//! Where a function of one variable turns, from its values and slopes: at smooth tops and at corners, as those of sampled forces.

use super::roots::Bracketed;

/// A function at one abscissa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sloped {
    /// The abscissa.
    pub x: f64,
    /// The function.
    pub value: f64,
    /// Its derivative.
    pub slope: f64,
}

/// Slope at a candidate over the one that it replaces, above which there is a corner in between.
const STEEP: f64 = 0.3;
/// Evaluations within which the interval must halve; else it is bisected.
const PATIENCE: usize = 4;
/// Candidates this far outside, in lengths of the interval, are rounded ones beside its end.
const OUTSIDE: f64 = 0.1;
/// Curvature of a side, in changes of slope over the interval, above which a corner has made it.
const STRAIGHT: f64 = 0.5;
/// Steps that solve for the intersection of two parabolas.
const POLISH: usize = 3;
/// Where candidates stay on one side: their distance from its end, and the geometric mean of width and interval, times this are stepped over.
const ONWARD: (f64, f64) = (2.0, 3.0);

/// The turn of f between two abscissae with slopes of opposite sign, to an absolute width, first looked for at a guess. Smooth tops are
/// met by interpolants of value and slope, corners by the intersection of both sides continued.
///
/// `f` returns value and slope, or fails: its error ends the search.
///
/// # Errors
/// Whatever `f` returns.
pub(crate) fn turning<E>(
    mut f: impl FnMut(f64) -> Result<(f64, f64), E>,
    (low, high): (Sloped, Sloped),
    guess: f64,
    width: f64,
) -> Result<Bracketed, E> {
    let mut search = Search {
        low: (low, None),
        high: (high, None),
        last: None,
        halved: high.x - low.x,
        since: 0,
    };
    let mut x = guess;
    loop {
        let (low, high) = (search.low.0.x, search.high.0.x);
        // At least half the width from both ends: the end of a search encloses the turn.
        let margin = (0.5 * width).min(0.25 * (high - low));
        x = x.clamp(low + margin, high - margin);
        let (value, slope) = f(x)?;
        let here = Sloped { x, value, slope };
        match search.next(here, width) {
            Some(next) => x = next,
            None => return Ok(search.result(here)),
        }
    }
}

/// The interval that holds the turn, and what was seen on both sides of it.
struct Search {
    /// End, and the place that was the end before.
    low: (Sloped, Option<Sloped>),
    high: (Sloped, Option<Sloped>),
    /// The last place, and whether it has become the lower end.
    last: Option<(Sloped, bool)>,
    /// Length of the interval when it had last halved, and evaluations since.
    halved: f64,
    since: usize,
}

impl Search {
    /// Takes the function at a place; the next place, or `None` at the end.
    fn next(&mut self, here: Sloped, width: f64) -> Option<f64> {
        let is_low = (here.slope > 0.0) == (self.low.0.slope > 0.0);
        let side = if is_low {
            &mut self.low
        } else {
            &mut self.high
        };
        let replaced = std::mem::replace(&mut side.0, here);
        side.1 = Some(replaced);
        let (low, high) = (self.low.0, self.high.0);
        let length = high.x - low.x;
        if here.slope == 0.0 || length <= width.max(4.0 * f64::EPSILON * here.x.abs()) {
            return None;
        }
        self.since += 1;
        let is_stuck = self.since >= PATIENCE && length > 0.5 * self.halved;
        if is_stuck || length <= 0.5 * self.halved {
            (self.halved, self.since) = (length, 0);
        }
        let same = self.last.filter(|last| last.1 == is_low);
        self.last = Some((here, is_low));
        let is_near = |x: &f64| *x > low.x - OUTSIDE * length && *x < high.x + OUTSIDE * length;
        let candidate = match (here.slope / replaced.slope).abs() > STEEP {
            _ if is_stuck => None,
            true => self.intersection(),
            false => {
                same.map(|(before, _)| secant(&before, &here))
                    .filter(is_near)
            }
            .or_else(|| top_of_cubic(&low, &high)),
        };
        let Some(x) = candidate.filter(is_near) else {
            return Some(0.5 * (low.x + high.x));
        };
        if same.is_none() {
            return Some(x);
        }
        // The other end, far away, decides how good candidates are: it is brought nearer.
        let onward = if is_low { 1.0 } else { -1.0 };
        let stride = (ONWARD.0 * (x - here.x).abs()).max(ONWARD.1 * (width * length).sqrt());
        Some(here.x + onward * stride.min(0.5 * length))
    }

    /// Where the two sides meet, each continued with its slope and, where it is known, its curvature.
    fn intersection(&self) -> Option<f64> {
        let ((a, _), (b, _)) = (self.low, self.high);
        let length = b.x - a.x;
        let limit = STRAIGHT * (a.slope - b.slope).abs() / length;
        let curvature = |(end, before): &(Sloped, Option<Sloped>)| {
            let bend = before.map(|before| (end.slope - before.slope) / (end.x - before.x));
            bend.filter(|bend| bend.abs() < limit)
        };
        let known = [curvature(&self.low), curvature(&self.high)];
        // One side's is a better guess at the other's than none.
        let bends = [known[0].or(known[1]), known[1].or(known[0])].map(|bend| bend.unwrap_or(0.0));
        let mut x = (b.value - a.value - b.slope * length) / (a.slope - b.slope);
        for _ in 0..POLISH {
            let y = x - length;
            let gap = a.value - b.value + x * (a.slope + 0.5 * bends[0] * x)
                - y * (b.slope + 0.5 * bends[1] * y);
            x -= gap / (a.slope + bends[0] * x - b.slope - bends[1] * y);
        }
        x.is_finite().then_some(a.x + x)
    }

    /// What the search has brought when it ends at a place.
    fn result(&self, here: Sloped) -> Bracketed {
        let (low, high) = (self.low.0, self.high.0);
        let flatter = match low.slope.abs() < high.slope.abs() {
            _ if here.slope == 0.0 => here.x,
            true => low.x,
            false => high.x,
        };
        Bracketed {
            root: flatter,
            low: low.x,
            high: high.x,
        }
    }
}

/// Where the slope through two places vanishes.
fn secant(a: &Sloped, b: &Sloped) -> f64 {
    b.x - b.slope * (b.x - a.x) / (b.slope - a.slope)
}

/// Where the cubic with the values and slopes of two places turns, these slopes being of opposite sign.
fn top_of_cubic(a: &Sloped, b: &Sloped) -> Option<f64> {
    let length = b.x - a.x;
    let slope = slope_of_cubic((length * a.slope, length * b.slope), b.value - a.value);
    let inside = turns_of_cubic(slope)
        .into_iter()
        .find(|x| *x > -OUTSIDE && *x < 1.0 + OUTSIDE);
    inside.map(|x| a.x + length * x)
}

/// Coefficients of 1, x, x^2 of the slope of the cubic over 0..1 with these slopes at its ends and this rise between them.
pub(crate) fn slope_of_cubic((from, to): (f64, f64), rise: f64) -> [f64; 3] {
    [
        from,
        6.0 * rise - 4.0 * from - 2.0 * to,
        3.0 * (from + to) - 6.0 * rise,
    ]
}

/// Where a slope with these coefficients of 1, x, x^2 vanishes; not a number where it does not.
pub(crate) fn turns_of_cubic([c0, c1, c2]: [f64; 3]) -> [f64; 2] {
    let root = (c1 * c1 - 4.0 * c0 * c2).sqrt();
    // The form without cancellation.
    let q = -0.5 * (c1 + root.copysign(c1));
    [q / c2, c0 / q]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// The turn of a function between 0 and 1 and the number of evaluations.
    fn turn_of(f: impl Fn(f64) -> (f64, f64), guess: f64) -> (Bracketed, usize) {
        let at = |x: f64| {
            let (value, slope) = f(x);
            Sloped { x, value, slope }
        };
        let mut calls = 0;
        let counted = |x| {
            calls += 1;
            Ok::<_, Infallible>(f(x))
        };
        let found = turning(counted, (at(0.0), at(1.0)), guess, 1e-9).unwrap();
        (found, calls)
    }

    #[test]
    fn smooth_tops_take_few_values() {
        let f = |x: f64| ((3.0 * x - 1.0).cos(), -3.0 * (3.0 * x - 1.0).sin());
        let (found, calls) = turn_of(f, 0.3);
        assert!(found.low <= 1.0 / 3.0 && found.high >= 1.0 / 3.0 && calls <= 8);
        assert!((found.root - 1.0 / 3.0).abs() <= 1e-9, "{found:?}");
        // A bottom as well, and one of fourth order, which no cubic has.
        let g = |x: f64| ((x - 0.7).powi(4), 4.0 * (x - 0.7).powi(3));
        let (found, calls) = turn_of(g, 0.1);
        assert!(
            (found.root - 0.7).abs() < 1e-9 && calls <= 70,
            "{found:?} {calls}"
        );
    }

    #[test]
    fn corners_are_met_by_their_tangents() {
        let corner = |x: f64| match x < 0.41 {
            true => (1.3 * x + 0.2 * x * x, 1.3 + 0.4 * x),
            false => {
                let top = 1.3 * 0.41 + 0.2 * 0.41 * 0.41;
                let y = x - 0.41;
                (top - 9.0 * y + y * y, -9.0 + 2.0 * y)
            }
        };
        for guess in [0.01, 0.41, 0.5, 0.99] {
            let (found, calls) = turn_of(corner, guess);
            assert!(found.low <= 0.41 && found.high >= 0.41, "{found:?}");
            assert!(
                found.high - found.low <= 1e-9 && calls <= 10,
                "{guess} {calls}"
            );
        }
        // Many corners of one ripple: each is a top, and one of them is found.
        let ripple = |x: f64| {
            (
                -(x - 0.6).powi(2) + 0.002 * (90.0 * x).sin(),
                -2.0 * (x - 0.6) + 0.18 * (90.0 * x).cos(),
            )
        };
        let (found, calls) = turn_of(ripple, 0.6);
        assert!(
            ripple(found.low).1 > 0.0 && ripple(found.high).1 < 0.0 && calls <= 40,
            "{calls}"
        );
    }
}
