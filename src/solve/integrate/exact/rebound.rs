//! Flights from rigid stops, followed by their own length so that the shortest ones keep their digits.

use super::ROUNDING;
use crate::numeric::bernstein::{Direction, evaluate, first_passage};
use crate::numeric::taylor::{COUNT, Polynomial};

/// Share of the motion beyond which a flight needs no length of its own.
const FAR: f64 = 1e-6;

/// A flight that began on a stop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rebound {
    /// Way out.
    pub direction: Direction,
    /// Distance from the stop, with digits of its own.
    pub gap: f64,
}

impl Rebound {
    pub(crate) fn new(direction: Direction) -> Rebound {
        Rebound {
            direction,
            gap: 0.0,
        }
    }

    /// The flight after theta of a step, given the coefficients of the deformation; `None` far from the stop. `size`: of the motion.
    pub(crate) fn after(self, deformation: &Polynomial, theta: f64, size: f64) -> Option<Rebound> {
        let mut course = *deformation;
        course[0] = 0.0;
        let moved = self.direction.sign() * evaluate(&course, theta).0;
        let gap = (self.gap - moved).max(0.0);
        (gap <= FAR * size).then_some(Rebound { gap, ..self })
    }

    /// First x in [0, 1] at which the deformation, in powers of x, is back at the stop. `least`: change of it that is nothing.
    pub(crate) fn ends(self, deformation: &Polynomial, least: f64) -> Option<f64> {
        if self.gap == 0.0 {
            // The level is taken out: the rate along the way.
            let next = |k: usize| deformation.get(k + 1).copied().unwrap_or(0.0);
            return self.passage(&std::array::from_fn::<f64, COUNT, _>(next), least);
        }
        let sign = self.direction.sign();
        let mut course = *deformation;
        course[0] = -sign * self.gap;
        // The time in which rate and acceleration alone close the gap.
        let (rate, half) = (sign * course[1], sign * course[2]);
        let root = (rate * rate + 4.0 * half * self.gap).sqrt();
        let time = match rate > 0.0 {
            true => 2.0 * self.gap / (rate + root),
            false => (root - rate) / (2.0 * half),
        };
        let is_early = time > 0.0 && time < 0.25;
        let soon = is_early.then(|| {
            let (mut head, mut power) = (course, 1.0);
            for c in &mut head {
                *c *= power;
                power *= 2.0 * time;
            }
            Some(2.0 * time * self.passage(&head, 0.0)?)
        });
        soon.flatten().or_else(|| self.passage(&course, least))
    }

    fn passage(self, course: &Polynomial, least: f64) -> Option<f64> {
        let size = course.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        first_passage(course, 0.0, self.direction, (ROUNDING * size).max(least))
    }
}
