//! What the last terms of a series say: how far it reaches, and when it is long enough.

use crate::numeric::roots::root_below;
use crate::numeric::taylor::Polynomial;

/// What the terms of a series are judged by, where the flow is not a closed form.
///
/// The motion and its error are measured as rates. A force far faster than the motion makes the unit of time short: beside q, the
/// change of a velocity per unit of time would be small whatever it is beside the velocity.
#[derive(Debug, Clone, Copy)]
pub struct SeriesControl {
    /// Error of a step relative to the motion.
    pub tolerance: f64,
    /// Rate per unit of time of the series that counts like a deflection of 1.
    pub share: f64,
}

impl SeriesControl {
    /// For a unit of time in omega_c t.
    pub fn new(tolerance: f64, unit: f64) -> SeriesControl {
        SeriesControl {
            tolerance,
            share: unit.min(1.0),
        }
    }

    /// Size of the motion at theta: of its rates from the first terms, and of what it is.
    fn size(&self, list: &[Polynomial], theta: f64) -> f64 {
        let mut size = f64::MIN_POSITIVE;
        for q in list {
            size = size.max(self.share * q[0].abs());
            let mut power = 1.0;
            for (k, c) in q.iter().enumerate().take(SIZE_TERMS).skip(1) {
                size = size.max(power * k as f64 * c.abs());
                power *= theta;
            }
        }
        size
    }
}

/// Whether the terms of a series count in the time that remains.
pub(crate) struct DecayEnd {
    remaining: f64,
    control: SeriesControl,
    size: f64,
    before: f64,
    power: f64,
}

impl DecayEnd {
    /// For a time in units of the series.
    pub fn new(remaining: f64, control: SeriesControl) -> DecayEnd {
        DecayEnd {
            remaining,
            control,
            size: f64::MIN_POSITIVE,
            before: f64::INFINITY,
            power: remaining,
        }
    }

    /// After term k + 2, whose modulus is given.
    pub(crate) fn is_reached(&mut self, k: usize, q: &[Polynomial], largest: f64) -> bool {
        if !self.power.is_finite() {
            return false;
        }
        if k + 3 == SIZE_TERMS {
            self.size = self.control.size(q, self.remaining.min(1.0));
        }
        let term = largest * self.power * (k + 2) as f64;
        let last = term.max(self.before);
        (self.before, self.power) = (term, self.power * self.remaining);
        k + 3 > SIZE_TERMS && last <= self.control.tolerance * self.size
    }
}

/// Largest theta at which the last two of a number of terms, as rates, are negligible beside the first ones at a scale of time.
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
    pace * root_below(ratio, 1.0 / power as f64).min(MAX_REACH)
}

/// The length for exact series, where the unit of time of the contact state is the scale.
pub(crate) fn reach_of_closed_form(list: &[Polynomial], count: usize, pace: f64) -> f64 {
    reach_at(list, count, (NEGLIGIBLE, pace))
}

/// The same where the step itself is the scale: near a pole the terms grow whatever the unit, and only what the first ones add up to
/// within the step is the motion.
///
/// ```text
/// last theta^(count - 2) (count - 1) <= tolerance size(theta),   theta <= 1
/// ```
pub(crate) fn reach_within(list: &[Polynomial], count: usize, control: SeriesControl) -> f64 {
    let mut last = 0.0_f64;
    for q in list {
        last = last.max(q[count - 2].abs().max(q[count - 1].abs()));
    }
    let ratio =
        |theta: f64| control.tolerance * control.size(list, theta) / ((count - 1) as f64 * last);
    let first = ratio(1.0);
    let power = if first < 1.0 { count - 3 } else { count - 2 };
    let mut theta = root_below(first, 1.0 / power as f64).min(MAX_REACH);
    for _ in 0..ROUNDS {
        if theta >= 1.0 {
            break;
        }
        let next = root_below(ratio(theta), 1.0 / (count - 3) as f64).min(theta);
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
pub(crate) const SIZE_TERMS: usize = 5;
/// The last terms are below this share of the motion; the first one left out is about a tenth of them, below rounding.
pub(super) const NEGLIGIBLE: f64 = 1e-15;
/// Longest step in units of time: the polynomials of a slow system would reach for ever.
pub(super) const MAX_REACH: f64 = 1e3;
