//! The conditions g that single out an event, as functions of the transition matrix.
//!
//! ```text
//! [M    B] [W]   [0]        M = Phi - I (fold), Phi + I (doubling), Phi^2 - 2 k Phi + I (Neimark-Sacker)
//! [C^T  0] [G] = [I],       G = 0 exactly where M is singular
//! ```
//!
//! For a Neimark-Sacker event M loses two ranks and G has four entries. In the plane of the pair M = (t - 2 k) A + (1 - d) I with
//! trace t and determinant d, so that G is a combination of two fixed matrices: its two coordinates are the conditions.

use nalgebra::{ComplexField, DMatrix, DVector};

/// Borders of a matrix that is nearly singular.
#[derive(Debug, Clone)]
pub(super) struct Borders {
    /// B: left vectors of the smallest singular values.
    pub left: DMatrix<f64>,
    /// C: right vectors.
    pub right: DMatrix<f64>,
    /// Coordinates of G in the plane of a pair: one row per condition over the entries of G, column by column.
    dual: Option<DMatrix<f64>>,
}

/// Phi - I or Phi + I.
pub(super) fn shifted(phi: &DMatrix<f64>, shift: f64) -> DMatrix<f64> {
    let mut m = phi.clone();
    for i in 0..m.nrows() {
        m[(i, i)] += shift;
    }
    m
}

/// Phi^2 - 2 k Phi + I.
pub(super) fn paired(phi: &DMatrix<f64>, k: f64) -> DMatrix<f64> {
    shifted(&(phi * phi - phi * (2.0 * k)), 1.0)
}

/// Left and right singular vectors of the value nearest to 0, to rounding, from those of the decomposition, which now and then are some orders
/// of magnitude worse:
///
/// ```text
/// [M    l] [v]   [0]    [M*  r] [w]   [0]
/// [r*   0] [g] = [1],   [l*  0] [g] = [1]
/// ```
pub(super) fn sharpened<T: ComplexField<RealField = f64>>(
    m: &DMatrix<T>,
    left: &DVector<T>,
    right: &DVector<T>,
) -> Option<(DVector<T>, DVector<T>)> {
    let unit = |vector: DVector<T>| {
        let length = vector.norm();
        length.is_normal().then(|| vector / T::from_real(length))
    };
    let new_left = unit(bordered_solution(&m.adjoint(), right, left)?)?;
    let new_right = unit(bordered_solution(m, left, right)?)?;
    Some((new_left, new_right))
}

/// v of a bordered matrix, [M, column; row*, 0] [v; g] = [0; 1].
fn bordered_solution<T: ComplexField<RealField = f64>>(
    m: &DMatrix<T>,
    column: &DVector<T>,
    row: &DVector<T>,
) -> Option<DVector<T>> {
    let n = m.nrows();
    let mut bordered = DMatrix::zeros(n + 1, n + 1);
    bordered.view_mut((0, 0), (n, n)).copy_from(m);
    bordered.view_mut((0, n), (n, 1)).copy_from(column);
    bordered.view_mut((n, 0), (1, n)).copy_from(&row.adjoint());
    let mut unit = DVector::zeros(n + 1);
    unit[n] = T::one();
    Some(bordered.lu().solve(&unit)?.rows(0, n).into_owned())
}

impl Borders {
    /// Of a matrix with a given rank deficiency; the orientation of single vectors is that of the borders before. `None` where there
    /// are not singular vectors.
    pub fn of(m: &DMatrix<f64>, rank: usize, before: Option<&Borders>) -> Option<Borders> {
        let n = m.nrows();
        if !m.iter().all(|x| x.is_finite()) {
            return None;
        }
        let svd = m.clone().svd(true, true);
        let (u, v) = (svd.u?, svd.v_t?.transpose());
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| svd.singular_values[*a].total_cmp(&svd.singular_values[*b]));
        let pick = |from: &DMatrix<f64>| -> Vec<DVector<f64>> {
            let columns = order[..rank].iter();
            columns.map(|k| from.column(*k).into_owned()).collect()
        };
        let (mut left, mut right) = (pick(&u), pick(&v));
        if let ([l], [r]) = (&mut left[..], &mut right[..])
            && let Some(sharper) = sharpened(m, l, r)
        {
            (*l, *r) = sharper;
        }
        let (mut left, mut right) = (DMatrix::from_columns(&left), DMatrix::from_columns(&right));
        if let Some(before) = before.filter(|_| rank == 1) {
            if left.dot(&before.left) < 0.0 {
                left.neg_mut();
            }
            if right.dot(&before.right) < 0.0 {
                right.neg_mut();
            }
        }
        Some(Borders {
            left,
            right,
            dual: None,
        })
    }

    /// The same for a pair: with the coordinates of G.
    pub(crate) fn of_pair(phi: &DMatrix<f64>, k: f64) -> Option<Borders> {
        let mut borders = Borders::of(&paired(phi, k), 2, None)?;
        let of_a = borders.left.transpose() * phi * &borders.right;
        let of_one = borders.left.transpose() * &borders.right;
        let columns = [of_a, of_one].map(|m| DVector::from_column_slice(m.as_slice()));
        borders.dual = Some(DMatrix::from_columns(&columns).pseudo_inverse(1e-10).ok()?);
        Some(borders)
    }

    /// The conditions at a matrix; `None` where the bordered one is singular.
    pub fn conditions(&self, m: &DMatrix<f64>) -> Option<Vec<f64>> {
        let (n, r) = (m.nrows(), self.left.ncols());
        let mut bordered = DMatrix::zeros(n + r, n + r);
        bordered.view_mut((0, 0), (n, n)).copy_from(m);
        bordered.view_mut((0, n), (n, r)).copy_from(&self.left);
        (bordered.view_mut((n, 0), (r, n))).copy_from(&self.right.transpose());
        let mut rhs = DMatrix::zeros(n + r, r);
        rhs.view_mut((n, 0), (r, r)).fill_with_identity();
        let solution = bordered.lu().solve(&rhs)?;
        let g = solution.view((n, 0), (r, r)).into_owned();
        let list = DVector::from_column_slice(g.as_slice());
        let list = match &self.dual {
            None => list,
            Some(dual) => dual * list,
        };
        let is_known = list.iter().all(|x| x.is_finite());
        is_known.then(|| list.as_slice().to_vec())
    }

    /// The left vector of a matrix itself, where it is singular, along that of the borders.
    ///
    /// ```text
    /// [M*  C] [w]   [0]
    /// [B*  0] [g] = [1]
    /// ```
    pub fn left_of(&self, m: &DMatrix<f64>) -> Option<DVector<f64>> {
        let (left, right) = self.vectors();
        bordered_solution(&m.transpose(), &right, &left)
    }

    /// The single left and right vector.
    pub(crate) fn vectors(&self) -> (DVector<f64>, DVector<f64>) {
        (
            self.left.column(0).into_owned(),
            self.right.column(0).into_owned(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_on_the_circle_meets_both_conditions() {
        let of = |radius: f64, angle: f64| {
            let (c, s) = (radius * angle.cos(), radius * angle.sin());
            #[rustfmt::skip]
            let block = DMatrix::from_row_slice(3, 3, &[c, -s, 0.2, s, c, 0.1, 0.0, 0.0, 0.3]);
            let turn =
                DMatrix::from_row_slice(3, 3, &[1.0, 0.4, 0.0, 0.2, 1.0, 0.5, 0.1, 0.0, 1.0]);
            turn.clone() * block * turn.try_inverse().unwrap()
        };
        let k = 0.7_f64.cos();
        let borders = Borders::of_pair(&of(1.001, 0.7003), k).unwrap();
        let exact = borders.conditions(&paired(&of(1.0, 0.7), k)).unwrap();
        assert!(exact.iter().all(|g| g.abs() < 1e-14), "{exact:?}");
        let radial = borders.conditions(&paired(&of(1.0001, 0.7), k)).unwrap();
        let angular = borders.conditions(&paired(&of(1.0, 0.7001), k)).unwrap();
        let area = radial[0] * angular[1] - radial[1] * angular[0];
        assert!(area.abs() > 1e-9, "{radial:?} {angular:?}");
    }
}
