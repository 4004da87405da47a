//! What the last terms of a series say: how far it reaches, and when it is long enough.

use crate::numeric::taylor::Polynomial;

/// Whether the terms of a series count in the time that remains.
pub struct Ending {
    remaining: f64,
    tolerance: f64,
    size: f64,
    before: f64,
    power: f64,
}

impl Ending {
    /// For a time in units of the series and an error relative to the motion.
    pub fn new(remaining: f64, tolerance: f64) -> Ending {
        Ending {
            remaining,
            tolerance,
            size: f64::MIN_POSITIVE,
            before: f64::INFINITY,
            power: remaining * remaining,
        }
    }

    /// After term k + 2, whose modulus is given.
    pub fn is_reached(&mut self, k: usize, q: &[Polynomial], largest: f64) -> bool {
        if !self.power.is_finite() {
            return false;
        }
        if k + 3 == SIZE_TERMS {
            self.size = size(q, self.remaining.min(1.0));
        }
        let term = largest * self.power * (k + 2) as f64;
        let last = term.max(self.before);
        (self.before, self.power) = (term, self.power * self.remaining);
        k + 3 > SIZE_TERMS && last <= self.tolerance * self.size
    }
}

/// Largest theta at which the last two of so many terms, as rates, are negligible beside the first ones at a scale of time.
fn reach_at(list: &[Polynomial], count: usize, (negligible, pace): (f64, f64)) -> f64 {
    let mut last = 0.0_f64;
    let power = match pace == 1.0 {
        true => 1.0,
        false => pace.powi(count as i32 - 2),
    };
    for q in list {
        let (a, b) = (q[count - 2].abs(), pace * q[count - 1].abs());
        last = last.max(power * a.max(b));
    }
    // last (count - 1) theta^power = negligible size, with the power that gives the shorter step.
    let ratio = negligible * size(list, pace) / ((count - 1) as f64 * last);
    let power = if ratio < 1.0 { count - 3 } else { count - 2 };
    pace * ratio.powf(1.0 / power as f64).min(MAX_REACH)
}

/// The same with exact series, for which the unit of time of the contact state is the scale.
pub fn reach_of_closed_form(list: &[Polynomial], count: usize, pace: f64) -> f64 {
    reach_at(list, count, (NEGLIGIBLE, pace))
}

/// The same where the step itself is the scale: near a pole the terms grow whatever the unit, and only what the first ones add up to
/// within the step is the motion.
///
///     last theta^(count - 1) (count - 1) <= tolerance max_k |c_k| theta^k,   k < 5, theta <= 1
pub fn reach_within(list: &[Polynomial], count: usize, tolerance: f64) -> f64 {
    let mut theta = reach_at(list, count, (tolerance, 1.0));
    let mut last = 0.0_f64;
    for q in list {
        last = last.max(q[count - 2].abs().max(q[count - 1].abs()));
    }
    for _ in 0..ROUNDS {
        if theta >= 1.0 {
            break;
        }
        let ratio = tolerance * size(list, theta) / ((count - 1) as f64 * last);
        let next = ratio.powf(1.0 / (count - 2) as f64).min(theta);
        if next > CLOSE * theta {
            return next;
        }
        theta = next;
    }
    theta
}

/// Largest of the first terms at theta.
fn size(list: &[Polynomial], theta: f64) -> f64 {
    let mut size = f64::MIN_POSITIVE;
    for q in list {
        let mut power = 1.0;
        for c in &q[..SIZE_TERMS] {
            size = size.max(power * c.abs());
            power *= theta;
        }
    }
    size
}

/// Rounds of the fixed-point iteration for a step, and the ratio of two at which it ends.
const ROUNDS: usize = 40;
const CLOSE: f64 = 0.9;
/// Terms that measure the size of the motion.
pub const SIZE_TERMS: usize = 5;
/// The last terms are below this share of the motion; the first one left out is about a tenth of them, below rounding.
const NEGLIGIBLE: f64 = 1e-15;
/// Longest step in units of time: the polynomials of a slow system would reach for ever.
const MAX_REACH: f64 = 1e3;
