//! Where trajectories side by side leave their regions.

use super::{Each, LANES, Lanes, larger};
use crate::numeric::bernstein::{Direction, evaluate_each};
use crate::numeric::newtons::Newtons;
use crate::numeric::outline::{Gate, Outline, Outlook};
use crate::numeric::taylor::COUNT;
use pulp::Simd;

/// The first crossing of a trajectory on a step.
#[derive(Clone, Copy)]
pub(super) struct LaneCrossing {
    pub theta: f64,
    pub line: usize,
    pub direction: Direction,
}

/// Passages whose roots are sought, of one connection, at most one of every lane.
struct Pending {
    newton: Newtons<LANES>,
    direction: [Direction; LANES],
    is_there: [bool; LANES],
}

impl<const N: usize> Lanes<N> {
    /// The first crossing of every lane.
    #[inline(always)]
    pub(super) fn crossings<S: Simd>(
        &mut self,
        simd: S,
        step: &Each,
    ) -> [Option<LaneCrossing>; LANES] {
        fill(&mut self.powers, step);
        let mut size = [0.0; LANES];
        for motion in &self.motion {
            for l in 0..LANES {
                size[l] = larger(size[l], larger(motion[0][l].abs(), motion[1][l].abs()));
            }
        }
        let mut first = [None; LANES];
        for number in 0..self.tables.lines.len() {
            self.scale(number);
            let mut pending = self.passages(simd, (number, step, &size), &mut first);
            pending.settle(simd, &self.scaled);
            for l in (0..LANES).filter(|l| pending.is_there[*l]) {
                note(
                    &mut first[l],
                    pending.newton.x[l] * step[l],
                    number,
                    pending.direction[l],
                );
            }
        }
        first
    }

    /// Coefficients of a deformation in powers of the share of the step.
    #[inline(always)]
    fn scale(&mut self, number: usize) {
        let motion = &self.motion[self.tables.lines[number].connection];
        for (k, out) in self.scaled.iter_mut().enumerate() {
            for l in 0..LANES {
                out[l] = motion[k][l] * self.powers[k][l];
            }
        }
    }

    /// Passages of the borders of a connection: those with roots still to be found; the others are noted.
    #[inline(always)]
    fn passages<S: Simd>(
        &mut self,
        simd: S,
        (number, step, size): (usize, &Each, &Each),
        first: &mut [Option<LaneCrossing>; LANES],
    ) -> Pending {
        let line = &self.tables.lines[number];
        let outline = Outline::new(&self.scaled);
        let (least, largest) = outline.hull();
        let mut starts = self.scaled[0];
        let mut pending = Pending {
            newton: Newtons::default(),
            direction: [Direction::Up; LANES],
            is_there: [false; LANES],
        };
        let borders = [
            (&self.low[number], Direction::Down, &least),
            (&self.high[number], Direction::Up, &largest),
        ];
        for (level, direction, extreme) in borders {
            let mut tolerance = [0.0; LANES];
            for l in 0..LANES {
                tolerance[l] = line.tolerance(level[l], size[l]);
            }
            let gate = |l: usize| Gate {
                level: level[l],
                direction,
                tolerance: tolerance[l],
            };
            let mut reaches = [false; LANES];
            for l in 0..LANES {
                reaches[l] = !gate(l).is_out_of_reach(extreme[l]);
            }
            if reaches == [false; LANES] {
                continue;
            }
            let survey = outline.survey(simd, direction, (level, &tolerance));
            for l in (0..LANES).filter(|l| reaches[*l]) {
                match survey.look(l) {
                    Outlook::Never => {}
                    Outlook::Once { guess, start } if !pending.is_there[l] => {
                        pending.newton.seek(l, guess);
                        (pending.direction[l], pending.is_there[l]) = (direction, true);
                        starts[l] = direction.sign() * start;
                    }
                    look => {
                        let mut polynomial = [0.0; COUNT];
                        for (out, c) in polynomial.iter_mut().zip(&self.scaled) {
                            *out = c[l];
                        }
                        if let Some(x) = look.resolve(gate(l), || polynomial) {
                            note(&mut first[l], x * step[l], number, direction);
                        }
                    }
                }
            }
        }
        self.scaled[0] = starts;
        pending
    }
}

impl Pending {
    /// Newton's method for all lanes at once.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S, scaled: &[Each; COUNT]) {
        let mut sign = [0.0; LANES];
        for (sign, direction) in sign.iter_mut().zip(&self.direction) {
            *sign = direction.sign();
        }
        while !self.newton.is_over() {
            let (mut value, mut slope) = evaluate_each(simd, scaled, &self.newton.x);
            for l in 0..LANES {
                (value[l], slope[l]) = (sign[l] * value[l], sign[l] * slope[l]);
            }
            self.newton.step(simd, (&value, &slope));
        }
    }
}

/// Keeps the earlier crossing.
#[inline(always)]
fn note(first: &mut Option<LaneCrossing>, theta: f64, line: usize, direction: Direction) {
    if first.is_none_or(|f| theta < f.theta) {
        *first = Some(LaneCrossing {
            theta,
            line,
            direction,
        });
    }
}

/// theta^k of every lane.
#[inline(always)]
fn fill(powers: &mut [Each; COUNT], theta: &Each) {
    powers[0] = [1.0; LANES];
    powers[1] = *theta;
    powers[2] = theta.map(|t| t * t);
    for l in 0..LANES {
        powers[3][l] = powers[2][l] * theta[l];
    }
    let factor = powers[2].map(|p| p * p);
    for k in 4..COUNT {
        for l in 0..LANES {
            powers[k][l] = powers[k - 4][l] * factor[l];
        }
    }
}
