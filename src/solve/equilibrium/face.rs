//! The linear part of the minimisation: forces on the connections that are closed at a state.

use nalgebra::{Cholesky, DMatrix, DVector};

/// A row whose part outside the span of the stiffer ones is smaller follows from them.
const INDEPENDENT: f64 = 1e-9;

/// The closed connections at a state: a basis of their rows, the stiffest first, and how the others follow.
pub(super) struct Face {
    /// Orthonormal, one column a basis row.
    vectors: Vec<DVector<f64>>,
    /// Basis row i is the sum over k <= i of lower[i][k] vectors[k].
    lower: Vec<Vec<f64>>,
    basis: Vec<usize>,
    /// Others with their combination of the basis rows.
    others: Vec<(usize, DVector<f64>)>,
    dof: usize,
}

/// A linear solution for the closed connections.
pub(super) struct FaceStep {
    pub(super) motion: DVector<f64>,
    /// Forces of the closed connections there, which balance the load.
    pub(super) forces: Vec<(usize, f64)>,
}

impl Face {
    /// The connections of non-zero stiffness. `rows`: their rows of unit length, e x n.
    pub(super) fn of(rows: &DMatrix<f64>, stiffness: &[f64]) -> Face {
        let mut order: Vec<usize> = (0..stiffness.len())
            .filter(|j| stiffness[*j] > 0.0)
            .collect();
        order.sort_by(|a, b| stiffness[*b].total_cmp(&stiffness[*a]));
        let mut face = Face {
            vectors: Vec::new(),
            lower: Vec::new(),
            basis: Vec::new(),
            others: Vec::new(),
            dof: rows.ncols(),
        };
        for j in order {
            let mut remainder = rows.row(j).transpose();
            let mut share = vec![0.0; face.vectors.len()];
            for _ in 0..2 {
                for (s, v) in share.iter_mut().zip(&face.vectors) {
                    let part = v.dot(&remainder);
                    if part != 0.0 {
                        remainder.axpy(-part, v, 1.0);
                        *s += part;
                    }
                }
            }
            let size = remainder.norm();
            if size > INDEPENDENT {
                share.push(size);
                face.lower.push(share);
                face.vectors.push(remainder / size);
                face.basis.push(j);
            } else {
                face.others.push((j, DVector::from_vec(share)));
            }
        }
        // From parts along the vectors to combinations of the basis rows, once the basis is complete.
        for (_, share) in &mut face.others {
            let m = share.len();
            for i in (0..m).rev() {
                share[i] /= face.lower[i][i];
                for k in 0..i {
                    share[k] -= share[i] * face.lower[i][k];
                }
            }
            *share = share.clone().resize_vertically(face.basis.len(), 0.0);
        }
        face
    }

    /// A force in parts: on motions that deform no closed connection, and as forces of the basis connections.
    pub(super) fn split(&self, force: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        let mut slack = force.clone();
        let mut along = DVector::zeros(self.vectors.len());
        for _ in 0..2 {
            for (a, v) in along.iter_mut().zip(&self.vectors) {
                let part = v.dot(&slack);
                slack.axpy(-part, v, 1.0);
                *a += part;
            }
        }
        // force = sum along_k v_k = sum u_i row_i: L^T u = along.
        for i in (0..along.len()).rev() {
            along[i] /= self.lower[i][i];
            for k in 0..i {
                along[k] -= along[i] * self.lower[i][k];
            }
        }
        (slack, along)
    }

    /// Balances the closed connections: wanted = t_B + C^T t_D with t_j + K_j dx_j in place of t_j.
    ///
    /// ```text
    /// (1 + S^T S) y = K_B^(-1/2) (wanted - t_B - C^T t_D),    S = K_D^(1/2) C K_B^(-1/2),    dx_B = K_B^(-1/2) y
    /// ```
    ///
    /// The basis is the stiffest, so that no entry of S is large and no spread of stiffnesses harms it.
    pub(super) fn balance(
        &self,
        (force, stiffness): (&[f64], &[f64]),
        wanted: DVector<f64>,
    ) -> Option<FaceStep> {
        let m = self.basis.len();
        let root: Vec<f64> = self.basis.iter().map(|j| stiffness[*j].sqrt()).collect();
        let mut missing = wanted.clone();
        for (i, j) in self.basis.iter().enumerate() {
            missing[i] -= force[*j];
        }
        let mut matrix = DMatrix::identity(m, m);
        for (j, combination) in &self.others {
            missing.axpy(-force[*j], combination, 1.0);
            let weight = stiffness[*j].sqrt();
            let row = DVector::from_fn(m, |i, _| weight * combination[i] / root[i]);
            matrix.ger(1.0, &row, &row, 1.0);
        }
        (0..m).for_each(|i| missing[i] /= root[i]);
        let mut change = Cholesky::new(matrix)?.solve(&missing);
        (0..m).for_each(|i| change[i] /= root[i]);
        let mut forces = Vec::new();
        let mut left = wanted;
        for (j, combination) in &self.others {
            let force_there = force[*j] + stiffness[*j] * combination.dot(&change);
            left.axpy(-force_there, combination, 1.0);
            forces.push((*j, force_there));
        }
        forces.extend(self.basis.iter().copied().zip(left.iter().copied()));
        // Parts along the vectors: L d = change.
        let mut motion = DVector::zeros(self.dof);
        let mut parts: Vec<f64> = Vec::with_capacity(m);
        for i in 0..m {
            let known: f64 = parts.iter().zip(&self.lower[i]).map(|(p, l)| p * l).sum();
            parts.push((change[i] - known) / self.lower[i][i]);
            motion.axpy(parts[i], &self.vectors[i], 1.0);
        }
        let is_finite = motion.iter().all(|x| x.is_finite());
        is_finite.then_some(FaceStep { motion, forces })
    }

    /// Orthonormal basis of the motions that deform no closed connection, n x (n - m).
    pub(super) fn open(&self) -> DMatrix<f64> {
        let n = self.dof;
        let mut all = self.vectors.clone();
        while all.len() < n {
            // The unit vector farthest from the span comes next.
            let distance = |i: &usize| 1.0 - all.iter().map(|v| v[*i] * v[*i]).sum::<f64>();
            let far = (0..n).max_by(|a, b| distance(a).total_cmp(&distance(b)));
            let mut next = DVector::zeros(n);
            next[far.unwrap_or(0)] = 1.0;
            for _ in 0..2 {
                for v in &all {
                    let part = v.dot(&next);
                    next.axpy(-part, v, 1.0);
                }
            }
            all.push(next.normalize());
        }
        let m = self.vectors.len();
        DMatrix::from_fn(n, n - m, |i, j| all[m + j][i])
    }
}
