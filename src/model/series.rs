//! Periodic functions in a model file: loads, stiffness variation, transmission error.

use super::fields::{Fields, Measure, Mistakes, Range, entries, number};
use crate::error::Diagnostic;
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::quantity::UnitDimension;
use crate::yaml::Node;

/// Highest order and base order: enough for any gear, and far from where sampling is hopeless.
const HIGHEST_ORDER: usize = 100_000;
/// A stiffness variation whose mean misses 1 by more is a mistake.
const MEAN_ONE: f64 = 1e-9;

/// A load.
///
///     T = mean + sum of amplitude cos(order phase + phase_0)
pub(super) fn load(
    node: &Node,
    path: &str,
    measure: Measure,
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    let fields = Fields::known(node, path, &["mean", "harmonics"], mistakes)?;
    Some(fourier(&fields, measure, 0.0, 1, mistakes))
}

/// A transmission error: harmonics or a table.
pub(super) fn transmission_error(
    node: &Node,
    path: &str,
    measure: Measure,
    base_order: usize,
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    let keys = ["mean", "harmonics", "table", "base_order"];
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let base = own_base(&fields, base_order, mistakes);
    match fields.get("table") {
        Some(_) => table(&fields, measure, base, mistakes),
        None => Some(fourier(&fields, measure, 0.0, base, mistakes)),
    }
}

/// A relative stiffness: harmonics, a table or a rectangle; mean 1, nowhere negative.
pub(super) fn stiffness_variation(
    node: &Node,
    path: &str,
    base_order: usize,
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    let keys = ["mean", "harmonics", "table", "rectangular", "base_order"];
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let base = own_base(&fields, base_order, mistakes);
    let before = mistakes.count();
    let ratio = Measure::Si(UnitDimension::NUMBER);
    let series = match (fields.get("table"), fields.get("rectangular")) {
        (Some(_), Some(_)) => {
            let message = "table and rectangular exclude each other";
            mistakes.add(Diagnostic::at(node, path, message));
            return None;
        }
        (Some(_), None) => table(&fields, ratio, base, mistakes),
        (None, Some(node)) => rectangular(node, &fields, base, mistakes),
        (None, None) => Some(fourier(&fields, ratio, 1.0, base, mistakes)),
    }?;
    if mistakes.count() == before {
        if (series.mean() - 1.0).abs() > MEAN_ONE {
            let message = format!(
                "mean {}, must be 1: the variation is relative to `stiffness`",
                series.mean()
            );
            mistakes.add(Diagnostic::at(node, path, message));
        }
        if is_negative(&series, base) {
            let message = "becomes negative: the connection would push where it must pull";
            mistakes.add(Diagnostic::at(node, path, message));
        }
    }
    Some(series)
}

fn is_negative(series: &Periodic, base: usize) -> bool {
    const SAMPLES: usize = 4096;
    match series {
        Periodic::Table { values, .. } => values.iter().any(|v| *v < 0.0),
        Periodic::Rectangular { high, low, .. } => high.min(*low) < 0.0,
        Periodic::Fourier { mean, harmonics } => {
            let swing: f64 = harmonics.iter().map(|h| h.cos.hypot(h.sin)).sum();
            let step = std::f64::consts::TAU / (SAMPLES * base) as f64;
            swing > *mean && (0..SAMPLES).any(|k| series.value(k as f64 * step) < 0.0)
        }
    }
}

fn own_base(fields: &Fields<'_>, base_order: usize, mistakes: &mut Mistakes) -> usize {
    match fields.get("base_order") {
        Some(_) => fields.count("base_order", HIGHEST_ORDER, mistakes),
        None => base_order,
    }
}

/// The `base_order` of a connection.
pub(super) fn base_order(fields: &Fields<'_>, mistakes: &mut Mistakes) -> usize {
    fields.count("base_order", HIGHEST_ORDER, mistakes)
}

/// mean + sum amplitude cos(order base_order phase + phase_0): cos part amplitude cos(phase_0), sin part -amplitude sin(phase_0).
fn fourier(
    fields: &Fields<'_>,
    measure: Measure,
    default_mean: f64,
    base: usize,
    mistakes: &mut Mistakes,
) -> Periodic {
    let mean = fields.number("mean", measure, Range::Any, mistakes);
    let list = fields.get("harmonics").map(|node| {
        let path = fields.path_of("harmonics");
        entries(node, &path, mistakes)
    });
    let mut harmonics = Vec::new();
    for (path, node) in list.unwrap_or_default() {
        let keys = ["order", "amplitude", "phase"];
        let Some(own) = Fields::known(node, &path, &keys, mistakes) else {
            continue;
        };
        own.required(
            "order",
            "a whole number, 1 for the excitation frequency",
            mistakes,
        );
        own.required("amplitude", "the amplitude of the cosine", mistakes);
        let order = own.count("order", HIGHEST_ORDER, mistakes);
        let amplitude = own.number("amplitude", measure, Range::Any, mistakes);
        let (sin, cos) = angle(&own, "phase", mistakes).sin_cos();
        let amplitude = amplitude.unwrap_or(0.0);
        harmonics.push(Harmonic {
            order: order * base,
            cos: amplitude * cos,
            // 0 - x, so that phase 0 gives +0.
            sin: 0.0 - amplitude * sin,
        });
    }
    Periodic::Fourier {
        mean: mean.unwrap_or(default_mean),
        harmonics,
    }
}

fn angle(fields: &Fields<'_>, key: &str, mistakes: &mut Mistakes) -> f64 {
    let radian = Measure::Si(UnitDimension::ANGLE);
    let value = fields.number(key, radian, Range::Any, mistakes);
    value.unwrap_or(0.0)
}

fn table(
    fields: &Fields<'_>,
    measure: Measure,
    base_order: usize,
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    for key in ["mean", "harmonics"] {
        if let Some(node) = fields.get(key) {
            let message = "does not go with a table, whose values say everything";
            mistakes.add(Diagnostic::at(node, &fields.path_of(key), message));
        }
    }
    let (node, path) = (fields.get("table")?, fields.path_of("table"));
    let list = entries(node, &path, mistakes);
    if is_short(node, list.len()) {
        let message = format!("found {} values, wanted at least 2", list.len());
        mistakes.add(Diagnostic::at(node, &path, message));
        return None;
    }
    let read = |(path, node): &(String, &Node)| number(node, path, measure, Range::Any);
    let values: Vec<Option<f64>> = list.iter().map(|x| mistakes.note(read(x))).collect();
    Some(Periodic::Table {
        values: values.into_iter().collect::<Option<_>>()?,
        base_order,
    })
}

/// Whether a list has too few values; what is no list has been refused already.
fn is_short(node: &Node, len: usize) -> bool {
    matches!(node.value, crate::yaml::Value::List(_)) && len < 2
}

fn rectangular(
    node: &Node,
    outer: &Fields<'_>,
    base_order: usize,
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    for key in ["mean", "harmonics"] {
        if let Some(node) = outer.get(key) {
            let message = "does not go with a rectangle, whose values say everything";
            mistakes.add(Diagnostic::at(node, &outer.path_of(key), message));
        }
    }
    let keys = ["high", "low", "duty", "phase"];
    let fields = Fields::known(node, &outer.path_of("rectangular"), &keys, mistakes)?;
    for key in ["high", "low", "duty"] {
        fields.required(key, "high, low and duty (the share of high)", mistakes);
    }
    let ratio = Measure::Si(UnitDimension::NUMBER);
    let mut value = |key| fields.number(key, ratio, Range::Any, mistakes);
    let (high, low, duty) = (value("high"), value("low"), value("duty"));
    let phase = angle(&fields, "phase", mistakes);
    let (high, low, duty) = (high?, low?, duty?);
    if !(duty > 0.0 && duty < 1.0) {
        let message = format!("found {duty}, must be between 0 and 1");
        let node = fields.get("duty").unwrap_or(node);
        mistakes.add(Diagnostic::at(node, &fields.path_of("duty"), message));
        return None;
    }
    Some(Periodic::Rectangular {
        high,
        low,
        duty,
        phase,
        base_order,
    })
}
