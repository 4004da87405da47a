//! Leaving a path where another one crosses it.

use super::bordered::Bordered;
use super::{Continuation, ContinuationOptions, PathPoint};
use crate::error::SolveError;
use crate::numeric::factors::Factors;
use crate::solve::residual::{Linearisation, Residual};
use nalgebra::DVector;

/// The two ways along a path that crosses another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrossingSide {
    /// The way on which the largest part of the direction grows.
    Forward,
    /// The other one.
    Backward,
}

/// One of the directions in which branches may leave a crossing of equal parts.
///
/// m equal multipliers at a crossing span a null space of dimension m. Its basis is reduced until every vector has a large
/// coordinate that the others lack: parts that do not act on each other then have a vector each. Tried are each vector alone and,
/// for up to three of them, all sums and differences; for more, the sum of all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heading {
    multiplicity: usize,
    number: usize,
}

/// Largest multiplicity for which all sums and differences are tried.
const MOST_COMBINED: usize = 3;

impl Heading {
    /// The only one of a simple crossing.
    pub const ONLY: Heading = Heading {
        multiplicity: 1,
        number: 0,
    };

    /// All that are tried at a crossing, single parts first.
    pub fn all(multiplicity: usize) -> Vec<Heading> {
        let count = match multiplicity {
            0 | 1 => 1,
            m if m <= MOST_COMBINED => combinations(m).len(),
            m => m + 1,
        };
        let heading = |number| Heading {
            multiplicity: multiplicity.max(1),
            number,
        };
        (0..count).map(heading).collect()
    }

    /// Coefficients of the basis vectors.
    fn coefficients(self) -> Vec<f64> {
        let m = self.multiplicity;
        match m {
            _ if m <= MOST_COMBINED => combinations(m).swap_remove(self.number),
            _ if self.number < m => (0..m).map(|k| f64::from(k == self.number)).collect(),
            _ => vec![1.0; m],
        }
    }
}

/// All vectors of -1, 0 and 1 but for their sign, those with fewest entries first.
fn combinations(m: usize) -> Vec<Vec<f64>> {
    let digits = |code: usize| -> Vec<f64> {
        let digit = |k: u32| [0.0, 1.0, -1.0][code / 3_usize.pow(k) % 3];
        (0..m as u32).map(digit).collect()
    };
    let mut list: Vec<Vec<f64>> = (1..3_usize.pow(m as u32)).map(digits).collect();
    list.retain(|c| c.iter().find(|x| **x != 0.0) == Some(&1.0));
    list.sort_by_key(|c| c.iter().filter(|x| **x != 0.0).count());
    list
}

/// Inverse iterations; the smallest singular value lies below the next one by 1e-4 and less.
const ROUNDS: usize = 4;
/// Shifts of the parameter, relative to its size, tried where a pivot vanishes at the crossing itself.
const SHIFTS: [f64; 3] = [0.0, 1e-10, 1e-8];
/// Increment of the golden ratio: an uneven right-hand side, the same everywhere.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Continuation {
    /// A path at a crossing that leaves it along the direction that the known path does not have; `None` when
    /// there is no such direction.
    ///
    /// ```text
    /// [dR/du  dR/dlambda] n = 0,    <tangent, n> = 0
    /// ```
    ///
    /// `crossing` is a point of the known path with its tangent.
    ///
    /// # Errors
    /// Contradictory options, or errors of the problem.
    pub(crate) fn branch_off(
        problem: &mut dyn Residual,
        crossing: &PathPoint,
        (side, heading): (CrossingSide, Heading),
        options: ContinuationOptions,
    ) -> Result<Option<Continuation>, SolveError> {
        options.validate()?;
        let Some(direction) = direction(problem, crossing, options.weight, heading)? else {
            return Ok(None);
        };
        let mut origin = crossing.clone();
        let dim = problem.dim();
        (origin.tangent_u, origin.tangent_lambda) = (direction.rows(0, dim).into(), direction[dim]);
        // Neither path is the only one here: the determinant has no sign.
        origin.orientation = 0;
        let mut this = Continuation::standing(problem, origin, options);
        let (u, lambda) = (&this.origin.tangent_u, this.origin.tangent_lambda);
        let length = this.dot(u, lambda, u, lambda).sqrt();
        let sign = match side {
            CrossingSide::Forward => 1.0,
            CrossingSide::Backward => -1.0,
        };
        this.origin.tangent_u *= sign / length;
        this.origin.tangent_lambda *= sign / length;
        (this.first, this.point) = (this.origin.clone(), this.origin.clone());
        Ok(Some(this))
    }
}

/// Half width of the difference quotient along the interpolant, in lengths of the step.
const QUOTIENT: f64 = 1e-4;

impl Continuation {
    /// The point with the tangent of the interpolant at its fraction of the last step: at a crossing the corrector's matrix is
    /// singular and its tangent may lie anywhere between the two paths.
    pub(crate) fn with_smooth_tangent(&self, mut point: PathPoint, fraction: f64) -> PathPoint {
        let (before, lambda_before) = self.interpolate(fraction - QUOTIENT);
        let (behind, lambda_behind) = self.interpolate(fraction + QUOTIENT);
        let (u, lambda) = (behind - before, lambda_behind - lambda_before);
        let length = self.dot(&u, lambda, &u, lambda).sqrt();
        (point.tangent_u, point.tangent_lambda) = (u / length, lambda / length);
        point
    }
}

/// A null vector (u, lambda) that is orthogonal to the tangent, its largest part positive.
fn direction(
    problem: &mut dyn Residual,
    crossing: &PathPoint,
    weight: f64,
    heading: Heading,
) -> Result<Option<DVector<f64>>, SolveError> {
    let structure = problem.structure().bordered();
    let (mut inner, mut u) = (Linearisation::of(problem), crossing.u.clone());
    let mut bordered = Bordered {
        problem,
        base: crossing,
        weight,
        inner: &mut inner,
        u: &mut u,
    };
    let mut work = Linearisation::new(&structure);
    let mut factors = Factors::new(&structure);
    for shift in SHIFTS {
        let lambda = crossing.lambda * (1.0 + shift) + shift;
        bordered.linearise(&crossing.u.clone().push(lambda), 0.0, &mut work)?;
        if !factors.factorise(&work.dr_du) {
            continue;
        }
        let Some(mut basis) = null_space(&mut factors, &work, heading.multiplicity) else {
            continue;
        };
        reduce(&mut basis);
        let terms = basis.iter().zip(heading.coefficients());
        let direction = terms.fold(DVector::zeros(work.r.len()), |sum, (x, c)| sum + x * c);
        let largest = direction[direction.icamax()];
        return Ok(Some(direction / largest));
    }
    Ok(None)
}

/// The vectors that the matrix shrinks most, by inverse iteration of all together.
fn null_space(
    factors: &mut Factors,
    work: &Linearisation,
    count: usize,
) -> Option<Vec<DVector<f64>>> {
    let size = work.r.len();
    let start = |c: usize| move |k: usize, _: usize| ((k + c * size) as f64 * GOLDEN).fract() - 0.5;
    let mut basis: Vec<DVector<f64>> = (0..count)
        .map(|c| DVector::from_fn(size, start(c)))
        .collect();
    // The larger the solution, the smaller its product with the matrix.
    let mut best = (0.0, None);
    for _ in 0..ROUNDS {
        if !orthonormalise(&mut basis) || !basis.iter_mut().all(|x| factors.solve(&work.dr_du, x)) {
            break;
        }
        let growth = basis.iter().map(|x| x.norm()).fold(f64::INFINITY, f64::min);
        if growth.is_finite() && growth > best.0 {
            best = (growth, Some(basis.clone()));
        }
    }
    best.1
}

/// Gram and Schmidt's rule; false where the vectors depend on each other.
fn orthonormalise(basis: &mut [DVector<f64>]) -> bool {
    for k in 0..basis.len() {
        let (done, rest) = basis.split_at_mut(k);
        let x = &mut rest[0];
        for other in done {
            let part = other.dot(x);
            x.axpy(-part, other, 1.0);
        }
        let norm = x.norm();
        if norm == 0.0 || !norm.is_finite() {
            return false;
        }
        *x /= norm;
    }
    true
}

/// Gauss and Jordan's rule with the largest pivots: every vector has a coordinate that the others lack.
fn reduce(basis: &mut [DVector<f64>]) {
    if basis.len() < 2 || !orthonormalise(basis) {
        return;
    }
    for k in 0..basis.len() {
        let largest = |x: &DVector<f64>| x[x.icamax()].abs();
        let at =
            (k..basis.len()).max_by(|i, j| largest(&basis[*i]).total_cmp(&largest(&basis[*j])));
        basis.swap(k, at.unwrap_or(k));
        let pivot = basis[k].icamax();
        let row = &basis[k] / basis[k][pivot];
        for (j, x) in basis.iter_mut().enumerate() {
            if j != k {
                let part = x[pivot];
                x.axpy(-part, &row, 1.0);
            }
        }
        basis[k] = row;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_parts_come_first() {
        let two: Vec<_> = Heading::all(2)
            .into_iter()
            .map(Heading::coefficients)
            .collect();
        assert_eq!(two, [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]]);
        assert_eq!(Heading::all(3).len(), 13);
        assert_eq!(Heading::all(1), [Heading::ONLY]);
    }

    #[test]
    fn parts_that_do_not_act_on_each_other_are_told_apart() {
        let mixed = |c: f64, d: f64| DVector::from_vec(vec![c, 0.5 * c, d, -0.2 * d]);
        let mut basis = [mixed(0.6, 0.8), mixed(0.8, -0.6)];
        reduce(&mut basis);
        for x in &basis {
            let [p, q] = [x.rows(0, 2).norm(), x.rows(2, 2).norm()];
            assert!(p.min(q) < 1e-15 && p.max(q) > 0.5, "{x}");
        }
    }
}
