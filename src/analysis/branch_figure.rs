//! Branches as figures: r.m.s. deformations with the backbone.

use super::branch_table::TracedMethod;
use super::columns::{frequency_axis, frequency_label};
use super::response::{Method, ResponseTable, Swept};
use crate::postprocess::connection::is_clearance;
use crate::report::{Curve, CurveStyle, Figure, FrequencyUnit, Panel, Words, readable};
use std::f64::consts::TAU;

/// Panels that connections without a gap may fill.
const FEW_PANELS: usize = 4;
/// Panels drawn at most; the table has every connection.
const MAX_PANELS: usize = 48;

/// Connections that are drawn, by number: all with a gap, and others while there are few panels.
pub fn drawn(swept: &Swept<'_>) -> Vec<usize> {
    let mounts = swept.setting.assembly.system.mounts();
    let has_gap = |e: &usize| is_clearance(mounts[*e].element.as_ref());
    let (gaps, others): (Vec<usize>, Vec<usize>) = (0..mounts.len()).partition(has_gap);
    let room = FEW_PANELS.saturating_sub(gaps.len());
    let mut drawn: Vec<usize> = gaps.into_iter().take(MAX_PANELS).collect();
    drawn.extend(others.into_iter().take(room));
    drawn.sort_unstable();
    drawn
}

/// R.m.s. deformation of each connection against the parameter, stable solid and unstable dashed, attractors as dots, one
/// curve a method; with the backbone: the response-variant natural frequencies at the same deformation.
pub fn figure(swept: &Swept<'_>, traced: &[TracedMethod<'_>]) -> Figure {
    let names = &swept.setting.assembly.connections;
    let panels = drawn(swept).into_iter();
    Figure {
        title: String::new(),
        panels: panels.map(|e| panel(swept, traced, e, &names[e])).collect(),
    }
}

fn panel(swept: &Swept<'_>, traced: &[TracedMethod<'_>], e: usize, connection: &str) -> Panel {
    let setting = swept.setting;
    let (abscissa, x_label) = match (swept.written(), setting.is_si()) {
        (None, true) => (
            "frequency_hz",
            frequency_label(setting, "excitation frequency [Hz]"),
        ),
        (None, false) => ("omega", "excitation frequency \u{3c9}/\u{3c9}c".to_string()),
        (Some(path), _) => ("parameter", Words::of_number(path, &swept.unit)),
    };
    let curve = |table: &str, x: &str, label: String, style, only| Curve {
        table: table.into(),
        x: x.into(),
        y: format!("rms.{connection}"),
        label,
        style,
        only,
    };
    let mut curves = Vec::new();
    // The branches of one method are one curve of several pieces.
    let mut methods: Vec<Method> = traced.iter().map(|t| t.method).collect();
    methods.dedup();
    let directions = directions(swept, traced);
    for (direction, branch) in &directions {
        let only = Some(("branch".to_owned(), branch.to_string()));
        curves.push(curve(
            "",
            abscissa,
            (*direction).into(),
            CurveStyle::Dots,
            only,
        ));
    }
    for method in methods.iter().filter(|_| directions.is_empty()) {
        let style = match method {
            Method::Integration => CurveStyle::Dots,
            Method::Galerkin | Method::Shooting => CurveStyle::Branch {
                branch: "branch".into(),
                stable: "stable".into(),
            },
        };
        let label = if methods.len() > 1 {
            method.title().to_string()
        } else {
            connection.to_string()
        };
        curves.push(curve(
            "",
            abscissa,
            label,
            style,
            Some(("method".into(), method.word().into())),
        ));
    }
    // The backbones of methods that agree lie on one another: the first one's is drawn, where frequencies are the abscissa.
    let first = traced
        .first()
        .map(|t| ("method".to_string(), t.method.word().to_string()));
    let backbones = match swept.written() {
        None => setting.assembly.system.dof().min(FEW_PANELS),
        Some(_) => 0,
    };
    for i in 1..=backbones {
        let (x, label) = (
            format!("effective_frequency.{i}"),
            format!("backbone, mode {i}"),
        );
        curves.push(curve("", &x, label, CurveStyle::Crosses, first.clone()));
    }
    let style = CurveStyle::Events {
        kind: "kind".into(),
    };
    if swept.computes(ResponseTable::Events) {
        curves.push(curve("events", abscissa, "events".into(), style, None));
    }
    let unit = match setting.is_si() {
        true => setting.model.units_of(e).0,
        false => "",
    };
    Panel {
        x_label,
        y_label: Words::of("rms").axis(unit),
        heading: readable(connection),
        x_range: Some(swept_range(swept)),
        x_frequency: match swept.written() {
            None => frequency_axis(setting, FrequencyUnit::Hertz),
            Some(_) => None,
        },
        curves,
        ..Panel::default()
    }
}

/// Sweeps of one attractor up and down, where these are all that is drawn: direction and branch.
fn directions(swept: &Swept<'_>, traced: &[TracedMethod<'_>]) -> Vec<(&'static str, usize)> {
    let direction = |(branch, t): (usize, &TracedMethod<'_>)| {
        let (first, last) = (t.points.first()?, t.points.last()?);
        let rise = swept.value(last.lambda) - swept.value(first.lambda);
        let is_swept = t.method == Method::Integration && rise != 0.0;
        let word = if rise > 0.0 { "upwards" } else { "downwards" };
        is_swept.then_some((word, branch))
    };
    let list: Option<Vec<_>> = traced.iter().enumerate().map(direction).collect();
    list.filter(|list| list.len() == 2).unwrap_or_default()
}

/// Ends of the abscissa: a backbone may leave them, and does where the excitation has many orders.
fn swept_range(swept: &Swept<'_>) -> (f64, f64) {
    let (from, to) = (swept.value(swept.range.0), swept.value(swept.range.1));
    match (swept.written(), swept.setting.is_si()) {
        (None, true) => (from / TAU, to / TAU),
        _ => (from, to),
    }
}
