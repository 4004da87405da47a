//! Which coordinates share equations, and the order in which they are eliminated.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

/// Pairs of coordinates whose block of a matrix may differ from zero. Symmetric; the diagonal always belongs to it.
///
/// A matrix of this pattern has `blocks` x `blocks` blocks of `size` x `size` entries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    size: usize,
    starts: Vec<usize>,
    rows: Vec<usize>,
}

impl Pattern {
    /// The pattern of these pairs, their mirror images and the diagonal.
    pub fn new(
        blocks: usize,
        size: usize,
        pairs: impl IntoIterator<Item = (usize, usize)>,
    ) -> Pattern {
        let mut columns: Vec<Vec<usize>> = (0..blocks).map(|j| vec![j]).collect();
        for (i, j) in pairs {
            columns[i].push(j);
            columns[j].push(i);
        }
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for mut column in columns {
            column.sort_unstable();
            column.dedup();
            rows.extend(column);
            starts.push(rows.len());
        }
        Pattern { size, starts, rows }
    }

    /// Coordinates.
    pub fn blocks(&self) -> usize {
        self.starts.len() - 1
    }

    /// Rows of a block.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Rows of the matrix.
    pub fn dim(&self) -> usize {
        self.blocks() * self.size
    }

    /// Blocks stored.
    pub fn stored(&self) -> usize {
        self.rows.len()
    }

    /// Rows of the blocks in a column, ascending.
    pub fn column(&self, j: usize) -> &[usize] {
        &self.rows[self.starts[j]..self.starts[j + 1]]
    }

    /// Position of block (i, j), counted column by column.
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        let within = self.column(j).binary_search(&i).ok()?;
        Some(self.starts[j] + within)
    }
}

/// An order of elimination and the blocks that it fills.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Elimination {
    /// Coordinates in the order in which they are eliminated.
    pub order: Vec<usize>,
    /// For every place in the order the later places that share a block with it, ascending, fill included.
    pub later: Vec<Vec<usize>>,
}

/// Coordinates eliminated from a pattern, and what is left.
#[derive(Debug)]
pub(super) struct Eliminated {
    /// In the order in which they are eliminated.
    pub order: Vec<usize>,
    /// For every one of them the others that share a block with it when its turn comes, ascending.
    pub sharing: Vec<Vec<usize>>,
    /// The blocks between those that are left, fill included: for every one of all coordinates, empty for eliminated ones.
    pub left: Vec<BTreeSet<usize>>,
}

/// Minimum degree, ties by number, among those wanted: the leaves of a tree go first, nothing fills.
pub(super) fn eliminate(pattern: &Pattern, is_wanted: impl Fn(usize) -> bool) -> Eliminated {
    let blocks = pattern.blocks();
    let others = |j: usize| pattern.column(j).iter().copied().filter(move |i| *i != j);
    let mut left: Vec<BTreeSet<usize>> = (0..blocks).map(|j| others(j).collect()).collect();
    let mut queue: BinaryHeap<Reverse<(usize, usize)>> = (0..blocks)
        .filter(|j| is_wanted(*j))
        .map(|j| Reverse((left[j].len(), j)))
        .collect();
    let (mut order, mut sharing) = (Vec::new(), Vec::new());
    let mut is_done = vec![false; blocks];
    while let Some(Reverse((degree, j))) = queue.pop() {
        if is_done[j] || degree != left[j].len() {
            continue;
        }
        is_done[j] = true;
        order.push(j);
        let clique: Vec<usize> = std::mem::take(&mut left[j]).into_iter().collect();
        for i in &clique {
            left[*i].remove(&j);
            left[*i].extend(clique.iter().filter(|k| *k != i));
            if is_wanted(*i) {
                queue.push(Reverse((left[*i].len(), *i)));
            }
        }
        sharing.push(clique);
    }
    Eliminated {
        order,
        sharing,
        left,
    }
}

impl Elimination {
    /// By minimum degree, with one coordinate kept for the end.
    pub fn new(pattern: &Pattern, last: usize) -> Elimination {
        let Eliminated {
            mut order,
            mut sharing,
            ..
        } = eliminate(pattern, |j| j != last);
        order.push(last);
        sharing.push(Vec::new());
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(k, j)| place[*j] = k);
        let later = sharing
            .into_iter()
            .map(|clique| {
                let mut places: Vec<usize> = clique.into_iter().map(|i| place[i]).collect();
                places.sort_unstable();
                places
            })
            .collect();
        Elimination { order, later }
    }

    /// Multiplications of elimination by blocks, in units of size^3, where that is much cheaper than dense elimination.
    pub fn cost(pattern: &Pattern) -> Option<f64> {
        let blocks = pattern.blocks();
        if blocks < 2 || pattern.stored() * CROWDED > blocks * blocks {
            return None;
        }
        let cost = Elimination::new(pattern, blocks - 1).operations();
        (cost * ADVANTAGE <= dense_cost(blocks)).then_some(cost)
    }

    /// Blocks of the factors, the diagonal included.
    pub fn stored(&self) -> usize {
        self.later.iter().map(|l| 1 + 2 * l.len()).sum()
    }

    /// Multiplications of a factorisation, in units of size^3: a third per pivot block, one per block of its row, one per product.
    pub fn operations(&self) -> f64 {
        let one = |later: &Vec<usize>| {
            let m = later.len() as f64;
            1.0 / 3.0 + m + m * m
        };
        self.later.iter().map(one).sum()
    }
}

/// How many times cheaper, in multiplications, elimination by blocks has to be: dense elimination runs so much faster on
/// large matrices than on small blocks.
pub(super) const ADVANTAGE: f64 = 4.0;
/// Share of blocks above which a pattern is not worth the analysis.
const CROWDED: usize = 3;

/// Multiplications of dense elimination, in units of size^3.
pub(super) fn dense_cost(blocks: usize) -> f64 {
    (blocks as f64).powi(3) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(n: usize) -> Pattern {
        Pattern::new(n, 3, (1..n).map(|k| (k - 1, k)))
    }

    #[test]
    fn a_tree_fills_nothing_whichever_coordinate_is_last() {
        // Ten coordinates, each hung on an earlier one.
        let tree = Pattern::new(10, 3, (1..10).map(|k| (k, (k * 7 % 5).min(k - 1))));
        for last in 0..10 {
            let elimination = Elimination::new(&tree, last);
            assert_eq!(elimination.stored(), tree.stored());
            assert_eq!(*elimination.order.last().unwrap(), last);
        }
    }

    #[test]
    fn the_cost_of_a_chain_grows_with_its_length() {
        let cost = |n: usize| Elimination::new(&chain(n), n - 1).operations();
        // Equal lengths cost the same wherever they are added.
        let (long, short) = (cost(400) - cost(40), cost(76) - cost(40));
        assert!((long / short - 10.0).abs() < 1e-9, "{long} {short}");
        assert_eq!(Elimination::new(&chain(400), 200).stored(), 3 * 400 - 2);
    }

    #[test]
    fn a_closed_chain_fills_one_row() {
        let ring = Pattern::new(30, 3, (0..30).map(|k| (k, (k + 1) % 30)));
        let elimination = Elimination::new(&ring, 0);
        // Every elimination joins two neighbours: at most two later blocks each.
        assert!(elimination.later.iter().all(|l| l.len() <= 2));
    }

    #[test]
    fn positions_count_column_by_column() {
        let pattern = chain(3);
        assert_eq!(pattern.stored(), 7);
        assert_eq!(pattern.position(1, 0), Some(1));
        assert_eq!(pattern.position(0, 2), None);
        assert_eq!(pattern.position(2, 2), Some(6));
    }
}
