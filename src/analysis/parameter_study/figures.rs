//! Figures of a study: quantities against parameters, distributions, sensitivities.

use super::statistics::{self, FEWEST};
use super::{Axis, ParameterStudy};
use crate::report::{
    Column, Curve, CurveStyle, Figure, NamedFigure, Panel, Table, Values, Words, readable,
};

/// Figures of a study, and the additional tables for them.
#[derive(Debug, Default)]
pub(super) struct Drawing {
    pub main: Option<Figure>,
    pub further: Vec<NamedFigure>,
    pub tables: Vec<Table>,
}

/// Default number of panels of a figure.
const MOST_PANELS: usize = 4;
/// Columns after the collected quantities.
const ENDING: usize = 3;
/// Room beside the values of a cumulative share, over their span.
const MARGIN: f64 = 0.03;
/// Correlations of fewer runs say little.
const FEWEST_FOR_RANKS: usize = 12;

impl Drawing {
    /// Everything that the rows of a study give.
    pub fn of(study: &ParameterStudy, table: &Table) -> Drawing {
        let first = 1 + study.parameters();
        let columns = &table.columns;
        let is_number = |c: &&Column| !matches!(c.values, Values::Text(_));
        let collected =
            &columns[first.min(columns.len())..columns.len().saturating_sub(ENDING).max(first)];
        let quantities: Vec<&Column> = collected.iter().filter(is_number).collect();
        let parameters: Vec<&Column> = columns[1..first].iter().filter(is_number).collect();
        let shown: Vec<&Column> = quantities.iter().copied().take(MOST_PANELS).collect();
        let (Some(x), false) = (parameters.first(), shown.is_empty()) else {
            return Drawing::default();
        };
        let mut drawing = Drawing {
            main: Some(main_figure(study, columns, &parameters, &shown, x)),
            ..Drawing::default()
        };
        drawing.tables.push(statistics::summary(&quantities));
        let enough: Vec<&Column> = shown
            .iter()
            .copied()
            .filter(|c| statistics::sorted(c).len() >= FEWEST)
            .collect();
        // The runs of a grid are not a sample.
        if study.grid.is_none() && !enough.is_empty() {
            drawing.tables.push(statistics::histograms(&enough));
            drawing.tables.push(statistics::cumulative(&enough));
            drawing.further.push(distribution(&enough));
        }
        let correlations = statistics::correlations(&quantities, &parameters);
        if parameters.len() > 1 && table.rows() >= FEWEST_FOR_RANKS && correlations.rows() > 0 {
            drawing.further.extend(sensitivity(&shown, &correlations));
            drawing.tables.push(correlations);
        }
        drawing
    }
}

/// Quantities against the first parameter: a line where it alone runs through a range, cells where two do, dots coloured by the
/// second one else.
fn main_figure(
    study: &ParameterStudy,
    columns: &[Column],
    parameters: &[&Column],
    shown: &[&Column],
    x: &Column,
) -> Figure {
    let grid = study.grid.as_ref();
    let is_range =
        |k: usize| grid.is_some_and(|g| matches!(g.values().nth(k), Some(Axis::Range(_))));
    let axes = grid.map_or(0, |g| g.len());
    let is_line = axes == 1 && is_range(0) && x.name == columns[1].name;
    let is_map = axes == 2 && parameters.len() == 2;
    let panel = |y: &&Column| {
        let by = |column: &Column| column.name.clone();
        let (ordinate, style) = match parameters.get(1) {
            Some(second) if is_map => {
                let names = Vec::new();
                (
                    *second,
                    CurveStyle::Cells {
                        value: by(y),
                        names,
                    },
                )
            }
            Some(second) => (*y, CurveStyle::Coloured { by: by(second) }),
            None if is_line => (*y, CurveStyle::Line),
            None => (*y, CurveStyle::Dots),
        };
        Panel {
            x_label: labelled(x),
            y_label: labelled(ordinate),
            heading: if is_map {
                readable(&y.name)
            } else {
                String::new()
            },
            curves: vec![curve("", &x.name, &ordinate.name, style, None)],
            ..Panel::default()
        }
    };
    Figure {
        title: String::new(),
        panels: shown.iter().map(panel).collect(),
    }
}

fn curve(table: &str, x: &str, y: &str, style: CurveStyle, quantity: Option<&str>) -> Curve {
    Curve {
        table: table.into(),
        x: x.into(),
        y: y.into(),
        label: String::new(),
        style,
        only: quantity.map(|name| ("quantity".into(), name.into())),
    }
}

/// Histogram and cumulative share of each quantity, side by side, with its percentiles.
fn distribution(quantities: &[&Column]) -> NamedFigure {
    let mut panels = Vec::new();
    for quantity in quantities {
        let own = Some(quantity.name.as_str());
        let list = statistics::sorted(quantity);
        let percentile = |p: f64| short(statistics::quantile(&list, p), &quantity.unit);
        // The last step of the cumulative share stands inside the frame.
        let (low, high) = (list[0], list[list.len() - 1]);
        let room = MARGIN * (high - low).max(1e-9 * low.abs().max(high.abs()));
        let bars = CurveStyle::Bars {
            width: "width".into(),
        };
        panels.push(Panel {
            x_label: labelled(quantity),
            y_label: "runs".into(),
            heading: readable(&quantity.name),
            curves: vec![curve("histogram", "middle", "count", bars, own)],
            ..Panel::default()
        });
        panels.push(Panel {
            x_label: labelled(quantity),
            y_label: "share of runs".into(),
            heading: percentiles([0.05, 0.5, 0.95].map(percentile)),
            x_range: (room > 0.0).then_some((low - room, high + room)),
            y_range: Some((0.0, 1.02)),
            curves: vec![curve("cumulative", "value", "share", CurveStyle::Line, own)],
            ..Panel::default()
        });
    }
    NamedFigure {
        name: "distribution".into(),
        figure: Figure {
            title: String::new(),
            panels,
        },
    }
}

/// Rank correlations of each quantity with the parameters.
fn sensitivity(quantities: &[&Column], correlations: &Table) -> Option<NamedFigure> {
    let Some(Values::Text(names)) = correlations.column("quantity").map(|c| &c.values) else {
        return None;
    };
    let panel = |quantity: &&Column| {
        names.contains(&quantity.name).then(|| Panel {
            x_label: "rank correlation (Spearman)".into(),
            heading: readable(&quantity.name),
            curves: vec![curve(
                "correlations",
                "rank_correlation",
                "rank_correlation",
                CurveStyle::Tornado {
                    name: "parameter".into(),
                },
                Some(&quantity.name),
            )],
            ..Panel::default()
        })
    };
    let panels: Vec<Panel> = quantities.iter().filter_map(panel).collect();
    (!panels.is_empty()).then(|| NamedFigure {
        name: "sensitivity".into(),
        figure: Figure {
            title: String::new(),
            panels,
        },
    })
}

fn labelled(column: &Column) -> String {
    Words::of(&column.name).axis(&column.unit)
}

/// Three percentiles in a heading; a unit that all of them have is written once.
fn percentiles(texts: [String; 3]) -> String {
    let parts = texts
        .each_ref()
        .map(|text| text.split_once(' ').unwrap_or((text, "")));
    let is_shared = parts.iter().all(|(_, unit)| *unit == parts[2].1);
    let bare = |k: usize| if is_shared { parts[k].0 } else { &texts[k] };
    format!("5, 50, 95 %: {}, {}, {}", bare(0), bare(1), texts[2])
}

/// Three significant digits with the unit, in the multiple of it that suits: `34.1 µm`.
fn short(x: f64, unit: &str) -> String {
    const PREFIXES: [(&str, f64); 7] = [
        ("M", 1e6),
        ("k", 1e3),
        ("", 1.0),
        ("m", 1e-3),
        ("\u{b5}", 1e-6),
        ("n", 1e-9),
        ("p", 1e-12),
    ];
    let takes_prefix = ["m", "rad", "N", "N m", "J", "s", "W", "Hz", "N/m"].contains(&unit);
    let fits = |(_, size): &&(&str, f64)| x.abs() >= 0.9995 * size;
    let plain = ("", 1.0);
    let (prefix, size) = match takes_prefix {
        true => *PREFIXES.iter().find(fits).unwrap_or(&plain),
        false => plain,
    };
    let text = format!("{:.2e}", x / size);
    let rounded = text
        .parse::<f64>()
        .map_or(text, |rounded| rounded.to_string());
    format!("{rounded} {prefix}{unit}").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::{percentiles, short};

    #[test]
    fn percentiles_have_units_that_suit() {
        assert_eq!(short(3.4123e-5, "m"), "34.1 \u{b5}m");
        assert_eq!(short(12_049.0, "N"), "12 kN");
        assert_eq!(short(0.0, "m"), "0 m");
        assert_eq!(short(2.0, ""), "2");
        assert_eq!(short(3.0e4, "rad/s"), "30000 rad/s");
        let of = |list: [f64; 3]| percentiles(list.map(|x| short(x, "N")));
        assert_eq!(of([2e3, 3e3, 4e3]), "5, 50, 95 %: 2, 3, 4 kN");
        assert_eq!(of([20.0, 3e3, 4e3]), "5, 50, 95 %: 20 N, 3 kN, 4 kN");
    }
}
