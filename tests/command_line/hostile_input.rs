//! Input that means harm, through the real binary: refused, or run to an end with finite numbers, and soon.

use crate::program::{Ended, Place, REDUCED, TRAIN};

/// Seconds of CPU that one run may take here; measured far below, but the caches of a busy machine are cold.
#[cfg(unix)]
const PATIENCE: &str = "ulimit -t 10";
/// Room for one run, threads and program included: half a gigabyte of addresses.
#[cfg(unix)]
const ROOM: &str = "ulimit -v 524288";

/// Runs the program; one that takes too long is killed, so that it has no exit code.
fn limited(place: &Place, arguments: &[&str]) -> Ended {
    #[cfg(unix)]
    return place.run_after(PATIENCE, arguments);
    #[cfg(not(unix))]
    place.run(arguments)
}

#[track_caller]
fn timed(place: &Place, arguments: &[&str], what: &str) -> Ended {
    let ended = limited(place, arguments);
    let panic = ended.err.contains("panicked") || ended.err.contains("overflowed its stack");
    assert!(!panic, "{what}: {}", ended.err);
    ended
}

#[track_caller]
fn refused(text: &str, part: &str) {
    let what = &text[..text.len().min(40)];
    let place = Place::with(text);
    let ended = timed(&place, &["run", "m.yaml"], what);
    assert_eq!(ended.code, 2, "{what}: {}", ended.err);
    assert!(ended.err.contains(part), "{what}: {}", ended.err);
    assert!(
        ended.err.len() < 100_000,
        "{what}: {} bytes",
        ended.err.len()
    );
    assert_eq!(place.names("."), ["m.yaml"]);
}

#[test]
fn nesting() {
    for unit in ["[", "{a: ", "- ", "? "] {
        refused(&unit.repeat(20_000), "nested deeper than 64");
        refused(&format!("x-deep: {}", unit.repeat(20_000)), "m.yaml:1:");
    }
}

#[test]
fn alias_bombs() {
    let mut bomb = String::from("x-a0: &a0 [x, x, x, x, x, x, x, x, x]\n");
    for level in 1..30 {
        let aliases = vec![format!("*a{}", level - 1); 9].join(", ");
        bomb.push_str(&format!("x-a{level}: &a{level} [{aliases}]\n"));
    }
    refused(&bomb, "aliases repeat");
}

#[test]
fn a_hundred_megabytes() {
    let place = Place::with("");
    let file = std::fs::File::create(place.path("m.yaml")).unwrap();
    file.set_len(100_000_000).unwrap();
    let ended = timed(&place, &["run", "m.yaml"], "100 MB of zeros");
    ended.ends_with(2).says(&["16 MiB"]);
}

#[test]
fn millions_of_values() {
    let list = |count: usize| format!("x-many: [{}0]\n{REDUCED}", "0,".repeat(count - 1));
    refused(&list(4_000_001), "more than 4000000 values");
    let place = Place::with(&list(3_900_000));
    timed(&place, &["check", "m.yaml"], "3.9 million values").ends_with(0);
}

#[test]
fn a_million_connections() {
    let many = |count: usize| {
        let list: String = (0..count)
            .map(|k| format!(" c{k}: {{ground: A, stiffness: 1}}\n"))
            .collect();
        format!("bodies: {{A: {{inertia: 1}}}}\nconnections:\n{list}")
    };
    refused(&many(1_000_000), "16 MiB");
    refused(&many(300_000), "found 300000, wanted at most 4096");
}

#[test]
fn hundreds_of_thousands_of_mistakes() {
    let list: String = (0..300_000).map(|k| format!(" b{k}: 1\n")).collect();
    refused(
        &format!("bodies:\n{list}"),
        "found 300000, wanted at most 8192",
    );
    refused(
        &format!("{}bodies: {{}}\n", list.replace(" b", "b")),
        "more mistakes",
    );
    refused(
        &format!("bodies: {{A: {{inertia: 1}}}}\nloads:\n{list}"),
        "more mistakes",
    );
}

/// What is refused needs little room.
#[cfg(unix)]
#[test]
fn little_memory() {
    for text in [
        "[".repeat(16 << 20),
        format!("x: [{}0]\n", "0,".repeat(4_000_001)),
        "- 0\n".repeat(4_100_000),
        format!("bodies:\n{}", " a: 1\n".repeat(2_000_000)),
        format!("x: \"{}\"\n", "y".repeat(16_000_000)),
    ] {
        let what = text[..20].to_owned();
        let ended = Place::with(&text).run_after(ROOM, &["check", "m.yaml"]);
        assert_eq!(ended.code, 2, "{what}: {}", ended.err);
    }
}

#[test]
fn deep_circles_of_files() {
    let place = Place::with("extends: b.yaml\n");
    place.write("b.yaml", "extends: c.yaml\n");
    place.write("c.yaml", "extends: m.yaml\n");
    let ended = timed(&place, &["run", "m.yaml"], "circle");
    ended.ends_with(2).says(&["extends"]);
}

/// Every law, series and option that takes a number.
const EVERYTHING: &str = "\
bodies:
  A: {inertia: 1.0e-3}
  B: {inertia: 2.0e-3}
  C: {inertia: 1.5e-3}
connections:
  mesh_1:
    gear: {A: 0.05, B: 0.04}
    stiffness: 2.0e8
    damping: 20.0
    element: {type: backlash, half_gap: 1.0e-5, impact_damping: 0.1}
    transmission_error: {mean: 0.0, harmonics: [{order: 2, amplitude: 1.0e-6, phase: 0.3}]}
    stiffness_variation: {rectangular: {high: 1.1, low: 0.9, duty: 0.5, phase: 0.2}}
    length: 2.0e-5
  shaft:
    acts_on: {B: 1.0, C: -1.0}
    stiffness: 3.0e5
    element: {type: piecewise_linear, breakpoints: [-1.0e-4, 1.0e-4], slopes: [1.0, 0.2, 1.0]}
  stop:
    ground: C
    stiffness: 1.0e4
    element: {type: one_sided, gap: 1.0e-4}
    base_order: 3
  spring:
    ground: A
    stiffness: 1.1e4
    element: {type: cubic, cubic: 2.0}
damping: {modal_ratio: 0.04, stiffness_proportional: 1.0e-8}
loads:
  A: {mean: 10.0, harmonics: [{order: 1, amplitude: 5.0, phase: 0.1}]}
  C: {mean: 8.0}
scaling: {frequency: 7000.0, length: 3.0e-5}
report: {units: nondimensional}
analyses:
  modes: {type: modes, effective_stiffness: [0.1, 0.9], points: 5}
  response: {type: frequency_response, from: 3.0, to: 2.9, harmonics: 3, step: 0.02, max_step: 0.1, min_step: 1.0e-8, tolerance: 1.0e-9, marks: [2.95]}
";

/// A branch over an enormous range is honest work; what is asked here is what one point does.
const FEW_POINTS: &str = "analyses.response.max_points=20";

/// Places of the plain numbers in a text.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let mut list = Vec::new();
    let mut at = 0;
    for token in text.split_inclusive(|c: char| " ,[]{}:\n".contains(c)) {
        let word = token.trim_end_matches(|c: char| " ,[]{}:\n".contains(c));
        if word.parse::<f64>().is_ok() {
            list.push(at..at + word.len());
        }
        at += token.len();
    }
    list
}

/// Puts a value in every numeric place in turn, runs, and looks at what comes out.
#[track_caller]
fn put_everywhere(value: &str, is_always_wrong: bool) {
    let mut faults = Vec::new();
    for text in [REDUCED, TRAIN, EVERYTHING] {
        let places = numbers(text);
        assert!(places.len() >= 10);
        for range in places {
            let mut changed = text.to_owned();
            changed.replace_range(range.clone(), value);
            if let Err(fault) = outcome(&changed, is_always_wrong) {
                let line = text[..range.start].lines().count();
                let old = &text[range];
                let what = format!("{value} instead of {old} in line {line}: {fault}");
                println!("{what}");
                faults.push(what);
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Refused, or run to an end with finite numbers.
fn outcome(text: &str, is_always_wrong: bool) -> Result<(), String> {
    let place = Place::with(text);
    let ended = limited(&place, &["run", "m.yaml", "--quiet", "--set", FEW_POINTS]);
    let said = ended.err.as_str();
    let allowed: &[i32] = if is_always_wrong { &[2] } else { &[0, 1, 2] };
    if !allowed.contains(&ended.code) || said.contains("panicked") {
        return Err(format!("exit {}: {said}", ended.code));
    }
    if ended.code == 2 {
        let is_clean = place.names(".") == ["m.yaml"] && said.contains("error");
        return is_clean.then_some(()).ok_or(format!("unclean: {said}"));
    }
    for name in place.names("results/m") {
        if !name.ends_with(".csv") {
            continue;
        }
        let is_finite = |cell: &String| cell.parse::<f64>().map_or(true, f64::is_finite);
        for row in &place.table(&format!("results/m/{name}"))[1..] {
            if !row.iter().all(is_finite) {
                return Err(format!("{name}: {row:?}"));
            }
        }
    }
    Ok(())
}

#[test]
fn the_models_of_this_test_run() {
    for text in [REDUCED, TRAIN, EVERYTHING] {
        Place::with(text).run(&["run", "m.yaml"]).ends_with(0);
    }
}

#[test]
fn not_finite_in_every_numeric_place() {
    for value in [".nan", "-.inf", "1e309"] {
        put_everywhere(value, true);
    }
}

#[test]
fn enormous_in_every_numeric_place() {
    put_everywhere("1e308", false);
    put_everywhere("-1e308", false);
}

#[test]
fn tiny_in_every_numeric_place() {
    put_everywhere("1e-308", false);
    put_everywhere("0", false);
}

#[test]
fn orders_beyond_all_samples_are_mistakes() {
    for (key, value) in [
        ("orders", "[1e308]"),
        ("orders", "[18446744073709551615]"),
        ("spectrum_to", "18446744073709551615"),
        ("spectrum_to", "9223372036854775808"),
    ] {
        let run_up = format!("type: run_up, from: 8 kHz, to: 9 kHz, duration: 1 s, {key}: {value}");
        let text = crate::program::TRAIN.split("analyses:").next().unwrap();
        let place = Place::with(&format!("{text}analyses: {{it: {{{run_up}}}}}\n"));
        place.run(&["check", "m.yaml"]).ends_with(2);
    }
}
