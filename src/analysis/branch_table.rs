//! Branches as tables and figures: the columns of a frequency response.

use super::Setting;
use super::columns::{float, integer, speed_rpm, text};
use super::response::{Method, ResponseTable, Swept};
use super::sections::Sections;
use crate::measure::{ColumnHeading, Solved};
use crate::postprocess::measures::Meter;
use crate::report::Table;
use crate::solve::attractor::Label;
use crate::solve::branch::{BranchPoint, Recorder, Stability};
use crate::solve::events::BifurcationEvent;
use crate::solve::orbit::Orbit;
use crate::system::System;

/// Records what the tables of a response hold, nondimensional.
pub struct MeasureRecorder<'a> {
    meter: Meter,
    sections: Sections,
    swept: &'a Swept<'a>,
    points: usize,
    /// Connections whose contact pulled somewhere on the branch.
    pub pulling: Vec<bool>,
}

impl<'a> MeasureRecorder<'a> {
    /// A recorder for orbits with `samples` samples.
    pub fn new(swept: &'a Swept<'a>, samples: usize) -> Self {
        let pulling = vec![false; swept.setting.assembly.connections.len()];
        MeasureRecorder {
            meter: Meter::new(samples),
            sections: swept.sections(),
            swept,
            points: 0,
            pulling,
        }
    }
}

impl Recorder for MeasureRecorder<'_> {
    fn record(&mut self, lambda: f64, system: &System, orbit: &Orbit, values: &mut Vec<f64>) {
        let mut connections = self.meter.measure(system, orbit);
        let here = self.swept.here(lambda);
        let marks = connections.iter_mut().zip(&mut self.pulling);
        for ((m, pulling), stiffening) in marks.zip(&here.stiffening) {
            // The law is in units of its own stiffness, the report in those of the stiffness as written.
            m.scale_force(*stiffening);
            *pulling |= m.pulls;
        }
        let at = Solved {
            model: &here.model,
            assembly: &here.assembly,
            system,
            orbit,
            connections: &connections,
            stiffening: &here.stiffening,
        };
        self.sections.measure(&at, values);
    }

    fn accept(&mut self, point: &BranchPoint) -> bool {
        self.points += 1;
        let (from, to) = self.swept.range;
        let share = ((point.lambda - from) / (to - from)).clamp(0.0, 1.0);
        let words = format!(
            "point {} at {}",
            self.points,
            self.swept.place(point.lambda)
        );
        let Setting { name, control, .. } = self.swept.setting;
        control.progress(name, share, &words);
        !control.is_interrupted()
    }
}

/// Headings of one measure of every connection, each with the place of its values among the recorded ones.
pub(super) fn main(swept: &Swept<'_>, measure: &str) -> Vec<(usize, ColumnHeading)> {
    let main = swept.columns(ResponseTable::Main);
    let is_measure = |name: &str| {
        name.strip_prefix(measure)
            .is_some_and(|rest| rest.starts_with('.'))
    };
    let found = main.filter(|(_, heading)| is_measure(&heading.name));
    found.map(|(k, heading)| (k, heading.clone())).collect()
}

/// The r.m.s. deformations among them.
pub(super) fn rms(swept: &Swept<'_>) -> Vec<(usize, ColumnHeading)> {
    main(swept, "rms")
}

/// Results of one method.
pub struct TracedMethod<'a> {
    /// Points in their order.
    pub points: &'a [BranchPoint],
    /// Events in their order.
    pub events: &'a [BifurcationEvent],
    /// Events that the flow refuted.
    pub refuted: &'a [BifurcationEvent],
    /// Kinds of the attractors, one per point; none for branches of periodic solutions.
    pub labels: &'a [Label],
    /// Method of the points.
    pub method: Method,
}

/// The main table: one row per point.
pub fn points(swept: &Swept<'_>, traced: &[TracedMethod<'_>]) -> Table {
    let setting = swept.setting;
    let rows: Vec<(usize, usize, &TracedMethod<'_>, &BranchPoint)> = traced
        .iter()
        .enumerate()
        .flat_map(|(b, t)| {
            let points = t.points.iter().enumerate();
            points.map(move |(p, point)| (b, p, t, point))
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
            rows.iter().map(|r| r.2.method.word().into()).collect(),
        ),
        float("omega", "", of(&|p| p.frequency)),
    ];
    if setting.is_si() {
        columns.push(float("frequency_hz", "Hz", of(&|p| p.frequency * hertz)));
    }
    columns.extend(speed_rpm(setting, of(&|p| p.frequency)));
    columns.push(float(
        "parameter",
        &swept.unit,
        of(&|p| swept.value(p.lambda)),
    ));
    columns.push(float("stable", "", of(&stable)));
    columns.push(float(
        "multiplier_modulus",
        "",
        of(&|p| p.multipliers.first().map_or(f64::NAN, |mu| mu.norm())),
    ));
    if setting.assembly.system.memory_count() > 0 {
        let neutral = |p: &BranchPoint| match p.multipliers.is_empty() {
            true => f64::NAN,
            false => p.neutral as f64,
        };
        columns.push(float("neutral", "", of(&neutral)));
    }
    columns.push(integer(
        "iterations",
        rows.iter().map(|r| r.3.newton.iterations as i64).collect(),
    ));
    columns.push(float("residual", "", of(&|p| p.newton.residual_norm)));
    for (k, heading) in swept.columns(ResponseTable::Main) {
        let values = rows.iter().map(|row| row.3.recorded[k]);
        columns.push(heading.clone().column(values));
    }
    if traced.iter().any(|t| t.method == Method::Integration) {
        let label = |(_, p, t, _): &(usize, usize, &TracedMethod<'_>, &BranchPoint)| {
            t.labels.get(*p).map_or(String::new(), Label::to_string)
        };
        columns.push(text("label", rows.iter().map(label).collect()));
    }
    Table {
        name: String::new(),
        columns,
    }
}

/// Rattle metrics, one row per point. What the columns mean is written in docs/rattle.md.
pub fn rattle(swept: &Swept<'_>, traced: &[TracedMethod<'_>]) -> Option<Table> {
    if !swept.computes(ResponseTable::Rattle) {
        return None;
    }
    let setting = swept.setting;
    let rows: Vec<(usize, usize, &BranchPoint)> = (traced.iter().enumerate())
        .flat_map(|(b, t)| {
            let points = t.points.iter().enumerate();
            points.map(move |(p, point)| (b, p, point))
        })
        .collect();
    let of = |f: &dyn Fn(&BranchPoint) -> f64| rows.iter().map(|r| f(r.2)).collect::<Vec<f64>>();
    let mut columns = vec![
        integer("branch", rows.iter().map(|r| r.0 as i64).collect()),
        integer("point", rows.iter().map(|r| r.1 as i64).collect()),
        float("omega", "", of(&|p| p.frequency)),
    ];
    if setting.is_si() {
        let frequency = setting.units().frequency("frequency_hz");
        columns.push(frequency.column(of(&|p| p.frequency)));
    }
    columns.extend(speed_rpm(setting, of(&|p| p.frequency)));
    let parameter = of(&|p| swept.value(p.lambda));
    columns.push(float("parameter", &swept.unit, parameter));
    for (k, heading) in swept.columns(ResponseTable::Rattle) {
        columns.push(heading.clone().column(of(&|p| p.recorded[k])));
    }
    Some(Table {
        name: "rattle".into(),
        columns,
    })
}
