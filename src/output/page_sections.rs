//! Sections of the page beside the analyses: the model, and what differs between two runs.

use std::fmt::Write as _;

use super::html::{escape, percent_encode, short};
use super::schematic;
use crate::report::{Comparison, Description};

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
        plain_table(page, ["body", "inertia", "speed [rpm]", "loads"], rows);
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
    plain_table(page, head, rows);
    page.push_str("</details>\n</section>\n");
}

fn plain_table<const N: usize>(
    page: &mut String,
    head: [&str; N],
    rows: impl Iterator<Item = [String; N]>,
) {
    page.push_str("<div class=\"scroll\"><table><thead><tr>");
    for name in head {
        let _ = write!(page, "<th>{}</th>", escape(name));
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
            plain_table(page, ["value", a, b], rows);
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
    plain_table(page, ["analysis", "quantity", a, b, "change"], rows);
    for text in &comparison.missing {
        let _ = writeln!(page, "<p class=\"soft\">{}</p>", escape(text));
    }
    page.push_str("</section>\n");
}
