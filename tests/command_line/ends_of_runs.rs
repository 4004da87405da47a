//! How runs in the time domain end before their time, through the real binary: the reason, the exit status, what is on disk.

use crate::program::{Ended, Place};

/// Negative damping: the motion grows beyond all bounds.
const GROWING: &str = "\
schema: 1
reduced:
  stiffness: [[1]]
  damping: {matrix: [[-20]]}
  elements: {spring: {type: linear}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.3]}]}
analyses:
";

/// A load below the preload: the joint rests on its middle, where DOPRI5 chatters.
const STICKING: &str = "\
schema: 1
reduced:
  stiffness: [[1]]
  damping: {modal_ratio: 0.05}
  elements: {joint: {type: preloaded, half_gap: 0, preload: 0.5}}
  loads: {mean: [0.1], harmonics: [{order: 1, cos: [0.05]}]}
analyses:
";

/// An attraction without bound: the motion falls into q = 1 with a velocity beyond all bounds.
const FALLING: &str = "\
schema: 1
reduced:
  stiffness: [[1]]
  damping: {modal_ratio: 0.05}
  elements: {magnet: {type: expression, force: -1/(1 - q)^2}}
  loads: {mean: [0], harmonics: [{order: 1, cos: [0.05]}]}
analyses:
";

const HISTORY: &str =
    "  it: {type: time_history, at: 0.1, periods: 9, samples_per_period: 4, initial: {q: [0.3]}}\n";
const MAP: &str =
    "  it: {type: poincare_map, at: 0.1, transient: 0, periods: 9, initial: {q: [0.3]}}\n";
const DIAGRAM: &str = "  it: {type: bifurcation_diagram, from: 0.1, to: 0.2, points: 3, transient: 0, periods: 9, initial: {q: [0.3]}}\n";

/// Runs a model with one analysis, which ends early for a reason.
fn ends_early(text: &str, reason: &str) -> Place {
    let place = Place::with(text);
    let ended: Ended = place.run(&["run", "m.yaml", "--out", "out"]).ends_with(1);
    let ended = ended.says(&["ended early: it:", reason]);
    assert!(ended.out.contains("ended early"), "{}", ended.out);
    let told = place.json("out/it.json")["ended_early"].to_string();
    assert!(told.contains(reason), "{told}");
    let names = place.names("out");
    for name in [
        "it.csv",
        "it.json",
        "it.svg",
        "manifest.json",
        "report.html",
    ] {
        assert!(names.iter().any(|n| n == name), "{name} in {names:?}");
    }
    place
}

#[test]
fn a_divergence() {
    for integrator in ["exact", "dopri5"] {
        for analysis in [HISTORY, MAP, DIAGRAM] {
            let analysis =
                analysis.replace("at: 0.1", &format!("integrator: {integrator}, at: 0.1"));
            let analysis =
                analysis.replace("from: 0.1", &format!("integrator: {integrator}, from: 0.1"));
            ends_early(
                &format!("{GROWING}{analysis}"),
                "the state is not finite in period",
            );
        }
    }
}

#[test]
fn what_was_reached_is_written() {
    // Grows by e^(0.3 T) only: some periods fit into the numbers.
    let text = GROWING.replace("[[-20]]", "[[-0.6]]");
    let map = MAP.replace("periods: 9", "periods: 900");
    let place = ends_early(&format!("{text}{map}"), "the state is not finite in period");
    let periods = place.column("out/it.csv", "period");
    assert!(
        periods.len() > 10 && periods.len() < 900,
        "{}",
        periods.len()
    );
    let wanted: Vec<f64> = (1..=periods.len()).map(|k| k as f64).collect();
    assert_eq!(periods, wanted);
}

#[test]
fn a_collapse_of_the_step() {
    for analysis in [HISTORY, MAP] {
        // The series flow names the place: q = 1, where the formula divides by zero.
        for what in [
            "magnet: a force is not analytic",
            "deformation 9.99",
            " at T = ",
        ] {
            ends_early(&format!("{FALLING}{analysis}"), what);
        }
        let analysis = analysis.replace("at: 0.1", "integrator: dopri5, at: 0.1");
        ends_early(
            &format!("{FALLING}{analysis}"),
            "the step fell below the resolution of the time",
        );
    }
}

#[test]
fn chatter() {
    for analysis in [HISTORY, MAP] {
        let analysis = analysis.replace("at: 0.1", "integrator: dopri5, at: 0.1");
        ends_early(
            &format!("{STICKING}{analysis}"),
            "too many switches in one period (chatter)",
        );
    }
}

#[test]
fn a_diagram_goes_on_behind_values_that_fail() {
    // Damping rises from -20 through -10 to 0.5: the last value has a motion.
    let diagram = "  it: {type: bifurcation_diagram, parameter: matrix.0.0, at: 0.5, from: -20, to: 0.5, points: 3, \
                   transient: 40, periods: 9}\n";
    let place = ends_early(
        &format!("{GROWING}{diagram}"),
        "run 0 at -2.000000e1: the state is not finite in period",
    );
    let summary = place.json("out/it.json");
    assert_eq!(summary["stops"].as_array().unwrap().len(), 2);
    let parameter = place.column("out/it.csv", "parameter");
    assert_eq!(parameter.iter().filter(|x| **x == 0.5).count(), 9);
    let labels = place.table("out/it.summary.csv");
    assert_eq!(labels.last().unwrap()[2], "period 1");
}

/// A finished analysis and a long one: Ctrl-C leaves the first, and what there is of the second.
#[cfg(unix)]
#[test]
fn an_interruption_keeps_what_is_finished() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let linear = GROWING.replace("[[-20]]", "[[0.1]]");
    let place = Place::with(&format!(
        "{linear}  quick: {{type: modes, points: 3}}\n  \
         long: {{type: poincare_map, at: 0.1, integrator: dopri5, transient: 0, periods: 10000000, lyapunov: false}}\n"
    ));
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("gearlash"))
        .current_dir(place.folder.path())
        .args(["run", "m.yaml", "--out", "out", "--jobs", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let began = Instant::now();
    let patience = Duration::from_secs(30);
    while !place.path("out/quick.json").exists() {
        assert!(
            began.elapsed() < patience,
            "the quick analysis does not end"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(200));
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
    while child.try_wait().unwrap().is_none() {
        if began.elapsed() > patience {
            child.kill().unwrap();
            panic!("the program does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("interrupted"), "{said}");
    let names = place.names("out");
    for name in [
        "quick.csv",
        "quick.json",
        "long.csv",
        "long.json",
        "manifest.json",
        "report.html",
    ] {
        assert!(names.iter().any(|n| n == name), "{name} in {names:?}");
    }
    assert!(!names.iter().any(|n| n.ends_with(".part")), "{names:?}");
    let periods = place.column("out/long.csv", "period");
    assert!(!periods.is_empty() && periods.len() < 10_000_000);
    assert_eq!(periods.last().copied(), Some(periods.len() as f64));
    assert_eq!(
        place.json("out/long.json")["ended_early"],
        "run 0: interrupted"
    );
}
