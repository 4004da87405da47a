//! Neighbourhoods of attractors from which no motion returns.

use super::cycle::Cycle;
use super::map::Map;
use super::scatter;
use crate::solve::integrate::IntegrationEnd;
use nalgebra::{DMatrix, DVector};

/// An ellipsoid around the first point of an attracting orbit which its return map takes into itself.
///
/// ```text
/// e' P e <= level,    A' P A - P = -I
/// ```
///
/// A is the derivative of the return map, so that the linear part shrinks e' P e by |e|^2 per lap. The ellipsoid is made so small
/// that, at sampled states on it and on smaller ones, at least half of that is left.
#[derive(Debug, Clone)]
pub(super) struct Trap {
    centre: DVector<f64>,
    metric: DMatrix<f64>,
    level: f64,
}

/// Doublings of the sum for P: it converges quadratically once powers of A shrink.
const DOUBLINGS: usize = 60;
/// Size of the first ellipsoid that is tried, relative to the attractor.
const FIRST: f64 = 0.5;
/// What a radius that is too large shrinks by.
const SHRINK: f64 = 0.5;
/// Radii tried.
const TRIALS: usize = 36;
/// Radii sampled below the one that is tried, in parts of it.
const SHELLS: [f64; 4] = [1.0, 0.6, 0.35, 0.15];
/// Directions per radius: a base number, and more per component of a state.
const DIRECTIONS: (usize, usize) = (8, 8);
/// Seed of the directions.
const SEED: u64 = 15;

impl Trap {
    /// Around an orbit; `None` where no ellipsoid passes.
    pub fn around(map: &mut dyn Map, cycle: &Cycle) -> Option<Trap> {
        let size = map.size();
        let metric = metric(&cycle.phi)?;
        let factor = metric.clone().cholesky()?.l().transpose();
        let least = metric.clone().symmetric_eigenvalues().min();
        let largest = cycle.points.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut trap = Trap {
            centre: DVector::from_column_slice(&cycle.points[..size]),
            metric,
            level: least * (FIRST * largest).powi(2),
        };
        let directions = directions(&factor, size)?;
        for _ in 0..TRIALS {
            if trap.shrinks(map, &directions, cycle.period) {
                return Some(trap);
            }
            trap.level *= SHRINK * SHRINK;
        }
        None
    }

    /// Whether a state lies inside.
    pub fn holds(&self, state: &[f64]) -> bool {
        self.height(state) <= self.level
    }

    /// e' P e.
    fn height(&self, state: &[f64]) -> f64 {
        let n = state.len();
        let mut sum = 0.0;
        for j in 0..n {
            let e = state[j] - self.centre[j];
            let column = self.metric.column(j);
            let row: f64 = (0..n)
                .map(|i| column[i] * (state[i] - self.centre[i]))
                .sum();
            sum += e * row;
        }
        sum
    }

    /// Whether the return map takes the sampled states inwards.
    fn shrinks(&self, map: &mut dyn Map, directions: &[DVector<f64>], period: usize) -> bool {
        let radius = self.level.sqrt();
        SHELLS.iter().all(|shell| {
            directions.iter().all(|direction| {
                let e = direction * (shell * radius);
                let mut state = (&self.centre + &e).as_slice().to_vec();
                let before = self.height(&state);
                let is_whole =
                    (0..period).all(|_| map.advance(&mut state) == IntegrationEnd::Reached);
                is_whole && self.height(&state) <= before - 0.5 * e.norm_squared()
            })
        })
    }
}

/// P = sum over k of (A^k)' A^k, by doubling; `None` where A does not shrink.
fn metric(a: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let (mut sum, mut power) = (DMatrix::identity(n, n), a.clone());
    for _ in 0..DOUBLINGS {
        let more = power.transpose() * &sum * &power;
        let is_done = more.amax() <= 1e-15 * sum.amax();
        sum += more;
        if is_done {
            return Some((&sum + sum.transpose()) * 0.5);
        }
        power = &power * &power;
    }
    None
}

/// States on the unit ellipsoid e' P e = 1, P = F' F.
fn directions(factor: &DMatrix<f64>, size: usize) -> Option<Vec<DVector<f64>>> {
    let widths = vec![1.0; size];
    (0..DIRECTIONS.0 + DIRECTIONS.1 * size)
        .map(|k| {
            let mut z = vec![0.0; size];
            scatter(SEED, k, &widths, &mut z);
            let z = DVector::from_vec(z).normalize();
            factor.solve_upper_triangular(&z)
        })
        .collect()
}
