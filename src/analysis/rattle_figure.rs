//! The rattle table as a figure: index, impacts, their energy, forces, accelerations.

use crate::report::{Curve, CurveStyle, Figure, NamedFigure, Panel, Table, Values, Words};

/// Quantities drawn, a panel each where the table has them.
const DRAWN: [&str; 5] = [
    "rattle_index",
    "impacts",
    "impact_energy",
    "force_peak",
    "peak_acceleration",
];
/// Curves of one panel.
const MOST: usize = 12;

/// Figure `rattle` beside the first figure of a response, with its abscissa; its first method is drawn. None where the table has
/// nothing that moves.
pub fn figure(table: &Table, first: Option<&Figure>) -> Option<NamedFigure> {
    let template = first?.panels.first()?;
    let lines = |c: &&Curve| matches!(c.style, CurveStyle::Branch { .. } | CurveStyle::Dots);
    let curve = template.curves.iter().find(lines)?;
    let panel = |quantity: &&str| {
        let front = format!("{quantity}.");
        let columns = table.columns.iter();
        let columns: Vec<_> = columns
            .filter(|c| c.name.starts_with(&front) && has_values(&c.values, quantity))
            .take(MOST)
            .collect();
        let curves: Vec<Curve> = (columns.iter())
            .map(|column| Curve {
                table: table.name.clone(),
                y: column.name.clone(),
                label: column.name[front.len()..].to_string(),
                ..curve.clone()
            })
            .collect();
        // Meshes and shafts, wheels and masses have different units.
        let mut units: Vec<&str> = Vec::new();
        for column in &columns {
            if !units.contains(&column.unit.as_str()) {
                units.push(&column.unit);
            }
        }
        if columns.is_empty() {
            return None;
        }
        Some(Panel {
            y_label: Words::of(quantity).axis(&units.join(", ")),
            curves,
            ..template_of(template)
        })
    };
    let panels: Vec<Panel> = DRAWN.iter().filter_map(panel).collect();
    (!panels.is_empty()).then(|| NamedFigure {
        name: "rattle".into(),
        figure: Figure {
            title: String::new(),
            panels,
        },
    })
}

/// Whether there is anything to see; an index this small is the rounding of forces that cancel.
fn has_values(values: &Values, quantity: &str) -> bool {
    let least = if quantity == "rattle_index" {
        1e-9
    } else {
        0.0
    };
    match values {
        Values::Float(list) => list.iter().any(|x| x.is_finite() && x.abs() > least),
        Values::Integer(list) => list.iter().any(|x| *x != 0),
        Values::Text(_) => false,
    }
}

/// The abscissa of a panel without what it shows.
fn template_of(panel: &Panel) -> Panel {
    Panel {
        curves: Vec::new(),
        heading: String::new(),
        y_label: String::new(),
        y_range: None,
        ..panel.clone()
    }
}
