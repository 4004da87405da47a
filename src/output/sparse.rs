//! Fewer points where a picture could not tell more apart: a file holds what was requested, a picture what it can show.

use std::collections::HashSet;
use std::ops::Range;

/// Lines of fewer points are drawn as they are.
const FEW: usize = 4000;

/// Rows of a line that a picture tells apart, in stretches without a gap.
///
/// `at`: place of a row in units that the picture resolves. Of consecutive points in one column the first, the last, the lowest and
/// the highest remain; where a line still has many, parts of it that lie on others are left out.
pub(super) fn line(rows: Range<usize>, at: impl Fn(usize) -> (f64, f64)) -> Vec<Vec<usize>> {
    if rows.len() <= FEW {
        return vec![rows.collect()];
    }
    let kept = by_column(rows, &at);
    if kept.len() <= FEW {
        return vec![kept];
    }
    let cell = |row: usize| {
        let (x, y) = at(row);
        (x.floor() as i64, y.floor() as i64)
    };
    let mut seen = HashSet::new();
    let mut stretches: Vec<Vec<usize>> = Vec::new();
    let mut is_open = false;
    for pair in kept.windows(2) {
        let (a, b) = (cell(pair[0]), cell(pair[1]));
        let is_new = seen.insert((a.min(b), a.max(b)));
        match (is_new, is_open, stretches.last_mut()) {
            (true, true, Some(last)) => last.push(pair[1]),
            (true, ..) => stretches.push(pair.to_vec()),
            (false, ..) => {}
        }
        is_open = is_new;
    }
    stretches
}

/// First, lowest, highest and last of consecutive points in one column.
fn by_column(rows: Range<usize>, at: impl Fn(usize) -> (f64, f64)) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    let mut begin = rows.start;
    let mut close = |begin: usize, end: usize| {
        let (mut low, mut high) = (begin, begin);
        for row in begin..end {
            let y = at(row).1;
            low = if y < at(low).1 { row } else { low };
            high = if y > at(high).1 { row } else { high };
        }
        let mut own = [begin, low.min(high), low.max(high), end - 1];
        own.sort_unstable();
        kept.extend(own);
    };
    for row in rows.clone().skip(1) {
        if at(row).0.floor() != at(begin).0.floor() {
            close(begin, row);
            begin = row;
        }
    }
    if begin < rows.end {
        close(begin, rows.end);
    }
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_record_keeps_its_envelope() {
        let y = |row: usize| (row as f64 * 0.7).sin() + 5.0 * f64::from(row == 777_777);
        let at = |row: usize| (row as f64 * 1e-3, 100.0 * y(row));
        let kept = line(0..1_000_000, at);
        let all: Vec<usize> = kept.into_iter().flatten().collect();
        assert!(all.len() <= 4 * 1000, "{}", all.len());
        assert!(all.contains(&777_777) && all.contains(&0) && all.contains(&999_999));
        assert!(all.windows(2).all(|w| w[0] < w[1]));
    }

    #[test]
    fn an_orbit_that_repeats_is_drawn_once() {
        let at = |row: usize| {
            let turn = (row % 1000) as f64 / 1000.0 * std::f64::consts::TAU;
            (200.0 * turn.cos(), 200.0 * turn.sin())
        };
        let kept = line(0..1_000_000, at);
        let count: usize = kept.iter().map(Vec::len).sum();
        assert!((500..=2100).contains(&count), "{count}");
    }

    #[test]
    fn short_lines_are_left_alone() {
        assert_eq!(line(3..6, |_| (0.0, 0.0)), [vec![3, 4, 5]]);
    }
}
