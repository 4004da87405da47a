//! Sections of the page beside the analyses: the model, and what differs between two runs.

use std::fmt::Write as _;

use super::html::{escape, percent_encode, short};
use super::schematic;
use super::units;
use crate::report::{Comparison, Description, Table, Values, Words};

/// The model: its drawing, bodies and connections with their numbers.
pub(super) fn model(page: &mut String, model: &Description) {
    if model.bodies.is_empty() && model.connections.is_empty() {
        return;
    }
    page.push_str("<section id=\"model\">\n<h2>Model</h2>\n");
    if let Some(svg) = schematic::render(model) {
        let _ = writeln!(
            page,
            "<div class=\"drawing\"><img alt=\"Drawing of the train: {} bodies, {} connections, listed below\" \
             src=\"data:image/svg+xml,{}\"></div>",
            model.bodies.len(),
            model.connections.len(),
            percent_encode(&svg)
        );
    }
    page.push_str("<details><summary>Bodies and connections as tables</summary>\n");
    if !model.bodies.is_empty() {
        let rows = model.bodies.iter().map(|body| {
            let speed = body.speed_rpm.map_or(String::new(), schematic::short);
            [
                body.name.clone(),
                body.inertia.clone(),
                speed,
                body.loads.join("; "),
            ]
        });
        let head = ["body", "inertia", "speed [rpm]", "loads"];
        plain_table(page, "Bodies", head, rows);
    }
    let rows = model.connections.iter().map(|c| {
        let arms = c
            .arms
            .iter()
            .map(|arm| format!("{} {}", arm.body, schematic::short(arm.length)));
        let acts = format!(
            "{}: {}",
            c.kind.replace('_', " "),
            arms.collect::<Vec<_>>().join(", ")
        );
        let acts = if c.kind.is_empty() {
            String::new()
        } else {
            acts
        };
        let law = [c.law.as_str(), &c.parameters].join(" ");
        [
            c.name.clone(),
            acts,
            c.stiffness.clone(),
            law,
            c.further.clone(),
        ]
    });
    let head = [
        "connection",
        "lever arms [m]",
        "stiffness",
        "law",
        "further",
    ];
    plain_table(page, "Connections", head, rows);
    page.push_str("</details>\n</section>\n");
}

/// Begins a table with a name for screen readers, in a box that scrolls by keyboard; the cells of its head follow.
pub(super) fn open_table(page: &mut String, name: &str, class: &str) {
    let name = escape(name);
    let _ = write!(
        page,
        "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"{name}\"><table class=\"{class}\" aria-label=\"{name}\"><thead><tr>"
    );
}

fn plain_table<const N: usize>(
    page: &mut String,
    name: &str,
    head: [&str; N],
    rows: impl Iterator<Item = [String; N]>,
) {
    open_table(page, name, "");
    for name in head {
        let _ = write!(page, "<th scope=\"col\">{}</th>", escape(name));
    }
    page.push_str("</tr></thead><tbody>\n");
    for row in rows {
        page.push_str("<tr>");
        for cell in row {
            let _ = write!(page, "<td>{}</td>", escape(&cell));
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody></table></div>\n");
}

/// What differs between two runs.
pub(super) fn comparison(page: &mut String, comparison: &Comparison) {
    let [a, b] = &comparison.names;
    page.push_str("<section id=\"comparison\">\n<h2>What differs</h2>\n<h3>In the model</h3>\n");
    match comparison.changes.is_empty() {
        true => page.push_str("<p>The models are equal.</p>\n"),
        false => {
            let rows = comparison.changes.iter().map(|change| {
                let [one, other] = change.values.clone();
                [change.path.clone(), one, other]
            });
            plain_table(page, "What differs in the model", ["value", a, b], rows);
        }
    }
    page.push_str("<h3>In the results</h3>\n");
    let rows = comparison.differences.iter().map(|difference| {
        let [one, other] = difference.values.map(short);
        let share = difference
            .share()
            .map(|share| format!("{:+.2} %", 100.0 * share));
        [
            difference.analysis.clone(),
            difference.quantity.clone(),
            one,
            other,
            share.unwrap_or_default(),
        ]
    });
    let head = ["analysis", "quantity", a, b, "change"];
    plain_table(page, "What differs in the results", head, rows);
    for text in &comparison.missing {
        let _ = writeln!(page, "<p class=\"soft\">{}</p>", escape(text));
    }
    page.push_str("</section>\n");
}

/// Quantities of some connections or bodies, side by side.
struct QuantityGrid {
    subjects: Vec<String>,
    /// Quantity, and a text per subject.
    rows: Vec<(String, Vec<String>)>,
}

/// A table of one row: a line per quantity, a column per connection or body.
pub(super) fn one_row(page: &mut String, table: &Table) {
    for grid in grids(table) {
        open_table(page, "Values", "");
        page.push_str("<th scope=\"col\">quantity</th>");
        for subject in &grid.subjects {
            let _ = write!(
                page,
                "<th scope=\"col\" class=\"number\">{}</th>",
                escape(subject)
            );
        }
        page.push_str("</tr></thead><tbody>\n");
        for (quantity, cells) in &grid.rows {
            let _ = write!(page, "<tr><th scope=\"row\">{}</th>", escape(quantity));
            for cell in cells {
                let _ = write!(page, "<td class=\"number\">{}</td>", escape(cell));
            }
            page.push_str("</tr>\n");
        }
        page.push_str("</tbody></table></div>\n");
    }
}

fn grids(table: &Table) -> Vec<QuantityGrid> {
    let mut quantities: Vec<(String, Vec<(String, String)>)> = Vec::new();
    for column in &table.columns {
        let text = match &column.values {
            Values::Float(list) => with_unit(list[0], &column.unit),
            Values::Integer(list) => list[0].to_string(),
            Values::Text(list) => list[0].clone(),
        };
        if text.is_empty() {
            continue;
        }
        let Words { quantity, subject } = Words::of(&column.name);
        match quantities.iter_mut().find(|(known, _)| *known == quantity) {
            Some((_, cells)) => cells.push((subject, text)),
            None => quantities.push((quantity, vec![(subject, text)])),
        }
    }
    let mut grids: Vec<QuantityGrid> = Vec::new();
    for (quantity, cells) in quantities {
        let is_in = |grid: &QuantityGrid| {
            cells
                .iter()
                .all(|(subject, _)| grid.subjects.contains(subject))
        };
        let at = grids.iter().position(is_in).unwrap_or_else(|| {
            grids.push(QuantityGrid {
                subjects: cells.iter().map(|(subject, _)| subject.clone()).collect(),
                rows: Vec::new(),
            });
            grids.len() - 1
        });
        let grid = &mut grids[at];
        let cell = |subject: &String| {
            let found = cells.iter().find(|(own, _)| own == subject);
            found.map_or(String::new(), |(_, text)| text.clone())
        };
        grid.rows
            .push((quantity, grid.subjects.iter().map(cell).collect()));
    }
    grids
}

/// A number in the multiple of its unit that suits; empty for NaN.
fn with_unit(x: f64, unit: &str) -> String {
    let digits = |x: f64| {
        let text = short(x);
        text.strip_suffix(".0").unwrap_or(&text).to_owned()
    };
    match units::prefixed(unit, x.abs()) {
        _ if x.is_nan() => String::new(),
        Some((unit, factor)) => format!("{} {unit}", digits(x * factor)),
        None => format!("{} {}", digits(x), units::pretty(unit))
            .trim_end()
            .to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Column;

    #[test]
    fn one_row_stands_upright() {
        let column = |name: &str, unit: &str, x: f64| Column {
            name: name.into(),
            unit: unit.into(),
            values: Values::Float(vec![x]),
        };
        let table = Table {
            name: String::new(),
            columns: vec![
                column("speed_rpm", "rpm", 800.0),
                column("mean.a_1", "m", 3.4e-5),
                column("mean.b", "rad", 0.25),
                column("rms.b", "rad", f64::NAN),
                column("impacts.b", "", 2.0),
                column("acceleration.body", "rad/s^2", 5.0),
            ],
        };
        let found = grids(&table);
        let shown: Vec<_> = found
            .iter()
            .map(|g| (g.subjects.join(","), g.rows.len()))
            .collect();
        assert_eq!(
            shown,
            [(String::new(), 1), ("a 1,b".into(), 2), ("body".into(), 1)]
        );
        let row = &found[1].rows[0];
        assert_eq!(row.1, ["34 \u{b5}m", "0.25 rad"]);
        assert_eq!(found[1].rows[1].1, ["", "2"]);
    }
}
