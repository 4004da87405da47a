//! Models given as text, run through the library without writing results.

#![allow(dead_code)] // every test binary uses a part of it

use gearlash::report::{Report, Values};
use gearlash::study::Study;
use std::sync::atomic::AtomicBool;

/// The main table of an analysis.
pub struct Results {
    pub report: Report,
}

impl Results {
    pub fn rows(&self) -> usize {
        self.report.table("").unwrap().rows()
    }

    /// The number in a column and row; an empty cell is NaN.
    #[track_caller]
    pub fn value(&self, column: &str, row: usize) -> f64 {
        let table = self.report.table("").unwrap();
        let column = table
            .column(column)
            .unwrap_or_else(|| panic!("no column {column}"));
        match &column.values {
            Values::Float(list) => list[row],
            Values::Integer(list) => list[row] as f64,
            Values::Text(list) => panic!("{} holds texts such as {}", column.name, list[row]),
        }
    }

    /// All numeric columns whose name starts with one of the words.
    pub fn names(&self, kinds: &[&str]) -> Vec<String> {
        let table = self.report.table("").unwrap();
        let names = table.columns.iter().map(|c| c.name.clone());
        names
            .filter(|name| kinds.iter().any(|kind| name.starts_with(kind)))
            .collect()
    }
}

/// Loads a model text.
#[track_caller]
pub fn load(text: &str) -> Study {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.yaml");
    std::fs::write(&path, text).unwrap();
    Study::load(&path, &[], &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs all analyses of a model text; none may end early.
#[track_caller]
pub fn run(text: &str) -> Vec<Results> {
    let reports = load(text).reports(&AtomicBool::new(false)).unwrap();
    for report in &reports {
        assert_eq!(report.ended_early, None, "{}", report.name);
    }
    reports
        .into_iter()
        .map(|report| Results { report })
        .collect()
}
