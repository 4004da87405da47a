//! Periodic functions in a model file: loads, stiffness variation, transmission error.

use super::fields::{Fields, Mistakes, NumberMeasure, Range, entries};
use super::orders::Orders;
use crate::error::Diagnostic;
use crate::numeric::fraction::{Fraction, gcd};
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;
use num_traits::One;

/// Unit of the orders in a connection, and the name that it had before.
pub(super) const UNIT_KEYS: [&str; 2] = ["order_unit", "base_order"];

/// Unit of the orders of one series.
#[derive(Debug, Clone)]
pub(super) struct OrderUnit {
    /// Order 1 of the series, in orders of the reference.
    pub order: Fraction,
    /// Tooth passing order of the connection.
    pub mesh: Option<Fraction>,
}

impl OrderUnit {
    /// Orders of the reference.
    pub(super) fn reference() -> OrderUnit {
        OrderUnit {
            order: Fraction::one(),
            mesh: None,
        }
    }
}

/// A turn, a little more for those who round it.
const TURN: f64 = 1.001 * std::f64::consts::TAU;
/// A stiffness variation whose mean misses 1 by more is an error.
const MEAN_ONE: f64 = 1e-9;

/// A transmission error: harmonics or a table.
pub(super) fn transmission_error(
    node: &Node,
    path: &str,
    measure: NumberMeasure,
    (unit, orders): (&OrderUnit, &mut Orders<'_>),
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    let keys = ["mean", "harmonics", "table"].into_iter().chain(UNIT_KEYS);
    let fields = Fields::known(node, path, &keys.collect::<Vec<_>>(), mistakes)?;
    let unit = &own_unit(&fields, unit, orders, mistakes);
    match fields.get("table") {
        Some(_) => table(&fields, measure, (unit, orders), mistakes),
        None => Some(fourier(&fields, measure, 0.0, (unit, orders), mistakes)),
    }
}

/// A relative stiffness: harmonics, a table or a rectangle; mean 1, nowhere negative.
pub(super) fn stiffness_variation(
    node: &Node,
    path: &str,
    (unit, orders): (&OrderUnit, &mut Orders<'_>),
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    let keys = ["mean", "harmonics", "table", "rectangular"];
    let keys: Vec<&str> = keys.into_iter().chain(UNIT_KEYS).collect();
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let unit = &own_unit(&fields, unit, orders, mistakes);
    let before = mistakes.count();
    let ratio = NumberMeasure::Si(UnitDimension::NUMBER);
    let series = match (fields.get("table"), fields.get("rectangular")) {
        (Some(_), Some(_)) => {
            let message = "table and rectangular exclude each other";
            mistakes.add(Diagnostic::at(node, path, message));
            return None;
        }
        (Some(_), None) => table(&fields, ratio, (unit, orders), mistakes),
        (None, Some(node)) => rectangular(node, &fields, (unit, orders), mistakes),
        (None, None) => Some(fourier(&fields, ratio, 1.0, (unit, orders), mistakes)),
    }?;
    if mistakes.count() == before {
        if (series.mean() - 1.0).abs() > MEAN_ONE {
            let message = format!(
                "mean {}, must be 1: the variation is relative to `stiffness`",
                series.mean()
            );
            mistakes.add(Diagnostic::at(node, path, message));
        }
        if is_negative(&series) {
            let message = "becomes negative: a stiffness cannot be negative";
            mistakes.add(Diagnostic::at(node, path, message));
        }
    }
    Some(series)
}

fn is_negative(series: &Periodic) -> bool {
    const SAMPLES: usize = 4096;
    match series {
        Periodic::Table { values, .. } | Periodic::Uneven { values, .. } => {
            values.iter().any(|v| *v < 0.0)
        }
        Periodic::Rectangular { high, low, .. } => high.min(*low) < 0.0,
        Periodic::Fourier { mean, harmonics } => {
            let swing: f64 = harmonics.iter().map(|h| h.cos.hypot(h.sin)).sum();
            let common = harmonics.iter().fold(0, |common, h| gcd(h.order, common));
            let step = std::f64::consts::TAU / (SAMPLES * common.max(1)) as f64;
            swing > *mean && (0..SAMPLES).any(|k| series.value(k as f64 * step) < 0.0)
        }
    }
}

/// The unit of a series, its own or that of its connection.
fn own_unit(
    fields: &Fields<'_>,
    outer: &OrderUnit,
    orders: &Orders<'_>,
    mistakes: &mut Mistakes,
) -> OrderUnit {
    let order = written_unit(fields, outer.mesh.as_ref(), orders, mistakes);
    OrderUnit {
        order: order.unwrap_or_else(|| outer.order.clone()),
        mesh: outer.mesh.clone(),
    }
}

/// The unit of a connection's series.
pub(super) fn unit(
    fields: &Fields<'_>,
    mesh: Option<&Fraction>,
    orders: &Orders<'_>,
    mistakes: &mut Mistakes,
) -> OrderUnit {
    OrderUnit {
        order: written_unit(fields, mesh, orders, mistakes).unwrap_or_else(Fraction::one),
        mesh: mesh.cloned(),
    }
}

fn written_unit(
    fields: &Fields<'_>,
    mesh: Option<&Fraction>,
    orders: &Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<Fraction> {
    let given: Vec<&str> = (UNIT_KEYS.into_iter())
        .filter(|key| fields.get(key).is_some())
        .collect();
    let key = given.first()?;
    let (node, path) = (fields.get(key)?, fields.path_of(key));
    if given.len() > 1 {
        let message = "order_unit and base_order are two names of one key";
        mistakes.add(Diagnostic::at(node, &path, message));
    }
    orders.read(node, &path, mesh, mistakes)
}

/// The unit of a table or a rectangle as a multiple of the base order.
fn periods(
    fields: &Fields<'_>,
    unit: &OrderUnit,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> usize {
    orders.multiple(Some(&unit.order), fields.node, &fields.path, mistakes)
}

/// mean + sum amplitude cos(order unit phase + phase_0): cos part amplitude cos(phase_0), sin part -amplitude sin(phase_0).
fn fourier(
    fields: &Fields<'_>,
    measure: NumberMeasure,
    default_mean: f64,
    (unit, orders): (&OrderUnit, &mut Orders<'_>),
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
        own.required("amplitude", "the amplitude of the cosine", mistakes);
        let amplitude = own.number("amplitude", measure, Range::Any, mistakes);
        let order = order_of(&own, (unit, orders), mistakes);
        harmonics.push(wave(&own, order, amplitude.unwrap_or(0.0), mistakes));
    }
    Periodic::Fourier {
        mean: mean.unwrap_or(default_mean),
        harmonics,
    }
}

/// The order of a harmonic.
fn order_of(
    own: &Fields<'_>,
    (unit, orders): (&OrderUnit, &mut Orders<'_>),
    mistakes: &mut Mistakes,
) -> usize {
    let written = own.required("order", "1 for the excitation frequency", mistakes);
    harmonic_order(written, &own.path_of("order"), (unit, orders), mistakes)
}

/// A harmonic with the phase that its fields name.
pub(super) fn wave(
    own: &Fields<'_>,
    order: usize,
    amplitude: f64,
    mistakes: &mut Mistakes,
) -> Harmonic {
    let (sin, cos) = angle(own, "phase", mistakes).sin_cos();
    Harmonic {
        order,
        cos: amplitude * cos,
        // 0 - x, so that phase 0 gives +0.
        sin: 0.0 - amplitude * sin,
    }
}

/// An order as a multiple of the base order: `mesh` and shafts are orders of the reference, numbers count in the unit.
pub(super) fn harmonic_order(
    node: Option<&Node>,
    path: &str,
    (unit, orders): (&OrderUnit, &mut Orders<'_>),
    mistakes: &mut Mistakes,
) -> usize {
    let Some(node) = node else {
        return 1;
    };
    let order = orders.read(node, path, unit.mesh.as_ref(), mistakes);
    let is_named = node.as_text(path).map_or(true, |text| text == "mesh");
    let order = order.map(|order| if is_named { order } else { order * &unit.order });
    orders.multiple(order.as_ref(), node, path, mistakes)
}

/// Whether a number has no unit.
fn is_bare(node: &Node) -> bool {
    Quantity::from_node(node, "").is_ok_and(|q| q.dimension.is_none())
}

fn angle(fields: &Fields<'_>, key: &str, mistakes: &mut Mistakes) -> f64 {
    let radian = NumberMeasure::Si(UnitDimension::ANGLE);
    let value = fields.number(key, radian, Range::Any, mistakes);
    let value = value.unwrap_or(0.0);
    let written = fields.get(key).filter(|_| value.abs() > TURN);
    if let Some(node) = written.filter(|node| is_bare(node)) {
        mistakes.warn(format!(
            "{} = {} is a bare number, hence in rad, and more than one turn: write `{} deg` if it is in degrees",
            fields.path_of(key),
            node.describe(),
            value
        ));
    }
    value
}

fn table(
    fields: &Fields<'_>,
    measure: NumberMeasure,
    (unit, orders): (&OrderUnit, &mut Orders<'_>),
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    let base_order = periods(fields, unit, orders, mistakes);
    for key in ["mean", "harmonics"] {
        if let Some(node) = fields.get(key) {
            let message = "excludes a table";
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
    let mut read =
        |(path, node): &(String, &Node)| mistakes.number(node, path, measure, Range::Any);
    let values: Vec<Option<f64>> = list.iter().map(&mut read).collect();
    Some(Periodic::Table {
        values: values.into_iter().collect::<Option<_>>()?,
        base_order,
    })
}

/// Whether a list has too few values; a value that is not a list has already been rejected.
fn is_short(node: &Node, len: usize) -> bool {
    matches!(node.value, crate::yaml::Value::List(_)) && len < 2
}

fn rectangular(
    node: &Node,
    outer: &Fields<'_>,
    (unit, orders): (&OrderUnit, &mut Orders<'_>),
    mistakes: &mut Mistakes,
) -> Option<Periodic> {
    let base_order = periods(outer, unit, orders, mistakes);
    for key in ["mean", "harmonics"] {
        if let Some(node) = outer.get(key) {
            let message = "excludes `rectangular`";
            mistakes.add(Diagnostic::at(node, &outer.path_of(key), message));
        }
    }
    let keys = ["high", "low", "duty", "phase"];
    let fields = Fields::known(node, &outer.path_of("rectangular"), &keys, mistakes)?;
    for key in ["high", "low", "duty"] {
        fields.required(
            key,
            "high, low and duty (the fraction of the period with high)",
            mistakes,
        );
    }
    let ratio = NumberMeasure::Si(UnitDimension::NUMBER);
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
