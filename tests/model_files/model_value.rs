//! Models as values: numbers by name, analyses in memory.

use gearlash::analysis::Observer;
use gearlash::error::Error;
use gearlash::model::{Knob, Model};
use gearlash::report::Report;
use gearlash::study::Study;
use serde_json::json;
use std::path::PathBuf;

const PAIR: &str = "
name: pair
bodies:
  A: {inertia: 1e-3}
  B: {inertia: 2e-3}
  slider: {inertia: 2 kg}
connections:
  mesh: {gear: {A: 50 mm, B: 60 mm}, stiffness: 2e8, element: {type: backlash, half_gap: 40 um}}
  twist: {acts_on: {A: 1, B: 1}, stiffness: 300 N m/rad}
  rail: {ground: slider, stiffness: 5e6}
damping: {stiffness_proportional: 1e-6}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 30, phase: 10 deg}]}
  B: {mean: 120}
analyses:
  modes: {type: modes}
  speed: {type: frequency_response, from: 3000 Hz, to: 2800 Hz, harmonics: 5}
  grid: {type: parameter_study, grid: {mesh.half_gap: [20 um, 40 um]}, analysis: modes, collect: {rows: {reduce: count}}}
";

fn is_shared<T: Send + Sync + Clone>(_: &T) {}

fn said(result: Result<impl Sized, Error>) -> String {
    result
        .err()
        .map_or(String::new(), |error| error.to_string())
}

#[test]
fn numbers_have_names_units_and_ranges() {
    let mut model = Model::from_yaml(PAIR).unwrap();
    is_shared(&model);
    let gap = model.knob("mesh.half_gap").unwrap();
    assert_eq!(gap.name(), "connections.mesh.element.half_gap");
    assert_eq!((model.get(&gap), gap.unit().as_str()), (40e-6, "m"));
    model.set(&gap, 5e-6).unwrap();
    assert_eq!(model.get(&gap), 5e-6);
    // Units decide what a stiffness or an inertia belongs to: a change of the value keeps them.
    for (name, unit, value) in [
        ("twist.stiffness", "N m/rad", 317.123456789),
        ("slider.inertia", "kg", 0.1 + 0.2),
        ("A.harmonics.0.phase", "rad", 0.1),
        ("mesh.gear.A", "m", 0.051),
        ("mesh.impact_damping", "s/m", 0.2),
    ] {
        let knob = model.knob(name).unwrap();
        assert_eq!(knob.unit(), unit, "{name}");
        model
            .set(&knob, value)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(model.get(&knob).to_bits(), value.to_bits(), "{name}");
    }
    assert_eq!(model.units_of(1), ("rad", "N m"));
    let list = model.numbers();
    let of = |name: &str| list.iter().find(|n| n.name.ends_with(name)).unwrap();
    assert!(of("mesh.element.half_gap").is_written && !of("mesh.damping").is_written);
    let names: std::collections::HashSet<_> = list.iter().map(|n| &n.name).collect();
    assert_eq!(names.len(), list.len());
}

#[test]
fn wrong_names_and_values_say_what_is_right() {
    let mut model = Model::from_yaml(PAIR).unwrap();
    for (name, wanted) in [
        ("mesh.half_gab", "did you mean `mesh.half_gap`?"),
        ("stiffness", "could be any of 3 numbers"),
        ("mesh.type", "wanted the path of a number"),
        ("bodies.A.inertya", "unknown key `inertya`"),
    ] {
        let found = said(model.knob(name));
        assert!(found.contains(wanted), "{name}: {found}");
    }
    let stiffness = model.knob("mesh.stiffness").unwrap();
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(model.set(&stiffness, value).is_err(), "{value}");
        assert_eq!((model.get(&stiffness), model.name.as_str()), (2e8, "pair"));
    }
    assert!(said(model.set(&stiffness, -1.0)).contains("must be > 0"));
    let changed = model.with([
        ("mesh.half_gap", json!("60 um")),
        ("analyses.speed.harmonics", json!(6)),
    ]);
    let changed = changed.unwrap();
    let gap = changed.knob("mesh.half_gap").unwrap();
    assert_eq!((changed.get(&gap), model.get(&gap)), (60e-6, 40e-6));
    assert!(said(model.with([("mesh.half_gab", json!(1.0))])).contains("did you mean"));
    assert!(said(model.run("sped")).contains("did you mean `speed`?"));
}

/// A report as text, empty cells as null.
fn text(report: &Report) -> String {
    serde_json::to_string(report).unwrap()
}

#[test]
fn a_model_in_memory_gives_what_its_file_gives() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("models/reverse_idler.yaml");
    let model = Model::load(&root).unwrap();
    let tree = Model::from_tree(&model.to_tree()).unwrap();
    let first = model.analyses()[0].clone();
    let study = Study::load(&root, &[], std::slice::from_ref(&first)).unwrap();
    let written = study
        .reports(&gearlash::interrupt::Interrupt::default())
        .unwrap();
    for model in [&model, &tree] {
        let report = model.run(&first).unwrap();
        assert_eq!(text(&report), text(&written[0]));
    }
}

#[test]
fn analyses_run_in_memory_and_stop_when_told() {
    let model = Model::from_yaml(PAIR).unwrap();
    assert_eq!(model.analyses(), ["modes", "speed", "grid"]);
    let report = model.run("speed").unwrap();
    let rows = report.main().unwrap().rows();
    assert!(rows > 3 && report.ended_early.is_none());
    let again: Report = serde_json::from_str(&text(&report)).unwrap();
    assert_eq!(text(&again), text(&report));
    assert_eq!(model.run("grid").unwrap().main().unwrap().rows(), 2);
    let observer = Observer::new(|_, _, _| false);
    let stopped = model.run_observed("speed", &observer).unwrap();
    assert!(stopped.ended_early.unwrap().contains("interrupted"));
    assert!(stopped.tables[0].rows() < rows);
}

fn shown(model: &Model) -> String {
    format!("{:?} {:?}", model.structure, model.warnings)
}

/// A value as a user writes it: the unit says what a stiffness or an inertia belongs to.
fn quantity(knob: &Knob, value: f64) -> serde_json::Value {
    match knob.unit().as_str() {
        "" if value.is_finite() => json!(value),
        unit => json!(format!("{value:?} {unit}")),
    }
}

/// A number that is written into its place gives the model that the reader makes of the changed document, for every number of every
/// shipped model: the same mechanics, the same warnings, the same refusals.
#[test]
fn numbers_in_place_are_what_the_reader_reads() {
    let mut compared = 0;
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("models");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|kind| kind != "yaml") {
            continue;
        }
        let model = Model::load(&path).unwrap();
        for number in model.numbers() {
            let knob = model.knob(&number.name).unwrap();
            for value in [1.1 * number.value, 0.3, 0.0, -2.5, 1e300, f64::INFINITY] {
                let mut set = model.clone();
                let found = set.set(&knob, value).map_err(|error| error.to_string());
                let found = found.map(|()| shown(&set));
                let followers = knob.followers().iter().map(|follower| &follower.knob);
                let moved = std::iter::once(&knob).chain(followers);
                let wanted = model.with(moved.map(|knob| (knob.name(), quantity(knob, value))));
                let wanted = wanted.map_err(|error| error.to_string());
                let wanted = wanted.map(|model| shown(&model));
                let place = format!("{}: {} = {value}", path.display(), number.name);
                assert_eq!(
                    found.is_ok(),
                    wanted.is_ok(),
                    "{place}: {found:?} {wanted:?}"
                );
                if let (Ok(found), Ok(wanted)) = (found, wanted) {
                    assert_eq!(found, wanted, "{place}");
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 1000, "{compared}");
}
