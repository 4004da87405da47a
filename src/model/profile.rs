//! Functions of time in a model file: points, or columns of a table.

use super::fields::{Fields, Mistakes, NumberMeasure, Range, entries};
use super::measured;
use crate::error::Diagnostic;
use crate::numeric::broken_line::BrokenLine;
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;

/// A quantity over time \[s\], SI units: linear between instants, a repeated instant is a jump, the ends hold.
pub(super) fn profile(
    node: &Node,
    path: &str,
    dimension: UnitDimension,
    mistakes: &mut Mistakes,
) -> Option<BrokenLine> {
    let keys = ["points", "file", "time", "column", "unit", "time_unit"];
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let (kind, given) = fields.exactly_one(&["points", "file"], "profile", mistakes)?;
    let given_path = fields.path_of(kind);
    let factor = unit(&fields, "unit", dimension, mistakes);
    let time_factor = unit(&fields, "time_unit", UnitDimension::TIME, mistakes);
    let (factor, time_factor) = (factor?, time_factor?);
    if kind == "points" {
        return points(given, &given_path, dimension, mistakes);
    }
    let wanted = |what| format!("the name of the column of {what}");
    let time = fields.required("time", &wanted("instants"), mistakes);
    let column = fields.required("column", &wanted("values"), mistakes);
    let (time, column) = (time?, column?);
    let time = mistakes.note(time.as_text(&fields.path_of("time")))?;
    let column = mistakes.note(column.as_text(&fields.path_of("column")))?;
    let file = measured::beside(given, &given_path, mistakes)?;
    let columns = measured::columns(&file, (given, &given_path), &[time, column], mistakes)?;
    let points: Vec<(f64, f64)> = (columns[0].iter().zip(&columns[1]))
        .map(|(t, y)| (t * time_factor, y * factor))
        .collect();
    let line = BrokenLine::new(points).map_err(|k| {
        let message = match columns[0].len() {
            0 => format!("{}: no row below the header", file.display()),
            _ => format!(
                "{}: row {}, column `{time}`: found {}, wanted at least {}, the instant before",
                file.display(),
                k + 2,
                columns[0][k],
                columns[0][k.max(1) - 1]
            ),
        };
        Diagnostic::at(given, &given_path, message)
    });
    mistakes.note(line)
}

/// SI value of the unit of bare numbers.
pub(super) fn unit(
    fields: &Fields<'_>,
    key: &str,
    dimension: UnitDimension,
    mistakes: &mut Mistakes,
) -> Option<f64> {
    let Some(node) = fields.get(key) else {
        return Some(1.0);
    };
    let path = fields.path_of(key);
    let text = mistakes.note(node.as_text(&path))?;
    let one = Quantity::parse(&format!("1 {text}")).and_then(|one| one.si(dimension));
    mistakes.note(one.map_err(|message| Diagnostic::at(node, &path, message)))
}

/// `[[0 s, 10 N m], [50 ms, 200 N m]]`.
fn points(
    node: &Node,
    path: &str,
    dimension: UnitDimension,
    mistakes: &mut Mistakes,
) -> Option<BrokenLine> {
    let (before, mut list) = (mistakes.count(), Vec::new());
    let rows = entries(node, path, mistakes);
    for (path, row) in &rows {
        let pair = entries(row, path, mistakes);
        let [(t_path, t), (y_path, y)] = pair.as_slice() else {
            let message = format!("found {} values, wanted an instant and a value", pair.len());
            mistakes.add(Diagnostic::at(row, path, message));
            continue;
        };
        let time = NumberMeasure::Si(UnitDimension::TIME);
        let t = mistakes.number(t, t_path, time, Range::Any);
        let y = mistakes.number(y, y_path, NumberMeasure::Si(dimension), Range::Any);
        list.extend(t.zip(y));
    }
    if mistakes.count() > before {
        return None;
    }
    let line = BrokenLine::new(list).map_err(|k| match rows.get(k) {
        None => Diagnostic::at(
            node,
            path,
            "found no points, wanted at least one: [[0 s, 10 N m], ..]",
        ),
        Some((path, row)) => Diagnostic::at(
            row,
            path,
            "its instant is before that of the previous point: instants ascend, a repeated one is a jump",
        ),
    });
    mistakes.note(line)
}
