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

    /// Where block (i, j) is stored, counted column by column.
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

impl Elimination {
    /// Minimum degree, ties by number, with one coordinate kept for the end: the leaves of a tree go first, nothing fills.
    pub fn new(pattern: &Pattern, last: usize) -> Elimination {
        let blocks = pattern.blocks();
        let mut neighbours: Vec<BTreeSet<usize>> = (0..blocks)
            .map(|j| {
                pattern
                    .column(j)
                    .iter()
                    .copied()
                    .filter(|i| *i != j)
                    .collect()
            })
            .collect();
        let mut queue: BinaryHeap<Reverse<(usize, usize)>> = (0..blocks)
            .filter(|j| *j != last)
            .map(|j| Reverse((neighbours[j].len(), j)))
            .collect();
        let mut place = vec![usize::MAX; blocks];
        let (mut order, mut shared) = (Vec::with_capacity(blocks), Vec::with_capacity(blocks));
        while let Some(Reverse((degree, j))) = queue.pop() {
            if place[j] != usize::MAX || degree != neighbours[j].len() {
                continue;
            }
            place[j] = order.len();
            order.push(j);
            let clique: Vec<usize> = std::mem::take(&mut neighbours[j]).into_iter().collect();
            for i in &clique {
                neighbours[*i].remove(&j);
                neighbours[*i].extend(clique.iter().filter(|k| *k != i));
                if *i != last {
                    queue.push(Reverse((neighbours[*i].len(), *i)));
                }
            }
            shared.push(clique);
        }
        place[last] = order.len();
        order.push(last);
        shared.push(Vec::new());
        let later = shared
            .into_iter()
            .map(|clique| {
                let mut places: Vec<usize> = clique.into_iter().map(|i| place[i]).collect();
                places.sort_unstable();
                places
            })
            .collect();
        Elimination { order, later }
    }

    /// Blocks of the factors, the diagonal included.
    pub fn stored(&self) -> usize {
        self.later.iter().map(|l| 1 + 2 * l.len()).sum()
    }

    /// Multiplications of a factorisation, in units of size^3: a third a pivot block, one a block of its row, one a product.
    pub fn operations(&self) -> f64 {
        let one = |later: &Vec<usize>| {
            let m = later.len() as f64;
            1.0 / 3.0 + m + m * m
        };
        self.later.iter().map(one).sum()
    }
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
