//! Parts of a study on several machines, and joining them.

use crate::program::Place;
use crate::study_support::{study, undisturbed};

/// Runs part `index` of `count` into the folder `p<index>`.
fn part(place: &Place, index: u64, count: u64, more: &[&str]) {
    let (shard, out) = (format!("{index}/{count}"), format!("p{index}"));
    let arguments = [
        "run", "m.yaml", "--shard", &shard, "--out", &out, "--jobs", "2",
    ];
    place.run(&[&arguments[..], more].concat()).ends_with(0);
}

#[test]
fn joined_parts_are_the_table_of_one_run() {
    let place = Place::with(&study(50));
    let wanted = undisturbed(&place);
    for count in [1, 3, 7] {
        for index in 1..=count {
            part(&place, index, count, &[]);
        }
        let folders: Vec<String> = (1..=count).rev().map(|index| format!("p{index}")).collect();
        let folders: Vec<&str> = folders.iter().map(String::as_str).collect();
        let all = [&["merge"], &folders[..], &["--out", "all"]].concat();
        let ended = place.run(&all).ends_with(0);
        assert!(
            ended.out.contains("study") && ended.out.contains("50"),
            "{}",
            ended.out
        );
        assert!(place.read("all/study.csv") == wanted, "{count}");
        // A folder belongs to one part of one division.
        for folder in folders {
            std::fs::remove_dir_all(place.path(folder)).unwrap();
        }
    }
    assert_eq!(place.names("all"), place.names("undisturbed"));
    assert!(place.read("all/study.svg") == place.read("undisturbed/study.svg"));
    let (joined, whole) = (
        place.json("all/study.json"),
        place.json("undisturbed/study.json"),
    );
    assert_eq!(joined, whole);
    let inputs = |folder: &str| place.json(&format!("{folder}/manifest.json"))["inputs"].clone();
    assert_eq!(inputs("all"), inputs("undisturbed"));
    // More parts than runs: some parts are empty.
    let place = Place::with(&study(2));
    let wanted = undisturbed(&place);
    (1..=3).for_each(|index| part(&place, index, 3, &[]));
    assert_eq!(place.column("p3/study.csv", "run").len(), 0);
    place
        .run(&["merge", "p1", "p2", "p3", "--out", "all"])
        .ends_with(0);
    assert!(place.read("all/study.csv") == wanted);
}

#[test]
fn failed_runs_are_counted_over_the_parts() {
    // Negative damping: no run reaches its end.
    let rows: String = (1..=12)
        .map(|k| format!("      - {{loads.mean.0: 0.0{k}}}\n"))
        .collect();
    let text = format!(
        "schema: 1
reduced:
  stiffness: [[1]]
  damping: {{matrix: [[-20]]}}
  elements: {{spring: {{type: linear}}}}
  loads: {{mean: [0.5], harmonics: [{{order: 1, cos: [0.3]}}]}}
analyses:
  study:
    type: parameter_study
    list:
{rows}    analysis: {{type: poincare_map, at: 0.1, transient: 0, periods: 9, initial: {{q: [0.3]}}}}
    collect: {{points: {{reduce: count}}}}
"
    );
    let place = Place::with(&text);
    for index in ["1/2", "2/2"] {
        let out = &index[..1];
        place
            .run(&["run", "m.yaml", "--shard", index, "--out", out])
            .ends_with(1)
            .says(&["6 of 6 runs failed"]);
    }
    place
        .run(&["merge", "1", "2", "--out", "all"])
        .ends_with(1)
        .says(&["12 of 12 runs failed"]);
}

#[test]
fn parts_that_do_not_belong_together_are_refused() {
    let place = Place::with(&study(20));
    (1..=3).for_each(|index| part(&place, index, 3, &[]));
    let merge = |folders: &[&str], says: &[&str]| {
        let all = [&["merge"], folders, &["--out", "all"]].concat();
        place.run(&all).ends_with(2).says(says);
        assert!(!place.path("all").exists(), "nothing is written");
    };
    // It prints the command that computes the missing part.
    let command = "gearlash run m.yaml --shard 2/3 --out p2";
    merge(
        &["p1", "p3"],
        &["1 of the 3 parts of `study` missing: 2", command],
    );
    merge(
        &["p1", "p2", "p3", "p2"],
        &["part 2/3 of `study` is also in p2"],
    );
    let copy = |from: &str, to: &str| {
        std::fs::create_dir_all(place.path(to)).unwrap();
        for name in place.names(from) {
            std::fs::copy(
                place.path(&format!("{from}/{name}")),
                place.path(&format!("{to}/{name}")),
            )
            .unwrap();
        }
    };
    let edit = |file: &str, from: &str, to: &str| {
        let text = place.read(file);
        assert!(text.contains(from), "{file} has no {from}");
        place.write(file, &text.replacen(from, to, 1));
    };
    // Another table than the one that was written: a row less, a digit more.
    copy("p2", "q2");
    let table = place.read("q2/study.csv");
    let end = table.trim_end().rfind("\r\n").unwrap() + 2;
    place.write("q2/study.csv", &table[..end]);
    merge(
        &["p1", "q2", "p3"],
        &["q2", "study.csv is not what was written"],
    );
    // Another version, another model, another number of parts.
    copy("p2", "v2");
    let version = format!("\"version\": \"{}\"", env!("CARGO_PKG_VERSION"));
    edit("v2/study.json", &version, "\"version\": \"0.0.1\"");
    merge(
        &["p1", "v2", "p3"],
        &["v2", "another program version", "0.0.1"],
    );
    let set = ["--set", "reduced.loads.mean=[0.4]", "--out", "other"];
    place
        .run(&[&["run", "m.yaml", "--shard", "2/3"], &set[..]].concat())
        .ends_with(0);
    merge(
        &["p1", "other", "p3"],
        &["other", "another input", "SHA-256"],
    );
    place
        .run(&["run", "m.yaml", "--shard", "2/4", "--out", "quarter"])
        .ends_with(0);
    merge(
        &["p1", "quarter", "p3"],
        &["another number of parts than in p1: 4 instead of 3"],
    );
    // A whole study is no part.
    undisturbed(&place);
    merge(&["undisturbed", "p2"], &["is a whole study, not a part"]);
    // No results yet.
    std::fs::create_dir(place.path("empty")).unwrap();
    merge(&["p1", "empty", "p3"], &["cannot read empty/manifest.json"]);
    // Two mistakes in one go.
    merge(
        &["empty", "q2"],
        &["empty/manifest.json", "is not what was written"],
    );
}

#[test]
fn a_folder_holds_one_part() {
    let place = Place::with(&study(20));
    part(&place, 1, 2, &[]);
    place
        .run(&["run", "m.yaml", "--shard", "2/2", "--out", "p1"])
        .ends_with(2)
        .says(&["p1 holds part 1/2", "a separate folder"]);
    part(&place, 1, 2, &[]);
    // Without --out every part has its own folder; other analyses wait for the whole run.
    let place = Place::with(&format!(
        "{}  lines: {{type: modes, points: 3}}\n",
        study(4)
    ));
    place
        .run(&["run", "m.yaml", "--shard", "2/2"])
        .ends_with(0)
        .says(&["note: lines is not a parameter_study"]);
    let names = place.names("results/m/shard-2-of-2");
    assert!(names.contains(&"study.csv".to_string()), "{names:?}");
    assert!(!names.contains(&"lines.csv".to_string()), "{names:?}");
}
