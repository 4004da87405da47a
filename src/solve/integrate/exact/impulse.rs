//! The impulses of several stops at one instant, and what they do to deviations from the motion.

use super::ROUNDING;
use crate::numeric::bernstein::Direction;
use crate::numeric::complementary::{least, solve};
use crate::system::System;
use nalgebra::DMatrix;

/// A part at a stop.
#[derive(Debug, Clone, Copy)]
pub(super) struct StopPart {
    pub(super) part: usize,
    pub(super) connection: usize,
    /// Way out.
    pub(super) direction: Direction,
    pub(super) level: f64,
    pub(super) coefficient: f64,
    pub(super) held: usize,
    /// Held; in an impact on others also: closed and at rest.
    pub(super) is_held: bool,
    /// Distance from the stop in a flight that began there, else 0.
    pub(super) gap: f64,
    /// Rate, outwards positive.
    pub(super) rate: f64,
    /// Size of rates of its deformation in this motion.
    pub(super) speed: f64,
}

impl StopPart {
    /// A rate that is rounding.
    pub(super) fn slow(&self) -> f64 {
        ROUNDING * self.speed
    }

    /// Closed and at rest, whether a force holds it or not.
    fn rests(&self) -> bool {
        self.is_held || (self.gap == 0.0 && self.rate.abs() <= STILL * self.speed)
    }

    /// 1 + r.
    fn factor(&self) -> f64 {
        if self.is_held {
            1.0
        } else {
            1.0 + self.coefficient
        }
    }

    /// What an impact has to add to the rate, inwards.
    fn change(&self) -> f64 {
        if self.is_held {
            0.0
        } else {
            self.factor() * self.rate
        }
    }
}

/// Slowest rates of a closed stop that are a motion, relative to the whole motion.
const STILL: f64 = 1e-11;
/// Share of a change of rate within which a stop is hit.
const HIT: f64 = 1e-9;

/// Impulses of an impact: no stop pulls, each is left at least as fast as its coefficient wants, and where it pushes exactly so.
///
/// ```text
/// J >= 0,   D J >= (1 + r) rates,   one of the two equal,   D = W_A kappa_A
/// ```
///
/// D J, thus the motion, is unique where stops depend on each other, too: of parallel ones with different coefficients the most elastic decides.
pub(super) struct Impact {
    /// Stops that are hit, and held ones that stay closed.
    pub(super) set: Vec<StopPart>,
    /// Their impulses, along the deformations.
    pub(super) impulses: Vec<f64>,
    /// kappa_A (W_A kappa_A)^-1 diag(1 + r).
    reversal: DMatrix<f64>,
}

/// W_A kappa_A with the signs of the stops.
fn outward(system: &System, near: &[StopPart]) -> DMatrix<f64> {
    DMatrix::from_fn(near.len(), near.len(), |a, b| {
        let (a, b) = (&near[a], &near[b]);
        let signs = a.direction.sign() * b.direction.sign();
        signs * system.mobility(a.connection, b.connection)
    })
}

/// Whether some rates keep within all stops that are closed.
pub(super) fn agree(system: &System, stops: &[StopPart]) -> bool {
    let closed: Vec<StopPart> = stops.iter().filter(|s| s.gap == 0.0).copied().collect();
    let rates: Vec<f64> = closed.iter().map(|s| s.rate).collect();
    closed.is_empty() || solve(&outward(system, &closed), &rates).is_some()
}

impl Impact {
    /// Impact on stops, past none of the others that are closed and at rest: what follows must not hang on the rounding of their rates,
    /// and a joint without play moves as one body. `None` where stops contradict each other.
    pub(super) fn among<'a>(
        system: &System,
        struck: &[StopPart],
        others: impl Iterator<Item = &'a StopPart> + Clone,
    ) -> Option<Impact> {
        let with = |keeps: fn(&StopPart) -> bool| {
            let kept = others.clone().filter(|s| keeps(s));
            let kept = kept.map(|s| StopPart {
                is_held: true,
                ..*s
            });
            let set: Vec<StopPart> = struck.iter().copied().chain(kept).collect();
            Impact::of(system, &set)
        };
        let moves = struck.iter().any(|s| s.rate > STILL * s.speed);
        let whole = if moves { with(StopPart::rests) } else { None };
        whole.or_else(|| with(|s| s.is_held))
    }

    /// `None` where stops contradict each other.
    fn of(system: &System, near: &[StopPart]) -> Option<Impact> {
        let (count, mobility) = (near.len(), outward(system, near));
        let changes: Vec<f64> = near.iter().map(StopPart::change).collect();
        let pushes = solve(&mobility, &changes)?;
        let is_hit = |a: usize| {
            let parts = (0..count).map(|b| mobility[(a, b)] * pushes[b]);
            let (sum, size) = parts.fold((0.0, 0.0), |(s, m), x| (s + x, m + f64::abs(x)));
            pushes[a] > 0.0 || (sum - changes[a]).abs() <= HIT * (size + changes[a].abs())
        };
        let hit: Vec<usize> = (0..count).filter(|a| is_hit(*a)).collect();
        let set: Vec<StopPart> = hit.iter().map(|a| near[*a]).collect();
        let impulses = hit.iter().map(|a| -near[*a].direction.sign() * pushes[*a]);
        let connections: Vec<usize> = set.iter().map(|s| s.connection).collect();
        let kappa = system.stiffness().select_columns(&connections);
        let mobility = system.element_map().select_rows(&connections) * &kappa;
        let mut reversal = kappa * least(&mobility)?;
        for (mut column, stop) in reversal.column_iter_mut().zip(&set) {
            column *= stop.factor();
        }
        Some(Impact {
            impulses: impulses.collect(),
            set,
            reversal,
        })
    }

    /// Phi <- S Phi; `shift`: a+ - a-, `accelerations`: W_i a- - e_i''.
    pub(super) fn saltate(
        &self,
        (system, phi): (&System, &mut DMatrix<f64>),
        (shift, accelerations): (&[f64], &[f64]),
    ) {
        let (n, set) = (system.dof(), &self.set);
        let moving = set.iter().filter(|s| !s.is_held).count().max(1) as f64;
        for mut column in phi.column_iter_mut() {
            let strain = |column: &[f64], stop: &StopPart| {
                let row = system.element_map_row(stop.connection).iter();
                row.map(|(i, w)| w * column[*i]).sum::<f64>()
            };
            let slice = column.as_mut_slice();
            let strains: Vec<(f64, f64)> = (set.iter())
                .map(|s| (strain(&slice[..n], s), strain(&slice[n..2 * n], s)))
                .collect();
            for (a, stop) in set.iter().enumerate() {
                let (x, v) = strains[a];
                for i in 0..n {
                    let reversal = self.reversal[(i, a)];
                    slice[i] -= reversal * x;
                    slice[n + i] -= reversal * v;
                    if !stop.is_held {
                        let rate = stop.direction.sign() * stop.rate;
                        let turn = shift[i] / moving + reversal * accelerations[a];
                        slice[n + i] += turn * x / rate;
                    }
                }
            }
        }
    }
}
