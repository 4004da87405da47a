//! The tutorial: its commands run as they stand and deliver the files that it names.

use crate::program::Place;
use std::path::Path;

fn text(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// Words of a shell line; double quotes join.
fn words(line: &str) -> Vec<String> {
    let (mut list, mut word, mut is_quoted) = (Vec::new(), String::new(), false);
    for c in line.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            ' ' if !is_quoted => list.push(std::mem::take(&mut word)),
            c => word.push(c),
        }
    }
    list.push(word);
    list
}

#[test]
fn the_commands_of_the_idle_rattle_tutorial_run() {
    let tutorial = text("docs/tutorial_idle_rattle.md");
    let place = Place::with("");
    place.write("models/idle_rattle.yaml", &text("models/idle_rattle.yaml"));
    let mut count = 0;
    for block in tutorial.split("```sh\n").skip(1) {
        for line in block.split("```").next().unwrap().lines() {
            let words = words(line);
            assert_eq!(words[0], "gearlash", "{line}");
            let arguments: Vec<&str> = words[1..].iter().map(String::as_str).collect();
            place.run(&arguments).ends_with(0);
            count += 1;
        }
    }
    assert_eq!(count, 7);
    let first = |name: &str| place.read(&format!("results/tutorial/{name}"));
    let columns = |name: &str| first(name).lines().next().unwrap().to_owned();
    for column in [
        "rattle_index.gear_1",
        "impacts.m1",
        "contact_ratio.m1",
        "impact_energy.m1",
        "speed_rpm",
    ] {
        assert!(
            columns("idle.csv").split(',').any(|c| c == column),
            "{column}"
        );
    }
    for column in ["impacts_per_s.m1", "impact_energy_per_s.m1", "rms.q.m1"] {
        assert!(
            columns("run_up.csv").split(',').any(|c| c == column),
            "{column}"
        );
    }
    for name in [
        "revolution.impacts.csv",
        "revolution.rattle.csv",
        "run_up.orders.csv",
        "run_up.resonances.csv",
    ] {
        assert!(first(name).lines().count() > 1, "{name}");
    }
    // Rattle at little drag, silence at much.
    let drag = first("drag.csv");
    let rows: Vec<Vec<String>> = drag
        .lines()
        .map(|l| l.split(',').map(String::from).collect())
        .collect();
    let energy = rows[0].iter().position(|c| c == "energy").unwrap();
    let value = |row: &Vec<String>| row[energy].parse::<f64>().unwrap();
    assert!(
        value(&rows[1]) > 1e-5 && value(&rows[rows.len() - 1]) < 1e-9,
        "{drag}"
    );
}
