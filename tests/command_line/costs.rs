//! What a run takes is known before it is paid for: limits of numbers, estimates of memory and time, limits of the user.

use crate::program::{Place, REDUCED, TRAIN};
use std::time::{Duration, Instant};

/// The small model with other analyses.
fn with_analyses(text: &str) -> Place {
    let model = REDUCED.split("analyses:").next().unwrap();
    Place::with(&format!("{model}analyses:\n{text}"))
}

/// A chain whose coordinates are all coupled by modal damping.
fn chain(bodies: usize, analysis: &str) -> String {
    let list: String = (0..bodies)
        .map(|k| format!("  B{k}: {{inertia: 1e-3}}\n"))
        .collect();
    let shafts: String = (1..bodies)
        .map(|k| {
            let ends = format!("B{}, B{k}", k - 1);
            format!(
                "  c{k}: {{shaft: [{ends}], stiffness: 1e4 N m/rad, element: {{type: backlash, half_gap: 0.01 rad}}}}\n"
            )
        })
        .collect();
    format!(
        "schema: 1\nbodies:\n{list}connections:\n{shafts}damping: {{modal_ratio: 0.05}}\n\
         loads: {{B0: {{mean: 100 N m, harmonics: [{{order: 1, amplitude: 50 N m}}]}}, B{}: {{mean: -100 N m}}}}\n\
         report: {{units: nondimensional}}\nanalyses:\n{analysis}",
        bodies - 1
    )
}

#[test]
fn every_number_has_an_upper_limit() {
    let most = u64::MAX;
    for (analysis, key) in [
        (format!("type: modes, points: {most}"), "points"),
        ("type: modes, points: 1000000000".into(), "points"),
        (format!("type: effective_frequencies, amplitude: [0, 5], mean_displacement: 0, points: {most}"), "points"),
        (format!("type: time_history, at: 1, transient: {most}"), "transient"),
        (format!("type: time_history, at: 1, periods: {most}"), "periods"),
        (format!("type: time_history, at: 1, samples_per_period: {most}"), "samples_per_period"),
        (format!("type: poincare_map, at: 1, transient: {most}"), "transient"),
        (format!("type: poincare_map, at: 1, periods: {most}"), "periods"),
        (format!("type: bifurcation_diagram, from: 2, to: 1, points: 2, transient: {most}"), "transient"),
        (format!("type: bifurcation_diagram, from: 2, to: 1, points: {most}"), "points"),
        (format!("type: bifurcation_diagram, from: 2, to: 1, points: 2, seeds: {{count: {most}, seed: 1}}"), "seeds.count"),
        (format!("type: frequency_response, from: 2, to: 1, max_points: {most}"), "max_points"),
        (format!("type: frequency_response, from: 2, to: 1, harmonics: {most}"), "harmonics"),
        (format!("type: frequency_response, from: 2, to: 1, subharmonic: {most}"), "harmonics"),
        ("type: frequency_response, from: 2, to: 1, harmonics: 9223372036854775808, subharmonic: 2".into(), "harmonics"),
        (format!("type: frequency_response, from: 2, to: 1, method: integration, points: {most}"), "points"),
        (format!("type: frequency_response, from: 2, to: 1, method: integration, transient: {most}"), "transient"),
        (format!("type: frequency_response, from: 2, to: 1, branches: {{limit: {most}}}"), "branches.limit"),
    ] {
        let place = with_analyses(&format!("  it: {{{analysis}}}\n"));
        for command in ["check", "run"] {
            let ended = place.run(&[command, "m.yaml"]).ends_with(2);
            let told = format!("analyses.it.{key}");
            assert!(ended.err.contains(&told) && ended.err.contains("at most"), "{analysis}: {}", ended.err);
        }
        assert_eq!(place.names("."), ["m.yaml"]);
    }
}

#[test]
fn what_the_memory_does_not_hold_is_refused_with_its_size() {
    let a = "  a: {type: frequency_response, from: 2, to: 0.5, harmonics: 4096, max_points: 2}\n";
    let place = Place::with(&chain(
        30,
        &format!("{a}  good: {{type: modes, points: 3}}\n"),
    ));
    for command in ["check", "run"] {
        let ended = place
            .run(&[command, "m.yaml", "--set", "name=chain"])
            .ends_with(2);
        // (29 x 8193)^2 numbers, seven times.
        ended.says(&[
            "analyses.a.harmonics",
            "bytes",
            "reduce `harmonics`",
            "3.2 TB",
        ]);
    }
    assert_eq!(place.names("."), ["m.yaml"]);
    // The same question with a limit of the user.
    let a = "  a: {type: frequency_response, from: 2, to: 0.5, harmonics: 40, max_points: 2}\n";
    let place = Place::with(&chain(12, a));
    let ended = place
        .run(&["run", "m.yaml", "--memory-limit", "10MB"])
        .ends_with(2);
    ended.says(&["analyses.a.harmonics", "10 MB available"]);
    place
        .run(&["run", "m.yaml", "--memory-limit", "1 GiB"])
        .ends_with(1);
}

#[test]
fn slow_orders_count_like_subharmonics() {
    // A thousand revolutions in a period, 10 000 harmonics.
    let text = REDUCED.replace("order: 1,", "order: 1e-3,");
    let place = Place::with(&text);
    let ended = place.run(&["run", "m.yaml"]).ends_with(2);
    ended.says(&[
        "analyses.response.harmonics",
        "at most 4096",
        "1000 revolutions",
    ]);
}

#[cfg(unix)]
#[test]
fn limits_of_the_process_count() {
    let a = "  a: {type: frequency_response, from: 2, to: 0.5, harmonics: 300, max_points: 2}\n";
    let place = Place::with(&chain(12, a));
    let ended = place.run_after("ulimit -v 1000000", &["run", "m.yaml"]);
    assert_eq!(ended.code, 2, "{}", ended.err);
    ended.says(&["analyses.a.harmonics", "memory"]);
}

#[test]
fn what_takes_long_is_announced() {
    let place = with_analyses(
        "  it: {type: bifurcation_diagram, from: 2, to: 0.5, points: 10001, transient: 100000, periods: 200}\n",
    );
    let ended = place.run(&["check", "m.yaml"]).ends_with(0);
    assert!(
        ended.out.contains("warning: it: estimated time"),
        "{}",
        ended.out
    );
    assert!(ended.out.contains("reduce `transient`"), "{}", ended.out);
    let began = Instant::now();
    let ended = place
        .run(&["run", "m.yaml", "--time-limit", "1s"])
        .ends_with(1);
    assert!(began.elapsed() < Duration::from_secs(10));
    ended.says(&[
        "warning: it: estimated time",
        "the time limit of 1.0 s was reached",
    ]);
    let told = place.json("results/m/it.json")["ended_early"].to_string();
    assert!(
        told.contains("time limit") && place.path("results/m/manifest.json").exists(),
        "{told}"
    );
}

#[test]
fn the_usual_runs_are_not_announced() {
    for text in [REDUCED, TRAIN] {
        let ended = Place::with(text).run(&["check", "m.yaml"]).ends_with(0);
        assert!(!ended.out.contains("estimated"), "{}", ended.out);
    }
}

#[test]
fn an_inertia_in_a_wrong_unit_does_not_take_hours() {
    let text = TRAIN
        .replace(
            "A: {inertia: 1.0e-3}",
            "A: {inertia: 1.0e-3}\n  P: {inertia: 1e-14}",
        )
        .replace(
            "damping:",
            "  shaft: {shaft: [A, P], stiffness: 1e5, damping: 0}\ndamping:",
        )
        .replace(
            "harmonics: 5",
            "harmonics: 5, methods: [galerkin, shooting]",
        );
    let place = Place::with(&text);
    let ended = place.run(&["run", "m.yaml"]).ends_with(2);
    ended.says(&[
        "analyses.response.max_steps",
        "wrong unit",
        "raise `max_steps`",
        "Hz",
    ]);
}

#[test]
fn limits_are_written_with_units() {
    let place = Place::with(REDUCED);
    for limit in [
        ["--time-limit", "2h"],
        ["--time-limit", "90"],
        ["--memory-limit", "3.5 GB"],
    ] {
        place
            .run(&["run", "m.yaml", limit[0], limit[1]])
            .ends_with(0);
    }
    for limit in [
        ["--time-limit", "0"],
        ["--time-limit", "2 kg"],
        ["--memory-limit", "0GB"],
        ["--memory-limit", "a"],
    ] {
        place
            .run(&["run", "m.yaml", limit[0], limit[1]])
            .ends_with(2)
            .says(&["wanted a number > 0"]);
    }
}
