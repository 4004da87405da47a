//! Measured torque over a cycle of one or more revolutions: a broken line, all of whose orders are exact.

use super::fields::{Fields, Measure, Mistakes, Range, entries, number};
use super::measured;
use super::orders::Orders;
use crate::error::Diagnostic;
use crate::numeric::fraction::whole;
use crate::numeric::periodic::Periodic;
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;

/// Most revolutions in a cycle.
const MOST_REVOLUTIONS: usize = 64;

/// The table of a `cycle`, with a note where its last row repeats the first.
pub(super) fn cycle(
    node: &Node,
    path: &str,
    torque: UnitDimension,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<(Periodic, Option<String>)> {
    let keys = ["values", "file", "column", "unit", "revolutions"];
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let factor = unit(&fields, torque, mistakes)?;
    let revolutions = match fields.get("revolutions") {
        Some(node) => {
            let read = super::fields::count(node, &fields.path_of("revolutions"), MOST_REVOLUTIONS);
            mistakes.note(read)?
        }
        None => 1,
    };
    let (kind, given) = fields.exactly_one(&["values", "file"], "cycle", mistakes)?;
    let given_path = fields.path_of(kind);
    let mut values = match kind {
        "values" => values(given, &given_path, torque, factor, mistakes)?,
        _ => from_file(&fields, (given, &given_path), factor, mistakes)?,
    };
    let is_closed = values.len() > 2 && values.first() == values.last();
    let note = is_closed.then(|| {
        values.pop();
        format!(
            "{path}: the last row repeats the first, which begins the next cycle: it is left out"
        )
    });
    if values.len() < 2 {
        let message = format!("found {} values, wanted at least 2", values.len());
        mistakes.add(Diagnostic::at(given, &given_path, message));
        return None;
    }
    let order = whole(1) / whole(revolutions as i64);
    let base_order = orders.multiple(Some(&order), node, path, mistakes);
    Some((Periodic::Table { values, base_order }, note))
}

/// SI value of the unit of bare numbers.
fn unit(fields: &Fields<'_>, torque: UnitDimension, mistakes: &mut Mistakes) -> Option<f64> {
    let Some(node) = fields.get("unit") else {
        return Some(1.0);
    };
    let path = fields.path_of("unit");
    let text = mistakes.note(node.as_text(&path))?;
    let one = Quantity::parse(&format!("1 {text}")).and_then(|one| one.si(torque));
    mistakes.note(one.map_err(|message| Diagnostic::at(node, &path, message)))
}

/// Listed values; a number with a unit of its own keeps it.
fn values(
    node: &Node,
    path: &str,
    torque: UnitDimension,
    factor: f64,
    mistakes: &mut Mistakes,
) -> Option<Vec<f64>> {
    let list = entries(node, path, mistakes);
    let read = |(path, node): &(String, &Node)| {
        let value = number(node, path, Measure::Si(torque), Range::Any)?;
        let has_unit = Quantity::from_node(node, path)?.dimension.is_some();
        Ok(if has_unit { value } else { value * factor })
    };
    let values: Vec<Option<f64>> = list.iter().map(|x| mistakes.note(read(x))).collect();
    values.into_iter().collect()
}

fn from_file(
    fields: &Fields<'_>,
    (node, path): (&Node, &str),
    factor: f64,
    mistakes: &mut Mistakes,
) -> Option<Vec<f64>> {
    let column = fields.required("column", "the name of the column of torques", mistakes)?;
    let column = mistakes.note(column.as_text(&fields.path_of("column")))?;
    let file = measured::beside(node, path, mistakes)?;
    let columns = measured::columns(&file, (node, path), &[column], mistakes)?;
    let mut values = columns.into_iter().next()?;
    values.iter_mut().for_each(|value| *value *= factor);
    Some(values)
}
