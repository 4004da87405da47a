//! The impulses of several stops at one instant, and what they do to deviations from the motion.

use crate::numeric::bernstein::Direction;
use crate::numeric::complementary::inverse;
use crate::system::System;
use nalgebra::{DMatrix, DVector};

/// A part at a stop.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    pub(super) part: usize,
    pub(super) connection: usize,
    /// Way out.
    pub(super) direction: Direction,
    pub(super) level: f64,
    pub(super) coefficient: f64,
    pub(super) held: usize,
    pub(super) is_held: bool,
    /// Distance from the stop in a flight that began there, else 0.
    pub(super) gap: f64,
    /// Rate, outwards positive.
    pub(super) rate: f64,
}

/// Impulses of an impact.
pub(super) struct Impact {
    pub(super) impulses: DVector<f64>,
    /// kappa_A (W_A kappa_A)^-1 diag(1 + r).
    reversal: DMatrix<f64>,
}

impl Impact {
    /// `None` where stops depend on each other.
    pub(super) fn of(system: &System, set: &[Stop]) -> Option<Impact> {
        let connections: Vec<usize> = set.iter().map(|s| s.connection).collect();
        let kappa = system.stiffness().select_columns(&connections);
        let mobility = system.element_map().select_rows(&connections) * &kappa;
        let inverse = inverse(&mobility)?;
        let factor = |s: &Stop| if s.is_held { 1.0 } else { 1.0 + s.coefficient };
        let sides = set.iter().map(|s| match s.is_held {
            true => 0.0,
            false => -factor(s) * s.direction.sign() * s.rate,
        });
        let impulses = &inverse * DVector::from_iterator(set.len(), sides);
        let mut reversal = kappa * inverse;
        for (mut column, stop) in reversal.column_iter_mut().zip(set) {
            column *= factor(stop);
        }
        Some(Impact { impulses, reversal })
    }

    /// Phi <- S Phi; `shift`: a+ - a-, `accelerations`: W_i a- - e_i''.
    pub(super) fn saltate(
        &self,
        (system, phi): (&System, &mut DMatrix<f64>),
        set: &[Stop],
        (shift, accelerations): (&[f64], &[f64]),
    ) {
        let n = system.dof();
        let moving = set.iter().filter(|s| !s.is_held).count().max(1) as f64;
        for mut column in phi.column_iter_mut() {
            let strain = |column: &[f64], stop: &Stop| {
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
