//! Loads in a model file: harmonics, measured cycles, functions of time.

use super::cycle::cycle;
use super::fields::{Fields, Mistakes, NumberMeasure, Range, entries, is_scalar};
use super::orders::Orders;
use super::profile::profile;
use super::series::wave;
use super::{Load, LoadPart};
use crate::error::Diagnostic;
use crate::numeric::broken_line::BrokenLine;
use crate::numeric::growth::Growth;
use crate::numeric::periodic::Periodic;
use crate::quantity::UnitDimension;
use crate::yaml::Node;

/// Keys of a load.
pub(super) const KEYS: [&str; 5] = ["mean", "harmonics", "cycle", "profile", "motion"];

/// A load, with a note where its cycle repeats its first row.
///
/// ```text
/// T = mean + sum of amplitude(speed) cos(order phase + phase_0) + cycle(phase) + profile(t)
/// ```
pub(super) fn load(
    node: &Node,
    path: &str,
    torque: UnitDimension,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<(Load, Option<String>)> {
    let fields = Fields::known(node, path, &KEYS, mistakes)?;
    let measure = NumberMeasure::Si(torque);
    let mean = fields.number("mean", measure, Range::Any, mistakes);
    let mut load = Load {
        series: Periodic::Fourier {
            mean: mean.unwrap_or(0.0),
            harmonics: Vec::new(),
        },
        others: Vec::new(),
    };
    if let Some(node) = fields.get("harmonics") {
        for (path, node) in entries(node, &fields.path_of("harmonics"), mistakes) {
            harmonic((node, &path), measure, orders, &mut load, mistakes);
        }
    }
    let mut note = None;
    if let Some(node) = fields.get("cycle") {
        let path = fields.path_of("cycle");
        let (series, said) = cycle((node, &path), torque, &[], orders, mistakes)?;
        load.others.push(LoadPart::Cycle(series));
        note = said;
    }
    if let Some(node) = fields.get("profile") {
        let line = profile(node, &fields.path_of("profile"), torque, mistakes)?;
        load.others.push(LoadPart::Profile(line));
    }
    Some((load, note))
}

/// One harmonic; its amplitude may depend on the speed.
fn harmonic(
    (node, path): (&Node, &str),
    measure: NumberMeasure,
    orders: &mut Orders<'_>,
    load: &mut Load,
    mistakes: &mut Mistakes,
) -> Option<()> {
    let keys = ["order", "amplitude", "phase", "speed_power", "at"];
    let own = Fields::known(node, path, &keys, mistakes)?;
    let written = own.required("order", "1 for the excitation frequency", mistakes)?;
    let (order, free) = orders.of_load(written, &own.path_of("order"), mistakes);
    let written = own.required("amplitude", "the amplitude of the cosine", mistakes)?;
    let (amplitude, growth) = amplitude(&own, written, measure, mistakes)?;
    let wave = wave(&own, order, amplitude, mistakes);
    match (growth, free, &mut load.series) {
        (Growth::Constant, None, Periodic::Fourier { harmonics, .. }) => harmonics.push(wave),
        (growth, free, _) => {
            let series = Periodic::Fourier {
                mean: 0.0,
                harmonics: vec![wave],
            };
            load.others.push(LoadPart::Growing(series, growth, free));
        }
    }
    Some(())
}

/// An amplitude and how it depends on the speed: a number, `speed_power` and `at` beside it, or a table.
fn amplitude(
    own: &Fields<'_>,
    written: &Node,
    measure: NumberMeasure,
    mistakes: &mut Mistakes,
) -> Option<(f64, Growth)> {
    let path = own.path_of("amplitude");
    let speed = NumberMeasure::Si(UnitDimension::FREQUENCY);
    let given = ["speed_power", "at"].map(|key| own.get(key));
    if is_scalar(written) {
        let amplitude = mistakes.number(written, &path, measure, Range::Any)?;
        let [Some(_), Some(_)] = given else {
            for (key, other) in [("speed_power", given[1]), ("at", given[0])] {
                if let (None, Some(node)) = (own.get(key), other) {
                    let message =
                        "speed_power and at belong together: amplitude (speed / at)^speed_power";
                    mistakes.add(Diagnostic::at(node, &own.path, message));
                }
            }
            return Some((amplitude, Growth::Constant));
        };
        let bare = NumberMeasure::Si(UnitDimension::NUMBER);
        let power = own.number("speed_power", bare, Range::Any, mistakes)?;
        let reference = own.number("at", speed, Range::Positive, mistakes)?;
        let growth = match power == 0.0 {
            true => Growth::Constant,
            false => Growth::Power { power, reference },
        };
        return Some((amplitude, growth));
    }
    for (key, node) in ["speed_power", "at"].into_iter().zip(given) {
        if let Some(node) = node {
            let message = "excludes a table of amplitudes";
            mistakes.add(Diagnostic::at(node, &own.path_of(key), message));
        }
    }
    let fields = Fields::known(written, &path, &["speed", "values"], mistakes)?;
    let list = |key: &str, measure, range, mistakes: &mut Mistakes| {
        let wanted =
            "lists of equal length: {speed: [600 rpm, 4000 rpm], values: [50 N m, 90 N m]}";
        let node = fields.required(key, wanted, mistakes)?;
        let list = entries(node, &fields.path_of(key), mistakes);
        let read = list
            .iter()
            .map(|(path, node)| mistakes.number(node, path, measure, range));
        read.collect::<Vec<_>>()
            .into_iter()
            .collect::<Option<Vec<f64>>>()
    };
    let speeds = list("speed", speed, Range::NotNegative, mistakes);
    let values = list("values", measure, Range::Any, mistakes);
    let (speeds, values) = (speeds?, values?);
    if speeds.len() != values.len() || speeds.is_empty() {
        let message = format!(
            "{} speeds and {} values, wanted equally many",
            speeds.len(),
            values.len()
        );
        mistakes.add(Diagnostic::at(written, &path, message));
        return None;
    }
    if let Some(k) = speeds.windows(2).position(|pair| pair[1] <= pair[0]) {
        let message = "speeds must ascend";
        let path = format!("{path}.speed.{}", k + 1);
        mistakes.add(Diagnostic::at(written, &path, message));
        return None;
    }
    let points = speeds.into_iter().zip(values).collect();
    let line = BrokenLine::new(points).ok()?;
    Some((1.0, Growth::Table(line)))
}
