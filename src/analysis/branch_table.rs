//! Branches as tables and figures: the columns of a frequency response.

use super::Setting;
use crate::postprocess::effective_stiffness::natural_frequencies;
use crate::postprocess::measures::{Measures, Meter};
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Table, Values};
use crate::solve::branch::{Branch, BranchPoint, Recorder, Stability};
use crate::solve::events::{BifurcationEvent, EventKind};
use crate::solve::orbit::Orbit;
use crate::system::System;

/// Records the measures of every connection and the effective frequencies, nondimensional.
pub struct MeasureRecorder<'a> {
    meter: Meter,
    setting: &'a Setting<'a>,
    range: (f64, f64),
    points: usize,
    /// Connections whose contact pulled somewhere on the branch.
    pub pulling: Vec<bool>,
}

/// Values recorded a connection, in the order of [`MeasureRecorder`].
const PER_CONNECTION: usize = 12;

impl<'a> MeasureRecorder<'a> {
    /// A recorder for orbits of so many samples.
    pub fn new(setting: &'a Setting<'a>, samples: usize, range: (f64, f64)) -> Self {
        let pulling = vec![false; setting.assembly.connections.len()];
        MeasureRecorder {
            meter: Meter::new(samples),
            setting,
            range,
            points: 0,
            pulling,
        }
    }
}

impl Recorder for MeasureRecorder<'_> {
    fn record(&mut self, system: &System, orbit: &Orbit, values: &mut Vec<f64>) {
        let measures = self.meter.measure(system, orbit);
        let mut slopes = Vec::with_capacity(measures.len());
        for (m, pulling) in measures.iter().zip(&mut self.pulling) {
            let Measures {
                mean,
                rms,
                min,
                max,
                rms_velocity,
                contact_ratio,
                impacts,
                ..
            } = *m;
            let stiffness =
                [m.effective_stiffness, m.effective_stiffness_dc].map(|k| k.unwrap_or(f64::NAN));
            values.extend([mean, rms, min, max, rms_velocity]);
            values.extend(stiffness);
            values.extend([
                contact_ratio,
                impacts,
                m.force_mean,
                m.force_max,
                m.force_std,
            ]);
            slopes.push(m.effective_stiffness.unwrap_or(m.mean_slope));
            *pulling |= m.pulls;
        }
        values.extend(natural_frequencies(system, &slopes));
    }

    fn accept(&mut self, point: &BranchPoint) -> bool {
        self.points += 1;
        let (from, to) = self.range;
        let share = ((point.lambda - from) / (to - from)).clamp(0.0, 1.0);
        let words = format!("point {} at {:.4}", self.points, point.lambda);
        self.setting
            .control
            .progress(self.setting.name, share, &words);
        !self.setting.control.is_interrupted()
    }
}

/// A recorded column: its name, unit, and the factor from nondimensional to reported values.
struct Recorded {
    name: String,
    unit: String,
    factor: f64,
}

/// Names, units and factors of the recorded values, in their order.
fn recorded_columns(setting: &Setting<'_>) -> Vec<Recorded> {
    let scales = &setting.assembly.scales;
    let is_si = setting.is_si();
    let mut list = Vec::new();
    for (e, connection) in setting.assembly.connections.iter().enumerate() {
        let (x, force) = setting.model.units_of(e);
        let (l, w, k) = (
            scales.displacement[e],
            scales.frequency,
            scales.stiffness[e],
        );
        for (name, unit, factor) in [
            ("mean", x.to_string(), l),
            ("rms", x.to_string(), l),
            ("min", x.to_string(), l),
            ("max", x.to_string(), l),
            ("rms_velocity", format!("{x}/s"), l * w),
            ("effective_stiffness", String::new(), 1.0),
            ("effective_stiffness_dc", String::new(), 1.0),
            ("contact_ratio", String::new(), 1.0),
            ("impacts", String::new(), 1.0),
            ("force_mean", force.to_string(), k * l),
            ("force_max", force.to_string(), k * l),
            ("force_std", force.to_string(), k * l),
        ] {
            let name = format!("{name}.{connection}");
            list.push(if is_si {
                Recorded { name, unit, factor }
            } else {
                Recorded {
                    name,
                    unit: String::new(),
                    factor: 1.0,
                }
            });
        }
    }
    debug_assert_eq!(
        list.len(),
        PER_CONNECTION * setting.assembly.connections.len()
    );
    for i in 1..=setting.assembly.system.dof() {
        let (unit, factor) = if is_si {
            ("Hz", scales.frequency / std::f64::consts::TAU)
        } else {
            ("", 1.0)
        };
        list.push(Recorded {
            name: format!("effective_frequency.{i}"),
            unit: unit.into(),
            factor,
        });
    }
    list
}

/// One branch with its number and the word for its method.
pub struct Traced<'a> {
    /// The branch.
    pub branch: &'a Branch,
    /// `galerkin`, `shooting`, ...
    pub method: &'static str,
}

/// The swept parameter as it is reported.
pub struct Swept {
    /// Unit of the column `parameter`.
    pub unit: String,
    /// Factor from the continued parameter to the column.
    pub factor: f64,
}

fn float(name: impl Into<String>, unit: impl Into<String>, values: Vec<f64>) -> Column {
    Column {
        name: name.into(),
        unit: unit.into(),
        values: Values::Float(values),
    }
}

fn integer(name: &str, values: Vec<i64>) -> Column {
    Column {
        name: name.into(),
        unit: String::new(),
        values: Values::Integer(values),
    }
}

fn text(name: &str, values: Vec<String>) -> Column {
    Column {
        name: name.into(),
        unit: String::new(),
        values: Values::Text(values),
    }
}

/// The main table: one row a point.
pub fn points(setting: &Setting<'_>, swept: &Swept, traced: &[Traced<'_>]) -> Table {
    let rows: Vec<(usize, usize, &Traced<'_>, &BranchPoint)> = traced
        .iter()
        .enumerate()
        .flat_map(|(b, t)| {
            t.branch
                .points
                .iter()
                .enumerate()
                .map(move |(p, point)| (b, p, t, point))
        })
        .collect();
    let hertz = setting.assembly.scales.frequency / std::f64::consts::TAU;
    let of =
        |f: &dyn Fn(&BranchPoint) -> f64| rows.iter().map(|row| f(row.3)).collect::<Vec<f64>>();
    let stable = |p: &BranchPoint| match p.stability {
        Stability::Stable => 1.0,
        Stability::Unstable => 0.0,
        Stability::Unknown => f64::NAN,
    };
    let mut columns = vec![
        integer("branch", rows.iter().map(|r| r.0 as i64).collect()),
        integer("point", rows.iter().map(|r| r.1 as i64).collect()),
        integer(
            "mark",
            rows.iter().map(|r| i64::from(r.3.is_mark)).collect(),
        ),
        text(
            "method",
            rows.iter().map(|r| r.2.method.to_string()).collect(),
        ),
        float("omega", "", of(&|p| p.frequency)),
    ];
    if setting.is_si() {
        columns.push(float("frequency_hz", "Hz", of(&|p| p.frequency * hertz)));
    }
    columns.push(float(
        "parameter",
        &swept.unit,
        of(&|p| p.lambda * swept.factor),
    ));
    columns.push(float("stable", "", of(&stable)));
    columns.push(float(
        "multiplier_modulus",
        "",
        of(&|p| p.multipliers.first().map_or(f64::NAN, |mu| mu.norm())),
    ));
    columns.push(integer(
        "iterations",
        rows.iter().map(|r| r.3.newton.iterations as i64).collect(),
    ));
    columns.push(float("residual", "", of(&|p| p.newton.residual_norm)));
    for (k, Recorded { name, unit, factor }) in recorded_columns(setting).into_iter().enumerate() {
        columns.push(float(name, unit, of(&|p| p.recorded[k] * factor)));
    }
    Table {
        name: String::new(),
        columns,
    }
}

/// All multipliers, by falling modulus; `None` when stability was not asked for.
pub fn multipliers(traced: &[Traced<'_>]) -> Option<Table> {
    let count = traced
        .iter()
        .flat_map(|t| &t.branch.points)
        .map(|p| p.multipliers.len())
        .max()?;
    if count == 0 {
        return None;
    }
    let (mut branch, mut point) = (Vec::new(), Vec::new());
    let mut parts = vec![Vec::new(); 2 * count];
    for (b, t) in traced.iter().enumerate() {
        for (p, accepted) in t.branch.points.iter().enumerate() {
            branch.push(b as i64);
            point.push(p as i64);
            for k in 0..count {
                let mu = accepted.multipliers.get(k);
                parts[2 * k].push(mu.map_or(f64::NAN, |mu| mu.re));
                parts[2 * k + 1].push(mu.map_or(f64::NAN, |mu| mu.im));
            }
        }
    }
    let mut columns = vec![integer("branch", branch), integer("point", point)];
    columns.extend(parts.into_iter().enumerate().map(|(k, values)| {
        let part = if k % 2 == 0 { "re" } else { "im" };
        float(format!("{part}.{}", k / 2 + 1), "", values)
    }));
    Some(Table {
        name: "multipliers".into(),
        columns,
    })
}

/// Located events, with the r.m.s. deformation of every connection for the plots.
pub fn events(setting: &Setting<'_>, swept: &Swept, traced: &[Traced<'_>]) -> Table {
    let rows: Vec<_> = traced
        .iter()
        .enumerate()
        .flat_map(|(b, t)| t.branch.events.iter().map(move |e| (b, e)))
        .collect();
    let of = |f: &dyn Fn(f64, f64, f64) -> f64| {
        rows.iter()
            .map(|(_, e)| f(e.lambda, e.bracket.0, e.bracket.1))
            .collect::<Vec<f64>>()
    };
    let factor = swept.factor;
    let mut columns = vec![
        text(
            "kind",
            rows.iter()
                .map(|(_, e)| e.kind.word().to_string())
                .collect(),
        ),
        float("omega", "", of(&|lambda, _, _| lambda)),
        float(
            "parameter",
            &swept.unit,
            of(&|lambda, _, _| lambda * factor),
        ),
        integer(
            "located",
            rows.iter().map(|(_, e)| i64::from(e.is_located())).collect(),
        ),
        float("bracket_low", &swept.unit, of(&|_, low, _| low * factor)),
        float("bracket_high", &swept.unit, of(&|_, _, high| high * factor)),
        integer("branch", rows.iter().map(|(b, _)| *b as i64).collect()),
        integer(
            "after_point",
            rows.iter().map(|(_, e)| e.after_point as i64).collect(),
        ),
        text(
            "connection",
            rows.iter().map(|(_, e)| touched(setting, e)).collect(),
        ),
    ];
    for (k, Recorded { name, unit, factor }) in recorded_columns(setting).into_iter().enumerate() {
        if name.starts_with("rms.") {
            let value =
                |e: &BifurcationEvent| e.recorded.get(k).map_or(f64::NAN, |x| x * factor);
            columns.push(float(
                name,
                unit,
                rows.iter().map(|(_, e)| value(e)).collect(),
            ));
        }
    }
    if setting.is_si() {
        let hertz = setting.assembly.scales.frequency / std::f64::consts::TAU;
        columns.push(float(
            "frequency_hz",
            "Hz",
            of(&|lambda, _, _| lambda * hertz),
        ));
    }
    columns.push(breakpoints(setting, rows.iter().map(|(_, e)| *e)));
    Table {
        name: "events".into(),
        columns,
    }
}

/// Name of the connection that grazes; empty for bifurcations.
fn touched(setting: &Setting<'_>, event: &BifurcationEvent) -> String {
    match event.kind {
        EventKind::Grazing { connection, .. } => setting.assembly.connections[connection].clone(),
        _ => String::new(),
    }
}

/// The breakpoint that is touched, in the unit of its connection.
fn breakpoints<'e>(
    setting: &Setting<'_>,
    events: impl Iterator<Item = &'e BifurcationEvent>,
) -> Column {
    let units = (0..setting.assembly.connections.len()).map(|k| setting.model.units_of(k).0);
    let mut units: Vec<_> = units.collect();
    units.dedup();
    let unit = match (&units[..], setting.is_si()) {
        ([unit], true) => unit.to_string(),
        _ => String::new(),
    };
    let value = |e: &BifurcationEvent| match (e.kind, e.breakpoint) {
        (EventKind::Grazing { connection, .. }, Some(b)) if setting.is_si() => {
            b * setting.assembly.scales.displacement[connection]
        }
        (_, b) => b.unwrap_or(f64::NAN),
    };
    float("breakpoint", unit, events.map(value).collect())
}

/// Panels drawn at most; the table has every connection.
pub const MAX_PANELS: usize = 4;

/// R.m.s. deformation of each connection against the frequency, stable solid and unstable dashed, one curve a method, with
/// the backbone: the response-variant natural frequencies at the same deformation.
pub fn figure(setting: &Setting<'_>, traced: &[Traced<'_>]) -> Figure {
    let names = setting
        .assembly
        .connections
        .iter()
        .enumerate()
        .take(MAX_PANELS);
    Figure {
        title: String::new(),
        panels: names
            .map(|(e, name)| panel(setting, traced, e, name))
            .collect(),
    }
}

fn panel(setting: &Setting<'_>, traced: &[Traced<'_>], e: usize, connection: &str) -> Panel {
    let (abscissa, x_label) = match setting.is_si() {
        true => ("frequency_hz", "excitation frequency [Hz]"),
        false => ("omega", "excitation frequency \u{3c9}/\u{3c9}c"),
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
    for t in traced {
        let style = CurveStyle::Branch {
            branch: "branch".into(),
            stable: "stable".into(),
        };
        let label = if traced.len() > 1 {
            format!("{connection}, {}", t.method)
        } else {
            connection.to_string()
        };
        curves.push(curve(
            "",
            abscissa,
            label,
            style,
            Some(("method".into(), t.method.into())),
        ));
    }
    // The backbones of methods that agree lie on one another: the first one's is drawn.
    let first = traced
        .first()
        .map(|t| ("method".to_string(), t.method.to_string()));
    for i in 1..=setting.assembly.system.dof().min(MAX_PANELS) {
        let (x, label) = (
            format!("effective_frequency.{i}"),
            format!("backbone, mode {i}"),
        );
        curves.push(curve("", &x, label, CurveStyle::Crosses, first.clone()));
    }
    let style = CurveStyle::Events {
        kind: "kind".into(),
    };
    curves.push(curve("events", abscissa, "events".into(), style, None));
    let unit = if setting.is_si() {
        format!(" [{}]", setting.model.units_of(e).0)
    } else {
        String::new()
    };
    Panel {
        x_label: x_label.into(),
        y_label: format!("r.m.s. of {connection}{unit}"),
        x_range: None,
        curves,
    }
}
