//! Floquet multipliers as a table, and their estimate from the averaged system as another with the same rows.

use super::branch_table::Traced;
use super::columns::{float, integer};
use super::response::Swept;
use crate::report::Table;
use crate::solve::branch::BranchPoint;
use crate::solve::floquet::Spectrum;

/// `multipliers` and `multiplier_estimates` (19)-(22), each by falling modulus; none when stability was not asked for, and no
/// estimates for long trains: they take a dense eigenvalue problem a point.
pub(super) fn multipliers(swept: &Swept<'_>, traced: &[Traced<'_>]) -> Vec<Table> {
    let rows: Vec<Row<'_>> = (traced.iter().enumerate())
        .flat_map(|(b, t)| {
            let points = t.points.iter().enumerate();
            points.map(move |(p, point)| (b, p, point))
        })
        .filter(|(_, _, point)| !point.multipliers.is_empty())
        .collect();
    let Some(count) = rows.iter().map(|r| r.2.multipliers.len()).max() else {
        return Vec::new();
    };
    let exact = |p: &BranchPoint, k: usize| {
        let mu = p.multipliers.get(k / 2);
        mu.map_or(
            f64::NAN,
            |mu| if k.is_multiple_of(2) { mu.re } else { mu.im },
        )
    };
    let mut tables = vec![table("multipliers", &rows, count, &exact)];
    if swept.spectrum() == Spectrum::Leading {
        return tables;
    }
    // The recorder puts the estimates last.
    let estimate = |p: &BranchPoint, k: usize| {
        let first = p.recorded.len().checked_sub(2 * count);
        first.map_or(f64::NAN, |first| p.recorded[first + k])
    };
    tables.push(table("multiplier_estimates", &rows, count, &estimate));
    tables
}

/// Branch, index and content of a point.
type Row<'a> = (usize, usize, &'a BranchPoint);

/// `part`: real (even) and imaginary (odd) parts, multiplier by multiplier.
fn table(
    name: &str,
    rows: &[Row<'_>],
    count: usize,
    part: &dyn Fn(&BranchPoint, usize) -> f64,
) -> Table {
    let mut columns = vec![
        integer("branch", rows.iter().map(|r| r.0 as i64).collect()),
        integer("point", rows.iter().map(|r| r.1 as i64).collect()),
    ];
    let names = (1..=count).flat_map(|k| ["re", "im"].map(|word| format!("{word}.{k}")));
    columns.extend(names.enumerate().map(|(k, name)| {
        let values = rows.iter().map(|r| part(r.2, k));
        float(name, "", values.collect())
    }));
    Table {
        name: name.into(),
        columns,
    }
}
