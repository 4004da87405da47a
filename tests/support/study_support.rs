//! Studies that run long enough to be disturbed, and looks into their journals.

#![allow(dead_code)] // every test binary uses a part of it

use crate::program::Place;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A study with a number of runs of some milliseconds each.
pub fn study(count: u64) -> String {
    format!(
        "schema: 1
name: one mesh
reduced:
  stiffness: [[1]]
  damping: {{modal_ratio: 0.05}}
  elements: {{mesh: {{type: backlash, half_gap: 1.0}}}}
  loads: {{mean: [0.5], harmonics: [{{order: 1, cos: [0.25]}}]}}
analyses:
  study:
    type: parameter_study
    title: Tolerances
    caption: What the gap does.
    sample:
      count: {count}
      seed: 11
      parameters:
        mesh.half_gap: {{distribution: normal, mean: 1.0, deviation: 0.2, low: 0.2}}
        damping.modal_ratio: {{distribution: uniform, low: 0.03, high: 0.07}}
    analysis: {{type: frequency_response, from: 1.4, to: 0.6, harmonics: 5}}
    collect:
      peak: {{column: rms.mesh, reduce: max}}
      peak_at: {{column: rms.mesh, reduce: argmax}}
      first_fold: {{table: events, column: omega, reduce: first, where: {{kind: fold}}}}
"
    )
}

/// The table of an undisturbed run on one thread, which everything else is compared with.
pub fn undisturbed(place: &Place) -> String {
    place
        .run(&["run", "m.yaml", "--jobs", "1", "--out", "undisturbed"])
        .ends_with(0);
    place.read("undisturbed/study.csv")
}

/// The program, started and left alone.
pub fn start(place: &Place, arguments: &[&str]) -> Child {
    Command::new(assert_cmd::cargo::cargo_bin("gearlash"))
        .current_dir(place.folder.path())
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The journals in a folder.
pub fn journals(place: &Place, folder: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(place.path(folder)) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|e| e == "journal"))
        .collect();
    paths.sort();
    paths
}

/// Numbers of the runs in the only journal of a folder, in its order; the last line is left out when it is torn.
pub fn journalled(place: &Place, folder: &str) -> Vec<u64> {
    let [path] = &journals(place, folder)[..] else {
        return Vec::new();
    };
    // A study that ends in between takes its journal away.
    let Ok(text) = std::fs::read_to_string(path) else {
        return Vec::new();
    };
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let number = |line: &str| line[9..].split(',').next().unwrap().parse().unwrap();
    whole.lines().skip(1).map(number).collect()
}

/// Waits until the journal of a folder has a number of runs.
#[track_caller]
pub fn wait_for(place: &Place, folder: &str, runs: usize, child: &mut Child) {
    let began = Instant::now();
    while journalled(place, folder).len() < runs && child.try_wait().unwrap().is_none() {
        assert!(began.elapsed() < Duration::from_secs(60), "nothing happens");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Ctrl-C.
pub fn interrupt(child: &Child) {
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
}

/// What became of it.
pub fn end(child: Child) -> Output {
    child.wait_with_output().unwrap()
}
