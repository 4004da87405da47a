//! Signals that end a run: what is finished and the finished part are on disk, soon, whatever is being computed.

use crate::program::{Place, REDUCED};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Analyses that would take hours, each in another kind of loop.
const LONG: &[(&str, &str)] = &[
    (
        "sweep",
        "type: bifurcation_diagram, from: 2, to: 0.5, points: 20001",
    ),
    (
        "one_period",
        "type: time_history, at: 1e-12, periods: 2, samples_per_period: 4",
    ),
    (
        "one_period_dopri5",
        "type: time_history, at: 1e-6, integrator: dopri5, periods: 2, samples_per_period: 4",
    ),
    (
        "transient",
        "type: poincare_map, at: 1, transient: 1000000000, periods: 1",
    ),
    (
        "scattered",
        "type: bifurcation_diagram, from: 2, to: 0.5, points: 1000, seeds: {count: 50, seed: 1}",
    ),
    (
        "shooting",
        "type: frequency_response, from: 0.0002, to: 0.0001, method: shooting, max_steps: 1000000000",
    ),
    (
        "attractors",
        "type: frequency_response, from: 2, to: 0.5, method: integration, transient: 1000000",
    ),
    (
        "fine",
        "type: frequency_response, from: 2, to: 0.5, max_step: 1e-6, max_points: 1000000",
    ),
];

/// A run that gets a signal once its quick analysis is on disk; exit status and the time that the end took.
fn signalled(place: &Place, signal: &str, front: &[&str]) -> (Option<i32>, Duration, String) {
    let binary = assert_cmd::cargo::cargo_bin("gearlash");
    let mut words: Vec<&str> = front.to_vec();
    let binary = binary.to_str().unwrap().to_owned();
    words.extend([
        binary.as_str(),
        "run",
        "m.yaml",
        "--out",
        "out",
        "--jobs",
        "2",
    ]);
    let mut child = Command::new(words[0])
        .current_dir(place.folder.path())
        .args(&words[1..])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let began = Instant::now();
    while !place.path("out/quick.json").exists() && child.try_wait().unwrap().is_none() {
        assert!(
            began.elapsed() < Duration::from_secs(60),
            "the quick analysis does not end"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(700));
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
    let began = Instant::now();
    while child.try_wait().unwrap().is_none() && began.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let took = began.elapsed();
    let _ = child.kill();
    let output = child.wait_with_output().unwrap();
    (
        output.status.code(),
        took,
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

/// Time for an end: two seconds of the program's, more of a machine that has other things to do.
const PATIENCE: Duration = Duration::from_secs(8);

fn model(analysis: &str) -> Place {
    let front = REDUCED.split("analyses:").next().unwrap();
    Place::with(&format!(
        "{front}analyses:\n  quick: {{type: modes, points: 3}}\n  long: {{{analysis}}}\n"
    ))
}

#[test]
fn every_signal_keeps_what_is_finished() {
    for (signal, status) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let place = model(LONG[0].1);
        let (code, took, said) = signalled(&place, signal, &[]);
        assert_eq!(code, Some(status), "{signal}: {said}");
        assert!(took < PATIENCE, "{signal}: {took:?}");
        for name in [
            "quick.csv",
            "long.csv",
            "long.json",
            "manifest.json",
            "report.html",
        ] {
            assert!(
                place.path(&format!("out/{name}")).exists(),
                "{signal}: {name}"
            );
        }
        assert!(place.table("out/long.csv").len() > 100);
        let told = place.json("out/long.json")["ended_early"].to_string();
        assert!(told.contains("interrupted after"), "{told}");
    }
}

#[test]
fn every_long_loop_hears_of_it() {
    for (name, analysis) in LONG {
        let place = model(analysis);
        let (code, took, said) = signalled(&place, "-TERM", &[]);
        assert_eq!(code, Some(143), "{name}: {said}");
        assert!(took < PATIENCE, "{name}: {took:?}");
        let manifest = place.read("out/manifest.json");
        assert!(
            manifest.contains("quick.csv") && manifest.contains("long.csv"),
            "{name}: {said}"
        );
        assert!(!said.contains("panicked"), "{said}");
        let left = place
            .names("out")
            .into_iter()
            .filter(|n| n.ends_with(".part"));
        assert_eq!(left.count(), 0, "{name}");
    }
}

#[test]
fn a_signal_that_is_ignored_stays_ignored() {
    let place = model("type: bifurcation_diagram, from: 2, to: 0.5, points: 3000, transient: 300");
    let front = ["sh", "-c", "trap '' HUP; exec \"$0\" \"$@\""];
    let (code, _, said) = signalled(&place, "-HUP", &front);
    assert_eq!(code, Some(0), "{said}");
}
