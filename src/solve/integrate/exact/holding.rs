//! Deformations that are kept at their levels: the motion projected along the forces that hold them.
//!
//! ```text
//! q'' = a - kappa_A f,   f = (W_A kappa_A)^-1 (W_A a - e_A''),   a: without these forces
//! ```

use super::entries::{MatrixEntry, SquareMatrix, entries};
use crate::numeric::complementary::{dependences, inverse, least};
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::system::System;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Connections that are held, and what that does to the equation of motion.
#[derive(Debug, Clone)]
pub struct Holding {
    connections: Vec<usize>,
    /// W_A.
    rows: DMatrix<f64>,
    /// (W_A kappa_A)^-1.
    inverse: DMatrix<f64>,
    /// kappa_A (W_A kappa_A)^-1.
    pull: DMatrix<f64>,
    /// Columns of kappa, projected.
    columns: Vec<Vec<(usize, f64)>>,
    /// Columns of W_A kappa.
    drive: DMatrix<f64>,
    /// The damping and the coupling without holding.
    pub free: (SquareMatrix, SquareMatrix),
    /// W_A Q - e'' of the step, then the forces.
    forces: Vec<Polynomial>,
}

impl Holding {
    /// Connections whose levels follow from those of others share the forces; `None` where these levels contradict each other.
    pub fn new(system: &System, connections: &[usize]) -> Option<Holding> {
        let count = connections.len();
        let none = SquareMatrix::new(system.dof(), Vec::new());
        let rows = system.element_map().select_rows(connections);
        let kappa = system.stiffness().select_columns(connections);
        let mobility = &rows * &kappa;
        let inverse = match inverse(&mobility) {
            None if !agree(system, connections, &mobility) => return None,
            None => least(&mobility)?,
            Some(inverse) => inverse,
        };
        let pull = &kappa * &inverse;
        let drive = &rows * system.stiffness();
        let columns = system.stiffness() - &pull * &drive;
        let sparse = |column: usize| {
            let column = columns.column(column);
            let list = column.iter().copied().enumerate();
            list.filter(|(_, x)| *x != 0.0).collect()
        };
        Some(Holding {
            connections: connections.to_vec(),
            columns: (0..system.element_count()).map(sparse).collect(),
            rows,
            inverse,
            pull,
            drive,
            free: (none.clone(), none),
            forces: vec![[0.0; COUNT]; count],
        })
    }

    /// The matrix of these entries without what would move the deformations that are held.
    pub fn project(&self, list: &SquareMatrix) -> SquareMatrix {
        let n = self.pull.nrows();
        let mut matrix = DMatrix::zeros(n, n);
        for entry in list.entries() {
            matrix[(entry.row, entry.column)] += entry.value;
        }
        let moved = &self.rows * &matrix;
        SquareMatrix::new(n, entries(&(matrix - &self.pull * moved), 1.0))
    }

    /// The same of what memories add.
    pub(crate) fn project_memories(&self, list: &mut Vec<MatrixEntry>) {
        let n = self.pull.nrows();
        let Some(last) = list.iter().map(|m| m.column).max() else {
            return;
        };
        let mut matrix = DMatrix::zeros(n, last + 1);
        for entry in list.iter() {
            matrix[(entry.row, entry.column)] += entry.value;
        }
        let moved = &self.rows * &matrix;
        *list = entries(&(matrix - &self.pull * moved), 1.0);
    }

    /// Projects the coefficients of the loads of a step; `errors`: those of all transmission errors.
    pub(crate) fn project_loads(
        &mut self,
        loads: &mut [Polynomial],
        errors: Option<&[Polynomial]>,
    ) {
        for (a, connection) in self.connections.iter().enumerate() {
            let force = &mut self.forces[a];
            for k in 0..COUNT {
                let sum = (0..loads.len()).map(|i| self.rows[(a, i)] * loads[i][k]);
                force[k] = sum.sum();
            }
            let Some(error) = errors.map(|e| &e[*connection]) else {
                continue;
            };
            for k in 0..COUNT - 2 {
                force[k] -= ((k + 1) * (k + 2)) as f64 * error[k + 2];
            }
        }
        for (i, load) in loads.iter_mut().enumerate() {
            for (a, force) in self.forces.iter().enumerate() {
                let pull = self.pull[(i, a)];
                for (load, f) in load.iter_mut().zip(force) {
                    *load -= pull * f;
                }
            }
        }
    }

    /// Makes the holding forces of a step from its motion; `unit`: that of time; `acting`: connections with forces made beside it.
    pub fn close<'a>(
        &mut self,
        q: &[Polynomial],
        unit: f64,
        acting: impl Iterator<Item = (usize, &'a Polynomial)>,
    ) {
        for d in self.free.0.entries() {
            for (a, force) in self.forces.iter_mut().enumerate() {
                let factor = self.rows[(a, d.row)] * d.value;
                if factor == 0.0 {
                    continue;
                }
                for k in 0..COUNT - 1 {
                    force[k] -= factor * (k + 1) as f64 * q[d.column][k + 1];
                }
            }
        }
        for c in self.free.1.entries() {
            for (a, force) in self.forces.iter_mut().enumerate() {
                let factor = self.rows[(a, c.row)] * c.value;
                if factor == 0.0 {
                    continue;
                }
                for k in 0..COUNT {
                    force[k] -= factor * q[c.column][k];
                }
            }
        }
        let square = unit * unit;
        for (connection, law) in acting {
            for (a, force) in self.forces.iter_mut().enumerate() {
                let factor = square * self.drive[(a, connection)];
                force
                    .iter_mut()
                    .zip(law)
                    .for_each(|(f, l)| *f -= factor * l);
            }
        }
        // The last terms of the recursion are not there.
        for k in 0..COUNT {
            let sides = DVector::from_iterator(self.forces.len(), self.forces.iter().map(|f| f[k]));
            let found = &self.inverse * sides / square;
            for (force, f) in self.forces.iter_mut().zip(found.iter()) {
                force[k] = if k < COUNT - 2 { *f } else { 0.0 };
            }
        }
    }

    /// Coefficients of the force that holds a connection.
    pub fn force(&self, connection: usize) -> Option<&Polynomial> {
        let place = self.connections.iter().position(|c| *c == connection)?;
        Some(&self.forces[place])
    }

    /// The coordinates that the force of a connection drives, and how.
    pub fn column(&self, connection: usize) -> &[(usize, f64)] {
        &self.columns[connection]
    }

    /// Moves a vector along the holding forces until W_A x is what is wanted, connection by connection.
    pub fn correct(&self, x: &mut [f64], wanted: impl Fn(usize) -> f64) {
        let gap = |(a, connection): (usize, &usize)| {
            let row = self.rows.row(a);
            let here: f64 = row.iter().zip(x.iter()).map(|(w, x)| w * x).sum();
            here - wanted(*connection)
        };
        let gaps = self.connections.iter().enumerate().map(gap);
        let gaps = DVector::from_iterator(self.connections.len(), gaps);
        let moves = &self.pull * gaps;
        x.iter_mut().zip(moves.iter()).for_each(|(x, m)| *x -= m);
    }
}

/// Phases at which the levels of connections are compared.
const PHASES: usize = 16;
/// Share of their rates by which they may differ.
const SAME: f64 = 1e-9;

/// Whether levels that depend on each other move together.
fn agree(system: &System, connections: &[usize], mobility: &DMatrix<f64>) -> bool {
    let dependences = dependences(mobility);
    let rate = |connection: usize, phase: f64| {
        let error = system.mounts()[connection].transmission_error.as_ref();
        error.map_or(0.0, |e| e.derivative(phase))
    };
    dependences.column_iter().all(|combination| {
        (0..PHASES).all(|k| {
            let phase = TAU * (k as f64 + 0.5) / PHASES as f64;
            let parts = combination.iter().zip(connections);
            let parts = parts.map(|(n, e)| n * rate(*e, phase));
            let (sum, size) = parts.fold((0.0, 0.0), |(s, m), x| (s + x, m + f64::abs(x)));
            sum.abs() <= SAME * size
        })
    })
}
