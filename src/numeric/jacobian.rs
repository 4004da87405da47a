//! Jacobian matrices: dense, or the blocks of coordinates that share equations.

use super::dense::zeros;
use super::pattern::Pattern;
use nalgebra::{DMatrix, DVector};
use std::ops::{Index, IndexMut};
use std::sync::Arc;

/// Shape of a Jacobian.
#[derive(Debug, Clone)]
pub enum JacobianStructure {
    /// n x n entries.
    Dense(usize),
    /// Blocks of a pattern.
    Block(Arc<Pattern>),
    /// Blocks of a pattern, one row and one column more.
    BorderedBlock(Arc<Pattern>),
}

/// Blocks below which every entry is stored: their analysis costs more than it saves.
const FEW: usize = 3;

impl JacobianStructure {
    /// Blocks, except for one or two coordinates.
    pub fn chosen(pattern: Pattern) -> JacobianStructure {
        if pattern.blocks() < FEW {
            return JacobianStructure::Dense(pattern.dim());
        }
        JacobianStructure::Block(Arc::new(pattern))
    }

    /// Rows.
    pub fn dim(&self) -> usize {
        match self {
            JacobianStructure::Dense(dim) => *dim,
            JacobianStructure::Block(pattern) => pattern.dim(),
            JacobianStructure::BorderedBlock(pattern) => pattern.dim() + 1,
        }
    }

    /// Whether every one of these pairs of blocks has its place.
    pub fn holds(&self, pairs: impl IntoIterator<Item = (usize, usize)>) -> bool {
        match self {
            JacobianStructure::Dense(_) => true,
            JacobianStructure::Block(pattern) | JacobianStructure::BorderedBlock(pattern) => {
                (pairs.into_iter()).all(|(i, j)| pattern.position(i, j).is_some())
            }
        }
    }

    /// Adds one row and one column.
    ///
    /// # Panics
    /// It has a border already.
    pub fn bordered(&self) -> JacobianStructure {
        match self {
            JacobianStructure::Dense(dim) => JacobianStructure::Dense(dim + 1),
            JacobianStructure::Block(pattern) => {
                JacobianStructure::BorderedBlock(Arc::clone(pattern))
            }
            JacobianStructure::BorderedBlock(_) => panic!("one border only"),
        }
    }
}

/// A square matrix of one of the two shapes.
#[derive(Debug, Clone)]
pub enum Jacobian {
    /// Every entry.
    Dense(DMatrix<f64>),
    /// Blocks, with or without a border.
    Block(Blocks),
}

/// The blocks of a pattern and, where there is one, a last row and column.
#[derive(Debug, Clone)]
pub struct Blocks {
    pub(super) pattern: Arc<Pattern>,
    /// Block after block, column by column of the pattern; each block column by column.
    pub(super) values: Vec<f64>,
    pub(super) border: Option<Border>,
}

/// Last row and last column of a bordered matrix.
#[derive(Debug, Clone)]
pub(crate) struct Border {
    pub(super) column: DVector<f64>,
    pub(super) row: DVector<f64>,
    pub(super) corner: f64,
}

impl Border {
    /// Largest entry of one coordinate's part of the row.
    pub(super) fn motion(&self, j: usize, size: usize) -> f64 {
        let block = &self.row.as_slice()[j * size..(j + 1) * size];
        block.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
    }

    /// The coordinate that moves most along the row, and how far.
    pub(super) fn fastest(&self, size: usize) -> (usize, f64) {
        let (mut best, mut largest) = (0, 0.0);
        for j in 0..self.row.len() / size {
            let motion = self.motion(j, size);
            if motion > largest {
                (best, largest) = (j, motion);
            }
        }
        (best, largest)
    }
}

impl Jacobian {
    /// Zero matrix of this shape.
    pub fn new(structure: &JacobianStructure) -> Jacobian {
        match structure {
            JacobianStructure::Dense(dim) => Jacobian::Dense(zeros(*dim, *dim)),
            JacobianStructure::Block(pattern) => Jacobian::Block(Blocks::new(pattern, false)),
            JacobianStructure::BorderedBlock(pattern) => {
                Jacobian::Block(Blocks::new(pattern, true))
            }
        }
    }

    /// Takes this shape, with zeros, unless it has it already.
    pub fn reshape(&mut self, structure: &JacobianStructure) {
        let has_it = match (&*self, structure) {
            (Jacobian::Dense(matrix), JacobianStructure::Dense(dim)) => matrix.nrows() == *dim,
            (Jacobian::Block(blocks), JacobianStructure::Block(pattern)) => {
                blocks.border.is_none() && is_same(&blocks.pattern, pattern)
            }
            (Jacobian::Block(blocks), JacobianStructure::BorderedBlock(pattern)) => {
                blocks.border.is_some() && is_same(&blocks.pattern, pattern)
            }
            _ => false,
        };
        if !has_it {
            *self = Jacobian::new(structure);
        }
    }

    /// Rows.
    pub fn dim(&self) -> usize {
        match self {
            Jacobian::Dense(matrix) => matrix.nrows(),
            Jacobian::Block(blocks) => blocks.dim(),
        }
    }

    /// Sets every entry of the shape; a border keeps its own.
    pub fn fill(&mut self, value: f64) {
        match self {
            Jacobian::Dense(matrix) => matrix.fill(value),
            Jacobian::Block(blocks) => blocks.values.fill(value),
        }
    }

    /// Largest entry in modulus, the border left out.
    pub fn amax(&self) -> f64 {
        match self {
            Jacobian::Dense(matrix) => matrix.amax(),
            Jacobian::Block(blocks) => blocks.values.iter().fold(0.0, |m, x| m.max(x.abs())),
        }
    }

    /// The block (i, j) of a matrix of `size` x `size` blocks.
    ///
    /// # Panics
    /// A block outside the pattern: the pattern was made for another system.
    pub(crate) fn block_mut(&mut self, size: usize, (i, j): (usize, usize)) -> BlockMut<'_> {
        let (values, begin, stride) = match self {
            Jacobian::Dense(matrix) => {
                let rows = matrix.nrows();
                (matrix.as_mut_slice(), j * size * rows + i * size, rows)
            }
            Jacobian::Block(blocks) => {
                let position = blocks.pattern.position(i, j).expect(IN_PATTERN);
                (&mut blocks.values[..], position * size * size, size)
            }
        };
        let end = begin + (size - 1) * stride + size;
        BlockMut {
            values: &mut values[begin..end],
            size,
            stride,
        }
    }

    /// Replaces a row and a column by those of the unit matrix; a border keeps its own.
    pub fn pin(&mut self, at: usize) {
        match self {
            Jacobian::Dense(matrix) => {
                matrix.row_mut(at).fill(0.0);
                matrix.column_mut(at).fill(0.0);
                matrix[(at, at)] = 1.0;
            }
            Jacobian::Block(blocks) => {
                for k in 0..blocks.pattern.dim() {
                    for entry in [(at, k), (k, at)] {
                        if let Some(place) = blocks.place(entry) {
                            blocks.values[place] = if k == at { 1.0 } else { 0.0 };
                        }
                    }
                }
            }
        }
    }

    /// Borders `inner`, whose entries move here: [inner, column; row, corner]. `row(k)` gives the last row.
    pub fn take_bordered(
        &mut self,
        inner: &mut Jacobian,
        column: &DVector<f64>,
        row: impl Fn(usize) -> f64,
        corner: f64,
    ) {
        self.reshape(&inner.structure().bordered());
        let dim = column.len();
        match (self, inner) {
            (Jacobian::Dense(outer), Jacobian::Dense(inner)) => {
                outer.view_mut((0, 0), (dim, dim)).copy_from(inner);
                outer.view_mut((0, dim), (dim, 1)).copy_from(column);
                (0..dim).for_each(|k| outer[(dim, k)] = row(k));
                outer[(dim, dim)] = corner;
            }
            (
                Jacobian::Block(Blocks {
                    values,
                    border: Some(border),
                    ..
                }),
                Jacobian::Block(inner),
            ) => {
                std::mem::swap(values, &mut inner.values);
                border.column.copy_from(column);
                (0..dim).for_each(|k| border.row[k] = row(k));
                border.corner = corner;
            }
            _ => unreachable!("both have the same shape"),
        }
    }

    /// Its shape.
    pub fn structure(&self) -> JacobianStructure {
        match self {
            Jacobian::Dense(matrix) => JacobianStructure::Dense(matrix.nrows()),
            Jacobian::Block(blocks) if blocks.border.is_some() => {
                JacobianStructure::BorderedBlock(Arc::clone(&blocks.pattern))
            }
            Jacobian::Block(blocks) => JacobianStructure::Block(Arc::clone(&blocks.pattern)),
        }
    }

    /// y = A x.
    pub fn multiply(&self, x: &DVector<f64>, y: &mut DVector<f64>) {
        match self {
            Jacobian::Dense(matrix) => y.gemv(1.0, matrix, x, 0.0),
            Jacobian::Block(blocks) => blocks.multiply(x.as_slice(), y.as_mut_slice()),
        }
    }

    /// The same matrix with every entry.
    pub fn to_dense(&self) -> DMatrix<f64> {
        match self {
            Jacobian::Dense(matrix) => matrix.clone(),
            Jacobian::Block(blocks) => blocks.to_dense(),
        }
    }
}

/// One block of a Jacobian.
#[derive(Debug)]
pub(crate) struct BlockMut<'a> {
    values: &'a mut [f64],
    size: usize,
    stride: usize,
}

impl BlockMut<'_> {
    /// Column l.
    pub fn column(&mut self, l: usize) -> &mut [f64] {
        let begin = l * self.stride;
        &mut self.values[begin..begin + self.size]
    }

    /// Adds `factor` times a matrix of the same size, column by column.
    pub fn add(&mut self, factor: f64, block: &[f64]) {
        let columns = self.values.chunks_mut(self.stride);
        for (target, source) in columns.zip(block.chunks_exact(self.size)) {
            for (t, s) in target.iter_mut().zip(source) {
                *t += factor * s;
            }
        }
    }
}

const IN_PATTERN: &str = "the pattern holds every pair of coordinates that share a body";

fn is_same(a: &Arc<Pattern>, b: &Arc<Pattern>) -> bool {
    Arc::ptr_eq(a, b) || a == b
}

impl Blocks {
    /// Zeros.
    pub(super) fn new(pattern: &Arc<Pattern>, is_bordered: bool) -> Blocks {
        let zeros = || DVector::zeros(pattern.dim());
        Blocks {
            values: vec![0.0; pattern.stored() * pattern.size().pow(2)],
            border: is_bordered.then(|| Border {
                column: zeros(),
                row: zeros(),
                corner: 0.0,
            }),
            pattern: Arc::clone(pattern),
        }
    }

    /// Block at a position, column by column.
    pub(super) fn block(&self, position: usize) -> &[f64] {
        let area = self.pattern.size().pow(2);
        &self.values[position * area..(position + 1) * area]
    }

    /// The same, to be written.
    pub(super) fn block_mut(&mut self, position: usize) -> &mut [f64] {
        let area = self.pattern.size().pow(2);
        &mut self.values[position * area..(position + 1) * area]
    }

    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        let (size, dim) = (self.pattern.size(), self.pattern.dim());
        y.fill(0.0);
        let mut position = 0;
        for (j, x) in x[..dim].chunks_exact(size).enumerate() {
            for i in self.pattern.column(j) {
                let y = &mut y[i * size..(i + 1) * size];
                add_product(self.block(position), x, 1.0, y);
                position += 1;
            }
        }
        if let Some(border) = &self.border {
            let last = x[dim];
            for (y, b) in y.iter_mut().zip(&border.column) {
                *y += last * b;
            }
            y[dim] = dot(border.row.as_slice(), &x[..dim]) + border.corner * last;
        }
    }

    /// Rows, the border's included.
    pub(super) fn dim(&self) -> usize {
        self.pattern.dim() + usize::from(self.border.is_some())
    }

    fn to_dense(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.dim(), self.dim());
        self.copy_to(&mut dense);
        dense
    }

    /// Every entry, into a matrix of as many rows.
    pub(super) fn copy_to(&self, dense: &mut DMatrix<f64>) {
        let (size, dim) = (self.pattern.size(), self.pattern.dim());
        dense.fill(0.0);
        for j in 0..self.pattern.blocks() {
            for i in self.pattern.column(j) {
                let position = self.pattern.position(*i, j).expect(IN_PATTERN);
                let mut view = dense.view_mut((i * size, j * size), (size, size));
                view.copy_from_slice(self.block(position));
            }
        }
        if let Some(border) = &self.border {
            dense.view_mut((0, dim), (dim, 1)).copy_from(&border.column);
            (0..dim).for_each(|k| dense[(dim, k)] = border.row[k]);
            dense[(dim, dim)] = border.corner;
        }
    }
}

/// y += factor A x, A column by column.
pub(super) fn add_product(a: &[f64], x: &[f64], factor: f64, y: &mut [f64]) {
    for (column, x) in a.chunks_exact(y.len()).zip(x) {
        let x = factor * x;
        for (y, a) in y.iter_mut().zip(column) {
            *y += a * x;
        }
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Blocks {
    /// Place of entry (r, c) in `values`; `None` outside the pattern.
    fn place(&self, (r, c): (usize, usize)) -> Option<usize> {
        let size = self.pattern.size();
        let position = self.pattern.position(r / size, c / size)?;
        Some((position * size + c % size) * size + r % size)
    }
}

/// Entry (row, column) of the matrix; 0 outside the pattern. The border is not a part of it.
impl Index<(usize, usize)> for Jacobian {
    type Output = f64;

    fn index(&self, at: (usize, usize)) -> &f64 {
        match self {
            Jacobian::Dense(matrix) => &matrix[at],
            Jacobian::Block(blocks) => blocks.place(at).map_or(&0.0, |k| &blocks.values[k]),
        }
    }
}

/// Entry (row, column) of the matrix; panics outside the pattern. The border is not a part of it.
impl IndexMut<(usize, usize)> for Jacobian {
    fn index_mut(&mut self, at: (usize, usize)) -> &mut f64 {
        match self {
            Jacobian::Dense(matrix) => &mut matrix[at],
            Jacobian::Block(blocks) => {
                let place = blocks.place(at).expect(IN_PATTERN);
                &mut blocks.values[place]
            }
        }
    }
}
