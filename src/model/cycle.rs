//! Measured torque over a cycle of one or more revolutions: a broken line, all of whose orders are exact.

use super::fields::{Fields, Mistakes, NumberMeasure, Range, entries};
use super::measured;
use super::orders::Orders;
use super::profile::unit;
use crate::error::Diagnostic;
use crate::numeric::fraction::whole;
use crate::numeric::periodic::Periodic;
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;

/// Most revolutions in a cycle.
const MOST_REVOLUTIONS: usize = 64;

/// The table of a `cycle`, with a note where its last row repeats the first; `others`: keys that somebody else reads.
pub(super) fn cycle(
    (node, path): (&Node, &str),
    torque: UnitDimension,
    others: &[&str],
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<(Periodic, Option<String>)> {
    let keys = [
        "values",
        "file",
        "column",
        "angle",
        "unit",
        "angle_unit",
        "revolutions",
    ];
    let keys: Vec<&str> = keys.iter().chain(others).copied().collect();
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let factor = unit(&fields, "unit", torque, mistakes)?;
    let revolutions = match fields.get("revolutions") {
        Some(node) => {
            let read = super::fields::count(node, &fields.path_of("revolutions"), MOST_REVOLUTIONS);
            mistakes.note(read)?
        }
        None => 1,
    };
    let (kind, given) =
        fields.exactly_one(&["values", "file"], "values over the cycle", mistakes)?;
    let given_path = fields.path_of(kind);
    let (mut values, places) = match kind {
        "values" => (
            values(given, &given_path, torque, factor, mistakes)?,
            angles(&fields, None, revolutions, mistakes)?,
        ),
        _ => from_file(
            &fields,
            (given, &given_path),
            (factor, revolutions),
            mistakes,
        )?,
    };
    let order = whole(1) / whole(revolutions as i64);
    let base_order = orders.multiple(Some(&order), node, path, mistakes);
    let is_closed = values.len() > 2 && values.first() == values.last();
    let (is_closed, places) = match places {
        None => (is_closed, None),
        // With angles only a row at the end of the cycle can repeat the first.
        Some(places) => {
            let turn = places.last().is_some_and(|x| x - places[0] >= 1.0);
            (turn, Some(places))
        }
    };
    let note = is_closed.then(|| {
        values.pop();
        format!(
            "{path}: the last row repeats the first, which begins the next cycle: it is dropped"
        )
    });
    if values.len() < 2 {
        let message = format!("found {} values, wanted at least 2", values.len());
        mistakes.add(Diagnostic::at(given, &given_path, message));
        return None;
    }
    let series = match places {
        None => Periodic::Table { values, base_order },
        Some(places) => uneven(places, values, base_order),
    };
    Some((series, note))
}

/// A table whose places, in cycles, ascend over no more than one: turned so that they lie in [0, 1).
fn uneven(mut places: Vec<f64>, mut values: Vec<f64>, base_order: usize) -> Periodic {
    places.truncate(values.len());
    places.iter_mut().for_each(|x| *x = x.rem_euclid(1.0));
    let first = (0..places.len()).min_by(|a, b| places[*a].total_cmp(&places[*b]));
    if let Some(first) = first {
        places.rotate_left(first);
        values.rotate_left(first);
    }
    Periodic::Uneven {
        places,
        values,
        base_order,
    }
}

/// Angles of the rows in cycles, from the column `angle` where there is one.
fn angles(
    fields: &Fields<'_>,
    column: Option<(&[f64], &str)>,
    revolutions: usize,
    mistakes: &mut Mistakes,
) -> Option<Option<Vec<f64>>> {
    let factor = unit(fields, "angle_unit", UnitDimension::ANGLE, mistakes)?;
    let Some((angles, file)) = column else {
        for key in ["angle", "angle_unit"] {
            if let Some(node) = fields.get(key) {
                let message = "needs a `file`: values without one are uniform in angle";
                mistakes.add(Diagnostic::at(node, &fields.path_of(key), message));
                return None;
            }
        }
        return Some(None);
    };
    let cycle = std::f64::consts::TAU * revolutions as f64;
    let places: Vec<f64> = angles.iter().map(|x| x * factor / cycle).collect();
    let node = fields.get("angle").unwrap_or(fields.node);
    let path = fields.path_of("angle");
    if let Some(k) = places.windows(2).position(|pair| pair[1] <= pair[0]) {
        let message = format!(
            "{file}: row {}: found angle {}, wanted more than {}, the one before",
            k + 3,
            angles[k + 1],
            angles[k]
        );
        mistakes.add(Diagnostic::at(node, &path, message));
        return None;
    }
    let span = places.last().unwrap_or(&0.0) - places.first().unwrap_or(&0.0);
    if span > 1.0 + 1e-9 {
        let message = format!(
            "{file}: the angles span {:.4} cycles of {revolutions} revolutions, wanted at most 1",
            span
        );
        let help = "angles without a unit are in rad: set `angle_unit: deg` if they are in degrees";
        mistakes.add(Diagnostic::at(node, &path, message).with_help(help));
        return None;
    }
    Some(Some(places))
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
    let mut read = |(path, node): &(String, &Node)| {
        let value = mistakes.number(node, path, NumberMeasure::Si(torque), Range::Any)?;
        let has_unit = Quantity::from_node(node, path).is_ok_and(|q| q.dimension.is_some());
        Some(if has_unit { value } else { value * factor })
    };
    let values: Vec<Option<f64>> = list.iter().map(&mut read).collect();
    values.into_iter().collect()
}

fn from_file(
    fields: &Fields<'_>,
    (node, path): (&Node, &str),
    (factor, revolutions): (f64, usize),
    mistakes: &mut Mistakes,
) -> Option<(Vec<f64>, Option<Vec<f64>>)> {
    let column = fields.required("column", "the name of the column of values", mistakes)?;
    let mut names = vec![mistakes.note(column.as_text(&fields.path_of("column")))?];
    if let Some(angle) = fields.get("angle") {
        names.push(mistakes.note(angle.as_text(&fields.path_of("angle")))?);
    }
    let file = measured::beside(node, path, mistakes)?;
    let columns = measured::columns(&file, (node, path), &names, mistakes)?;
    let values: Vec<f64> = columns[0].iter().map(|value| value * factor).collect();
    let shown = file.display().to_string();
    let places = match columns.get(1) {
        Some(list) => angles(fields, Some((list, &shown)), revolutions, mistakes)?,
        None => None,
    };
    Some((values, places))
}
