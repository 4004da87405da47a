//! Reports with every feature of a figure: folds, an unstable middle, gaps, events, crosses, dots, small numbers.

use gearlash::report::{Column, Curve, CurveStyle, Figure, Panel, Report, Table, Values};
use serde_json::json;

pub fn column(name: &str, unit: &str, values: Values) -> Column {
    Column {
        name: name.into(),
        unit: unit.into(),
        values,
    }
}

fn curve(table: &str, x: &str, y: &str, label: &str, style: CurveStyle) -> Curve {
    Curve {
        table: table.into(),
        x: x.into(),
        y: y.into(),
        label: label.into(),
        style,
        only: None,
    }
}

fn branch() -> CurveStyle {
    CurveStyle::Branch {
        branch: "branch".into(),
        stable: "stable".into(),
    }
}

/// Points of a softening Duffing-like resonance, by rising amplitude and down again: (omega, amplitude, stable).
fn duffing(stiffening: f64, force: f64) -> Vec<(f64, f64, f64)> {
    let damping = 0.08;
    let mut upper = Vec::new();
    let mut lower = Vec::new();
    for k in 1..400 {
        let a = 0.9 * f64::from(k) / 400.0;
        let backbone = 1.0 + 0.75 * stiffening * a * a;
        // (w0^2 - w^2)^2 + (c w)^2 = (F/a)^2, a quadratic in w^2.
        let b = backbone - damping * damping / 2.0;
        let disc = b * b - backbone * backbone + (force / a) * (force / a);
        if disc > 0.0 {
            let (low, high) = (b - disc.sqrt(), b + disc.sqrt());
            if low > 0.0 {
                lower.push((low.sqrt(), a));
            }
            upper.push((high.sqrt(), a));
        }
    }
    upper.reverse();
    lower.extend(upper);
    let mut points: Vec<_> = lower
        .into_iter()
        .filter(|p| p.0 > 0.3 && p.0 < 2.5)
        .collect();
    points.reverse();
    let mut out = Vec::new();
    for k in 0..points.len() {
        let back = k > 0 && points[k].0 > points[k - 1].0;
        out.push((points[k].0, points[k].1, if back { 0.0 } else { 1.0 }));
    }
    out
}

fn main_table() -> Table {
    let (mut branch, mut point, mut omega) = (vec![], vec![], vec![]);
    let (mut a1, mut a2, mut k1, mut k2, mut stable) = (vec![], vec![], vec![], vec![], vec![]);
    for (b, list) in [duffing(-0.9, 0.055), duffing(-0.35, 0.02)]
        .iter()
        .enumerate()
    {
        for (p, (w, a, s)) in list.iter().enumerate() {
            branch.push(b as i64);
            point.push(p as i64);
            omega.push(*w);
            a1.push(*a);
            a2.push(0.6 * a * (1.0 + 0.3 * (3.0 * w).sin()));
            k1.push(1.0 - 0.8 * a);
            k2.push(if p % 97 == 50 {
                f64::NAN
            } else {
                1.0 - 0.4 * a * a
            });
            stable.push(if p < 6 { f64::NAN } else { *s });
        }
    }
    Table {
        name: String::new(),
        columns: vec![
            column("branch", "", Values::Integer(branch)),
            column("point", "", Values::Integer(point)),
            column("omega", "", Values::Float(omega)),
            column("stable", "", Values::Float(stable)),
            column("rms.mesh_1", "", Values::Float(a1)),
            column("rms.mesh_2", "", Values::Float(a2)),
            column("effective_stiffness.mesh_1", "", Values::Float(k1)),
            column("effective_stiffness.mesh_2", "", Values::Float(k2)),
        ],
    }
}

fn events_table(main: &Table) -> Table {
    let floats = |name: &str| match &main.column(name).unwrap().values {
        Values::Float(v) => v.clone(),
        Values::Integer(v) => v.iter().map(|&i| i as f64).collect(),
        Values::Text(_) => panic!("numbers wanted"),
    };
    let (w, s, b, p) = (
        floats("omega"),
        floats("stable"),
        floats("branch"),
        floats("point"),
    );
    let mut rows: Vec<(String, usize)> = (1..w.len())
        .filter(|&k| b[k] == b[k - 1] && (s[k] - s[k - 1]).abs() == 1.0)
        .map(|k| ("fold".to_string(), k - 1))
        .collect();
    for (k, kind) in [
        "grazing",
        "period_doubling",
        "neimark_sacker",
        "branch_point",
    ]
    .iter()
    .enumerate()
    {
        rows.push((kind.to_string(), 30 + 45 * k));
    }
    Table {
        name: "events".into(),
        columns: vec![
            column(
                "kind",
                "",
                Values::Text(rows.iter().map(|r| r.0.clone()).collect()),
            ),
            column(
                "omega",
                "",
                Values::Float(rows.iter().map(|r| w[r.1]).collect()),
            ),
            column(
                "located",
                "",
                Values::Integer(rows.iter().map(|_| 1).collect()),
            ),
            column(
                "branch",
                "",
                Values::Integer(rows.iter().map(|r| b[r.1] as i64).collect()),
            ),
            column(
                "after_point",
                "",
                Values::Integer(rows.iter().map(|r| p[r.1] as i64).collect()),
            ),
            column(
                "connection",
                "",
                Values::Text(rows.iter().map(|_| String::new()).collect()),
            ),
        ],
    }
}

fn backbone_table() -> Table {
    let a: Vec<f64> = (0..25).map(|k| 0.03 * f64::from(k)).collect();
    let w = a
        .iter()
        .map(|a| (1.0 - 0.75 * 0.9 * a * a).sqrt())
        .collect();
    Table {
        name: "backbone".into(),
        columns: vec![
            column("effective_frequency.1", "", Values::Float(w)),
            column("rms.mesh_1", "", Values::Float(a)),
        ],
    }
}

/// A frequency response with folds, two panels, events on the curves and a backbone.
pub fn resonance() -> Report {
    let main = main_table();
    let events = events_table(&main);
    let event_curve = |y: &str| {
        curve(
            "events",
            "omega",
            y,
            "",
            CurveStyle::Events {
                kind: "kind".into(),
            },
        )
    };
    let figure = Figure {
        title: "Figure 11: reverse-idler pair, b2 = 0.1".into(),
        panels: vec![
            Panel {
                x_label: "excitation frequency Ω = ω/ωc".into(),
                y_label: "r.m.s. displacement".into(),
                x_range: Some((2.5, 0.3)),
                curves: vec![
                    curve("", "omega", "rms.mesh_1", "mesh_1", branch()),
                    curve("", "omega", "rms.mesh_2", "mesh_2", branch()),
                    curve(
                        "backbone",
                        "effective_frequency.1",
                        "rms.mesh_1",
                        "backbone, mode 1",
                        CurveStyle::Crosses,
                    ),
                    event_curve("rms.mesh_1"),
                ],
                ..Panel::default()
            },
            Panel {
                x_label: "excitation frequency Ω = ω/ωc".into(),
                y_label: "effective stiffness".into(),
                x_range: Some((2.5, 0.3)),
                curves: vec![
                    curve(
                        "",
                        "omega",
                        "effective_stiffness.mesh_1",
                        "mesh_1",
                        branch(),
                    ),
                    curve(
                        "",
                        "omega",
                        "effective_stiffness.mesh_2",
                        "mesh_2",
                        branch(),
                    ),
                ],
                ..Panel::default()
            },
        ],
    };
    let mut report = Report {
        name: "fig_11".into(),
        kind: "frequency_response".into(),
        title: "Figure 11 <i>of</i> the paper".into(),
        caption: "Softening resonance & jump; look at the dashed middle.".into(),
        assumed: vec!["zeta = 0.05 (not legible)".into()],
        tables: vec![main, events, backbone_table()],
        figure: Some(figure),
        warnings: vec!["connection mesh_1 pulls at 3 points: 1 + beta v < 0".into()],
        ..Report::default()
    };
    report.summary.insert(
        "branches".into(),
        json!([
            {"branch": 0, "method": "galerkin", "points": 700, "end": {"reason": "range_covered", "message": "reached 0.3"}},
            {"branch": 1, "method": "shooting", "points": 450, "end": {"reason": "returned_to_start", "message": "turned back at 0.87"}},
        ]),
    );
    report
}

/// Dots in SI units: small numbers on both axes, many points.
pub fn bifurcation() -> Report {
    let (mut x, mut y) = (vec![], vec![]);
    for k in 0..400 {
        let r = 2.8 + 1.2 * f64::from(k) / 400.0;
        let mut q: f64 = 0.4;
        for i in 0..300 {
            q = r * q * (1.0 - q);
            if i >= 200 {
                x.push(r * 1e-6);
                y.push((q - 0.5) * 4e-5);
            }
        }
    }
    let rows = x.len();
    Report {
        name: "diagram".into(),
        kind: "bifurcation_diagram".into(),
        title: "Attractors against the gap".into(),
        tables: vec![Table {
            name: String::new(),
            columns: vec![
                column("parameter", "m", Values::Float(x)),
                column("run", "", Values::Integer(vec![0; rows])),
                column("q.mesh_1", "m", Values::Float(y)),
            ],
        }],
        figure: Some(Figure {
            title: "Attractors against the gap".into(),
            panels: vec![Panel {
                x_label: "half gap of mesh_2 [m]".into(),
                y_label: "displacement of mesh_1 [m]".into(),
                curves: vec![curve(
                    "",
                    "parameter",
                    "q.mesh_1",
                    "mesh_1",
                    CurveStyle::Dots,
                )],
                ..Panel::default()
            }],
        }),
        ended_early: Some("interrupted after 400 of 500 values".into()),
        ..Report::default()
    }
}

/// Plain lines of three families, a report without figure, and one without any row.
pub fn all() -> Vec<Report> {
    let t: Vec<f64> = (0..2000).map(|k| 0.05 * f64::from(k)).collect();
    let wave = |p: f64| {
        Values::Float(
            t.iter()
                .map(|t| (t + p).sin() * (-t / 40.0).exp() + 0.3)
                .collect(),
        )
    };
    let line = |c: &str| curve("", "T", &format!("q.{c}"), c, CurveStyle::Line);
    let history = Report {
        name: "history".into(),
        kind: "time_history".into(),
        title: "Free decay".into(),
        tables: vec![Table {
            name: String::new(),
            columns: vec![
                column("T", "", Values::Float(t.clone())),
                column("q.mesh_1", "", wave(0.0)),
                column("q.mesh_2", "", wave(1.0)),
                column("q.shaft", "", wave(2.0)),
            ],
        }],
        figure: Some(Figure {
            title: "Free decay".into(),
            panels: vec![Panel {
                x_label: "nondimensional time T".into(),
                y_label: "displacement".into(),
                curves: vec![line("mesh_1"), line("mesh_2"), line("shaft")],
                ..Panel::default()
            }],
        }),
        ..Report::default()
    };
    let mut empty = resonance();
    empty.name = "empty".into();
    for column in empty.tables.iter_mut().flat_map(|t| &mut t.columns) {
        match &mut column.values {
            Values::Float(v) => v.clear(),
            Values::Integer(v) => v.clear(),
            Values::Text(v) => v.clear(),
        }
    }
    let bare = Report {
        name: "bare".into(),
        kind: "parameter_study".into(),
        title: "Nothing to draw".into(),
        ..Report::default()
    };
    vec![resonance(), bifurcation(), history, empty, bare]
}
