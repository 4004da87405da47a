//! The balance of forces of a system: its own where a train gave it one, else recovered from kappa and W.

use crate::numeric::dense::Lu;
use crate::numeric::symmetric::symmetriser;
use crate::system::{Balance, System};
use nalgebra::{DMatrix, DVector};

/// Balance of the mean loads: W^T diag(k) f = F.
#[derive(Debug)]
pub(super) struct Demand {
    /// k, e values.
    pub(super) stiffness: Vec<f64>,
    /// F, n values.
    pub(super) load: DVector<f64>,
    /// Part of each F that is rounding, n values.
    pub(super) noise: DVector<f64>,
}

/// Rounding of a sum of loads, relative to its parts.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Largest misfit of kappa = A W^T diag(k) in a reduced system, relative.
const MISFIT: f64 = 1e-9;

impl Demand {
    /// `None` for reduced systems without such a balance.
    pub(super) fn of(system: &System) -> Option<Demand> {
        match system.balance() {
            Some(balance) => Some(Demand::given(system, balance)),
            None if system.is_tree() => Demand::of_tree(system),
            None => Demand::recovered(system),
        }
    }

    fn given(system: &System, balance: &Balance) -> Demand {
        let n = system.dof();
        let (mut load, mut noise) = (DVector::zeros(n), DVector::zeros(n));
        let values = (system.loads().iter().zip(&balance.loads))
            .filter(|(source, _)| !source.kind.is_free_of_rest());
        for (source, force) in values {
            let mean = source.series.mean();
            load.axpy(mean, force, 1.0);
            let weigh = force.component_mul(&balance.weight);
            noise.add_scalar_mut(ROUNDING * mean.abs() * weigh.amax());
        }
        Demand {
            stiffness: balance.stiffness.clone(),
            load,
            noise: noise.component_div(&balance.weight),
        }
    }

    /// kappa f = Q: every force follows.
    fn of_tree(system: &System) -> Option<Demand> {
        let inverse = inverse(system.stiffness())?;
        let load = system.mean_load();
        let stiffness = vec![1.0; system.dof()];
        Some(Demand {
            noise: inverse.map(f64::abs) * load.map(f64::abs) * ROUNDING,
            load: inverse * load,
            stiffness,
        })
    }

    /// k and A of kappa = A W^T diag(k) with a symmetric A, where coordinates are deformations.
    fn recovered(system: &System) -> Option<Demand> {
        let (n, e) = (system.dof(), system.element_count());
        let is_unit = |k: &usize, i: usize| system.element_map_row(*k) == [(i, 1.0)];
        let basis: Option<Vec<usize>> = (0..n).map(|i| (0..e).find(|k| is_unit(k, i))).collect();
        let own = system.stiffness().select_columns(&basis?);
        let mut mobility = own.clone();
        for (mut column, d) in mobility.column_iter_mut().zip(symmetriser(&own)?) {
            column /= d * d;
        }
        let inverse = inverse(&mobility)?;
        let driven = &inverse * system.stiffness();
        let mut stiffness = Vec::with_capacity(e);
        for (column, row) in driven.column_iter().zip(system.element_map().row_iter()) {
            let row = row.transpose();
            let k = column.dot(&row) / row.norm_squared();
            let misfit = (column - &row * k).norm();
            if !(k > 0.0 && misfit <= MISFIT * column.norm()) {
                return None;
            }
            stiffness.push(k);
        }
        let load = system.mean_load();
        Some(Demand {
            stiffness,
            noise: inverse.map(f64::abs) * load.map(f64::abs) * ROUNDING,
            load: inverse * load,
        })
    }
}

fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    if matrix.shape() != (n, n) {
        return None;
    }
    let mut lu = Lu::with_columns(n, n);
    let is_regular = lu.factorise(matrix) && lu.smallest_pivot() > 1e-14 * matrix.amax();
    let mut identity = DMatrix::identity(n, n);
    lu.solve_columns(identity.as_mut_slice(), n);
    (is_regular && identity.iter().all(|x| x.is_finite())).then_some(identity)
}
