//! Forces that push but do not pull: the linear complementarity problem of a few contacts.

use nalgebra::{DMatrix, DVector};

/// Smallest share of its diagonal that an elimination may leave.
const DEPENDENT: f64 = 1e-11;
/// Share of the largest side within which a force or an acceleration is rounding.
const NOTHING: f64 = 1e-14;

/// f with f >= 0, D f >= b and, of each pair of the two, one equal to 0.
///
/// One index at a time enters or leaves the forces that are not zero: the one that is most wrong, which of parallel contacts takes the one
/// that is enough; if that does not end soon, the first that is wrong (Murty), finite where every principal minor is positive. `None` where
/// the forces are not determined.
pub(crate) fn solve(d: &DMatrix<f64>, b: &[f64]) -> Option<Vec<f64>> {
    let count = b.len();
    let nothing = NOTHING * b.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let mut active: Vec<usize> = Vec::with_capacity(count);
    let most = 100 + 20 * count * count;
    for round in 0..most {
        let among = d.select_rows(&active).select_columns(&active);
        let sides = DVector::from_iterator(active.len(), active.iter().map(|k| b[*k]));
        let found = match active.is_empty() {
            true => sides,
            false => inverse(&among)? * sides,
        };
        let mut forces = vec![0.0; count];
        active
            .iter()
            .zip(found.iter())
            .for_each(|(k, f)| forces[*k] = *f);
        let left = |k: usize| -> f64 {
            let taken: f64 = active.iter().map(|a| d[(k, *a)] * forces[*a]).sum();
            b[k] - taken
        };
        let wrong = |k: usize| match active.contains(&k) {
            true if forces[k] <= 0.0 => f64::MIN_POSITIVE - forces[k],
            false if left(k) > nothing => left(k) / d[(k, k)].abs(),
            _ => 0.0,
        };
        let all = (0..count).filter(|k| wrong(*k) > 0.0);
        let next = match round < 4 * count {
            true => all.max_by(|a, b| wrong(*a).total_cmp(&wrong(*b))),
            false => all.min(),
        };
        let Some(wrong) = next else {
            return Some(forces);
        };
        match active.iter().position(|k| *k == wrong) {
            Some(place) => {
                active.remove(place);
            }
            None => active.push(wrong),
        }
    }
    None
}

/// The inverse of a small matrix; `None` where a row depends on the others.
pub(crate) fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = matrix.nrows();
    let scale = |i: usize| matrix[(i, i)].abs().sqrt();
    if (0..size).any(|i| scale(i) == 0.0) {
        return None;
    }
    let unit = DMatrix::from_fn(size, size, |i, j| matrix[(i, j)] / (scale(i) * scale(j)));
    let lu = unit.clone().lu();
    let pivots = lu.u().diagonal();
    if pivots.iter().any(|p| p.abs() < DEPENDENT) {
        return None;
    }
    let inverse = lu.try_inverse()?;
    Some(DMatrix::from_fn(size, size, |i, j| {
        inverse[(i, j)] / (scale(i) * scale(j))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three contacts in a row, one of which would have to pull.
    #[test]
    fn no_force_pulls_and_nothing_is_passed() {
        let d = DMatrix::from_row_slice(3, 3, &[2.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0]);
        let b = [1.0, -3.0, 0.5];
        let f = solve(&d, &b).unwrap();
        assert_eq!(f, [0.5, 0.0, 0.25]);
    }

    /// Of two parallel contacts the one that reaches farther is enough; of two that press against each other the forces are not determined.
    #[test]
    fn parallel_contacts() {
        let ones = DMatrix::from_element(2, 2, 1.0);
        assert_eq!(solve(&ones, &[0.1, 0.3]).unwrap(), [0.0, 0.3]);
        assert_eq!(solve(&ones, &[0.3, 0.1]).unwrap(), [0.3, 0.0]);
        let opposed = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]);
        assert_eq!(solve(&opposed, &[0.3, 0.1]), None);
    }
}
