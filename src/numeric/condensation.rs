//! Exact condensation onto nonlinear coordinates: those that only linear connections deform leave the system harmonic by harmonic.
//!
//! The column of such a coordinate k has blocks that mix the coefficients of one harmonic only ([`Pairs`]), and they stay so as
//! long as no other coordinate has been eliminated:
//!
//! ```text
//! X_kp = S_kk^-1 S_kp,    S_qp <- S_qp - S_qk X_kp    for all p, q that share a block with k
//! ```
//!
//! costs (2H + 1)^2 a block, not (2H + 1)^3, and (2H + 1) where p is such a coordinate too. What is left, with its fill, is a
//! matrix of blocks again, for the other coordinates. The border of a path is condensed along.

use super::jacobian::{Blocks, add_product, dot};
use super::pairs::Pairs;
use super::pattern::{Eliminated, Pattern, eliminate};
use crate::interrupt;
use nalgebra::DVector;
use std::sync::Arc;

/// The condensed coordinates and their buffers.
#[derive(Debug)]
pub(super) struct Condensation {
    whole: Arc<Pattern>,
    steps: Vec<CondensationStep>,
    /// Remaining coordinates, ascending; positions of their blocks in the whole matrix.
    kept: Vec<usize>,
    sources: Vec<Option<usize>>,
    /// What is left of the matrix.
    left: Blocks,
    rhs: DVector<f64>,
    /// One coordinate's part of a solution.
    own: Vec<f64>,
}

/// One condensed coordinate.
#[derive(Debug)]
struct CondensationStep {
    coordinate: usize,
    /// S_kk, then its inverse; its position in the matrix.
    pivot: Pairs,
    position: usize,
    sign: i8,
    /// Numbers of later steps that share a block with it, then places of kept coordinates.
    later: Vec<usize>,
    kept: Vec<usize>,
    /// S_qk of all of them, and their positions in the matrix.
    below: Vec<Pairs>,
    below_from: Vec<Option<usize>>,
    /// S_kp, then X_kp, of the later steps; of the kept coordinates side by side, with the border's column last.
    right: Vec<Pairs>,
    right_full: Vec<f64>,
    right_from: Vec<Option<usize>>,
    /// Block of the border's row.
    row: Vec<f64>,
    /// Position of S_qp, q fastest.
    targets: Vec<EntryTarget>,
}

#[derive(Debug, Clone, Copy)]
enum EntryTarget {
    Pivot(usize),
    Below(usize, usize),
    Right(usize, usize),
    RightFull(usize, usize),
    Left(usize),
}

impl Condensation {
    /// Takes out the coordinates whose columns are paired.
    pub fn new(matrix: &Blocks, is_paired: &[bool]) -> Condensation {
        let whole = Arc::clone(&matrix.pattern);
        let eliminated = eliminate(&whole, |j| is_paired[j]);
        let kept: Vec<usize> = (0..whole.blocks()).filter(|j| !is_paired[*j]).collect();
        let mut place = vec![0; whole.blocks()];
        for list in [&eliminated.order, &kept] {
            list.iter().enumerate().for_each(|(k, j)| place[*j] = k);
        }
        let between = eliminated.left.iter().enumerate().flat_map(|(j, list)| {
            let place = &place;
            list.iter().map(move |i| (place[*i], place[j]))
        });
        let pattern = Arc::new(Pattern::new(kept.len(), whole.size(), between));
        let sources = (0..kept.len())
            .flat_map(|j| pattern.column(j).iter().map(move |i| (*i, j)))
            .map(|(i, j)| whole.position(kept[i], kept[j]))
            .collect();
        let mut steps = steps(&whole, &eliminated, &place, is_paired);
        for k in 0..steps.len() {
            steps[k].targets = targets(&steps, &pattern, k);
        }
        let left = Blocks::new(&pattern, matrix.border.is_some());
        Condensation {
            whole,
            steps,
            kept,
            sources,
            rhs: DVector::zeros(left.dim()),
            own: vec![0.0; left.pattern.size()],
            left,
        }
    }

    /// Condensed coordinates.
    pub fn count(&self) -> usize {
        self.steps.len()
    }

    /// Multiplications in units of size^3.
    pub fn cost(&self) -> f64 {
        let size = self.whole.size() as f64;
        let one = |step: &CondensationStep| {
            let (a, b) = (step.later.len() as f64, step.kept.len() as f64);
            (1.0 + a + b) * (2.0 * b / size + 4.0 * a / (size * size))
        };
        self.steps.iter().map(one).sum()
    }

    /// Remaining system after [`Condensation::reduce`].
    pub fn left(&self) -> &Blocks {
        &self.left
    }

    /// Condenses a matrix; false where a coordinate cannot be taken out.
    pub fn reduce(&mut self, matrix: &Blocks) -> bool {
        self.load(matrix);
        (0..self.steps.len()).all(|k| !interrupt::is_requested() && self.eliminate(k))
    }

    fn load(&mut self, matrix: &Blocks) {
        let size = self.whole.size();
        let rows = |j: usize| j * size..(j + 1) * size;
        for step in &mut self.steps {
            let block = |position: &Option<usize>| position.map(|p| matrix.block(p));
            step.pivot.load(Some(matrix.block(step.position)));
            for (below, from) in step.below.iter_mut().zip(&step.below_from) {
                below.load(block(from));
            }
            let (paired, full) = step.right_from.split_at(step.later.len());
            for (right, from) in step.right.iter_mut().zip(paired) {
                right.load(block(from));
            }
            for (right, from) in step.right_full.chunks_exact_mut(size * size).zip(full) {
                copy(block(from), right);
            }
            if let Some(border) = &matrix.border {
                let rows = rows(step.coordinate);
                step.column_mut()
                    .copy_from_slice(&border.column.as_slice()[rows.clone()]);
                step.row.copy_from_slice(&border.row.as_slice()[rows]);
            }
        }
        for (position, from) in self.sources.iter().enumerate() {
            let source = from.map(|p| matrix.block(p));
            copy(source, self.left.block_mut(position));
        }
        if let (Some(from), Some(to)) = (&matrix.border, &mut self.left.border) {
            for (place, j) in self.kept.iter().enumerate() {
                let (here, there) = (rows(place), rows(*j));
                to.column.as_mut_slice()[here.clone()]
                    .copy_from_slice(&from.column.as_slice()[there.clone()]);
                to.row.as_mut_slice()[here].copy_from_slice(&from.row.as_slice()[there]);
            }
            to.corner = from.corner;
        }
    }

    fn eliminate(&mut self, k: usize) -> bool {
        let (done, rest) = self.steps.split_at_mut(k + 1);
        let step = &mut done[k];
        let size = step.row.len();
        step.sign = step.pivot.invert();
        if step.sign == 0 {
            return false;
        }
        for right in &mut step.right {
            right.multiply_from_left(&step.pivot);
        }
        for column in step.right_full.chunks_exact_mut(size) {
            step.pivot.apply(column);
        }
        let (paired, all) = (step.later.len(), step.below.len());
        for (t, target) in step.targets.iter().enumerate() {
            let (below, p) = (&step.below[t % all], t / all);
            match *target {
                EntryTarget::Pivot(s) => {
                    (rest[s - k - 1].pivot).subtract_product(below, &step.right[p])
                }
                EntryTarget::Below(s, i) => {
                    rest[s - k - 1].below[i].subtract_product(below, &step.right[p]);
                }
                EntryTarget::Right(s, i) => {
                    rest[s - k - 1].right[i].subtract_product(below, &step.right[p]);
                }
                EntryTarget::RightFull(s, i) => {
                    let block = rest[s - k - 1].full_mut(i);
                    subtract(below, step.full(p - paired), block, size);
                }
                EntryTarget::Left(position) => {
                    let block = self.left.block_mut(position);
                    subtract(below, step.full(p - paired), block, size);
                }
            }
        }
        condense_border(step, rest, k, &mut self.left);
        true
    }

    /// Takes the condensed coordinates out of a right-hand side; the rest of it.
    pub fn forward(&mut self, x: &mut DVector<f64>) -> &mut DVector<f64> {
        let size = self.whole.size();
        let (x, border) = x.as_mut_slice().split_at_mut(self.whole.dim());
        let rows = |j: usize| j * size..(j + 1) * size;
        let own = &mut self.own;
        for step in &self.steps {
            step.pivot.apply(&mut x[rows(step.coordinate)]);
            own.copy_from_slice(&x[rows(step.coordinate)]);
            let later = step.later.iter().map(|s| self.steps[*s].coordinate);
            let others = later.chain(step.kept.iter().map(|place| self.kept[*place]));
            for (below, j) in step.below.iter().zip(others) {
                below.subtract_from(own, &mut x[rows(j)]);
            }
            if let Some(b) = border.first_mut() {
                *b -= dot(&step.row, own);
            }
        }
        let (left, last) = self.rhs.as_mut_slice().split_at_mut(self.kept.len() * size);
        for (to, j) in left.chunks_exact_mut(size).zip(&self.kept) {
            to.copy_from_slice(&x[rows(*j)]);
        }
        last.copy_from_slice(border);
        &mut self.rhs
    }

    /// The whole solution from that of the rest, which [`Condensation::forward`] handed out.
    pub fn backward(&mut self, x: &mut DVector<f64>) {
        let size = self.whole.size();
        let (x, border) = x.as_mut_slice().split_at_mut(self.whole.dim());
        let rows = |j: usize| j * size..(j + 1) * size;
        let (left, last) = self.rhs.as_slice().split_at(self.kept.len() * size);
        for (from, j) in left.chunks_exact(size).zip(&self.kept) {
            x[rows(*j)].copy_from_slice(from);
        }
        border.copy_from_slice(last);
        let own = &mut self.own;
        for step in self.steps.iter().rev() {
            own.copy_from_slice(&x[rows(step.coordinate)]);
            for (right, s) in step.right.iter().zip(&step.later) {
                right.subtract_from(&x[rows(self.steps[*s].coordinate)], own);
            }
            for (p, place) in step.kept.iter().enumerate() {
                add_product(step.full(p), &x[rows(self.kept[*place])], -1.0, own);
            }
            if let Some(b) = border.first() {
                let column = own.iter_mut().zip(step.column());
                column.for_each(|(x, c)| *x -= b * c);
            }
            x[rows(step.coordinate)].copy_from_slice(own);
        }
    }

    /// Sign of the determinant of the condensed part.
    pub fn determinant_sign(&self) -> i8 {
        self.steps.iter().map(|step| step.sign).product()
    }
}

impl CondensationStep {
    /// S_kp or X_kp of a kept coordinate.
    fn full(&self, p: usize) -> &[f64] {
        let area = self.row.len().pow(2);
        &self.right_full[p * area..(p + 1) * area]
    }

    fn full_mut(&mut self, p: usize) -> &mut [f64] {
        let area = self.row.len().pow(2);
        &mut self.right_full[p * area..(p + 1) * area]
    }

    /// Block of the border's column.
    fn column(&self) -> &[f64] {
        &self.right_full[self.kept.len() * self.row.len().pow(2)..]
    }

    fn column_mut(&mut self) -> &mut [f64] {
        let begin = self.kept.len() * self.row.len().pow(2);
        &mut self.right_full[begin..]
    }
}

/// The border's share of the elimination of step k.
fn condense_border(
    step: &CondensationStep,
    rest: &mut [CondensationStep],
    k: usize,
    left: &mut Blocks,
) {
    let Some(border) = &mut left.border else {
        return;
    };
    let size = step.row.len();
    let (later, kept) = step.below.split_at(step.later.len());
    border.corner -= dot(&step.row, step.column());
    for ((below, right), s) in later.iter().zip(&step.right).zip(&step.later) {
        let other = &mut rest[s - k - 1];
        below.subtract_from(step.column(), other.column_mut());
        right.transpose_subtract_from(&step.row, &mut other.row);
    }
    for (p, (below, place)) in kept.iter().zip(&step.kept).enumerate() {
        let rows = place * size..(place + 1) * size;
        let column = &mut border.column.as_mut_slice()[rows.clone()];
        below.subtract_from(step.column(), column);
        let row = border.row.as_mut_slice()[rows].iter_mut();
        for (r, x) in row.zip(step.full(p).chunks_exact(size)) {
            *r -= dot(&step.row, x);
        }
    }
}

/// The steps with buffers, without their targets.
fn steps(
    whole: &Pattern,
    eliminated: &Eliminated,
    place: &[usize],
    is_paired: &[bool],
) -> Vec<CondensationStep> {
    let size = whole.size();
    let one = |(j, sharing): (&usize, &Vec<usize>)| {
        let part = |paired: bool| -> Vec<usize> {
            let part = sharing.iter().filter(|i| is_paired[**i] == paired);
            part.map(|i| place[*i]).collect()
        };
        let mut later = part(true);
        later.sort_unstable();
        let kept = part(false);
        let numbers = later.iter().map(|s| eliminated.order[*s]);
        let others: Vec<usize> = numbers
            .chain(sharing.iter().copied().filter(|i| !is_paired[*i]))
            .collect();
        CondensationStep {
            coordinate: *j,
            pivot: Pairs::new(size),
            position: whole.position(*j, *j).expect(DIAGONAL),
            sign: 0,
            below: vec![Pairs::new(size); others.len()],
            below_from: others.iter().map(|i| whole.position(*i, *j)).collect(),
            right: vec![Pairs::new(size); later.len()],
            right_full: vec![0.0; (kept.len() * size + 1) * size],
            right_from: others.iter().map(|i| whole.position(*j, *i)).collect(),
            row: vec![0.0; size],
            targets: Vec::new(),
            later,
            kept,
        }
    };
    eliminated
        .order
        .iter()
        .zip(&eliminated.sharing)
        .map(one)
        .collect()
}

/// Where the products of step k go.
fn targets(steps: &[CondensationStep], left: &Pattern, k: usize) -> Vec<EntryTarget> {
    let step = &steps[k];
    let find = |list: &[usize], x: usize| list.binary_search(&x).expect(FILLED);
    let (a, all) = (step.later.len(), step.below.len());
    let of = |q: usize, p: usize| match (q < a, p < a) {
        (true, true) => {
            let (q, p) = (step.later[q], step.later[p]);
            match q.cmp(&p) {
                std::cmp::Ordering::Equal => EntryTarget::Pivot(q),
                std::cmp::Ordering::Less => EntryTarget::Right(q, find(&steps[q].later, p)),
                std::cmp::Ordering::Greater => EntryTarget::Below(p, find(&steps[p].later, q)),
            }
        }
        (true, false) => {
            let q = step.later[q];
            EntryTarget::RightFull(q, find(&steps[q].kept, step.kept[p - a]))
        }
        (false, true) => {
            let p = step.later[p];
            let within = find(&steps[p].kept, step.kept[q - a]);
            EntryTarget::Below(p, steps[p].later.len() + within)
        }
        (false, false) => {
            let position = left.position(step.kept[q - a], step.kept[p - a]);
            EntryTarget::Left(position.expect(FILLED))
        }
    };
    (0..all)
        .flat_map(|p| (0..all).map(move |q| (q, p)))
        .map(|(q, p)| of(q, p))
        .collect()
}

const DIAGONAL: &str = "the diagonal belongs to every pattern";
const FILLED: &str = "elimination fills the blocks between neighbours";

/// A block of the matrix, or the zeros of one that only fill will need.
fn copy(from: Option<&[f64]>, to: &mut [f64]) {
    match from {
        Some(from) => to.copy_from_slice(from),
        None => to.fill(0.0),
    }
}

/// C <- C - A B, column by column.
fn subtract(a: &Pairs, b: &[f64], c: &mut [f64], size: usize) {
    let columns = b.chunks_exact(size).zip(c.chunks_exact_mut(size));
    columns.for_each(|(b, c)| a.subtract_from(b, c));
}
