//! Models, runs and tables for the tests of the time domain.
#![allow(dead_code)] // Every test file takes its own share.

use gearlash::analysis::Control;
use gearlash::report::{Report, Table, Values};
use gearlash::study::{RunSettings, Study};
use std::path::Path;

/// One linear mass: q'' + 0.1 q' + q = 0.5 + 0.3 cos(0.8 T).
pub const LINEAR: &str = "
schema: 1
reduced:
  stiffness: [[1]]
  damping: {matrix: [[0.1]]}
  elements: {spring: {type: linear}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.3], sin: [0]}]}
";

/// A motor mass on a shaft and a translating mass behind it.
pub const TRAIN: &str = "
schema: 1
bodies:
  A: {inertia: 2.0e-3}
  B: {inertia: 1.0e-3}
connections:
  mesh: {gear: {A: 50 mm, B: 40 mm}, stiffness: 2.0e8, element: {type: backlash, half_gap: 20 um}}
  shaft: {ground: B, stiffness: 1.0e5}
damping: {modal_ratio: 0.04}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 60}]}
";

/// The flagship pair, case 1.
pub const PAIR: &str = "
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {mesh_1: {type: backlash, half_gap: 1.0}, mesh_2: {type: backlash, half_gap: 0.1}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0], sin: [0, 0]}]}
";

pub struct Quiet;
impl Control for Quiet {}

pub fn load(model: &str, analyses: &str, folder: &Path) -> Result<Study, String> {
    let file = folder.join("model.yaml");
    std::fs::write(&file, format!("{model}\nanalyses:\n{analyses}\n")).unwrap();
    Study::load(&file, &[], &[]).map_err(|e| e.to_string())
}

pub fn run_with(model: &str, analyses: &str, jobs: usize, control: &dyn Control) -> Vec<Report> {
    let folder = tempfile::tempdir().unwrap();
    let study = load(model, analyses, folder.path()).unwrap();
    let settings = RunSettings {
        out: folder.path().join("out"),
        figures: vec![],
        jobs,
    };
    study.run(&settings, control).unwrap().reports
}

pub fn run(model: &str, analysis: &str) -> Report {
    run_with(model, &format!("  it: {analysis}"), 1, &Quiet).remove(0)
}

pub fn refusal(model: &str, analysis: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    load(model, &format!("  it: {analysis}"), folder.path())
        .err()
        .unwrap()
}

pub fn floats(table: &Table, name: &str) -> Vec<f64> {
    match &table
        .column(name)
        .unwrap_or_else(|| panic!("no column {name}"))
        .values
    {
        Values::Float(list) => list.clone(),
        Values::Integer(list) => list.iter().map(|x| *x as f64).collect(),
        Values::Text(_) => panic!("{name} holds words"),
    }
}

pub fn texts(table: &Table, name: &str) -> Vec<String> {
    match &table.column(name).unwrap().values {
        Values::Text(list) => list.clone(),
        _ => panic!("{name} holds numbers"),
    }
}

pub fn names(table: &Table) -> Vec<&str> {
    table.columns.iter().map(|c| c.name.as_str()).collect()
}

pub fn main_table(report: &Report) -> &Table {
    report.table("").unwrap()
}
