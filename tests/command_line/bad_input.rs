//! Mistakes of a user through the real binary: what is said and where, exit status 2, nothing written.

use crate::program::{Place, REDUCED, TRAIN};

/// Replaces one part of a right model; the program must refuse it with every one of `parts`.
#[track_caller]
fn refused(model: &str, part: &str, by: &str, parts: &[&str]) {
    assert!(model.contains(part), "{part}");
    refused_text(&model.replacen(part, by, 1), parts);
}

#[track_caller]
fn refused_text(text: &str, parts: &[&str]) {
    let place = Place::with(text);
    for command in ["run", "check"] {
        place.run(&[command, "m.yaml"]).ends_with(2).says(parts);
    }
    assert_eq!(place.names("."), ["m.yaml"], "nothing is written");
}

#[test]
fn the_models_are_right() {
    for text in [REDUCED, TRAIN] {
        Place::with(text).run(&["check", "m.yaml"]).ends_with(0);
    }
}

#[test]
fn unknown_keys_have_a_nearest_name() {
    let cases = [
        (
            "damping:",
            "dampin:",
            "m.yaml:11:1",
            "did you mean `damping`?",
        ),
        (
            "stiffness:",
            "stifness:",
            "m.yaml:9:5",
            "did you mean `stiffness`?",
        ),
        (
            "half_gap:",
            "halfgap:",
            "m.yaml:10:31",
            "did you mean `half_gap`?",
        ),
        (
            "inertia: 1.0e-3}",
            "inertai: 1.0e-3}",
            "m.yaml:4:7",
            "did you mean `inertia`?",
        ),
        (
            "harmonics: 5",
            "harmonic: 5",
            "m.yaml:17:66",
            "did you mean `harmonics`?",
        ),
        (
            "amplitude:",
            "amplitud:",
            "m.yaml:13:45",
            "did you mean `amplitude`?",
        ),
    ];
    for (part, by, place, help) in cases {
        let key = by.split(':').next().unwrap();
        refused(TRAIN, part, by, &[key, place, help]);
    }
}

#[test]
fn unknown_names_have_a_nearest_name() {
    refused(
        TRAIN,
        "type: backlash",
        "type: backlsh",
        &["m.yaml:10:21", "backlsh", "did you mean `backlash`?"],
    );
    refused(TRAIN, "gear: {A", "gear: {C", &["m.yaml:8:12", "`C`"]);
    refused(
        TRAIN,
        "  B: {mean: 100}",
        "  D: {mean: 100}",
        &["m.yaml:14:3", "`D`"],
    );
    refused(
        TRAIN,
        "type: frequency_response",
        "type: frequency_respnse",
        &[
            "m.yaml:17:20",
            "no analysis type is called `frequency_respnse`",
            "did you mean `frequency_response`?",
        ],
    );
    refused(
        TRAIN,
        "harmonics: 5",
        "method: galerkn",
        &["m.yaml:17:", "galerkn", "galerkin"],
    );
}

#[test]
fn duplicate_keys() {
    let twice = "  A: {inertia: 1.0e-3}\n  A: {inertia: 1.0e-3}\n";
    refused(
        TRAIN,
        "  A: {inertia: 1.0e-3}\n",
        twice,
        &["m.yaml:5:3", "`A`"],
    );
    refused(
        TRAIN,
        "half_gap: 50 um",
        "half_gap: 50 um, half_gap: 5 um",
        &["m.yaml:10:", "half_gap"],
    );
}

#[test]
fn numbers_that_are_none() {
    for word in [".nan", ".inf", "-.inf", "1e999", "nan", "many"] {
        refused(
            TRAIN,
            "2.4e8",
            word,
            &["m.yaml:9:16", "connections.mesh.stiffness"],
        );
        refused(
            REDUCED,
            "half_gap: 1.0",
            &format!("half_gap: {word}"),
            &["m.yaml:6:", "half_gap"],
        );
        refused(
            REDUCED,
            "from: 2.0",
            &format!("from: {word}"),
            &["m.yaml:10:", "analyses.response"],
        );
    }
}

#[test]
fn wrong_units_say_which_are_right() {
    refused(
        TRAIN,
        "1.0e-3 kg m^2",
        "1.0e-3 kg m",
        &["m.yaml:5:", "bodies.B.inertia", "kg m", "kg m^2"],
    );
    refused(
        TRAIN,
        "50 um}",
        "50 deg}",
        &["m.yaml:10:", "half_gap", "deg"],
    );
    refused(
        TRAIN,
        "from: 9 kHz",
        "from: 9 km",
        &["m.yaml:17:", "from", "km"],
    );
    refused(
        TRAIN,
        "100 N m,",
        "100 furlong,",
        &["m.yaml:13:", "furlong"],
    );
    refused(
        REDUCED,
        "half_gap: 1.0",
        "half_gap: 1 mm",
        &["m.yaml:6:", "half_gap", "mm", "nondimensional"],
    );
    refused(
        REDUCED,
        "from: 2.0",
        "from: 2 Hz",
        &["m.yaml:10:", "analyses.response.from", "nondimensional"],
    );
    refused(
        TRAIN,
        "from: 9 kHz",
        "from: 9000",
        &[
            "m.yaml:17:46",
            "analyses.response.from",
            "bare number 9000 is ambiguous",
            "9000 Hz",
        ],
    );
}

#[test]
fn negative_values() {
    refused(
        TRAIN,
        "inertia: 1.0e-3}",
        "inertia: -1.0e-3}",
        &["m.yaml:4:16", "bodies.A.inertia", "found -1.0e-3", "> 0"],
    );
    refused(
        TRAIN,
        "half_gap: 50 um",
        "half_gap: -50 um",
        &["m.yaml:10:", "half_gap", ">= 0"],
    );
    refused(
        TRAIN,
        "2.4e8",
        "0",
        &["m.yaml:9:16", "connections.mesh.stiffness", "> 0"],
    );
    refused(TRAIN, "9 kHz", "-9 kHz", &["m.yaml:17:", "from", "> 0"]);
}

#[test]
fn empty_systems() {
    refused_text("", &["m.yaml", "empty"]);
    refused_text("schema: 1\nname: x\n", &["nothing to compute"]);
    refused_text("bodies: {}\nconnections: {}\n", &["m.yaml:1:", "bodies"]);
    refused(
        REDUCED,
        "elements: {mesh: {type: backlash, half_gap: 1.0}}",
        "elements: {}",
        &["m.yaml:6:", "reduced.elements"],
    );
}

#[test]
fn loads_on_a_body_that_nobody_holds() {
    let free = TRAIN
        .replace("connections:\n", "  F: {inertia: 1}\nconnections:\n")
        .replace("report:", "  F: {mean: 1}\nreport:");
    refused_text(&free, &["m.yaml:16:3", "loads.F", "`F`"]);
}

#[test]
fn analyses_are_checked_before_anything_runs() {
    refused(
        REDUCED,
        "marks: [1.9]",
        "marks: [1.9, 2.5]",
        &[
            "m.yaml:10:",
            "analyses.response.marks.1",
            "2.5 lies outside the range from 2 to 1.6",
        ],
    );
    refused(
        REDUCED,
        "marks: [1.9]",
        "set: {reduced.elements.mush.half_gap: 2}",
        &[
            "m.yaml:10:",
            "reduced.elements.mush.half_gap",
            "did you mean `mesh`?",
        ],
    );
    refused(
        REDUCED,
        "marks: [1.9]",
        "set: {reduced.elements.mesh.half_gap: -2}",
        &["m.yaml:10:", "half_gap", ">= 0"],
    );
    refused(
        REDUCED,
        "points: 3",
        "points: x",
        &["m.yaml:9:", "analyses.lines.points"],
    );
    refused(
        REDUCED,
        "type: modes, ",
        "",
        &["m.yaml:9:", "analyses.lines", "needs a `type`"],
    );
    refused(
        REDUCED,
        "harmonics: 5",
        "harmonics: 0",
        &["m.yaml:10:", "analyses.response.harmonics"],
    );
    refused(
        REDUCED,
        "harmonics: 5",
        "samples: 1000",
        &["m.yaml:10:", "power of two"],
    );
    refused(
        REDUCED,
        "to: 1.6",
        "to: 2.0",
        &["m.yaml:10:", "analyses.response"],
    );
    refused(
        REDUCED,
        "lines:",
        "manifest:",
        &["m.yaml:9:3", "would overwrite"],
    );
    refused(REDUCED, "lines:", "a b:", &["m.yaml:9:3", "a b"]);
}

#[test]
fn circles_and_missing_bases() {
    refused_text("extends: m.yaml\n", &["m.yaml:1:", "extends"]);
    refused_text("extends: none.yaml\n", &["m.yaml:1:", "none.yaml"]);
}

#[test]
fn independent_mistakes_are_reported_in_one_go() {
    let text = TRAIN
        .replace("inertia: 1.0e-3}", "inertia: -1.0e-3}")
        .replace("half_gap", "halfgap")
        .replace("gear: {A", "gear: {C")
        .replace("harmonics: 5", "harmonic: 5")
        .replace("report:", "reprot:");
    refused_text(
        &text,
        &[
            "m.yaml:4:16",
            "m.yaml:8:12",
            "m.yaml:10:31",
            "m.yaml:15:1",
            "m.yaml:17:66",
            "did you mean `half_gap`?",
            "did you mean `report`?",
        ],
    );
}

#[test]
fn a_mistake_in_a_base_file_names_that_file() {
    let place = Place::with("extends: parts/base.yaml\nname: own\n");
    place.write("parts/base.yaml", &TRAIN.replace("2.4e8", "-1"));
    place
        .run(&["run", "m.yaml"])
        .ends_with(2)
        .says(&["base.yaml:9:16", "connections.mesh.stiffness"]);
}
