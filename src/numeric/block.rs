//! LU factorisation block by block, in time and memory linear in the length of a train.
//!
//! With the coordinates in the order of their elimination, S_kk the block of the k-th when its turn comes:
//!
//! ```text
//! X_kp = S_kk^-1 S_kp,    S_qp <- S_qp - S_qk X_kp    for all later p, q that share a block with k
//! ```
//!
//! Rows are exchanged inside S_kk only. A border (last row and column) travels along and is eliminated together with the
//! last coordinate, in one block with pivoting. At a fold the matrix without its border is singular along the tangent of
//! the path; the last coordinate is one that moves along it, so that every block before the last one stays regular.

use super::dense::{Lu, subtract_product};
use super::jacobian::{Blocks, add_product, dot};
use super::pattern::{Elimination, Pattern};
use crate::interrupt;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Share of the largest block of the border's row below which another coordinate becomes the last one.
pub(super) const TOO_STILL: f64 = 0.1;

/// Factors of a matrix of blocks.
#[derive(Debug)]
pub struct BlockLu {
    pattern: Arc<Pattern>,
    is_bordered: bool,
    elimination: Elimination,
    fronts: Vec<Front>,
    /// The last coordinate and the border.
    root: Lu,
    root_column: DVector<f64>,
    root_row: DVector<f64>,
    corner: f64,
    root_rhs: DVector<f64>,
}

/// One coordinate, at its place in the order.
#[derive(Debug)]
struct Front {
    /// S_kk.
    pivot: Lu,
    /// S_kp, then X_kp, side by side; the border's column comes last.
    right: DMatrix<f64>,
    /// S_qk.
    below: Vec<DMatrix<f64>>,
    /// Block of the border's row.
    row: DVector<f64>,
    /// Places of the later coordinates.
    later: Vec<usize>,
    /// Position of S_qp, q fastest.
    targets: Vec<BlockTarget>,
}

/// Place of a block: on the diagonal of a front, right of it or below it.
#[derive(Debug, Clone, Copy)]
enum BlockTarget {
    Pivot(usize),
    Right(usize, usize),
    Below(usize, usize),
}

impl BlockTarget {
    /// Place of block (q, p) of the ordered matrix.
    fn of(later: &[Vec<usize>], q: usize, p: usize) -> BlockTarget {
        let within = |front: usize, other: usize| {
            later[front]
                .binary_search(&other)
                .expect("elimination fills the blocks between later neighbours")
        };
        match q.cmp(&p) {
            std::cmp::Ordering::Equal => BlockTarget::Pivot(q),
            std::cmp::Ordering::Less => BlockTarget::Right(q, within(q, p)),
            std::cmp::Ordering::Greater => BlockTarget::Below(p, within(p, q)),
        }
    }
}

impl Front {
    fn new(size: usize, later: &[Vec<usize>], k: usize) -> Front {
        let own = &later[k];
        let pairs = own.iter().flat_map(|p| own.iter().map(move |q| (*q, *p)));
        let columns = own.len() * size + 1;
        Front {
            pivot: Lu::with_columns(size, columns),
            right: DMatrix::zeros(size, columns),
            below: vec![DMatrix::zeros(size, size); own.len()],
            row: DVector::zeros(size),
            targets: pairs.map(|(q, p)| BlockTarget::of(later, q, p)).collect(),
            later: own.clone(),
        }
    }

    /// S_kp or X_kp.
    fn right_block(&self, p: usize) -> &[f64] {
        let area = self.right.nrows().pow(2);
        &self.right.as_slice()[p * area..(p + 1) * area]
    }

    /// Block of the border's column.
    fn column(&self) -> &[f64] {
        let size = self.right.nrows();
        &self.right.as_slice()[self.later.len() * size * size..]
    }

    fn column_mut(&mut self) -> &mut [f64] {
        let size = self.right.nrows();
        &mut self.right.as_mut_slice()[self.later.len() * size * size..]
    }
}

/// The block at a place of the fronts from number `first` on.
fn block_mut(fronts: &mut [Front], first: usize, target: BlockTarget) -> &mut [f64] {
    match target {
        BlockTarget::Pivot(k) => fronts[k - first].pivot.matrix_mut().as_mut_slice(),
        BlockTarget::Right(k, p) => {
            let front = &mut fronts[k - first];
            let area = front.right.nrows().pow(2);
            &mut front.right.as_mut_slice()[p * area..(p + 1) * area]
        }
        BlockTarget::Below(k, q) => fronts[k - first].below[q].as_mut_slice(),
    }
}

impl BlockLu {
    /// Analysis and buffers for matrices like this one.
    pub fn new(matrix: &Blocks) -> BlockLu {
        let last = matrix.pattern.blocks() - 1;
        let elimination = Elimination::new(&matrix.pattern, last);
        BlockLu::ordered(matrix, elimination)
    }

    fn ordered(matrix: &Blocks, elimination: Elimination) -> BlockLu {
        let pattern = Arc::clone(&matrix.pattern);
        let (size, is_bordered) = (pattern.size(), matrix.border.is_some());
        let fronts = (0..pattern.blocks())
            .map(|k| Front::new(size, &elimination.later, k))
            .collect();
        let rows = size + usize::from(is_bordered);
        BlockLu {
            fronts,
            root: Lu::new(rows),
            root_column: DVector::zeros(size),
            root_row: DVector::zeros(size),
            corner: 0.0,
            root_rhs: DVector::zeros(rows),
            pattern,
            is_bordered,
            elimination,
        }
    }

    /// Whether the buffers fit this matrix.
    pub fn fits(&self, matrix: &Blocks) -> bool {
        self.is_bordered == matrix.border.is_some()
            && (Arc::ptr_eq(&self.pattern, &matrix.pattern) || self.pattern == matrix.pattern)
    }

    /// Blocks stored, fill included.
    pub fn stored(&self) -> usize {
        self.elimination.stored()
    }

    /// Factorises; false when a pivot vanishes or is not finite.
    pub fn factorise(&mut self, matrix: &Blocks) -> bool {
        self.choose_last(matrix);
        self.load(matrix);
        let last = self.fronts.len() - 1;
        (0..last).all(|k| !interrupt::is_requested() && self.eliminate(k)) && self.factorise_root()
    }

    /// Keeps a coordinate that moves along the border's row, the tangent of a path, for the end.
    fn choose_last(&mut self, matrix: &Blocks) {
        let Some(border) = &matrix.border else { return };
        let size = self.pattern.size();
        let (best, largest) = border.fastest(size);
        let last = self.elimination.order[self.fronts.len() - 1];
        if border.motion(last, size) < TOO_STILL * largest {
            let elimination = Elimination::new(&self.pattern, best);
            *self = BlockLu::ordered(matrix, elimination);
        }
    }

    /// Copies the matrix into the fronts.
    fn load(&mut self, matrix: &Blocks) {
        let size = self.pattern.size();
        for (k, front) in self.fronts.iter_mut().enumerate() {
            let j = self.elimination.order[k];
            front.right.fill(0.0);
            let position = self.pattern.position(j, j).expect(DIAGONAL);
            (front.pivot.matrix_mut().as_mut_slice()).copy_from_slice(matrix.block(position));
            for (p, place) in front.later.iter().enumerate() {
                let i = self.elimination.order[*place];
                let (right, below) = (self.pattern.position(j, i), self.pattern.position(i, j));
                let area = size * size;
                if let Some(position) = right {
                    front.right.as_mut_slice()[p * area..(p + 1) * area]
                        .copy_from_slice(matrix.block(position));
                }
                match below {
                    Some(position) => {
                        front.below[p]
                            .as_mut_slice()
                            .copy_from_slice(matrix.block(position));
                    }
                    None => front.below[p].fill(0.0),
                }
            }
            if let Some(border) = &matrix.border {
                let rows = j * size..(j + 1) * size;
                front
                    .column_mut()
                    .copy_from_slice(&border.column.as_slice()[rows.clone()]);
                front
                    .row
                    .as_mut_slice()
                    .copy_from_slice(&border.row.as_slice()[rows]);
            }
        }
        self.corner = matrix.border.as_ref().map_or(0.0, |border| border.corner);
    }

    /// Eliminates the coordinate at place k from the later ones.
    fn eliminate(&mut self, k: usize) -> bool {
        let (done, rest) = self.fronts.split_at_mut(k + 1);
        let front = &mut done[k];
        if !front.pivot.factorise_stored() {
            return false;
        }
        let columns = front.right.ncols() - usize::from(!self.is_bordered);
        front
            .pivot
            .solve_columns(front.right.as_mut_slice(), columns);
        let count = front.later.len();
        for (t, target) in front.targets.iter().enumerate() {
            let block = block_mut(rest, k + 1, *target);
            let size = front.right.nrows();
            subtract_product(
                block,
                front.below[t % count].as_slice(),
                front.right_block(t / count),
                size,
            );
        }
        if self.is_bordered {
            self.corner -= dot(front.row.as_slice(), front.column());
            for (p, place) in front.later.iter().enumerate() {
                let later = &mut rest[place - k - 1];
                add_product(
                    front.below[p].as_slice(),
                    front.column(),
                    -1.0,
                    later.column_mut(),
                );
                let size = later.row.len();
                for (r, column) in later
                    .row
                    .iter_mut()
                    .zip(front.right_block(p).chunks_exact(size))
                {
                    *r -= dot(front.row.as_slice(), column);
                }
            }
        }
        true
    }

    /// Factorises the last coordinate with the border.
    fn factorise_root(&mut self) -> bool {
        let (size, last) = (self.pattern.size(), self.fronts.len() - 1);
        let front = &mut self.fronts[last];
        self.root_column
            .as_mut_slice()
            .copy_from_slice(front.column());
        self.root_row.copy_from(&front.row);
        let root = self.root.matrix_mut();
        root.view_mut((0, 0), (size, size))
            .copy_from(front.pivot.matrix_mut());
        if self.is_bordered {
            root.view_mut((0, size), (size, 1))
                .copy_from(&self.root_column);
            root.view_mut((size, 0), (1, size))
                .tr_copy_from(&self.root_row);
            root[(size, size)] = self.corner;
        }
        self.root.factorise_stored()
    }

    /// Sign of the determinant of the factorised matrix.
    pub fn determinant_sign(&self) -> i8 {
        let last = self.fronts.len() - 1;
        let fronts = self.fronts[..last]
            .iter()
            .map(|front| front.pivot.determinant_sign());
        fronts.product::<i8>() * self.root.determinant_sign()
    }

    /// Overwrites `rhs` with the solution.
    pub fn solve(&mut self, rhs: &mut DVector<f64>) {
        let (size, last) = (self.pattern.size(), self.fronts.len() - 1);
        let order = &self.elimination.order;
        let (x, border) = rhs.as_mut_slice().split_at_mut(self.pattern.dim());
        let rows = |place: usize| order[place] * size..(order[place] + 1) * size;
        for k in 0..last {
            let front = &mut self.fronts[k];
            front.pivot.solve_columns(&mut x[rows(k)], 1);
            for (below, place) in front.below.iter().zip(&front.later) {
                let (from, to) = disjoint(x, rows(k), rows(*place));
                add_product(below.as_slice(), from, -1.0, to);
            }
            if let Some(b) = border.first_mut() {
                *b -= dot(front.row.as_slice(), &x[rows(k)]);
            }
        }
        let root = self.root_rhs.as_mut_slice();
        root[..size].copy_from_slice(&x[rows(last)]);
        root[size..].copy_from_slice(border);
        self.root.solve(&mut self.root_rhs);
        x[rows(last)].copy_from_slice(&self.root_rhs.as_slice()[..size]);
        border.copy_from_slice(&self.root_rhs.as_slice()[size..]);
        for k in (0..last).rev() {
            let front = &self.fronts[k];
            for (p, place) in front.later.iter().enumerate() {
                let (from, to) = disjoint(x, rows(*place), rows(k));
                add_product(front.right_block(p), from, -1.0, to);
            }
            if let Some(b) = border.first() {
                for (x, c) in x[rows(k)].iter_mut().zip(front.column()) {
                    *x -= b * c;
                }
            }
        }
    }
}

const DIAGONAL: &str = "the diagonal belongs to every pattern";

/// Two stretches of a vector, the first to read, the second to write.
fn disjoint(
    x: &mut [f64],
    from: std::ops::Range<usize>,
    to: std::ops::Range<usize>,
) -> (&[f64], &mut [f64]) {
    if from.start < to.start {
        let (left, right) = x.split_at_mut(to.start);
        (&left[from], &mut right[..to.end - to.start])
    } else {
        let (left, right) = x.split_at_mut(from.start);
        (&right[..from.end - from.start], &mut left[to])
    }
}
