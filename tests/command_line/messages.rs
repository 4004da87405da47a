//! Mistakes that users make, and what they read: each message names the place, what is wrong, and the next move.

use crate::program::{Place, TRAIN};

/// Text of a good model, text of the user, and parts of the message; the first part is the place.
const CASES: &[(&str, &str, &[&str])] = &[
    (
        "{inertia: 1.0e-3}",
        "{inertia: 1,0e-3}",
        &[
            "m.yaml:4:18",
            "unknown key `0e-3`",
            "write decimals with a point",
        ],
    ),
    (
        "stiffness: 2.4e8",
        "stiffness 2.4e8",
        &["m.yaml:9:5", "followed by `:` and a space"],
    ),
    (
        "stiffness: 2.4e8",
        "stiffness:2.4e8",
        &["m.yaml:9:5", "followed by `:` and a space"],
    ),
    (
        "    stiffness: 2.4e8",
        "   stiffness: 2.4e8",
        &["m.yaml:9:4", "in one column"],
    ),
    (
        "name: pair",
        "name: pair: two",
        &["m.yaml:2:11", "quote a text"],
    ),
    (
        "  B: {inertia: 1.0e-3 kg m^2}",
        "  B: {inertia: 1.0e-3 kg m^2",
        &["m.yaml:6:12", "a closing bracket or a comma is missing"],
    ),
    (
        "  B: {inertia",
        "\tB: {inertia",
        &["m.yaml:5:2", "indent with spaces"],
    ),
    (
        "stiffness: 2.4e8",
        "stiffness: 2.4e8 Nm",
        &[
            "m.yaml:9:16",
            "a moment [N m]; wanted a stiffness [N/m], for example `2.4e8 N/m`",
        ],
    ),
    (
        "stiffness: 2.4e8",
        "stiffness: 240 kN/mm2",
        &["m.yaml:9:16", "a power is written with `^`"],
    ),
    (
        "half_gap: 50 um",
        "half_gap: -50 um",
        &["m.yaml:10:41", "found -50 um, must be >= 0"],
    ),
    (
        "half_gap: 50 um",
        "half-gap: 50 um",
        &["m.yaml:10:31", "did you mean `half_gap`?"],
    ),
    (
        "half_gap: 50 um",
        "half_gap: 50 inches",
        &["m.yaml:10:41", "did you mean `in`?"],
    ),
    (
        "{inertia: 1.0e-3}",
        "{inertia: 1 kgm^2}",
        &["m.yaml:4:16", "write `kg m`, with a space"],
    ),
    (
        "{type: backlash, half_gap: 50 um}",
        "backlash",
        &[
            "m.yaml:10:14",
            "wanted a map",
            "such as `element: {type: backlash, half_gap: 50 um}`",
        ],
    ),
    (
        "gear: {A: 50 mm, B: 50 mm}",
        "gear: [A, B]",
        &[
            "m.yaml:8:11",
            "wanted a map",
            "such as `gear: {A: 50 mm, B: 40 mm}`",
        ],
    ),
    (
        "gear: {A: 50 mm, B: 50 mm}",
        "shaft: {A, B}",
        &["m.yaml:8:12", "wanted a list", "such as `shaft: [A, B]`"],
    ),
    (
        "[{order: 1, amplitude: 20}]",
        "{order: 1, amplitude: 20}",
        &[
            "m.yaml:13:33",
            "such as `harmonics: [{order: 1, amplitude: 20}]`",
        ],
    ),
    (
        "modal_ratio: 0.05",
        "modal_ratio: 5 %",
        &["m.yaml:11:24", "5 % as 0.05"],
    ),
    (
        "report: {units: si}",
        "report: si",
        &["m.yaml:15:9", "such as `report: {units: si}`"],
    ),
    (
        "units: si",
        "units: SI",
        &["m.yaml:15:17", "did you mean `si`?"],
    ),
    (
        "harmonics: 5",
        "harmonics: 5, orbits: all",
        &[
            "m.yaml:17:88",
            "found the text `all`, wanted false, true or `marks`",
        ],
    ),
    (
        "frequency_response",
        "frequency-response",
        &["m.yaml:17:20", "did you mean `frequency_response`?"],
    ),
    (
        "from: 9 kHz",
        "from: 9",
        &["m.yaml:17:46", "give a frequency with a unit"],
    ),
];

#[test]
fn every_message_has_a_place_and_a_next_move() {
    for (good, bad, parts) in CASES {
        assert_eq!(TRAIN.matches(good).count(), 1, "{good}");
        let place = Place::with(&TRAIN.replace(good, bad));
        place.run(&["check", "m.yaml"]).ends_with(2).says(parts);
    }
}

/// One misspelt key does not hide behind twenty consequences.
#[test]
fn a_misspelt_section_is_reported_once() {
    let place = Place::with(&TRAIN.replace("bodies:", "Bodies:"));
    let ended = place.run(&["check", "m.yaml"]).ends_with(2);
    assert_eq!(ended.err.matches("error:").count(), 2, "{}", ended.err);
    ended.says(&["did you mean `bodies`?", "`bodies` is missing"]);
}

#[test]
fn of_thousands_of_mistakes_the_first_are_shown() {
    let bodies: String = (0..5000)
        .map(|k| format!("  B{k}: {{inertia: -1}}\n"))
        .collect();
    let text = format!("bodies:\n{bodies}connections: {{c: {{ground: B0, stiffness: 1}}}}\n");
    let ended = Place::with(&text).run(&["check", "m.yaml"]).ends_with(2);
    assert!(ended.err.matches("must be > 0").count() < 200);
    ended.says(&[
        "bodies.B0.inertia",
        "more mistakes",
        "mistakes; the first 1000 are kept",
    ]);
}
