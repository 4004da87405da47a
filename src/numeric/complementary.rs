//! Forces that push but do not pull: the linear complementarity problem of a few contacts.

use nalgebra::{DMatrix, DVector};

/// Smallest share of its diagonal that an elimination may leave.
const DEPENDENT: f64 = 1e-11;
/// Share of the largest side within which a force or an acceleration is rounding.
const NOTHING: f64 = 1e-14;

/// Share of the largest side by which contacts that depend on each other may disagree.
const SAME: f64 = 1e-9;
/// Coupling of two contacts, relative to their own mobilities, that is rounding.
const UNCOUPLED: f64 = 1e-20;

/// f with f >= 0, D f >= b and, of each pair of the two, one equal to 0; D = G diag(k) with G symmetric and without negative eigenvalue.
///
/// The minimum of the energy x^T U x / 2 - c^T x over x >= 0, U: D balanced. One contact at a time joins those that press; one that depends
/// on them takes over from the one that it relieves first. G f, thus the motion, is unique; of contacts that depend on each other, as few as
/// possible press. `None` where contacts contradict each other.
pub(crate) fn solve(d: &DMatrix<f64>, b: &[f64]) -> Option<Vec<f64>> {
    let count = b.len();
    let balance = ContactScales::of(d)?;
    let u = balance.matrix(d);
    let c: Vec<f64> = b.iter().zip(&balance.left).map(|(b, l)| b * l).collect();
    let largest = c.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let mut pressing = Pressing::new(count);
    let most = 100 + 20 * count * count;
    for round in 0..most {
        let lacks = |k: usize| match pressing.takes_part(k) {
            true => 0.0,
            false => pressing.lack(&u, &c, k),
        };
        let all = (0..count).filter(|k| lacks(*k) > NOTHING * largest);
        let next = match round < 4 * count {
            true => all.max_by(|a, b| lacks(*a).total_cmp(&lacks(*b))),
            false => all.min(),
        };
        let Some(next) = next else {
            return forces(d, b, &pressing.active);
        };
        let lack = lacks(next);
        if !pressing.admit(&u, next, lack > SAME * largest)? {
            continue;
        }
        pressing.settle(&u, &c)?;
        if !pressing.active.contains(&next) {
            pressing.carried.push(next);
        }
    }
    None
}

/// Forces of the contacts that press.
fn forces(d: &DMatrix<f64>, b: &[f64], active: &[usize]) -> Option<Vec<f64>> {
    let mut forces = vec![0.0; b.len()];
    if active.is_empty() {
        return Some(forces);
    }
    let among = d.select_rows(active).select_columns(active);
    let sides = DVector::from_iterator(active.len(), active.iter().map(|k| b[*k]));
    let found = inverse(&among)? * sides;
    for (k, f) in active.iter().zip(found.iter()) {
        forces[*k] = f.max(f64::MIN_POSITIVE);
    }
    Some(forces)
}

/// The contacts that press, and their forces, in the balanced problem.
struct Pressing {
    x: Vec<f64>,
    active: Vec<usize>,
    /// Contacts that others keep where they are, within rounding.
    carried: Vec<usize>,
}

impl Pressing {
    fn new(count: usize) -> Pressing {
        Pressing {
            x: vec![0.0; count],
            active: Vec::with_capacity(count),
            carried: Vec::new(),
        }
    }

    fn takes_part(&self, k: usize) -> bool {
        self.active.contains(&k) || self.carried.contains(&k)
    }

    /// What a contact lacks.
    fn lack(&self, u: &DMatrix<f64>, c: &[f64], k: usize) -> f64 {
        let taken: f64 = self.active.iter().map(|a| u[(k, *a)] * self.x[*a]).sum();
        c[k] - taken
    }

    /// Lets a contact press; whether the forces change. `None` where nothing relieves it.
    fn admit(&mut self, u: &DMatrix<f64>, next: usize, is_sure: bool) -> Option<bool> {
        let along = self.follow(u, next)?;
        let shared: f64 = (self.active.iter().zip(&along))
            .map(|(a, y)| u[(next, *a)] * y)
            .sum();
        if u[(next, next)] - shared > DEPENDENT {
            self.active.push(next);
            return Some(true);
        }
        if !is_sure {
            self.carried.push(next);
            return Some(false);
        }
        let relief = |place: usize| self.x[self.active[place]] / along[place];
        let first = (0..along.len())
            .filter(|p| along[*p] > DEPENDENT)
            .min_by(|a, b| relief(*a).total_cmp(&relief(*b)))?;
        let step = relief(first);
        for (a, y) in self.active.iter().zip(&along) {
            self.x[*a] -= step * y;
        }
        self.x[next] = step;
        let relieved = std::mem::replace(&mut self.active[first], next);
        self.x[relieved] = 0.0;
        // What had been carried by the others may have to press now.
        self.carried.clear();
        Some(true)
    }

    /// U_AA^-1 U_Aj.
    fn follow(&self, u: &DMatrix<f64>, j: usize) -> Option<Vec<f64>> {
        let side = |a: &usize| u[(*a, j)];
        self.balance_among(u, side)
    }

    fn balance_among(&self, u: &DMatrix<f64>, side: impl Fn(&usize) -> f64) -> Option<Vec<f64>> {
        if self.active.is_empty() {
            return Some(Vec::new());
        }
        let among = u.select_rows(&self.active).select_columns(&self.active);
        let sides = DVector::from_iterator(self.active.len(), self.active.iter().map(side));
        let found = among.lu().solve(&sides)?;
        Some(found.iter().copied().collect())
    }

    /// Goes to the balance of the contacts that press, past those that would have to pull.
    fn settle(&mut self, u: &DMatrix<f64>, c: &[f64]) -> Option<()> {
        while !self.active.is_empty() {
            let wanted = self.balance_among(u, |a| c[*a])?;
            let pulls = wanted.iter().any(|x| *x <= 0.0);
            let share = |place: usize| {
                let x = self.x[self.active[place]];
                match wanted[place] <= 0.0 {
                    true => x / (x - wanted[place]).max(f64::MIN_POSITIVE),
                    false => 1.0,
                }
            };
            let first = (0..wanted.len()).min_by(|a, b| share(*a).total_cmp(&share(*b)))?;
            let step = share(first).min(1.0);
            for (a, wanted) in self.active.iter().zip(&wanted) {
                self.x[*a] += step * (wanted - self.x[*a]);
            }
            if !pulls {
                break;
            }
            self.x[self.active[first]] = 0.0;
            self.active.remove(first);
        }
        Some(())
    }
}

/// Factors l and r with which l_i d_ij r_j is symmetric and 1 on its diagonal.
struct ContactScales {
    left: Vec<f64>,
    right: Vec<f64>,
}

impl ContactScales {
    /// `None` where a contact moves nothing.
    fn of(d: &DMatrix<f64>) -> Option<ContactScales> {
        let count = d.nrows();
        let mut weights = vec![0.0; count];
        for root in 0..count {
            if weights[root] != 0.0 {
                continue;
            }
            weights[root] = 1.0;
            let mut list = vec![root];
            while let Some(i) = list.pop() {
                for j in 0..count {
                    let (there, back) = (d[(i, j)], d[(j, i)]);
                    let own = (d[(i, i)] * d[(j, j)]).abs();
                    if weights[j] == 0.0 && there * back > UNCOUPLED * own {
                        weights[j] = weights[i] * there / back;
                        list.push(j);
                    }
                }
            }
        }
        let own: Vec<f64> = (0..count)
            .map(|i| (d[(i, i)] / weights[i]).sqrt())
            .collect();
        if !own.iter().all(|g| *g > 0.0) {
            return None;
        }
        Some(ContactScales {
            left: own.iter().map(|g| 1.0 / g).collect(),
            right: own
                .iter()
                .zip(&weights)
                .map(|(g, k)| 1.0 / (g * k))
                .collect(),
        })
    }

    fn matrix(&self, d: &DMatrix<f64>) -> DMatrix<f64> {
        let entry = |i: usize, j: usize| self.left[i] * d[(i, j)] * self.right[j];
        DMatrix::from_fn(d.nrows(), d.ncols(), |i, j| {
            0.5 * (entry(i, j) + entry(j, i))
        })
    }
}

/// The inverse of a small matrix D = G diag(k) as above; where rows depend on others the least forces that give a motion, in units that do
/// not depend on those of the rows. `None` where a contact moves nothing.
pub(crate) fn least(d: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if let Some(inverse) = inverse(d) {
        return Some(inverse);
    }
    let balance = ContactScales::of(d)?;
    let eigen = balance.matrix(d).symmetric_eigen();
    let kept = eigen
        .eigenvalues
        .map(|x| if x > DEPENDENT { 1.0 / x } else { 0.0 });
    let mut scaled = eigen.eigenvectors.clone();
    for (mut column, factor) in scaled.column_iter_mut().zip(kept.iter()) {
        column *= *factor;
    }
    let among = scaled * eigen.eigenvectors.transpose();
    Some(DMatrix::from_fn(d.nrows(), d.ncols(), |i, j| {
        balance.right[i] * among[(i, j)] * balance.left[j]
    }))
}

/// Of solutions f of [`solve`] that give the same motion the least one, if all its forces push: contacts that are alike bear alike.
pub(crate) fn share(d: &DMatrix<f64>, b: &[f64], f: Vec<f64>) -> Vec<f64> {
    let is_tight = |k: usize| {
        let parts = (0..b.len()).map(|j| d[(k, j)] * f[j]);
        let (sum, size) = parts.fold((0.0, 0.0), |(s, m), x| (s + x, m + f64::abs(x)));
        f[k] > 0.0 || (size > 0.0 && (sum - b[k]).abs() <= SAME * size)
    };
    let tight: Vec<usize> = (0..b.len()).filter(|k| is_tight(*k)).collect();
    if tight.len() == f.iter().filter(|f| **f > 0.0).count() {
        return f;
    }
    let among = d.select_rows(&tight).select_columns(&tight);
    let sides = DVector::from_iterator(tight.len(), tight.iter().map(|k| b[*k]));
    let Some(found) = least(&among).map(|inverse| inverse * sides) else {
        return f;
    };
    if found.iter().any(|f| *f <= 0.0) {
        return f;
    }
    let mut shared = vec![0.0; b.len()];
    tight
        .iter()
        .zip(found.iter())
        .for_each(|(k, f)| shared[*k] = *f);
    shared
}

/// Combinations of the rows of such a matrix that vanish, column by column: n^T D = 0.
pub(crate) fn dependences(d: &DMatrix<f64>) -> DMatrix<f64> {
    let Some(balance) = ContactScales::of(d) else {
        return DMatrix::zeros(d.nrows(), 0);
    };
    let eigen = balance.matrix(d).symmetric_eigen();
    let columns: Vec<usize> = (0..d.nrows())
        .filter(|k| eigen.eigenvalues[*k] <= DEPENDENT)
        .collect();
    let mut list = eigen.eigenvectors.select_columns(&columns);
    for (mut row, left) in list.row_iter_mut().zip(&balance.left) {
        row *= *left;
    }
    list
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

    /// Of two parallel contacts the one that reaches farther is enough, of equal ones the first; two that press against each other
    /// contradict each other.
    #[test]
    fn parallel_contacts() {
        let ones = DMatrix::from_element(2, 2, 1.0);
        assert_eq!(solve(&ones, &[0.1, 0.3]).unwrap(), [0.0, 0.3]);
        assert_eq!(solve(&ones, &[0.3, 0.1]).unwrap(), [0.3, 0.0]);
        let equal = solve(&ones, &[0.3, 0.3]).unwrap();
        assert_eq!(equal.iter().sum::<f64>(), 0.3);
        let opposed = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]);
        assert_eq!(solve(&opposed, &[0.3, 0.1]), None);
        let turned = solve(&opposed, &[0.3, -0.3]).unwrap();
        assert_eq!(turned, [0.3, 0.0]);
    }

    /// Random contacts, more of them than they move coordinates, with lever arms and stiffnesses of all sizes: forces push, no contact is
    /// passed, and only contacts that are reached press.
    #[test]
    fn dependent_contacts_are_complementary() {
        let mut seed = 7_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for _ in 0..500 {
            let (n, count) = (2, 5);
            let arms = DMatrix::from_fn(count, n, |_, _| random());
            let k: Vec<f64> = (0..count).map(|_| 10_f64.powf(6.0 * random())).collect();
            let g = &arms * arms.transpose();
            let d = DMatrix::from_fn(count, count, |i, j| g[(i, j)] * k[j]);
            // Sides that a motion in the coordinates can meet.
            let motion = DVector::from_fn(n, |_, _| random());
            let b: Vec<f64> = (&arms * motion)
                .iter()
                .map(|x| x - 0.1 * random().abs())
                .collect();
            let f = solve(&d, &b).unwrap();
            let moved = &d * DVector::from_vec(f.clone());
            for i in 0..count {
                let excess = moved[i] - b[i];
                assert!(f[i] >= 0.0 && excess >= -1e-9, "{f:?} {excess}");
                assert!(f[i] == 0.0 || excess.abs() < 1e-9, "{f:?} {excess}");
            }
        }
    }

    /// The least forces of two parallel contacts are equal whatever the units of their stiffnesses.
    #[test]
    fn parallel_contacts_share_alike() {
        // One mass on two stops with reference stiffnesses 1 and 4, whose forces are in these units.
        let d = DMatrix::from_row_slice(2, 2, &[1.0, 4.0, 1.0, 4.0]);
        let f = least(&d).unwrap() * DVector::from_vec(vec![1.0, 1.0]);
        assert!((f[0] - 0.5).abs() < 1e-12 && (4.0 * f[1] - 0.5).abs() < 1e-12);
        let free = dependences(&d);
        assert_eq!(free.ncols(), 1);
        assert!((free[0] + free[1]).abs() < 1e-12);
    }
}
