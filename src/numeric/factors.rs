//! Factors of a Jacobian of either shape, with a check of every solution by blocks.

use super::block::BlockLu;
use super::dense::Lu;
use super::jacobian::{Blocks, Jacobian, Structure};
use nalgebra::DVector;

/// LU factors of a Jacobian.
///
/// Elimination by blocks exchanges rows inside the blocks only. What it returns is checked against the matrix: a residual
/// beyond rounding is corrected by refinement, and where that fails the matrix is factorised anew, dense and with row
/// exchanges across all coordinates.
#[derive(Debug)]
pub struct Factors {
    shape: Shape,
    dense: Option<Lu>,
    is_dense: bool,
    exchanges: usize,
    /// Largest entry of the matrix factorised last.
    largest: f64,
    residual: DVector<f64>,
    rhs: DVector<f64>,
}

#[derive(Debug)]
enum Shape {
    Unknown,
    Dense,
    Block(Box<BlockLu>),
}

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
    pub fn new(structure: &Structure) -> Factors {
        let dim = structure.dim();
        let (shape, dense) = match structure {
            Structure::Dense(_) => (Shape::Dense, Some(Lu::new(dim))),
            Structure::Block(_) | Structure::BorderedBlock(_) => (Shape::Unknown, None),
        };
        Factors {
            shape,
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
            Jacobian::Dense(_) => {
                self.shape = Shape::Dense;
                self.factorise_dense(matrix)
            }
            Jacobian::Block(blocks) => {
                self.is_dense = false;
                self.largest = matrix.amax();
                self.block(blocks).factorise(blocks) || self.exchange_rows(matrix)
            }
        }
    }

    fn block(&mut self, matrix: &Blocks) -> &mut BlockLu {
        let fits = matches!(&self.shape, Shape::Block(lu) if lu.fits(matrix));
        if !fits {
            self.shape = Shape::Block(Box::new(BlockLu::new(matrix)));
        }
        match &mut self.shape {
            Shape::Block(lu) => lu,
            _ => unreachable!("set above"),
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
            blocks => lu.factorise(&blocks.to_dense()),
        }
    }

    /// Dense elimination instead of that by blocks.
    fn exchange_rows(&mut self, matrix: &Jacobian) -> bool {
        if matrix.dim() > LARGEST_DENSE {
            return false;
        }
        self.exchanges += 1;
        self.factorise_dense(matrix)
    }

    /// Overwrites `rhs` with the solution of A x = rhs, A the matrix factorised last; false when none could be found.
    pub fn solve(&mut self, matrix: &Jacobian, rhs: &mut DVector<f64>) -> bool {
        let Shape::Block(lu) = &mut self.shape else {
            return self.solve_dense(rhs);
        };
        if self.is_dense {
            return self.solve_dense(rhs);
        }
        self.rhs.copy_from(rhs);
        lu.solve(rhs);
        let mut size = self.judge(matrix, rhs);
        for _ in 0..REFINEMENTS {
            if size <= ROUNDING {
                return true;
            }
            let Shape::Block(lu) = &mut self.shape else {
                break;
            };
            lu.solve(&mut self.residual);
            *rhs += &self.residual;
            let refined = self.judge(matrix, rhs);
            // NaN is no progress either.
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
        match (&self.shape, &self.dense) {
            (Shape::Block(lu), _) if !self.is_dense => lu.determinant_sign(),
            (_, Some(lu)) => lu.determinant_sign(),
            _ => 0,
        }
    }

    /// How often elimination by blocks gave way to row exchanges across all coordinates.
    pub fn exchanges(&self) -> usize {
        self.exchanges
    }
}
