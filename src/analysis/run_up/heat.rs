//! Levels over speed and order as pictures, with the natural frequencies over them (Campbell diagram).

use super::plan::RunUpPlan;
use super::record::Window;
use super::tables::{Natural, speed};
use crate::analysis::columns::{self, float, integer};
use crate::analysis::{Setting, columns::text};
use crate::measure::ColumnHeading;
use crate::report::{Column, Curve, CurveStyle, Figure, NamedFigure, Panel, Table, Words};

/// Levels further below the largest one are drawn as if they were this far below \[dB\].
pub const RANGE: f64 = 80.0;
/// Natural frequencies closer than this are one.
const SAME: f64 = 1e-9;
/// Points of a natural frequency over the range of speed.
const POINTS: usize = 61;

/// References of levels by unit: ISO 1683 where it has one.
fn reference(unit: &str) -> f64 {
    match unit {
        "m" => 1e-12,
        "m/s" => 1e-9,
        "" => 1.0,
        _ => 1e-6,
    }
}

/// `re 1e-12 m`.
fn reference_in_words(unit: &str) -> String {
    match unit {
        "" => "1".to_owned(),
        unit => format!("{:e} {unit}", reference(unit)),
    }
}

/// The reference of every signal's level, by name.
pub fn references(
    setting: &Setting<'_>,
    plan: &RunUpPlan,
) -> serde_json::Map<String, serde_json::Value> {
    let signals = plan.signals.iter().map(|signal| signal.heading(setting));
    signals
        .map(|h| (h.name, reference_in_words(&h.unit).into()))
        .collect()
}

/// Levels of a signal at every window and line, 20 lg(r.m.s. / reference), no further than [`RANGE`] below the largest.
pub fn levels(
    setting: &Setting<'_>,
    plan: &RunUpPlan,
    windows: &[Window],
    signal: usize,
) -> Column {
    let heading = plan.signals[signal].heading(setting);
    let size = heading.factor / reference(&heading.unit) * std::f64::consts::FRAC_1_SQRT_2;
    let amplitudes = windows.iter().flat_map(|w| &w.spectra[signal]);
    let level = amplitudes.map(|a| 20.0 * (a.abs() * size).log10());
    let mut level: Vec<f64> = level.collect();
    let largest = level
        .iter()
        .copied()
        .filter(|x| x.is_finite())
        .fold(f64::NEG_INFINITY, f64::max);
    level.iter_mut().for_each(|x| *x = x.max(largest - RANGE));
    let unit = format!("dB re {}", reference_in_words(&heading.unit));
    float(format!("level.{}", heading.name), unit, level)
}

/// `campbell`: natural frequencies as orders over the range of speed, as far as the spectra go.
pub fn campbell(setting: &Setting<'_>, plan: &RunUpPlan, natural: &[Natural]) -> Table {
    let (low, high) = plan.ramp.extent();
    let least = low.max(1e-3 * high);
    let speeds = (0..POINTS).map(|k| least + (high - least) * k as f64 / (POINTS - 1) as f64);
    let speeds: Vec<f64> = speeds.collect();
    let inside = |natural: &Natural, w: f64| natural.frequency / w <= plan.spectrum as f64;
    // A mode that is the same at rest is one line.
    let is_known = |own: &Natural| {
        let agrees = |other: &Natural| (other.frequency / own.frequency - 1.0).abs() < SAME;
        own.state == "rest" && natural.iter().any(|n| n.state != "rest" && agrees(n))
    };
    let rows: Vec<(&Natural, f64)> = (natural.iter())
        .filter(|n| !is_known(n))
        .flat_map(|n| speeds.iter().map(move |w| (n, *w)))
        .filter(|(n, w)| inside(n, *w))
        .collect();
    Table {
        name: "campbell".into(),
        columns: vec![
            text("line", rows.iter().map(|(n, _)| n.name()).collect()),
            text(
                "state",
                rows.iter().map(|(n, _)| n.state.to_owned()).collect(),
            ),
            integer("mode", rows.iter().map(|(n, _)| n.mode as i64).collect()),
            speed(setting).column(rows.iter().map(|r| r.1)),
            float(
                "order",
                "",
                rows.iter().map(|(n, w)| n.frequency / w).collect(),
            ),
        ],
    }
}

/// One picture per signal: levels over speed and order, natural frequencies over them.
pub fn figure(setting: &Setting<'_>, plan: &RunUpPlan, campbell: &Table) -> NamedFigure {
    let x: ColumnHeading = speed(setting);
    let x_label = columns::frequency_label(setting, &x.axis());
    let mut lines: Vec<String> = match campbell.column("line").map(|c| &c.values) {
        Some(values) => values.as_texts().map_or(Vec::new(), <[String]>::to_vec),
        None => Vec::new(),
    };
    lines.dedup();
    let panel = |signal: &super::signals::Signal| {
        let heading = signal.heading(setting);
        let unit = reference_in_words(&heading.unit);
        let signal = Words::of(&heading.name).axis("");
        let cells = Curve {
            table: "spectra".into(),
            x: x.name.clone(),
            y: "order".into(),
            label: format!("level of {signal} [dB re {unit}]"),
            style: CurveStyle::Cells {
                value: format!("level.{}", heading.name),
                names: Vec::new(),
            },
            only: None,
        };
        let line = |name: &String| Curve {
            table: "campbell".into(),
            x: x.name.clone(),
            y: "order".into(),
            label: name.clone(),
            style: CurveStyle::Line,
            only: Some(("line".into(), name.clone())),
        };
        Panel {
            x_label: x_label.clone(),
            y_label: "order".into(),
            heading: signal,
            y_range: Some((0.0, plan.spectrum as f64)),
            curves: std::iter::once(cells)
                .chain(lines.iter().map(line))
                .collect(),
            ..Panel::default()
        }
    };
    NamedFigure {
        name: "spectra".into(),
        figure: Figure {
            title: String::new(),
            panels: plan.signals.iter().map(panel).collect(),
        },
    }
}
