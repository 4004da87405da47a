//! Where trajectories side by side leave their regions.

use super::{Each, LANES, Lanes, larger};
use crate::numeric::bernstein::{Direction, evaluate_each};
use crate::numeric::outline::{Gate, Look, Outline};
use crate::numeric::roots::Newton;
use crate::numeric::taylor::COUNT;

/// The first crossing of a trajectory on a step.
#[derive(Clone, Copy)]
pub(super) struct Crossing {
    pub theta: f64,
    pub line: usize,
    pub direction: Direction,
}

/// A passage whose root is sought.
#[derive(Clone, Copy)]
struct Pending {
    newton: Newton,
    direction: Direction,
    /// First coefficient, without the level.
    start: f64,
}

impl<const N: usize> Lanes<N> {
    /// The first crossing of every lane.
    #[inline(always)]
    pub(super) fn crossings(&mut self, step: &Each) -> [Option<Crossing>; LANES] {
        fill(&mut self.powers, step);
        let mut size = [0.0; LANES];
        for motion in &self.motion {
            for l in 0..LANES {
                size[l] = larger(size[l], larger(motion[0][l].abs(), motion[1][l].abs()));
            }
        }
        let mut first = [None; LANES];
        for number in 0..self.tables.lines.len() {
            let mut pending = self.passages(number, step, &size, &mut first);
            settle(&mut pending, &mut self.scaled);
            for l in 0..LANES {
                if let Some(p) = &pending[l] {
                    note(&mut first[l], p.newton.x * step[l], number, p.direction);
                }
            }
        }
        first
    }

    /// Passages of the borders of a connection: those with roots still to be found; the others are noted.
    #[inline(always)]
    fn passages(
        &mut self,
        number: usize,
        step: &Each,
        size: &Each,
        first: &mut [Option<Crossing>; LANES],
    ) -> [Option<Pending>; LANES] {
        let line = &self.tables.lines[number];
        let motion = &self.motion[line.connection];
        for (k, out) in self.scaled.iter_mut().enumerate() {
            for l in 0..LANES {
                out[l] = motion[k][l] * self.powers[k][l];
            }
        }
        let outline = Outline::new(&self.scaled);
        let (least, largest) = outline.hull();
        let mut pending = [None; LANES];
        for l in 0..LANES {
            let borders = [
                (self.low[number][l], Direction::Down, least[l]),
                (self.high[number][l], Direction::Up, largest[l]),
            ];
            for (level, direction, extreme) in borders {
                let gate = Gate {
                    level,
                    direction,
                    tolerance: line.tolerance(level, size[l]),
                };
                if gate.is_out_of_reach(extreme) {
                    continue;
                }
                let look = outline.look(l, gate);
                match look {
                    Look::Once { guess, start } if pending[l].is_none() => {
                        pending[l] = Some(Pending {
                            newton: Newton::new(guess, (0.0, -1.0), 1.0),
                            direction,
                            start: direction.sign() * start,
                        });
                    }
                    Look::Never => {}
                    Look::Once { .. } | Look::Unclear => {
                        let polynomial = self.scaled.map(|c| c[l]);
                        if let Some(x) = look.resolve(gate, || polynomial) {
                            note(&mut first[l], x * step[l], number, direction);
                        }
                    }
                }
            }
        }
        pending
    }
}

/// Newton's method for all lanes at once.
#[inline(always)]
fn settle(pending: &mut [Option<Pending>; LANES], scaled: &mut [Each; COUNT]) {
    let (mut x, mut sought, mut count) = ([0.5; LANES], [false; LANES], 0);
    for l in 0..LANES {
        if let Some(p) = &pending[l] {
            scaled[0][l] = p.start;
            (x[l], sought[l]) = (p.newton.x, true);
            count += 1;
        }
    }
    while count > 0 {
        let (value, slope) = evaluate_each(scaled, &x);
        for l in 0..LANES {
            let Some(p) = pending[l].as_mut().filter(|_| sought[l]) else {
                continue;
            };
            let sign = p.direction.sign();
            if p.newton.is_over((sign * value[l], sign * slope[l])) {
                sought[l] = false;
                count -= 1;
            }
            x[l] = p.newton.x;
        }
    }
}

/// Keeps the earlier crossing.
#[inline(always)]
fn note(first: &mut Option<Crossing>, theta: f64, line: usize, direction: Direction) {
    if first.is_none_or(|f| theta < f.theta) {
        *first = Some(Crossing {
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
