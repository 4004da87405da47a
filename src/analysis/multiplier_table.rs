//! Floquet multipliers as a table, and their estimate from the averaged system as another with the same rows.

use super::branch_table::TracedMethod;
use super::columns::{float, integer};
use super::response::{ResponseTable, Swept};
use crate::report::{Column, Table};
use crate::solve::branch::BranchPoint;
use crate::solve::floquet::by_falling_modulus;
use num_complex::Complex;

/// `multipliers` and `multiplier_estimates` (19)-(22), each by falling modulus, as far as they are computed.
pub(super) fn multipliers(swept: &Swept<'_>, traced: &[TracedMethod<'_>]) -> Vec<Table> {
    let rows: Vec<MultiplierRow<'_>> = (traced.iter().enumerate())
        .flat_map(|(b, t)| {
            let points = t.points.iter().enumerate();
            points.map(move |(p, point)| (b, p, point))
        })
        .filter(|(_, _, point)| !point.multipliers.is_empty())
        .collect();
    let Some(count) = rows.iter().map(|r| r.2.multipliers.len()).max() else {
        return Vec::new();
    };
    // Multipliers that are 1 by construction are sorted by modulus like the others.
    let whole = |p: &BranchPoint| {
        let mut list = p.multipliers.clone();
        list.truncate(list.len() - p.neutral);
        list.extend((0..p.neutral).map(|_| Complex::new(1.0, 0.0)));
        by_falling_modulus(list)
    };
    let lists: Vec<Vec<Complex<f64>>> = rows.iter().map(|r| whole(r.2)).collect();
    let exact = |list: &Vec<Complex<f64>>, k: usize| {
        let mu = list.get(k / 2);
        mu.map_or(
            f64::NAN,
            |mu| if k.is_multiple_of(2) { mu.re } else { mu.im },
        )
    };
    let mut tables = Vec::new();
    if swept.computes(ResponseTable::Multipliers) {
        let names = (1..=count).flat_map(|k| ["re", "im"].map(|part| format!("{part}.{k}")));
        let columns = names.enumerate().map(|(k, name)| {
            let values = lists.iter().map(|list| exact(list, k));
            float(name, "", values.collect())
        });
        tables.push(table("multipliers", &rows, columns));
    }
    if swept.computes(ResponseTable::MultiplierEstimates) {
        let estimates = swept.columns(ResponseTable::MultiplierEstimates);
        let columns = estimates.map(|(k, heading)| {
            let values = rows.iter().map(|r| r.2.recorded[k]);
            heading.clone().column(values)
        });
        tables.push(table("multiplier_estimates", &rows, columns));
    }
    tables
}

/// Branch, index and content of a point.
type MultiplierRow<'a> = (usize, usize, &'a BranchPoint);

fn table(name: &str, rows: &[MultiplierRow<'_>], parts: impl Iterator<Item = Column>) -> Table {
    let mut columns = vec![
        integer("branch", rows.iter().map(|r| r.0 as i64).collect()),
        integer("point", rows.iter().map(|r| r.1 as i64).collect()),
    ];
    columns.extend(parts);
    Table {
        name: name.into(),
        columns,
    }
}
