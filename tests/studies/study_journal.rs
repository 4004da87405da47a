//! Studies that are killed, interrupted, disturbed: nothing is lost, nothing is done twice, the table is the same.

use crate::program::Place;
use crate::study_support::{
    end, interrupt, journalled, journals, start, study, undisturbed, wait_for,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashSet;
use std::process::Command;
use std::time::Duration;

const RUN: [&str; 6] = ["run", "m.yaml", "--jobs", "2", "--out", "out"];

#[test]
fn a_study_killed_again_and_again_gives_the_undisturbed_table() {
    const COUNT: usize = 400;
    let place = Place::with(&study(COUNT as u64));
    let wanted = undisturbed(&place);
    let mut random = ChaCha8Rng::seed_from_u64(20261122);
    let (mut known, mut kills) = (HashSet::new(), 0);
    loop {
        let mut child = start(&place, &RUN);
        let more = known.len() + random.random_range(0..120);
        wait_for(&place, "out", more, &mut child);
        std::thread::sleep(Duration::from_micros(random.random_range(0..20_000)));
        child.kill().unwrap();
        let ended = end(child);
        if ended.status.success() {
            break;
        }
        kills += 1;
        if journals(&place, "out").is_empty() {
            continue;
        }
        let runs = journalled(&place, "out");
        let set: HashSet<u64> = runs.iter().copied().collect();
        assert_eq!(set.len(), runs.len(), "a run was done twice");
        assert!(known.is_subset(&set), "a run was lost");
        known = set;
    }
    assert!(kills >= 3, "killed {kills} times");
    assert!(place.read("out/study.csv") == wanted);
    assert_eq!(place.names("out"), place.names("undisturbed"));
}

#[test]
fn the_table_does_not_depend_on_the_threads() {
    let place = Place::with(&study(60));
    let wanted = undisturbed(&place);
    for jobs in ["2", "4", "7"] {
        place
            .run(&["run", "m.yaml", "--jobs", jobs, "--out", jobs])
            .ends_with(0);
        assert!(place.read(&format!("{jobs}/study.csv")) == wanted, "{jobs}");
    }
}

#[test]
fn an_interrupted_study_keeps_what_is_finished_and_goes_on() {
    const COUNT: usize = 300;
    let place = Place::with(&study(COUNT as u64));
    let wanted = undisturbed(&place);
    let mut child = start(&place, &RUN);
    wait_for(&place, "out", 20, &mut child);
    interrupt(&child);
    let ended = end(child);
    assert_eq!(ended.status.code(), Some(130));
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(said.contains("interrupted after"), "{said}");
    let before = journalled(&place, "out");
    assert!(before.len() >= 20 && before.len() < COUNT);
    // The finished part is a table in the order of the runs.
    let numbers = place.column("out/study.csv", "run");
    let mut sorted: Vec<f64> = before.iter().map(|run| *run as f64).collect();
    sorted.sort_by(f64::total_cmp);
    assert_eq!(numbers, sorted);
    let data = place.json("out/study.json");
    assert_eq!(data["study"]["finished"], before.len());
    assert!(
        data["ended_early"]
            .as_str()
            .unwrap()
            .contains("of 300 runs")
    );
    assert!(data["journal"].as_str().unwrap().ends_with(".journal"));
    place.run(&RUN).ends_with(0);
    assert!(place.read("out/study.csv") == wanted);
    assert!(journals(&place, "out").is_empty());
}

#[test]
fn ten_million_runs_start_at_once_in_little_memory() {
    let place = Place::with(&study(10_000_000));
    let began = std::time::Instant::now();
    let mut child = start(&place, &RUN);
    wait_for(&place, "out", 4, &mut child);
    let waited = began.elapsed();
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
    interrupt(&child);
    assert_eq!(end(child).status.code(), Some(130));
    // Loading and checking a model takes some milliseconds; the limit leaves room for a machine with other work.
    assert!(waited < Duration::from_secs(5), "{waited:?}");
    let numbers = place.column("out/study.csv", "run");
    assert!(numbers.len() >= 4);
    if let Ok(status) = status {
        let line = status.lines().find(|l| l.starts_with("VmHWM:")).unwrap();
        let kilobytes: u64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(kilobytes < 64_000, "{line}");
    }
}

#[test]
fn torn_and_damaged_journals_cost_runs_but_never_a_wrong_row() {
    let place = Place::with(&study(200));
    let wanted = undisturbed(&place);
    let mut child = start(&place, &RUN);
    wait_for(&place, "out", 60, &mut child);
    child.kill().unwrap();
    end(child);
    let path = journals(&place, "out").remove(0);
    let bytes = std::fs::read(&path).unwrap();
    // A torn last line is what a kill leaves: no word about it.
    std::fs::write(&path, &bytes[..bytes.len() - 7]).unwrap();
    let mut child = start(&place, &RUN);
    wait_for(&place, "out", 100, &mut child);
    interrupt(&child);
    let ended = end(child);
    assert_eq!(ended.status.code(), Some(130));
    assert!(!String::from_utf8_lossy(&ended.stderr).contains("damaged"));
    // A digit changed in the middle is not.
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    place.run(&RUN).ends_with(0).says(&["was damaged"]);
    assert!(place.read("out/study.csv") == wanted);
}

#[test]
fn other_settings_neither_use_nor_lose_a_journal() {
    let place = Place::with(&study(200));
    let wanted = undisturbed(&place);
    let mut child = start(&place, &RUN);
    wait_for(&place, "out", 30, &mut child);
    interrupt(&child);
    end(child);
    let journal = journals(&place, "out").remove(0);
    let before = std::fs::read(&journal).unwrap();
    let other = ["--set", "analyses.study.sample.count=3"];
    place
        .run(&[&RUN[..], &other].concat())
        .ends_with(0)
        .says(&["with other settings", "it is kept"]);
    assert_eq!(place.column("out/study.csv", "run").len(), 3);
    assert!(std::fs::read(&journal).unwrap() == before);
    // Titles and other analyses do not count as settings.
    let title = ["--set", "analyses.study.title=Another"];
    place.run(&[&RUN[..], &title].concat()).ends_with(0);
    assert!(place.read("out/study.csv") == wanted);
    assert!(journals(&place, "out").is_empty());
}

#[test]
fn two_processes_do_not_share_a_journal() {
    let place = Place::with(&study(100_000));
    let mut child = start(&place, &RUN);
    wait_for(&place, "out", 3, &mut child);
    place.run(&RUN).ends_with(2).says(&[
        "cannot open",
        ".journal",
        "another process is running this study",
    ]);
    interrupt(&child);
    assert_eq!(end(child).status.code(), Some(130));
}

#[test]
fn a_full_disk_is_an_error_that_names_the_file_and_loses_nothing() {
    let place = Place::with(&study(300));
    let wanted = undisturbed(&place);
    // No file may grow beyond 8 KiB, and the signal that would end the process is ignored: writing fails.
    let program = assert_cmd::cargo::cargo_bin("gearlash");
    let script = format!(
        "trap '' XFSZ; ulimit -f 16; exec {} {}",
        program.display(),
        RUN.join(" ")
    );
    let ended = Command::new("sh")
        .current_dir(place.folder.path())
        .args(["-c", &script])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(2), "{said}");
    assert!(
        said.contains("cannot write out/study.") && said.contains(".journal"),
        "{said}"
    );
    assert!(!said.contains("panicked"), "{said}");
    assert!(journalled(&place, "out").len() > 20);
    place.run(&RUN).ends_with(0);
    assert!(place.read("out/study.csv") == wanted);
}

#[test]
fn what_cannot_be_written_is_named() {
    let place = Place::with(&study(20));
    place
        .run(&["run", "m.yaml", "--out", "m.yaml/out"])
        .ends_with(2)
        .says(&["cannot create m.yaml/out"]);
    // The journal keeps the runs when the table cannot take its place.
    std::fs::create_dir_all(place.path("out/study.csv/in_the_way")).unwrap();
    place
        .run(&RUN)
        .ends_with(2)
        .says(&["cannot write out/study.csv"]);
    assert_eq!(journalled(&place, "out").len(), 20);
    std::fs::remove_dir_all(place.path("out/study.csv")).unwrap();
    place.run(&RUN).ends_with(0);
    assert!(place.read("out/study.csv") == undisturbed(&place));
}
