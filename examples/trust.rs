//! What the program says against what it can be compared with; prints the tables of `docs/trust.md`.
//!
//! ```text
//! cargo run --release --example trust              events, multipliers and errors against independent programs
//! cargo run --release --example trust -- models    default runs of the shipped models against shooting in small steps
//! cargo run --release --example trust -- errors    error estimates against true errors
//! ```
//!
//! What to look at: digits of the series alone and of what is reported; missing events; shares of estimates within a factor.

use gearlash::error::Error;
use gearlash::model::Model;
use gearlash::report::{Report, Table, Values};
use gearlash::serde_json::{Value, json};

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
    match std::env::args().nth(1).as_deref() {
        Some("models") => models(),
        Some("errors") => errors(),
        _ => cases(),
    }
}

/// Against exact values.
fn cases() -> Result<(), Error> {
    println!(
        "| Case | Quantity | Exact | Series alone | Reported | Digits, series | Digits, reported |"
    );
    println!("|---|---|--:|--:|--:|--:|--:|");
    let with_flow = run(STIFF_STOP)?;
    let alone = run(&without_flow(STIFF_STOP))?;
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
    let soft = run(SOFT_STOP)?;
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

fn run(model: &str) -> Result<Report, Error> {
    Model::from_yaml(model)?.run("a")
}

/// A response by the Galerkin method among the models of `models/`.
struct Response {
    name: String,
    analysis: String,
    tree: Value,
}

impl Response {
    /// All of them.
    fn shipped() -> Result<Vec<Response>, Error> {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
        let entries = std::fs::read_dir(folder).expect("the models are shipped");
        let mut files: Vec<_> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .collect();
        files.retain(|file| file.extension().is_some_and(|e| e == "yaml"));
        files.sort();
        let mut list = Vec::new();
        for file in files {
            let model = Model::load(&file)?;
            let (tree, stem) = (model.to_tree(), file.file_stem().unwrap_or_default());
            for analysis in model.analyses() {
                let settings = &tree["analyses"][&analysis];
                let kind = settings["type"].as_str().unwrap_or_default();
                let method = settings["method"].as_str().unwrap_or("galerkin");
                if matches!(kind, "frequency_response" | "parameter_response")
                    && method == "galerkin"
                {
                    let name = format!("{} {analysis}", stem.to_string_lossy());
                    let tree = tree.clone();
                    list.push(Response {
                        name,
                        analysis,
                        tree,
                    });
                }
            }
        }
        Ok(list)
    }

    /// With other settings; `null` takes a key away.
    fn run(&self, settings: &[(&str, Value)]) -> Result<Report, Error> {
        let mut tree = self.tree.clone();
        let own = tree["analyses"][&self.analysis].as_object_mut();
        let own = own.expect("an analysis has keys");
        own.remove("methods");
        for (key, value) in settings {
            match value {
                Value::Null => own.remove(*key),
                value => own.insert((*key).to_owned(), value.clone()),
            };
        }
        Model::from_tree(&tree)?.run(&self.analysis)
    }
}

/// Largest difference of an event between the two methods, relative to its place.
const SAME_EVENT: f64 = 1e-6;

/// Default runs against shooting in small steps.
fn models() -> Result<(), Error> {
    println!("| Response | Events | Largest difference | Only by default | Only by shooting |");
    println!("|---|--:|--:|---|---|");
    for response in Response::shipped()? {
        let by_default = located(&response.run(&[])?);
        let fine = [
            ("method", json!("shooting")),
            ("max_step", json!(0.005)),
            ("max_points", json!(100_000)),
        ];
        let mut left = located(&response.run(&fine)?);
        let (mut only, mut largest, count) = (Vec::new(), 0.0_f64, by_default.len());
        for event in by_default {
            let gap = |other: &(String, f64)| (other.1 / event.1 - 1.0).abs();
            let alike = (0..left.len()).filter(|k| left[*k].0 == event.0);
            let nearest = alike.min_by(|i, j| gap(&left[*i]).total_cmp(&gap(&left[*j])));
            match nearest.filter(|k| gap(&left[*k]) <= SAME_EVENT) {
                Some(k) => largest = largest.max(gap(&left.swap_remove(k))),
                None => only.push(event),
            }
        }
        let told = |list: &[(String, f64)]| {
            let texts: Vec<String> = list
                .iter()
                .map(|(kind, at)| format!("{kind} {at:.7}"))
                .collect();
            texts.join(", ")
        };
        let Response { name, .. } = &response;
        println!(
            "| {name} | {count} | {largest:.1e} | {} | {} |",
            told(&only),
            told(&left)
        );
    }
    Ok(())
}

/// Kinds with connections, and places, of located events.
fn located(report: &Report) -> Vec<(String, f64)> {
    let table = report.table("events").expect("events are always listed");
    let texts = |name: &str| match table.column(name).map(|c| &c.values) {
        Some(Values::Text(texts)) => texts.clone(),
        _ => Vec::new(),
    };
    let (kinds, connections) = (texts("kind"), texts("connection"));
    let is_located = match table.column("located").map(|c| &c.values) {
        Some(Values::Integer(list)) => list.clone(),
        _ => Vec::new(),
    };
    let at = floats(table, "parameter");
    let rows = (0..at.len()).filter(|k| is_located[*k] == 1);
    let one = |k: usize| {
        (
            format!("{} {}", kinds[k], connections[k])
                .trim_end()
                .to_owned(),
            at[k],
        )
    };
    rows.map(one).collect()
}

/// Errors below these say nothing: of r.m.s. values and forces relative to their largest, of multipliers to their modulus or 1.
const LEAST_ERROR: f64 = 1e-8;

/// Estimates by the series, and by default, against the difference from the exact orbit.
fn errors() -> Result<(), Error> {
    println!(
        "| Response | Quantity | Values | Judged by the flow | Estimates of the series within 2 | Within 5 |"
    );
    println!("|---|---|--:|--:|--:|--:|");
    for response in Response::shipped()? {
        let asked = ("error_estimate", json!(true));
        let alone = response.run(&[asked.clone(), ("confirm", json!("none"))])?;
        let exact = response.run(&[asked])?;
        let tables = [
            alone.table("accuracy"),
            exact.table("accuracy"),
            exact.table(""),
        ];
        let [Some(alone), Some(exact), Some(points)] = tables else {
            continue;
        };
        for quantity in ["error_rms.", "error_force_max.", "error_multipliers"] {
            compare(&response.name, quantity, (alone, exact, points));
        }
    }
    Ok(())
}

/// One line: estimates of the series against true errors, of all columns of a quantity.
fn compare(name: &str, quantity: &str, (alone, exact, points): (&Table, &Table, &Table)) {
    let judged_by = match exact.column("judged_by").map(|c| &c.values) {
        Some(Values::Text(list)) => &list[..],
        _ => &[],
    };
    let (mut count, mut by_flow, mut within) = (0, 0, [0, 0]);
    let columns = exact
        .columns
        .iter()
        .filter(|c| c.name.starts_with(quantity));
    for column in columns {
        let (estimates, errors) = (floats(alone, &column.name), floats(exact, &column.name));
        let measured = column.name.trim_start_matches("error_");
        let values = floats(points, measured).iter().map(|x| x.abs());
        let least = LEAST_ERROR
            * match quantity {
                "error_multipliers" => 1.0,
                _ => values.fold(0.0, f64::max),
            };
        for (k, (estimate, error)) in estimates.iter().zip(errors).enumerate() {
            let is_known =
                estimate.is_finite() && error.is_finite() && estimate.max(*error) > least;
            if !is_known {
                continue;
            }
            count += 1;
            if judged_by[k] != "flow" {
                continue;
            }
            by_flow += 1;
            let ratio = (estimate / error).ln().abs();
            for (within, factor) in within.iter_mut().zip([2.0_f64, 5.0]) {
                *within += usize::from(ratio <= factor.ln());
            }
        }
    }
    let share =
        |part: usize, all: usize| format!("{:.1} %", 100.0 * part as f64 / all.max(1) as f64);
    let quantity = quantity.trim_start_matches("error_").trim_end_matches('.');
    println!(
        "| {name} | {quantity} | {count} | {} | {} | {} |",
        share(by_flow, count),
        share(within[0], by_flow),
        share(within[1], by_flow)
    );
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
    let table = report.table(table).expect("the table was requested");
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
