//! Events, multipliers and error estimates against exact values from independent programs; prints the table of `docs/trust.md`.
//!
//! ```text
//! cargo run --release --example trust
//! ```
//!
//! What to look at: the last two columns, digits of the series alone and digits of what is reported.

use gearlash::error::Error;
use gearlash::report::{Report, Table, Values};
use gearlash::study::{RunSettings, Study};
use std::sync::atomic::AtomicBool;

/// x'' + 0.1 x' + x + 1e4 max(x - 1, 0) = 0.5 cos wt.
const STIFF_STOP: &str = "\
schema: 1
name: oscillator with a stiff stop
bodies: {m1: {inertia: 1 kg}}
connections:
  spring: {ground: m1, stiffness: 1 N/m, damping: 0.1 N s/m}
  stop: {ground: m1, stiffness: 10000 N/m, element: {type: one_sided, gap: 1 m}}
loads: {m1: {harmonics: [{order: 1, amplitude: 0.5}]}}
scaling: {frequency: 1 rad/s, length: 1 m}
report: {units: nondimensional}
analyses:
  a: {type: frequency_response, quadrature: exact, harmonics: 40, from: 0.4, to: 1.2, marks: [0.9, 0.985, 1.0], error_estimate: true}
";

/// Two masses with springs to each other and to ground, and a stop a hundred times stiffer.
const SOFT_STOP: &str = "\
schema: 1
name: two masses, unilateral spring
bodies: {m1: {inertia: 1 kg}, m2: {inertia: 1 kg}}
connections:
  c12: {acts_on: {m1: 1, m2: -1}, stiffness: 1 N/m, damping: 0.03 N s/m}
  ground2: {ground: m2, stiffness: 1 N/m, damping: 0.03 N s/m}
  stop: {ground: m1, stiffness: 100 N/m, element: {type: one_sided, gap: 1 m}}
loads: {m2: {harmonics: [{order: 1, amplitude: 0.1}]}}
scaling: {frequency: 1 rad/s, length: 1 m}
report: {units: nondimensional}
analyses:
  a: {type: frequency_response, quadrature: exact, harmonics: 40, from: 0.8, to: 0.5}
";

fn main() -> Result<(), Error> {
    println!(
        "| Case | Quantity | Exact | Series alone | Reported | Digits, series | Digits, reported |"
    );
    println!("|---|---|--:|--:|--:|--:|--:|");
    let with_flow = run(STIFF_STOP, "stop")?;
    let alone = run(&without_flow(STIFF_STOP), "stop-alone")?;
    let case = "stop 1e4 times stiffer, 40 harmonics";
    event(case, &with_flow, ("period_doubling", 0.9813869647));
    for (omega, modulus) in [(0.9, 1.5434516), (1.0, 0.7304027)] {
        let value = |report| at(report, "", omega, "multiplier_modulus");
        let name = format!("largest multiplier at {omega}");
        line(case, &name, modulus, value(&alone), value(&with_flow));
    }
    for (omega, name, exact) in [
        (0.985, "rms.stop", 0.63830262),
        (0.9, "force_max.stop", 0.0057647656642),
    ] {
        let error = (at(&with_flow, "", omega, name) - exact).abs();
        let estimate = |report| at(report, "accuracy", omega, &format!("error_{name}"));
        let name = format!("error of {name} at {omega}");
        line(case, &name, error, estimate(&alone), estimate(&with_flow));
    }
    let soft = run(SOFT_STOP, "soft")?;
    let case = "two masses, stop 100 times stiffer, 40 harmonics";
    for wanted in [
        ("period_doubling", 0.7555861593561),
        ("period_doubling", 0.7387830253732),
        ("neimark_sacker", 0.6186068742671),
    ] {
        event(case, &soft, wanted);
    }
    Ok(())
}

/// The same model, its series not compared with the flow.
fn without_flow(model: &str) -> String {
    model.replace("from: 0.4", "confirm: none, from: 0.4")
}

fn run(model: &str, name: &str) -> Result<Report, Error> {
    let folder = std::env::temp_dir().join("gearlash-trust");
    let file = folder.join(format!("{name}.yaml"));
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&file, model))
        .expect("the folder of temporary files can be written to");
    let study = Study::load(&file, &[], &[])?;
    let settings = RunSettings {
        out: folder.join(name),
        figures: Vec::new(),
        jobs: 1,
    };
    let mut outcome = study.run(&settings, &AtomicBool::new(false))?;
    Ok(outcome.reports.swap_remove(0))
}

/// The located event nearest to an exact one, and what the series says of it.
fn event(case: &str, report: &Report, (kind, exact): (&str, f64)) {
    let table = report.table("events").expect("events are always listed");
    let (omega, own) = (floats(table, "omega"), floats(table, "omega_method"));
    let kinds = match table.column("kind").map(|c| &c.values) {
        Some(Values::Text(kinds)) => &kinds[..],
        _ => &[],
    };
    let alike = (0..omega.len()).filter(|k| kinds[*k] == kind);
    let gap = |k: &usize| (omega[*k] - exact).abs();
    let best = alike.clone().min_by(|a, b| gap(a).total_cmp(&gap(b)));
    let gap = |k: &usize| (own[*k] - exact).abs();
    let series = alike
        .filter(|k| own[*k].is_finite())
        .min_by(|a, b| gap(a).total_cmp(&gap(b)));
    let value = |list: &[f64], k: Option<usize>| k.map_or(f64::NAN, |k| list[k]);
    line(case, kind, exact, value(own, series), value(omega, best));
}

fn line(case: &str, quantity: &str, exact: f64, alone: f64, reported: f64) {
    let digits = |x: f64| -(x / exact - 1.0).abs().log10();
    println!(
        "| {case} | {quantity} | {exact:.10} | {alone:.10} | {reported:.10} | {:.1} | {:.1} |",
        digits(alone),
        digits(reported)
    );
}

/// Value of a column in the row of a frequency.
fn at(report: &Report, table: &str, omega: f64, column: &str) -> f64 {
    let table = report.table(table).expect("the table was asked for");
    let row = floats(table, "omega").iter().position(|w| *w == omega);
    row.map_or(f64::NAN, |row| floats(table, column)[row])
}

/// A column of real numbers.
fn floats<'a>(table: &'a Table, name: &str) -> &'a [f64] {
    match table.column(name).map(|column| &column.values) {
        Some(Values::Float(values)) => values,
        _ => &[],
    }
}
