//! Figures as the user wants them: columns, ranges, connections, methods, backbone, events.

use crate::error::{Diagnostic, Error, did_you_mean};
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Plot, Report, Table, Values, Words};

/// A figure of a report arranged by what is asked of it. Columns and ordinates are those of the first figure; what else is asked
/// holds for all.
///
/// # Errors
/// A column, connection, method or unit that the results do not have.
pub fn arranged(figure: &Figure, report: &Report) -> Result<Figure, Error> {
    let plot = &report.plot;
    let is_first = report.figure.as_ref() == Some(figure);
    let mut figure = figure.clone();
    if !is_first {
        // The requested ordinates are not those of this figure.
    } else if !plot.y.is_empty() {
        figure.panels = chosen(&figure, report)?;
    } else if let Some(x) = &plot.x {
        for panel in &mut figure.panels {
            abscissa(panel, x, report)?;
        }
    }
    select_connections(&mut figure, report).map_err(|text| fault(report, "connections", text))?;
    for panel in &mut figure.panels {
        select_curves(panel, plot);
        if let Some([a, b]) = plot.x_range {
            let base = match plot.x_unit {
                Some(_) => 1.0,
                None => super::shown::drawn_over_written(panel),
            };
            panel.x_range = Some((a / base, b / base));
        } else if plot.x_unit.is_some() && panel.x_range.is_some() {
            convert_range(panel, plot).map_err(|text| fault(report, "x_unit", text))?;
        }
        if let Some([a, b]) = plot.y_range.filter(|_| is_first) {
            panel.y_range = Some((a, b));
        }
        panel.y_scale = match is_first {
            true => plot.y_scale.unwrap_or(panel.y_scale),
            false => panel.y_scale,
        };
        if let Some(unit) = &plot.x_unit {
            panel.x_unit.clone_from(unit);
            super::units::Scaled::abscissa(panel).map_err(|text| fault(report, "x_unit", text))?;
        }
    }
    select_methods(&mut figure, plot).map_err(|text| fault(report, "methods", text))?;
    for panel in &mut figure.panels {
        add_measured(panel, plot);
    }
    Ok(figure)
}

/// The range of the analysis in the requested unit.
fn convert_range(panel: &mut Panel, plot: &Plot) -> Result<(), String> {
    let unit = plot.x_unit.clone().unwrap_or_default();
    let factor = super::units::Scaled::abscissa(&Panel {
        x_unit: unit,
        ..panel.clone()
    })?
    .factor;
    panel.x_range = panel.x_range.map(|(a, b)| (a * factor, b * factor));
    Ok(())
}

/// One panel per requested column, in the style of the first panel of the figure.
fn chosen(figure: &Figure, report: &Report) -> Result<Vec<Panel>, Error> {
    let mut panels = Vec::new();
    for (k, wanted) in report.plot.y.iter().enumerate() {
        let found = matches(report, wanted);
        if found.is_empty() {
            let names = report
                .tables
                .iter()
                .flat_map(|t| &t.columns)
                .map(|c| c.name.as_str());
            let hint = did_you_mean(wanted, names);
            let text = format!("no column is called `{wanted}`; {hint}");
            return Err(fault(report, &format!("y.{k}"), text));
        }
        for (table, column) in found {
            panels.push(panel_of(figure, report, table, column)?);
        }
    }
    Ok(panels)
}

/// Columns of this name, or all of this quantity, in the first table that has any.
fn matches<'a>(report: &'a Report, wanted: &str) -> Vec<(&'a Table, &'a Column)> {
    let front = format!("{wanted}.");
    let is_wanted = |name: &str| name == wanted || name.starts_with(&front);
    let is_number = |c: &&Column| !matches!(c.values, Values::Text(_));
    let of = |table: &'a Table| -> Vec<(&'a Table, &'a Column)> {
        let columns = table.columns.iter().filter(is_number);
        columns
            .filter(|c| is_wanted(&c.name))
            .map(|c| (table, c))
            .collect()
    };
    report
        .tables
        .iter()
        .map(of)
        .find(|list| !list.is_empty())
        .unwrap_or_default()
}

fn panel_of(
    figure: &Figure,
    report: &Report,
    table: &Table,
    column: &Column,
) -> Result<Panel, Error> {
    let template = figure.panels.first().cloned().unwrap_or_default();
    let curves = template.curves.iter();
    let drawn: Vec<&Curve> = curves
        .filter(|c| !matches!(c.style, CurveStyle::Crosses))
        .collect();
    let (_, subject) = column.name.split_once('.').unwrap_or_default();
    let mut curves = Vec::new();
    for old in drawn {
        let is_events = matches!(old.style, CurveStyle::Events { .. });
        if is_events && !table.name.is_empty() {
            continue;
        }
        curves.push(Curve {
            table: match is_events {
                true => old.table.clone(),
                false => table.name.clone(),
            },
            y: column.name.clone(),
            label: relabelled(old, subject),
            ..old.clone()
        });
    }
    // A panel with several connections would draw the column more than once.
    curves.dedup_by(|a, b| (&a.x, &a.style, &a.only) == (&b.x, &b.style, &b.only));
    if curves.is_empty() {
        let x = report
            .plot
            .x
            .clone()
            .unwrap_or_else(|| table.columns[0].name.clone());
        curves.push(Curve {
            table: table.name.clone(),
            x,
            y: column.name.clone(),
            label: column.name.clone(),
            style: CurveStyle::Dots,
            only: None,
        });
    }
    let words = Words::of(&column.name);
    let is_heading = !words.subject.is_empty();
    let mut panel = Panel {
        y_label: match is_heading {
            true => Words {
                subject: String::new(),
                ..words.clone()
            }
            .axis(&column.unit),
            false => words.axis(&column.unit),
        },
        heading: words.subject,
        curves,
        y_range: None,
        ..template
    };
    if let Some(x) = &report.plot.x {
        abscissa(&mut panel, x, report)?;
    }
    Ok(panel)
}

/// The label of a curve of another column: `mesh_1, shooting` becomes `mesh_2, shooting`.
fn relabelled(old: &Curve, subject: &str) -> String {
    let (_, own) = old.y.split_once('.').unwrap_or_default();
    match (own, subject) {
        ("", _) | (_, "") => old.label.clone(),
        (own, subject) => old.label.replacen(own, subject, 1),
    }
}

/// Another column along the abscissa.
fn abscissa(panel: &mut Panel, x: &str, report: &Report) -> Result<(), Error> {
    let found = report.tables.iter().find_map(|t| t.column(x));
    let Some(column) = found.filter(|c| !matches!(c.values, Values::Text(_))) else {
        let names = report
            .tables
            .iter()
            .flat_map(|t| &t.columns)
            .map(|c| c.name.as_str());
        let text = format!(
            "no column of numbers is called `{x}`; {}",
            did_you_mean(x, names)
        );
        return Err(fault(report, "x", text));
    };
    if panel.curves.iter().all(|c| c.x == x) {
        return Ok(());
    }
    panel.x_label = Words::of(x).axis(&column.unit);
    (panel.x_range, panel.x_frequency) = (None, None);
    let has = |table: &str| report.table(table).is_some_and(|t| t.column(x).is_some());
    panel.curves.retain(|curve| match curve.style {
        CurveStyle::Crosses => false,
        CurveStyle::Events { .. } => has(&curve.table),
        _ => true,
    });
    for curve in &mut panel.curves {
        x.clone_into(&mut curve.x);
    }
    Ok(())
}

fn select_connections(figure: &mut Figure, report: &Report) -> Result<(), String> {
    let Some(list) = &report.plot.connections else {
        return Ok(());
    };
    if let Some(unknown) = list.iter().find(|name| !report.connections.contains(name)) {
        let hint = did_you_mean(unknown, &report.connections);
        return Err(format!("no connection is called `{unknown}`; {hint}"));
    }
    // Curves of bodies and modes stay.
    let is_drawn = |curve: &Curve| {
        let subject = curve.y.split_once('.').map(|(_, s)| s.to_string());
        subject.is_none_or(|s| !report.connections.contains(&s) || list.contains(&s))
    };
    for panel in &mut figure.panels {
        panel.curves.retain(is_drawn);
    }
    figure.panels.retain(|panel| !panel.curves.is_empty());
    match figure.panels.is_empty() {
        true => Err(format!(
            "nothing of {} is drawn; name columns with `y`",
            list.join(", ")
        )),
        false => Ok(()),
    }
}

fn select_curves(panel: &mut Panel, plot: &Plot) {
    let backbone = plot.backbone.unwrap_or(false);
    panel.curves.retain(|curve| match curve.style {
        CurveStyle::Crosses => backbone,
        CurveStyle::Events { .. } => plot.events.as_ref().is_none_or(|kinds| !kinds.is_empty()),
        _ => true,
    });
}

fn select_methods(figure: &mut Figure, plot: &Plot) -> Result<(), String> {
    let Some(list) = &plot.methods else {
        return Ok(());
    };
    let method = |curve: &Curve| match &curve.only {
        Some((column, value)) if column == "method" => Some(value.clone()),
        _ => None,
    };
    let drawn = figure
        .panels
        .iter()
        .flat_map(|p| &p.curves)
        .filter_map(method);
    let drawn: Vec<String> = drawn.collect();
    if let Some(unknown) = list.iter().find(|name| !drawn.contains(name)) {
        let hint = did_you_mean(unknown, drawn.iter().map(String::as_str));
        return Err(format!("the figure has no method `{unknown}`; {hint}"));
    }
    for panel in &mut figure.panels {
        panel
            .curves
            .retain(|c| method(c).is_none_or(|m| list.contains(&m)));
    }
    Ok(())
}

/// Measured values over the curves of the same columns.
fn add_measured(panel: &mut Panel, plot: &Plot) {
    for measured in &plot.measured {
        let is_over = |curve: &Curve| curve.x == measured.x && curve.y == measured.y;
        if panel.curves.iter().any(is_over) {
            panel.curves.push(Curve {
                table: measured.table.clone(),
                x: measured.x.clone(),
                y: measured.y.clone(),
                label: measured.label.clone(),
                style: CurveStyle::Dots,
                only: None,
            });
        }
    }
}

fn fault(report: &Report, key: &str, message: String) -> Error {
    Error::Input(vec![Diagnostic {
        location: None,
        path: format!("analyses.{}.plot.{key}", report.name),
        message,
        help: None,
    }])
}
