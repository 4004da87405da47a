//! Short runs of mutated models: no panic, no abort, no run that does not hear of an interruption, no result without values.
//!
//! `GEARLASH_FUZZ_SECONDS` sets the time (a few seconds here, two minutes in `.ci/run`). Every case has a seed of its own; a failure
//! prints the model.

use gearlash::interrupt::Interrupt;
use gearlash::report::{Report, Values};
use gearlash::study::Study;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng as Random;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

const TRAIN: &str = "\
schema: 1
bodies: {A: {inertia: 1.0e-3}, B: {inertia: 1.0e-3}, C: {inertia: 2.0e-3}}
connections:
  mesh: {gear: {A: 50 mm, B: 50 mm}, stiffness: 2.4e8, damping: 10, element: {type: backlash, half_gap: 50 um}}
  shaft: {shaft: [B, C], stiffness: 1.0e5, element: {type: piecewise_linear, breakpoints: [-0.01, 0.01], slopes: [1, 0.1, 1]}}
  stop: {ground: C, stiffness: 1.0e4, element: {type: expression, force: FORMULA}}
damping: {modal_ratio: 0.05}
loads: {A: {mean: 100 N m, harmonics: [{order: 1, amplitude: 150, phase: 0.3}]}, B: {mean: 100}}
report: {units: nondimensional}
";
/// A train with memory, impacts, speeds and a cycle.
const GEARBOX: &str = "\
schema: 1
bodies: {engine: {inertia: 0.1}, input: {inertia: 4.0e-3, drag: 0.5 N m}, idler: {inertia: 1.0e-3, drag: 0.2 N m}}
connections:
  clutch: {shaft: [engine, input], stiffness: 1000, length: 0.05, damping: 0.1, element: {type: clutch, stages: [{to: 8 deg, stiffness: 30, \
hysteresis: 1, hysteresis_stiffness: 500}, {stiffness: 1000, hysteresis: 15, hysteresis_stiffness: 4000}]}}
  mesh: {gear: {teeth: {input: 23, idler: 41}, module: 2 mm, pressure_angle: 20 deg}, stiffness: 2.0e6, damping: 80, length: 50 um, element: LAW}
  brake: {ground: idler, stiffness: 100, element: {type: jenkins, slip_force: 0.3}}
reference: {body: engine, speed: 900 rpm}
balance: engine
loads: {engine: {harmonics: [{order: 2, amplitude: 60}, {order: 0.5, amplitude: 3}]}, input: {cycle: {values: [0, 1, -2, 0.5], revolutions: 1}}}
report: {units: si}
";
const LAWS: &[&str] = &[
    "{type: backlash, half_gap: 50 um}",
    "{type: rigid_stop, half_gap: 50 um, restitution: 0.6, least_impact: 0.01}",
    "{type: preloaded, half_gap: 10 um, preload: 5}",
    "{type: tanh_friction, force: 1, velocity: 0.01}",
];
const DRIVEN: &[&str] = &[
    "type: operating_point, at: 900 rpm, settle: 5, periods: 5, extend: 1",
    "type: run_up, from: 800 rpm, to: 900 rpm, duration: 1 s, window: 4, orders: [2, 1]",
    "type: time_history, at: 900 rpm, duration: 0.2 s, samples_per_period: 20",
    "type: time_history, duration: 0.1 s, speed: {points: [[0, 600], [0.1, 900]]}, points: 50",
    "type: frequency_response, from: 900 rpm, to: 800 rpm, method: integration, points: 2, transient: 5, periods: 5",
    "type: parameter_response, parameter: loads.engine.harmonics.0.amplitude, at: 900 rpm, from: 60, to: 40, harmonics: 6, max_points: 10",
    "type: modes, points: 3",
];
const REDUCED: &str = "\
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {m1: {type: backlash, half_gap: 1.0}, m2: {type: one_sided, gap: 0.1}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0], sin: [0, 0.1]}]}
";
const ANALYSES: &[&str] = &[
    "type: modes, points: 5",
    "type: effective_frequencies, amplitude: [0, 5], points: 5, mean_displacement: 0",
    "type: frequency_response, from: 2.0, to: 1.6, harmonics: 5, max_points: 30",
    "type: frequency_response, from: 2.0, to: 1.6, harmonics: 5, samples: 1024, methods: [shooting], max_points: 20, marks: [1.9]",
    "type: frequency_response, from: 2.0, to: 1.6, method: integration, points: 3, transient: 20, periods: 30",
    "type: frequency_response, from: 2.0, to: 1.6, harmonics: {tolerance: 0.01, most: 40}, max_points: 10, subharmonic: 2",
    "type: time_history, at: 1.3, periods: 3, transient: 2, samples_per_period: 20",
    "type: poincare_map, at: 1.3, transient: 20, periods: 20",
    "type: operating_point, at: 1.3, settle: 20, periods: 20",
    "type: basins, at: 1.6, transient: 10, periods: 10, limit: 60, grid: {q.NAME: {from: -3, to: 3, points: 3}, v.NAME: {from: -1, to: 1, points: 3}}",
    "type: regime_map, parameters: {frequency: {from: 1, to: 2, points: 3}, damping.modal_ratio: {from: 0.02, to: 0.1, points: 2}}, transient: 10, periods: 10, measures: [impacts]",
    "type: bifurcation_curve, parameters: [frequency, damping.modal_ratio], ranges: [[1, 2], [0.01, 0.2]], start: {kind: grazing, connection: NAME, at: {frequency: 1.47, damping.modal_ratio: 0.05}}",
    "type: torus, at: 1.2, parameter: damping.modal_ratio, start: {attractor: {value: 0.05}}, from: 0.05, to: 0.06",
    "type: bifurcation_diagram, from: 2, to: 1, points: 5, transient: 20, periods: 20, seeds: {count: 2, seed: 1, box: 0.5}",
    "type: parameter_study, grid: {damping.modal_ratio: [0.05, 0.1]}, analysis: {type: modes, points: 3}, \
     collect: {w: {column: natural_frequency.1, reduce: max}}",
];
/// Numbers at the ends of what numbers can be.
const NUMBERS: &[&str] = &[
    "0",
    "-1",
    "1",
    "2",
    "3.5",
    "1e-3",
    "1e-9",
    "1e-300",
    "1e300",
    "-1e300",
    "1e18",
    "4096",
    "1000000000",
    "18446744073709551615",
    "9223372036854775808",
    ".nan",
    ".inf",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "1e6",
    "0.999999",
    "7",
    "16",
    "1 um",
    "5 Hz",
];
const PIECES: &[&str] = &[
    "q", "v", "phase", "1", "0", "1e308", "2", "+", "-", "*", "/", "^", "(", ")", "abs(", "max(",
    "min(", "sign(", "sin(", "exp(", "sqrt(", ",", "if(", "<", "tanh(", " ",
];

/// Replaces some of the numbers of a text, and loses a piece of it now and then.
fn mutated(text: &str, random: &mut Random) -> String {
    let mut text = text.to_string();
    for _ in 0..random.random_range(0..4) {
        let starts: Vec<usize> = (1..text.len())
            .filter(|k| {
                text.is_char_boundary(*k)
                    && text.as_bytes()[*k].is_ascii_digit()
                    && b" [{".contains(&text.as_bytes()[k - 1])
            })
            .collect();
        let Some(start) = starts
            .get(random.random_range(0..starts.len().max(1)))
            .copied()
        else {
            break;
        };
        let rest = &text[start..];
        let end = start + rest.find([',', '}', ']', '\n']).unwrap_or(rest.len());
        text.replace_range(start..end, NUMBERS[random.random_range(0..NUMBERS.len())]);
    }
    if random.random_range(0..8) == 0 {
        let from = random.random_range(0..text.len());
        let to = (from + random.random_range(0..12)).min(text.len());
        if text.is_char_boundary(from) && text.is_char_boundary(to) {
            text.replace_range(from..to, "");
        }
    }
    text
}

fn model(random: &mut Random) -> String {
    let formula: String = match random.random_range(0..3) {
        0 => "q".into(),
        1 => "1e4*q + 1e3*q^3".into(),
        _ => (0..random.random_range(1..9))
            .map(|_| PIECES[random.random_range(0..PIECES.len())])
            .collect(),
    };
    let pick =
        |list: &[&'static str], random: &mut Random| list[random.random_range(0..list.len())];
    let (model, name, list) = match random.random_range(0..3) {
        0 => (
            TRAIN.replace("FORMULA", &format!("\"{formula}\"")),
            "mesh",
            ANALYSES,
        ),
        1 => (REDUCED.to_string(), "m1", ANALYSES),
        _ => (GEARBOX.replace("LAW", pick(LAWS, random)), "mesh", DRIVEN),
    };
    let mut analysis = pick(list, random).replace("NAME", name);
    if name == "m1" {
        analysis = analysis.replace("damping.modal_ratio", "reduced.damping.modal_ratio");
    }
    mutated(&format!("{model}analyses:\n  it: {{{analysis}}}\n"), random)
}

/// Whether a complete report has columns without a value that it says nothing of, or numbers that are not finite.
fn is_hollow(report: &Report) -> bool {
    let explained = report
        .summary
        .get("empty_columns")
        .cloned()
        .unwrap_or_default();
    report
        .tables
        .iter()
        .filter(|table| table.rows() > 0)
        .any(|table| {
            let name = if table.name.is_empty() {
                "main"
            } else {
                &table.name
            };
            table.columns.iter().any(|column| match &column.values {
                Values::Float(list) => {
                    let is_empty = list.iter().all(|x| x.is_nan());
                    let is_said = explained
                        .get(name)
                        .is_some_and(|t| t.get(&column.name).is_some());
                    list.iter().any(|x| x.is_infinite()) || (is_empty && !is_said)
                }
                _ => false,
            })
        })
}

/// Time that a run gets, and time after which one that was interrupted has not heard of it.
const TIME: Duration = Duration::from_millis(700);
const PATIENCE: Duration = Duration::from_secs(20);

fn try_one(text: &str, file: &std::path::Path) -> Option<String> {
    std::fs::write(file, text).unwrap();
    let Ok(study) = Study::load(file, &[], &[]) else {
        return None;
    };
    let flag = Interrupt::default();
    if study.costs(&flag).is_err() {
        return None;
    }
    let timer = flag.clone();
    let (done, wait) = std::sync::mpsc::channel::<()>();
    let thread = std::thread::spawn(move || {
        if wait.recv_timeout(TIME).is_err() {
            timer.request();
        }
    });
    let began = Instant::now();
    let reports = study.reports(&flag);
    let took = began.elapsed();
    let _ = done.send(());
    thread.join().unwrap();
    if took > PATIENCE {
        return Some(format!("took {took:?}"));
    }
    let reports = reports.unwrap_or_default();
    let hollow = reports
        .iter()
        .find(|r| r.ended_early.is_none() && r.warnings.is_empty() && is_hollow(r));
    hollow.map(|_| "complete, but without a value".into())
}

#[test]
fn short_runs_of_mutated_models() {
    let seconds = std::env::var("GEARLASH_FUZZ_SECONDS")
        .ok()
        .and_then(|text| text.parse().ok());
    let time = Duration::from_secs(seconds.unwrap_or(10));
    let folder = tempfile::tempdir().unwrap();
    let began = Instant::now();
    // Other seeds find other faults.
    let first = std::env::var("GEARLASH_FUZZ_FIRST").ok();
    let first: u64 = first.map_or(0, |text| text.parse().expect("a whole number"));
    let mut seed = first;
    while began.elapsed() < time {
        let text = model(&mut Random::seed_from_u64(seed));
        let file = folder.path().join("m.yaml");
        let outcome = catch_unwind(AssertUnwindSafe(|| try_one(&text, &file)));
        match outcome {
            Ok(None) => {}
            Ok(Some(fault)) => panic!("seed {seed}: {fault}\n{text}"),
            Err(_) => panic!("seed {seed}: panic\n{text}"),
        }
        seed += 1;
    }
    let models = seed - first;
    assert!(models > 20, "{models} models only");
    println!("{models} models");
}
