//! Assignment of least total cost.

/// For every row the column assigned to it, so that the sum of the costs is least; every column serves one row at most.
///
/// `cost(i, j)`: finite; `rows` <= `columns`. Shortest augmenting paths with potentials, O(rows^2 columns).
///
/// Jonker & Volgenant (1987).
pub(crate) fn assign(
    rows: usize,
    columns: usize,
    cost: impl Fn(usize, usize) -> f64,
) -> Vec<usize> {
    debug_assert!(rows <= columns);
    // Column 0 is a dummy from which every augmenting path starts; rows and columns count from 1.
    let mut row_potential = vec![0.0; rows + 1];
    let mut column_potential = vec![0.0; columns + 1];
    let mut owner = vec![0; columns + 1];
    let mut least = vec![0.0; columns + 1];
    let mut way = vec![0; columns + 1];
    let mut used = vec![false; columns + 1];
    for row in 1..=rows {
        owner[0] = row;
        least.fill(f64::INFINITY);
        used.fill(false);
        let mut column = 0;
        while owner[column] != 0 {
            used[column] = true;
            let (i, from) = (owner[column], column);
            let (mut delta, mut next) = (f64::INFINITY, 0);
            for j in (1..=columns).filter(|j| !used[*j]) {
                let reduced = cost(i - 1, j - 1) - row_potential[i] - column_potential[j];
                if reduced < least[j] {
                    (least[j], way[j]) = (reduced, from);
                }
                if least[j] < delta || next == 0 {
                    (delta, next) = (least[j], j);
                }
            }
            for j in 0..=columns {
                if used[j] {
                    row_potential[owner[j]] += delta;
                    column_potential[j] -= delta;
                } else {
                    least[j] -= delta;
                }
            }
            column = next;
        }
        while column != 0 {
            owner[column] = owner[way[column]];
            column = way[column];
        }
    }
    let mut list = vec![0; rows];
    for (j, row) in owner.iter().enumerate().skip(1).filter(|(_, r)| **r != 0) {
        list[row - 1] = j - 1;
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every arrangement of `columns` things in `rows` places.
    fn arrangements(rows: usize, columns: usize) -> Vec<Vec<usize>> {
        if rows == 0 {
            return vec![Vec::new()];
        }
        let mut list = Vec::new();
        for shorter in arrangements(rows - 1, columns) {
            for j in (0..columns).filter(|j| !shorter.contains(j)) {
                list.push([shorter.as_slice(), &[j]].concat());
            }
        }
        list
    }

    #[test]
    fn no_arrangement_is_cheaper() {
        for (rows, columns) in [(1, 1), (2, 4), (4, 4), (4, 6)] {
            for seed in 0..20 {
                let cost = |i: usize, j: usize| {
                    ((seed * 31 + i * 17 + j * 7 + i * j * 5) as f64 * 1.7).sin() - 0.3
                };
                let total = |list: &[usize]| -> f64 {
                    list.iter().enumerate().map(|(i, j)| cost(i, *j)).sum()
                };
                let found = assign(rows, columns, cost);
                let best = arrangements(rows, columns)
                    .iter()
                    .map(|list| total(list))
                    .fold(f64::INFINITY, f64::min);
                assert!((total(&found) - best).abs() < 1e-12);
            }
        }
    }
}
