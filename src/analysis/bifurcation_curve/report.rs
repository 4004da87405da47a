//! Curves as tables and as a figure.

use super::BifurcationCurve;
use super::plane::{Axes, CurveAxis};
use super::trace::{CurvePiece, TracedCurve};
use crate::analysis::Setting;
use crate::analysis::columns::{float, frequency_axis, integer, states, text};
use crate::analysis::parameter::VariedParameter;
use crate::report::{Column, Curve, CurveStyle, Figure, FrequencyUnit, Panel, Report, Table};
use crate::solve::curve::{Codimension, CurveEvent, CurveKind, CurvePoint, Grazing, OrbitsBeside};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Pieces with their numbers and kinds, in the order of the results.
fn numbered(curves: &[TracedCurve]) -> Vec<(usize, CurveKind, &CurvePiece)> {
    let pieces = curves.iter().filter_map(|c| Some((c.kind?, &c.pieces)));
    let pieces = pieces.flat_map(|(kind, list)| list.iter().map(move |piece| (kind, piece)));
    pieces
        .enumerate()
        .map(|(k, (kind, piece))| (k, kind, piece))
        .collect()
}

/// Everything that is delivered.
pub(super) fn assemble(
    keys: &BifurcationCurve,
    setting: &Setting<'_>,
    (axes, marks): (&Axes, &[f64]),
    curves: &[TracedCurve],
) -> Report {
    let mut report = Report {
        tables: tables(setting, (axes, marks), curves),
        figure: Some(figure(setting, axes, curves)),
        ended_early: ended_early(curves),
        warnings: refuted(curves)
            .into_iter()
            .chain(unlocated(setting, axes, curves))
            .collect(),
        ..Report::default()
    };
    let options = serde_json::to_value(keys).unwrap_or(Value::Null);
    let one = |curve: &TracedCurve| {
        json!({
            "kind": curve.kind.map(CurveKind::word),
            "pieces": curve.pieces.len(),
            "confirmed": verdicts(curve, true),
            "refuted": verdicts(curve, false),
            "points": curve.pieces.iter().map(|p| p.points.len()).sum::<usize>(),
            "integrator": curve.integrator,
            "ends": curve.ends.iter().map(|end| json!({"reason": end.reason(), "message": end.message()})).collect::<Vec<_>>(),
            "failure": curve.failure,
        })
    };
    for (key, value) in [
        ("options", options),
        ("curves", curves.iter().map(one).collect()),
    ] {
        report.summary.insert(key.into(), value);
    }
    report
}

/// Points of a curve with a verdict.
fn verdicts(curve: &TracedCurve, verdict: bool) -> usize {
    let all = curve.pieces.iter().flat_map(|piece| &piece.confirmed);
    all.filter(|own| **own == Some(verdict)).count()
}

/// Curves with points that a branch in the first parameter does not meet.
fn refuted(curves: &[TracedCurve]) -> Vec<String> {
    let one = |(k, curve): (usize, &TracedCurve)| {
        let (good, bad) = (verdicts(curve, true), verdicts(curve, false));
        (bad > 0).then(|| {
            format!(
                "start {k}: {bad} of {} points that were located again along a branch lie elsewhere; see the column `confirmed`",
                good + bad
            )
        })
    };
    curves.iter().enumerate().filter_map(one).collect()
}

/// Events whose place is not known.
fn unlocated(setting: &Setting<'_>, axes: &Axes, curves: &[TracedCurve]) -> Vec<String> {
    let names = &setting.assembly.connections;
    let told = |curve: usize, place: usize, event: &CurveEvent| {
        let what = match event.kind {
            Codimension::MeetsGrazing { connection } => format!("{} touches", names[connection]),
            kind => kind.word().to_string(),
        };
        let both = [0, 1].map(|k| axes.list[k].told(axes.list[k].value(event.spot.p[k])));
        let after = place.saturating_sub(1);
        format!(
            "curve {curve}, behind point {after}: {what} near {}; the curve cannot be corrected closer to it, so its place is left empty",
            both.join(", ")
        )
    };
    let pieces = numbered(curves).into_iter();
    let events = pieces.flat_map(|(k, _, piece)| piece.events.iter().map(move |e| (k, e)));
    let open = events.filter(|(_, (_, event))| !event.is_located);
    open.map(|(k, (place, event))| told(k, *place, event))
        .collect()
}

/// What is missing, if anything is.
fn ended_early(curves: &[TracedCurve]) -> Option<String> {
    let mut list: Vec<String> = Vec::new();
    for (k, curve) in curves.iter().enumerate() {
        list.extend(curve.failure.clone());
        let early = curve.ends.iter().filter(|end| !end.is_complete());
        list.extend(early.map(|end| format!("start {k}: {}", end.message())));
    }
    (!list.is_empty()).then(|| list.join("; "))
}

/// Main table and events.
pub(super) fn tables(
    setting: &Setting<'_>,
    (axes, marks): (&Axes, &[f64]),
    curves: &[TracedCurve],
) -> Vec<Table> {
    let pieces = numbered(curves);
    let list = vec![
        points(setting, (axes, marks), &pieces),
        events(setting, axes, &pieces),
    ];
    if axes.are_users() {
        return list;
    }
    let drawn = |table| axes.drawn(table, ["parameter_1", "parameter_2"]);
    list.into_iter().map(drawn).collect()
}

/// Reported value of a parameter at a share.
fn reported(axis: &CurveAxis, share: f64) -> f64 {
    axis.value(share) * axis.factor
}

fn points(
    setting: &Setting<'_>,
    (axes, marks): (&Axes, &[f64]),
    pieces: &[(usize, CurveKind, &CurvePiece)],
) -> Table {
    let rows: Vec<(usize, usize, CurveKind, &CurvePoint)> = (pieces.iter())
        .flat_map(|(k, kind, piece)| {
            let list = piece.points.iter().enumerate();
            list.map(move |(number, point)| (*k, number, *kind, point))
        })
        .collect();
    let of = |f: &dyn Fn(&CurvePoint) -> f64| rows.iter().map(|r| f(r.3)).collect::<Vec<f64>>();
    let [first, second] = &axes.list;
    let mark = |point: &CurvePoint| match point.mark {
        Some(k) => marks[k] * second.factor,
        None => reported(second, point.spot.p[1]),
    };
    let word = |kind: CurveKind| kind.word().to_string();
    let mut columns = vec![
        integer("curve", rows.iter().map(|r| r.0 as i64).collect()),
        integer("point", rows.iter().map(|r| r.1 as i64).collect()),
        integer(
            "mark",
            rows.iter().map(|r| i64::from(r.3.mark.is_some())).collect(),
        ),
        text("kind", rows.iter().map(|r| word(r.2)).collect()),
        float(
            "parameter_1",
            &first.unit,
            of(&|p| reported(first, p.spot.p[0])),
        ),
        float("parameter_2", &second.unit, of(&mark)),
        float("theta", "rad", of(&|p| p.theta)),
        float("criticality", "", of(&|p| p.criticality)),
    ];
    columns.extend(frequency(
        setting,
        axes,
        &of(&|p| p.spot.p[0]),
        &of(&|p| p.spot.p[1]),
    ));
    let list = states(setting).into_iter().enumerate();
    columns.extend(list.map(|(i, heading)| heading.column(of(&|p| p.spot.u[i]))));
    let verdicts = pieces.iter().flat_map(|(_, _, piece)| &piece.confirmed);
    let verdicts = verdicts.map(|verdict| verdict.map_or(f64::NAN, |is| f64::from(u8::from(is))));
    columns.push(float("confirmed", "", verdicts.collect()));
    let words = |f: &dyn Fn(&Grazing) -> &'static str| -> Vec<String> {
        let word = |point: &CurvePoint| point.grazing.as_ref().map_or("", f).to_string();
        rows.iter().map(|r| word(r.3)).collect()
    };
    columns.push(text(
        "type",
        words(&|g| g.fate.map_or("", OrbitsBeside::word)),
    ));
    columns.push(text("map", words(&|g| g.border.word())));
    Table {
        name: String::new(),
        columns,
    }
}

/// `frequency_hz` in SI reports, where the frequency is a parameter.
fn frequency(setting: &Setting<'_>, axes: &Axes, first: &[f64], second: &[f64]) -> Option<Column> {
    let list = axes.list.iter().zip([first, second]);
    let mut list = list.filter(|(axis, _)| axis.parameter.is_frequency());
    let (axis, shares) = list.next().filter(|_| setting.is_si())?;
    let values = shares.iter().map(|share| reported(axis, *share) / TAU);
    Some(float("frequency_hz", "Hz", values.collect()))
}

fn events(setting: &Setting<'_>, axes: &Axes, pieces: &[(usize, CurveKind, &CurvePiece)]) -> Table {
    let rows: Vec<(usize, usize, CurveKind, &CurveEvent)> = (pieces.iter())
        .flat_map(|(k, kind, piece)| {
            let list = piece.events.iter();
            list.map(move |(place, event)| (*k, *place, *kind, event))
        })
        .collect();
    let value = |k: usize| -> Vec<f64> {
        let axis = &axes.list[k];
        let known = |event: &CurveEvent, x: f64| if event.is_located { x } else { f64::NAN };
        let place = |event: &CurveEvent| known(event, reported(axis, event.spot.p[k]));
        rows.iter().map(|r| place(r.3)).collect()
    };
    let names = &setting.assembly.connections;
    let connection = |event: &CurveEvent, kind: CurveKind| match (event.kind, kind) {
        (Codimension::MeetsGrazing { connection }, _) => names[connection].clone(),
        (_, CurveKind::Grazing { connection, .. }) => names[connection].clone(),
        _ => String::new(),
    };
    let meets = |event: &CurveEvent| match event.kind {
        Codimension::MeetsGrazing { .. } => "grazing",
        kind => kind.met().unwrap_or_default(),
    };
    let meaning = |event: &CurveEvent| match event.is_birth {
        Some(true) => "isola_birth",
        Some(false) => "branches_join",
        None => "",
    };
    let word = |event: &CurveEvent| event.kind.word().to_string();
    let mut columns = vec![
        text("kind", rows.iter().map(|r| word(r.3)).collect()),
        float("parameter_1", &axes.list[0].unit, value(0)),
        float("parameter_2", &axes.list[1].unit, value(1)),
        integer("curve", rows.iter().map(|r| r.0 as i64).collect()),
        integer(
            "after_point",
            rows.iter().map(|r| r.1.saturating_sub(1) as i64).collect(),
        ),
        text(
            "connection",
            rows.iter().map(|r| connection(r.3, r.2)).collect(),
        ),
        text(
            "meets",
            rows.iter().map(|r| meets(r.3).to_string()).collect(),
        ),
        text(
            "meaning",
            rows.iter().map(|r| meaning(r.3).to_string()).collect(),
        ),
    ];
    let list = states(setting).into_iter().enumerate();
    let state = |event: &CurveEvent, i: usize| match event.is_located {
        true => event.spot.u[i],
        false => f64::NAN,
    };
    columns.extend(list.map(|(i, heading)| heading.column(rows.iter().map(|r| state(r.3, i)))));
    Table {
        name: "events".into(),
        columns,
    }
}

/// The second parameter against the first, in the user's units.
fn figure(setting: &Setting<'_>, axes: &Axes, curves: &[TracedCurve]) -> Figure {
    let [first, second] = &axes.list;
    let are_users = axes.are_users();
    let [x, y] = match are_users {
        true => ["parameter_1", "parameter_2"],
        false => ["x", "y"],
    };
    let line = |(k, kind, _): (usize, CurveKind, &CurvePiece)| Curve {
        table: String::new(),
        x: x.into(),
        y: y.into(),
        label: label(setting, kind),
        style: CurveStyle::Line,
        only: Some(("curve".into(), k.to_string())),
    };
    let mut list: Vec<Curve> = numbered(curves).into_iter().map(line).collect();
    list.push(Curve {
        table: "events".into(),
        x: x.into(),
        y: y.into(),
        label: String::new(),
        style: CurveStyle::Events {
            kind: "kind".into(),
        },
        only: None,
    });
    let x_frequency = match first.parameter {
        VariedParameter::Frequency(_) if are_users => {
            frequency_axis(setting, FrequencyUnit::RadianPerSecond)
        }
        _ => None,
    };
    Figure {
        title: String::new(),
        panels: vec![Panel {
            x_label: first.label(setting),
            y_label: second.label(setting),
            x_frequency,
            curves: list,
            ..Panel::default()
        }],
    }
}

/// What a curve is called in a legend.
fn label(setting: &Setting<'_>, kind: CurveKind) -> String {
    match kind {
        CurveKind::Grazing { connection, .. } => {
            format!("grazing of {}", setting.assembly.connections[connection])
        }
        CurveKind::NeimarkSacker => "Neimark-Sacker".into(),
        kind => kind.word().replace('_', " "),
    }
}
