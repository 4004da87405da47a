//! Tables and figure of a run-up.

use super::heat;
use super::plan::RunUpPlan;
use super::record::{RunUpRecord, Window};
use super::signals::Signal;
use crate::analysis::columns::{float, integer};
use crate::analysis::transient::switch_table;
use crate::analysis::{Setting, columns};
use crate::measure::ColumnHeading;
use crate::model::Structure;
use crate::postprocess::connection::is_clearance;
use crate::postprocess::effective_stiffness::frequencies_at_rest;
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Report, Table};
use crate::solve::equilibrium::equilibrium;
use serde_json::json;
use std::f64::consts::TAU;

/// Order curves in a panel at most.
const MOST_CURVES: usize = 8;

/// The speed of the reference: `speed_rpm`, or `omega` in nondimensional reports of reduced models.
pub fn speed(setting: &Setting<'_>) -> ColumnHeading {
    match setting.model.structure {
        Structure::Train(_) => {
            let factor = setting.assembly.scales.frequency * 60.0 / TAU;
            ColumnHeading::new("speed_rpm", "rpm", factor)
        }
        Structure::Reduced(_) => ColumnHeading::number("omega"),
    }
}

/// Connections with a gap.
fn gaps(setting: &Setting<'_>) -> Vec<usize> {
    let mounts = setting.assembly.system.mounts();
    let has_gap = |k: &usize| is_clearance(mounts[*k].element.as_ref());
    (0..mounts.len()).filter(has_gap).collect()
}

/// The report but for its options.
pub fn report(setting: &Setting<'_>, plan: &RunUpPlan, record: RunUpRecord<'_>) -> Report {
    let length = record.orders.window;
    let windows = &record.windows;
    let natural = natural(setting);
    let mut tables = vec![
        ranges(setting, plan, windows),
        orders(setting, plan, windows),
        resonances(setting, plan, &natural),
    ];
    let mut further_figures = Vec::new();
    if plan.spectrum > 0 {
        tables.push(spectra(setting, plan, windows, length));
        let campbell = heat::campbell(setting, plan, &natural);
        further_figures.push(heat::figure(setting, plan, &campbell));
        tables.push(campbell);
    }
    if plan.writes_switches {
        tables.push(switch_table(setting, &record.switches));
    }
    if plan.keeps_series {
        tables.push(series(setting, plan, &record));
    }
    let mut report = Report {
        figure: Some(figure(setting, plan)),
        further_figures,
        tables,
        ..Report::default()
    };
    let spectra = json!({
        "window": format!("rectangular, {length} whole revolutions, uniform in phase, end excluded"),
        "averaging": "none: one spectrum per window",
        "resolution": format!("1/{length} order"),
        "amplitude": "peak amplitude of each order, linear; levels in bands are r.m.s.",
        "level": format!("20 lg(r.m.s. / reference) dB, at least {} dB below the largest", heat::RANGE),
        "reference": heat::references(setting, plan),
    });
    report.summary.insert("spectra".into(), spectra);
    report
}

/// All tables without rows.
pub fn empty(setting: &Setting<'_>, plan: &RunUpPlan) -> Vec<Table> {
    vec![
        ranges(setting, plan, &[]),
        orders(setting, plan, &[]),
        resonances(setting, plan, &[]),
    ]
}

fn begins(windows: &[Window]) -> Vec<Column> {
    vec![
        integer("window", (0..windows.len() as i64).collect()),
        integer(
            "first_revolution",
            windows.iter().map(|w| w.first).collect(),
        ),
    ]
}

/// The main table: ranges of the signals and rattle, window by window.
fn ranges(setting: &Setting<'_>, plan: &RunUpPlan, windows: &[Window]) -> Table {
    let mut list = begins(windows);
    list.push(columns::time(setting).column(windows.iter().map(|w| w.middle.0)));
    list.push(speed(setting).column(windows.iter().map(|w| w.middle.1)));
    for (kind, word) in ["rms", "min", "max"].into_iter().enumerate() {
        for (s, signal) in plan.signals.iter().enumerate() {
            let heading = signal.heading(setting).prefixed(&format!("{word}."));
            list.push(heading.column(windows.iter().map(|w| w.ranges[s][kind])));
        }
    }
    let per_time = 1.0 / columns::time(setting).factor;
    let unit = |unit: &str| match setting.is_si() {
        true => format!("{unit}/s"),
        false => String::new(),
    };
    let names = &setting.assembly.connections;
    for k in gaps(setting) {
        let name = format!("impacts_per_s.{}", names[k]);
        let heading = ColumnHeading::new(name, unit("1"), per_time);
        list.push(heading.column(windows.iter().map(|w| w.impacts[k][0])));
    }
    for k in gaps(setting) {
        let energy = setting.units().energy("", k);
        let name = format!("impact_energy_per_s.{}", names[k]);
        let heading = ColumnHeading::new(name, unit(&energy.unit), energy.factor * per_time);
        list.push(heading.column(windows.iter().map(|w| w.impacts[k][1])));
    }
    for (b, band) in plan.bands.iter().enumerate() {
        for (s, signal) in plan.signals.iter().enumerate() {
            let heading = signal.heading(setting).prefixed(&format!("level.{b}."));
            list.push(heading.column(windows.iter().map(|w| level(w, s, *band))));
        }
    }
    Table {
        name: String::new(),
        columns: list,
    }
}

/// R.m.s. of a signal in a band of frequency over omega_c, at the speed in the middle of a window.
fn level(window: &Window, signal: usize, (low, high): (f64, f64)) -> f64 {
    let Some(lines) = window.spectra.get(signal) else {
        return f64::NAN;
    };
    let length = window.resolution;
    let frequency = |line: usize| (line + 1) as f64 * length * window.middle.1;
    let inside = lines
        .iter()
        .enumerate()
        .filter(|(k, _)| (low..high).contains(&frequency(*k)));
    (0.5 * inside.map(|(_, a)| a * a).sum::<f64>()).sqrt()
}

/// `orders`: one row per order and window, order by order.
fn orders(setting: &Setting<'_>, plan: &RunUpPlan, windows: &[Window]) -> Table {
    let count = plan.orders.len();
    let rows = || {
        let windows = || windows.iter().enumerate();
        (0..count).flat_map(move |o| windows().map(move |(w, window)| (w, window, o)))
    };
    let mut list = vec![
        integer("window", rows().map(|r| r.0 as i64).collect()),
        integer("first_revolution", rows().map(|r| r.1.first).collect()),
        speed(setting).column(rows().map(|r| r.1.middle.1)),
        float("order", "", rows().map(|r| plan.orders[r.2]).collect()),
    ];
    for (s, signal) in plan.signals.iter().enumerate() {
        let heading = signal.heading(setting).prefixed("amplitude.");
        list.push(heading.column(rows().map(|r| r.1.waves[s][r.2].0)));
    }
    // Deformations under the name of the connection alone as well.
    for (s, signal) in plan.signals.iter().enumerate() {
        if let Signal::Deformation(k) = signal {
            let name = format!("amplitude.{}", setting.assembly.connections[*k]);
            let heading = setting.units().displacement(name, *k);
            list.push(heading.column(rows().map(|r| r.1.waves[s][r.2].0)));
        }
    }
    for (s, signal) in plan.signals.iter().enumerate() {
        let name = format!("phase.{}", signal.heading(setting).name);
        list.push(float(
            name,
            "rad",
            rows().map(|r| r.1.waves[s][r.2].1).collect(),
        ));
    }
    Table {
        name: "orders".into(),
        columns: list,
    }
}

/// `spectra`: one row per window and line.
fn spectra(setting: &Setting<'_>, plan: &RunUpPlan, windows: &[Window], length: usize) -> Table {
    let lines = plan.spectrum * length;
    let rows = || {
        windows
            .iter()
            .enumerate()
            .flat_map(|(w, window)| (0..lines).map(move |l| (w, window, l)))
    };
    let mut list = vec![
        integer("window", rows().map(|r| r.0 as i64).collect()),
        speed(setting).column(rows().map(|r| r.1.middle.1)),
        float(
            "order",
            "",
            rows().map(|r| (r.2 + 1) as f64 / length as f64).collect(),
        ),
    ];
    for (s, signal) in plan.signals.iter().enumerate() {
        let heading = signal.heading(setting).prefixed("amplitude.");
        list.push(heading.column(rows().map(|r| r.1.spectra[s][r.2])));
    }
    list.extend((0..plan.signals.len()).map(|s| heat::levels(setting, plan, windows, s)));
    Table {
        name: "spectra".into(),
        columns: list,
    }
}

/// A natural frequency of the train.
pub struct Natural {
    /// `contact` or `rest`.
    pub state: &'static str,
    /// From 1.
    pub mode: usize,
    /// Over omega_c.
    pub frequency: f64,
}

impl Natural {
    /// `mode 2 at rest`.
    pub fn name(&self) -> String {
        match self.state {
            "rest" => format!("mode {} at rest", self.mode),
            _ => format!("mode {} in contact", self.mode),
        }
    }
}

/// Natural frequencies above 0 in full contact and at rest.
fn natural(setting: &Setting<'_>) -> Vec<Natural> {
    let assembly = setting.assembly;
    let rest = equilibrium(&assembly.system).ok();
    let at_rest = rest
        .and_then(|rest| frequencies_at_rest(&assembly.system, &rest, &assembly.connections).ok());
    let contact: Vec<f64> = assembly.natural_frequencies.iter().copied().collect();
    let states = [("contact", contact), ("rest", at_rest.unwrap_or_default())];
    let list = states.into_iter().flat_map(|(state, list)| {
        let numbered = list.into_iter().enumerate();
        numbered.map(move |(k, frequency)| Natural {
            state,
            mode: k + 1,
            frequency,
        })
    });
    list.filter(|natural| natural.frequency > 0.0).collect()
}

/// `resonances`: speeds of the range at which an order meets a natural frequency, in full contact and at rest.
fn resonances(setting: &Setting<'_>, plan: &RunUpPlan, natural: &[Natural]) -> Table {
    let (low, high) = plan.ramp.extent();
    let all = natural.iter();
    let rows: Vec<(&Natural, f64, f64)> = all
        .flat_map(|n| {
            plan.orders
                .iter()
                .map(move |order| (n, *order, n.frequency / order))
        })
        .filter(|(.., at)| (low..=high).contains(at))
        .collect();
    let frequency = setting.units().frequency("natural_frequency");
    Table {
        name: "resonances".into(),
        columns: vec![
            columns::text("state", rows.iter().map(|r| r.0.state.to_owned()).collect()),
            integer("mode", rows.iter().map(|r| r.0.mode as i64).collect()),
            frequency.column(rows.iter().map(|r| r.0.frequency)),
            float("order", "", rows.iter().map(|r| r.1).collect()),
            speed(setting).column(rows.iter().map(|r| r.2)),
        ],
    }
}

/// `series`: the signals at every sample.
fn series(setting: &Setting<'_>, plan: &RunUpPlan, record: &RunUpRecord<'_>) -> Table {
    let stride = 1 + plan.signals.len();
    let pick = |k: usize| record.series.iter().skip(k).step_by(stride).copied();
    let mut list = vec![columns::time(setting).column(pick(0))];
    for (s, signal) in plan.signals.iter().enumerate() {
        list.push(signal.heading(setting).column(pick(1 + s)));
    }
    Table {
        name: "series".into(),
        columns: list,
    }
}

/// Order tracks of the signals, their r.m.s., and impacts per second, against the speed.
fn figure(setting: &Setting<'_>, plan: &RunUpPlan) -> Figure {
    let x = speed(setting);
    let x_label = columns::frequency_label(setting, &x.axis());
    let curve = |table: &str, y: String, label: String, only| Curve {
        table: table.into(),
        x: x.name.clone(),
        y,
        label,
        style: CurveStyle::Line,
        only,
    };
    let panel = |y_label: String, curves: Vec<Curve>| Panel {
        x_label: x_label.clone(),
        y_label,
        curves,
        ..Panel::default()
    };
    let mut panels = Vec::new();
    for signal in &plan.signals {
        let heading = signal.heading(setting).prefixed("amplitude.");
        let one = |order: &f64| {
            let label = format!("order {order}");
            let only = Some(("order".to_owned(), order.to_string()));
            curve("orders", heading.name.clone(), label, only)
        };
        let curves = plan.orders.iter().take(MOST_CURVES).map(one).collect();
        let unit = signal.heading(setting);
        panels.push(panel(format!("amplitude of {}", unit.axis()), curves));
    }
    let names = &setting.assembly.connections;
    let gaps = gaps(setting);
    let impacts = gaps.iter().map(|k| {
        let y = format!("impacts_per_s.{}", names[*k]);
        curve("", y, names[*k].clone(), None)
    });
    if !gaps.is_empty() {
        panels.push(panel("impacts per second".into(), impacts.collect()));
        let energy = gaps.iter().map(|k| {
            let y = format!("impact_energy_per_s.{}", names[*k]);
            curve("", y, names[*k].clone(), None)
        });
        panels.push(panel("impact power [W]".into(), energy.collect()));
    }
    Figure {
        title: String::new(),
        panels,
    }
}
