//! Events of branches as a table.

use super::Setting;
use super::branch_table::{TracedMethod, rms};
use super::columns::{float, integer, speed_rpm, text};
use super::response::Swept;
use crate::report::{Column, Table};
use crate::solve::events::{BifurcationEvent, EventKind, Verdict};

/// Events of all branches, with the r.m.s. deformation of every connection for the plots.
pub fn events(swept: &Swept<'_>, traced: &[TracedMethod<'_>]) -> Table {
    table(swept, "events", traced.iter().map(|t| t.events))
}

/// Events of the series that do not exist; the columns are those of the events.
pub fn refuted(swept: &Swept<'_>, traced: &[TracedMethod<'_>]) -> Table {
    table(swept, "refuted", traced.iter().map(|t| t.refuted))
}

/// A table of events, given by branch.
fn table<'e>(
    swept: &Swept<'_>,
    name: &str,
    branches: impl Iterator<Item = &'e [BifurcationEvent]>,
) -> Table {
    let setting = swept.setting;
    let rows: Vec<_> = branches
        .enumerate()
        .flat_map(|(b, list)| list.iter().map(move |e| (b, e)))
        .collect();
    let of =
        |f: &dyn Fn(&BifurcationEvent) -> f64| rows.iter().map(|(_, e)| f(e)).collect::<Vec<f64>>();
    // A parameter that falls along the path turns the bracket round.
    let bracket = |e: &BifurcationEvent| {
        let ends = (swept.value(e.bracket.0), swept.value(e.bracket.1));
        (ends.0.min(ends.1), ends.0.max(ends.1))
    };
    let mut columns = vec![
        text(
            "kind",
            rows.iter()
                .map(|(_, e)| e.kind.word().to_string())
                .collect(),
        ),
        float("omega", "", of(&|e| swept.excitation(e.lambda))),
        float("parameter", &swept.unit, of(&|e| swept.value(e.lambda))),
        integer(
            "located",
            rows.iter()
                .map(|(_, e)| i64::from(e.is_located()))
                .collect(),
        ),
        float("bracket_low", &swept.unit, of(&|e| bracket(e).0)),
        float("bracket_high", &swept.unit, of(&|e| bracket(e).1)),
        integer("branch", rows.iter().map(|(b, _)| *b as i64).collect()),
        integer(
            "after_point",
            rows.iter().map(|(_, e)| e.after_point as i64).collect(),
        ),
        text(
            "connection",
            rows.iter().map(|(_, e)| touched(setting, e)).collect(),
        ),
        integer(
            "multiplicity",
            rows.iter().map(|(_, e)| e.multiplicity as i64).collect(),
        ),
    ];
    for (k, heading) in rms(swept) {
        let value = |e: &BifurcationEvent| e.recorded.get(k).copied().unwrap_or(f64::NAN);
        columns.push(heading.column(of(&value)));
    }
    if setting.is_si() {
        let hertz = setting.assembly.scales.frequency / std::f64::consts::TAU;
        columns.push(float(
            "frequency_hz",
            "Hz",
            of(&|e| swept.excitation(e.lambda) * hertz),
        ));
    }
    columns.extend(speed_rpm(setting, of(&|e| swept.excitation(e.lambda))));
    columns.push(float(
        "omega_method",
        "",
        of(&|e| match e.method_lambda.is_nan() {
            true => f64::NAN,
            false => swept.excitation(e.method_lambda),
        }),
    ));
    columns.push(float(
        "parameter_method",
        &swept.unit,
        of(&|e| swept.value(e.method_lambda)),
    ));
    columns.push(float("confirmed", "", of(&confirmed)));
    columns.push(breakpoints(setting, rows.iter().map(|(_, e)| *e)));
    Table {
        name: name.into(),
        columns,
    }
}

/// 1 or 0; not a number where the flow was not asked.
fn confirmed(event: &BifurcationEvent) -> f64 {
    match event.verdict {
        Verdict::NotTried => f64::NAN,
        Verdict::Confirmed => 1.0,
        Verdict::Refuted => 0.0,
    }
}

/// Kinds of events, as tables have them.
pub const EVENTS: [&str; 7] = [
    "fold",
    "branch_point",
    "period_doubling",
    "neimark_sacker",
    "grazing",
    "slip_onset",
    "unresolved",
];

/// Name of the connection that grazes or begins to slip; empty for bifurcations.
fn touched(setting: &Setting<'_>, event: &BifurcationEvent) -> String {
    match event.kind {
        EventKind::Grazing { connection, .. } | EventKind::SlipOnset { connection } => {
            setting.assembly.connections[connection].clone()
        }
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
