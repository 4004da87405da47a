//! Factors of a Jacobian of either shape, with a check of every solution by blocks.

use super::block::{BlockLu, TOO_STILL};
use super::condensation::Condensation;
use super::dense::Lu;
use super::jacobian::{Blocks, Jacobian, JacobianStructure};
use super::pairs;
use super::pattern::{self, Elimination, Pattern};
use crate::interrupt;
use nalgebra::DVector;
use std::sync::Arc;

/// LU factors of a Jacobian.
///
/// Coordinates that only linear connections deform are condensed first, where that is cheaper; the rest is eliminated by blocks or
/// dense, whichever is faster. Elimination by blocks exchanges rows inside the blocks only. What it returns is checked against
/// the matrix: a residual beyond rounding is corrected by refinement, and where that fails the matrix is factorised again, dense
/// and with row exchanges across all coordinates.
#[derive(Debug)]
pub struct Factors {
    rest: Rest,
    condensation: Option<Box<Condensation>>,
    watch: Condensable,
    /// The whole matrix with row exchanges, if that was necessary or requested.
    dense: Option<Lu>,
    is_dense: bool,
    exchanges: usize,
    /// Largest entry of the matrix factorised last.
    largest: f64,
    residual: DVector<f64>,
    rhs: DVector<f64>,
}

/// Remaining system after condensation.
#[derive(Debug)]
enum Rest {
    Unknown,
    Dense(Lu),
    Block(Box<BlockLu>),
}

/// Coordinates that can be condensed.
#[derive(Debug, Default)]
struct Condensable {
    pattern: Option<Arc<Pattern>>,
    is_paired: Vec<bool>,
    /// Matrices seen since a coordinate's column had other entries, or the coordinate was needed in the rest.
    since: Vec<usize>,
}

/// Matrices after which a coordinate whose column has been paired ever since is condensed again. Every change costs an
/// analysis: coordinates that come and go stay.
const PATIENCE: usize = 64;
/// How many times faster than condensation a dense elimination runs, a multiplication each.
const SLOWNESS: f64 = 2.0 * pattern::ADVANTAGE;

/// Residual of a solution, relative to the terms that cancel in it, that counts as rounding.
const ROUNDING: f64 = 1e-13;
/// Residual beyond which a refined solution is given up.
const USELESS: f64 = 1e-10;
/// Refinements at most.
const REFINEMENTS: usize = 3;
/// Rows of the largest matrix that is factorised dense when elimination by blocks fails: 300 MB.
const LARGEST_DENSE: usize = 6000;

impl Factors {
    /// Buffers for matrices of this shape.
    pub fn new(structure: &JacobianStructure) -> Factors {
        let dim = structure.dim();
        let dense = match structure {
            JacobianStructure::Dense(_) => Some(Lu::new(dim)),
            JacobianStructure::Block(_) | JacobianStructure::BorderedBlock(_) => None,
        };
        Factors {
            rest: Rest::Unknown,
            condensation: None,
            watch: Condensable::default(),
            dense,
            is_dense: true,
            exchanges: 0,
            largest: 0.0,
            residual: DVector::zeros(dim),
            rhs: DVector::zeros(dim),
        }
    }

    /// Factorises; false when the matrix is singular to working precision or has an entry that is not finite.
    pub fn factorise(&mut self, matrix: &Jacobian) -> bool {
        match matrix {
            _ if interrupt::is_requested() => false,
            Jacobian::Dense(_) => self.factorise_dense(matrix),
            Jacobian::Block(blocks) => {
                self.is_dense = false;
                self.largest = matrix.amax();
                self.factorise_blocks(blocks) || self.exchange_rows(matrix)
            }
        }
    }

    fn factorise_blocks(&mut self, blocks: &Blocks) -> bool {
        if self.watch.update(blocks) {
            self.condensation = condensed(blocks, &self.watch.is_paired).map(Box::new);
            self.rest = Rest::Unknown;
        }
        match &mut self.condensation {
            None => self.rest.factorise(blocks),
            Some(condensation) => {
                condensation.reduce(blocks) && self.rest.factorise(condensation.left())
            }
        }
    }

    fn factorise_dense(&mut self, matrix: &Jacobian) -> bool {
        let dim = matrix.dim();
        let lu = match &mut self.dense {
            Some(lu) if lu.rows() == dim => lu,
            other => other.insert(Lu::new(dim)),
        };
        self.is_dense = true;
        match matrix {
            Jacobian::Dense(matrix) => lu.factorise(matrix),
            Jacobian::Block(blocks) => {
                blocks.copy_to(lu.matrix_mut());
                lu.factorise_stored()
            }
        }
    }

    /// Dense elimination instead of that by blocks.
    fn exchange_rows(&mut self, matrix: &Jacobian) -> bool {
        let is_exchanged = matches!(self.rest, Rest::Dense(_)) && self.condensation.is_none();
        if is_exchanged || matrix.dim() > LARGEST_DENSE || interrupt::is_requested() {
            return false;
        }
        self.exchanges += 1;
        self.factorise_dense(matrix)
    }

    /// Overwrites `rhs` with the solution of A x = rhs, A the matrix factorised last; false when none could be found.
    pub fn solve(&mut self, matrix: &Jacobian, rhs: &mut DVector<f64>) -> bool {
        if self.is_dense {
            return self.solve_dense(rhs);
        }
        self.rhs.copy_from(rhs);
        solve_blocks(&mut self.condensation, &mut self.rest, rhs);
        if self.condensation.is_none() && matches!(self.rest, Rest::Dense(_)) {
            return true;
        }
        let mut size = self.judge(matrix, rhs);
        for _ in 0..REFINEMENTS {
            if size <= ROUNDING {
                return true;
            }
            solve_blocks(&mut self.condensation, &mut self.rest, &mut self.residual);
            *rhs += &self.residual;
            let refined = self.judge(matrix, rhs);
            // NaN is not progress either.
            let improves = refined < 0.5 * size;
            size = refined;
            if !improves {
                break;
            }
        }
        if size <= USELESS {
            return true;
        }
        rhs.copy_from(&self.rhs);
        self.exchange_rows(matrix) && self.solve_dense(rhs)
    }

    fn solve_dense(&mut self, rhs: &mut DVector<f64>) -> bool {
        if let Some(lu) = &mut self.dense {
            lu.solve(rhs);
        }
        self.dense.is_some()
    }

    /// Residual of a solution into its buffer; its size relative to the terms that cancel in it.
    fn judge(&mut self, matrix: &Jacobian, x: &DVector<f64>) -> f64 {
        matrix.multiply(x, &mut self.residual);
        let size = self.residual.amax().max(self.rhs.amax());
        for (r, b) in self.residual.iter_mut().zip(&self.rhs) {
            *r = b - *r;
        }
        let terms = size.max(self.largest * x.amax());
        let error = self.residual.amax() / terms.max(f64::MIN_POSITIVE);
        if x.iter().all(|x| x.is_finite()) {
            error
        } else {
            f64::INFINITY
        }
    }

    /// Sign of the determinant of the matrix factorised last.
    pub fn determinant_sign(&self) -> i8 {
        let condensed = self.condensation.as_ref();
        match (&self.rest, &self.dense) {
            (_, Some(lu)) if self.is_dense => lu.determinant_sign(),
            (rest, _) => condensed.map_or(1, |c| c.determinant_sign()) * rest.determinant_sign(),
        }
    }

    /// Coordinates condensed in the matrix factorised last.
    pub fn condensed(&self) -> usize {
        let condensation = self.condensation.as_ref().filter(|_| !self.is_dense);
        condensation.map_or(0, |c| c.count())
    }

    /// Number of times elimination by blocks was replaced by row exchanges across all coordinates.
    pub fn exchanges(&self) -> usize {
        self.exchanges
    }
}

/// Condensation of a matrix where it is cheaper than going without.
fn condensed(matrix: &Blocks, is_paired: &[bool]) -> Option<Condensation> {
    if !is_paired.contains(&true) {
        return None;
    }
    let time = |pattern: &Pattern| match Elimination::cost(pattern) {
        Some(cost) => pattern::ADVANTAGE * cost,
        None => pattern::dense_cost(pattern.blocks()),
    };
    let condensation = Condensation::new(matrix, is_paired);
    let rest = time(&condensation.left().pattern);
    (rest + SLOWNESS * condensation.cost() < time(&matrix.pattern)).then_some(condensation)
}

fn solve_blocks(
    condensation: &mut Option<Box<Condensation>>,
    rest: &mut Rest,
    x: &mut DVector<f64>,
) {
    match condensation {
        None => rest.solve(x),
        Some(condensation) => {
            rest.solve(condensation.forward(x));
            condensation.backward(x);
        }
    }
}

impl Condensable {
    /// Looks at a matrix; whether the coordinates to condense are others than before.
    fn update(&mut self, matrix: &Blocks) -> bool {
        let (pattern, count) = (&matrix.pattern, matrix.pattern.blocks());
        let is_new = !matches!(&self.pattern, Some(p) if Arc::ptr_eq(p, pattern) || p == pattern);
        if is_new {
            self.pattern = Some(Arc::clone(pattern));
            self.since = vec![PATIENCE; count];
            self.is_paired = vec![false; count];
        }
        let size = pattern.size();
        let mut position = 0;
        for j in 0..count {
            let blocks = position..position + pattern.column(j).len();
            position = blocks.end;
            let is_paired = blocks
                .into_iter()
                .all(|p| pairs::is_paired(matrix.block(p), size));
            self.since[j] = if is_paired {
                self.since[j].saturating_add(1)
            } else {
                0
            };
        }
        if let Some(needed) = self.needed(matrix) {
            self.since[needed] = 0;
        }
        let mut is_other = is_new;
        for (paired, since) in self.is_paired.iter_mut().zip(&self.since) {
            let now = *since > PATIENCE;
            is_other |= now != *paired;
            *paired = now;
        }
        is_other
    }

    /// A coordinate that has to stay in the rest though its column is paired: at a fold the matrix without its border is
    /// singular along the border's row, which has to move something there.
    fn needed(&self, matrix: &Blocks) -> Option<usize> {
        let count = self.since.len();
        let Some(border) = &matrix.border else {
            return self
                .since
                .iter()
                .all(|since| *since > PATIENCE)
                .then_some(count - 1);
        };
        let size = matrix.pattern.size();
        let (best, largest) = border.fastest(size);
        let rest = (0..count).filter(|j| self.since[*j] <= PATIENCE);
        let stays = rest.map(|j| border.motion(j, size)).fold(0.0, f64::max);
        (stays <= TOO_STILL * largest).then_some(best)
    }
}

impl Rest {
    /// Factorises; false when a pivot vanishes or is not finite.
    fn factorise(&mut self, matrix: &Blocks) -> bool {
        let fits = match self {
            Rest::Unknown => false,
            Rest::Dense(lu) => lu.rows() == matrix.dim(),
            Rest::Block(lu) => lu.fits(matrix),
        };
        if !fits {
            *self = match Elimination::cost(&matrix.pattern) {
                None => Rest::Dense(Lu::new(matrix.dim())),
                Some(_) => Rest::Block(Box::new(BlockLu::new(matrix))),
            };
        }
        match self {
            Rest::Unknown => unreachable!("set above"),
            Rest::Dense(lu) => {
                matrix.copy_to(lu.matrix_mut());
                lu.factorise_stored()
            }
            Rest::Block(lu) => lu.factorise(matrix),
        }
    }

    fn solve(&mut self, rhs: &mut DVector<f64>) {
        match self {
            Rest::Unknown => {}
            Rest::Dense(lu) => lu.solve(rhs),
            Rest::Block(lu) => lu.solve(rhs),
        }
    }

    fn determinant_sign(&self) -> i8 {
        match self {
            Rest::Unknown => 0,
            Rest::Dense(lu) => lu.determinant_sign(),
            Rest::Block(lu) => lu.determinant_sign(),
        }
    }
}
