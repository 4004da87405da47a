//! Rows of responses held against each other.

use crate::time_domain_support::floats;
use gearlash::report::{Table, Values};

/// Rows at marks.
pub fn marked(table: &Table) -> Vec<usize> {
    let marks = floats(table, "mark");
    (0..marks.len()).filter(|k| marks[*k] == 1.0).collect()
}

/// Measures of a row with their units: everything behind the column `residual`.
pub fn measures(table: &Table, row: usize) -> Vec<(String, String, f64)> {
    let begin = table.columns.iter().position(|c| c.name == "residual");
    let list = table.columns.iter().skip(begin.unwrap() + 1);
    list.filter_map(|c| match &c.values {
        Values::Float(v) => Some((c.name.clone(), c.unit.clone(), v[row])),
        _ => None,
    })
    .collect()
}

/// Largest difference of two rows, relative to the largest value of the same unit.
pub fn gap(a: &[(String, String, f64)], b: &[(String, String, f64)]) -> (f64, String) {
    assert_eq!(a.len(), b.len());
    let size = |unit: &str| {
        let same = a.iter().filter(|m| m.1 == unit && m.2.is_finite());
        same.fold(f64::MIN_POSITIVE, |s, m| s.max(m.2.abs()))
    };
    let mut worst = (0.0, String::new());
    for ((name, unit, x), (other, _, y)) in a.iter().zip(b) {
        assert_eq!(name, other);
        if x.is_nan() && y.is_nan() {
            continue;
        }
        let gap = (x - y).abs() / size(unit);
        // A value that is there on one side only is as wrong as can be.
        let gap = if gap.is_nan() { f64::INFINITY } else { gap };
        if gap > worst.0 {
            worst = (gap, format!("{name}: {x} {y}"));
        }
    }
    worst
}
