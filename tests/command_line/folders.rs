//! The folder of the results and the files of a model, where somebody else has been at work.

use crate::program::{Place, REDUCED};

#[test]
fn equal_results_have_equal_files() {
    let place = Place::with(REDUCED);
    for out in ["first", "second"] {
        place.run(&["run", "m.yaml", "--out", out]).ends_with(0);
    }
    assert_eq!(place.names("first"), place.names("second"));
    for name in place
        .names("first")
        .iter()
        .filter(|name| *name != "timings.json")
    {
        let [a, b] = ["first", "second"].map(|out| place.read(&format!("{out}/{name}")));
        assert!(a == b, "{name} differs");
    }
    assert!(!place.read("first/manifest.json").contains("timings"));
}

#[cfg(unix)]
#[test]
fn what_a_killed_run_leaves_is_removed() {
    let place = Place::with(REDUCED);
    // The limit of the size of a file is an error, and what was begun goes at once.
    let ended = place
        .run_after("ulimit -f 20", &["run", "m.yaml", "--out", "out"])
        .ends_with(2);
    ended.says(&["cannot write"]);
    let parts = |place: &Place| {
        place
            .names("out")
            .into_iter()
            .filter(|n| n.ends_with(".part"))
            .count()
    };
    assert_eq!(parts(&place), 0);
    for name in [
        ".gearlash-ZZGIee.part",
        ".gearlash-8388608-ab12cd.part",
        ".gearlash-study.csv.part",
    ] {
        place.write(&format!("out/{name}"), "left over");
    }
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert_eq!(parts(&place), 0, "{:?}", place.names("out"));
}

#[test]
fn a_folder_that_cannot_be_written_is_noticed_before_the_work() {
    let slow = REDUCED.split("analyses:").next().unwrap().to_string()
        + "analyses:\n  it: {type: poincare_map, at: 1, transient: 1000000000}\n";
    let place = Place::with(&slow);
    place.write("taken", "a file");
    let ended = place
        .run(&["run", "m.yaml", "--out", "taken/sub"])
        .ends_with(2);
    ended.says(&["taken"]);
    let ended = place.run(&["run", "m.yaml", "--out", "taken"]).ends_with(2);
    ended.says(&["taken"]);
}

#[test]
fn results_of_an_earlier_model_are_named() {
    let place = Place::with(REDUCED);
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    place.write("out/notes.json", "{\"mine\": 1}");
    // Another run of a part of the same model says nothing.
    let ended = place
        .run(&["run", "m.yaml", "--out", "out", "--only", "lines"])
        .ends_with(0);
    assert_eq!(ended.err, "");
    place.write("new.yaml", &REDUCED.replace("response:", "new:"));
    let ended = place.run(&["run", "new.yaml", "--out", "out"]).ends_with(0);
    let ended = ended.says(&[
        "warning: results of an analysis `response`",
        "response.csv",
        "response.rattle.csv",
    ]);
    assert!(
        !ended.err.contains("lines") && !ended.err.contains("notes"),
        "{}",
        ended.err
    );
    // So is a table that the analysis no longer writes.
    place.write(
        "orbits.yaml",
        &REDUCED.replace("harmonics: 5,", "harmonics: 5, orbits: true,"),
    );
    place
        .run(&["run", "orbits.yaml", "--out", "two"])
        .ends_with(0);
    let ended = place.run(&["run", "m.yaml", "--out", "two"]).ends_with(0);
    ended.says(&["warning: response.orbits.csv of `response`"]);
}

#[test]
fn names_of_other_systems_are_warned_of_and_long_ones_refused() {
    let model = REDUCED.split("analyses:").next().unwrap();
    let place = Place::with(&format!(
        "{model}analyses:\n  a1: {{type: modes}}\n  A1: {{type: modes}}\n  Nul: {{type: modes}}\n"
    ));
    let ended = place.run(&["check", "m.yaml"]).ends_with(0);
    for part in [
        "warning: analyses a1 and A1",
        "warning: an analysis called Nul",
    ] {
        assert!(ended.out.contains(part), "{}", ended.out);
    }
    place
        .run(&["run", "m.yaml"])
        .ends_with(0)
        .says(&["warning: analyses a1 and A1"]);
    for name in [
        "n".repeat(250),
        "n".repeat(231),
        "timings".into(),
        "Manifest".into(),
    ] {
        place.write(
            "m.yaml",
            &format!("{model}analyses:\n  {name}: {{type: modes}}\n"),
        );
        place.run(&["check", "m.yaml"]).ends_with(2);
    }
    let longest = "n".repeat(230);
    place.write(
        "m.yaml",
        &REDUCED.replace("response:", &format!("{longest}:")),
    );
    place
        .run(&["run", "m.yaml", "--figures", "svg,png,pdf"])
        .ends_with(0);
}

#[test]
fn control_characters_are_shown_as_symbols() {
    let texts =
        "title: \"bell\\a\", caption: \"escape\\e[31m\", assumed: [\"nul\\0 \\x9b \\u202e end\"], ";
    let text = REDUCED
        .replace(
            "{type: frequency_response",
            &format!("{{{texts}type: frequency_response"),
        )
        .replace("name: one mesh", "name: \"one\\e[2J mesh\"");
    let place = Place::with(&text);
    let checked = place.run(&["check", "m.yaml"]).ends_with(0);
    let ended = place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    let mut all = vec![(
        "terminal".to_string(),
        checked.out + &checked.err + &ended.out + &ended.err,
    )];
    for name in place.names("out") {
        let text = place.read(&format!("out/{name}"));
        all.push((name, text));
    }
    for (name, text) in all {
        let raw = text
            .chars()
            .find(|c| c.is_control() && !matches!(c, '\n' | '\r' | '\t'));
        // JSON has escapes for those below 32 only.
        let raw = raw.filter(|c| !name.ends_with(".json") || (*c as u32) < 32);
        assert_eq!(raw, None, "{name}");
    }
    assert!(place.read("out/report.html").contains("escape\u{241b}[31m"));
}

#[test]
fn a_file_that_is_no_model_is_not_shown() {
    let lines: String = (1..40)
        .map(|k| format!("user{k}:SECRET{k}:1:::\n"))
        .collect();
    for (text, part) in [
        (lines.as_str(), "none of its keys"),
        ("token: SECRET\n", "none of its keys"),
        ("- SECRET\n", "not a map"),
        ("a: SECRET\na: SECRET\n", "key"),
        ("key: {a: SECRET\n", "cannot be read as a model"),
        ("\"SECRET\": [\n", "cannot be read as a model"),
        ("a: *SECRET\n", "cannot be read as a model"),
        ("\tSECRET: 1\n", "cannot be read as a model"),
    ] {
        let place = Place::with("extends: private.txt\n");
        place.write("private.txt", text);
        let ended = place.run(&["check", "m.yaml"]).ends_with(2);
        assert!(!ended.err.contains("SECRET"), "{}", ended.err);
        ended.says(&["private.txt", part]);
    }
    let place = Place::with("extends: private.txt\n");
    std::fs::write(place.path("private.txt"), b"name: SECRET\xff\n").unwrap();
    let ended = place.run(&["check", "m.yaml"]).ends_with(2);
    assert!(!ended.err.contains("SECRET"), "{}", ended.err);
}

#[cfg(unix)]
#[test]
fn only_regular_files_are_extended() {
    let place = Place::with("extends: pipe\n");
    let made = std::process::Command::new("mkfifo")
        .arg(place.path("pipe"))
        .status();
    assert!(made.unwrap().success());
    for name in ["pipe", "/dev/zero", "."] {
        place.write("m.yaml", &format!("extends: {name}\n"));
        place
            .run(&["check", "m.yaml"])
            .ends_with(2)
            .says(&["is no regular file"]);
    }
}
