//! Tables beside model files: measured cycles and functions of time, and what can be wrong with them.

use crate::program::Place;

fn model(load: &str) -> String {
    format!(
        "schema: 1\nbodies: {{A: {{inertia: 1.0e-3}}, B: {{inertia: 2.0e-3}}}}\nconnections: {{s: {{shaft: [A, B], stiffness: 1.0e3, damping: 0.1}}}}\n\
         loads: {{A: {load}}}\nreference: {{body: A, speed: 600 rpm}}\nreport: {{units: si}}\n\
         analyses: {{it: {{type: time_history, at: 600 rpm, duration: 50 ms, points: 11}}}}\n"
    )
}

fn history(load: &str, files: &[(&str, &str)]) -> Vec<String> {
    let place = Place::with(&model(load));
    for (name, text) in files {
        place.write(name, text);
    }
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    let table = place.read("out/it.csv");
    table.lines().map(String::from).collect()
}

const CYCLE: &str = "cycle: {file: a.csv, column: torque, unit: N m, revolutions: 2}";

#[test]
fn tables_of_several_programs_are_the_same_load() {
    let values = history("{cycle: {values: [1, 5, -2, 0.5], revolutions: 2}}", &[]);
    for text in [
        "angle,torque\n0,1\n180,5\n360,-2\n540,0.5\n",
        "\u{feff}torque;angle\r\n1,0;0\r\n5;180\r\n-2;360\r\n0,5;540\r\n",
        "torque\tx\n1\ta\n5\tb\n-2\tc\n0.5\td\n",
        "torque\n1\n5\n-2\n0.5\n1\n",
    ] {
        assert_eq!(
            history(&format!("{{{CYCLE}}}"), &[("a.csv", text)]),
            values,
            "{text}"
        );
    }
    // Angles that are given as they would be anyway, and a row on a straight segment.
    let angles = "angle,torque\n0,1\n90,3\n180,5\n360,-2\n540,0.5\n720,1\n";
    let load =
        "{cycle: {file: a.csv, column: torque, angle: angle, angle_unit: deg, revolutions: 2}}";
    let found = history(load, &[("a.csv", angles)]);
    for (a, b) in found.iter().zip(&values).skip(1) {
        let numbers =
            |line: &str| -> Vec<f64> { line.split(',').map(|x| x.parse().unwrap()).collect() };
        for (a, b) in numbers(a).iter().zip(numbers(b)) {
            assert!((a - b).abs() < 1e-10 * (1.0 + b.abs()), "{a} {b}");
        }
    }
}

#[test]
fn functions_of_time_come_from_points_or_files() {
    let points = history(
        "{profile: {points: [[0 s, 1 N m], [20 ms, 1], [20 ms, 3], [0.04, -1]]}}",
        &[],
    );
    let file = "t,T\n0,1000\n20,1000\n20,3000\n40,-1000\n";
    let load = "{profile: {file: p.csv, time: t, column: T, unit: mN m, time_unit: ms}}";
    assert_eq!(history(load, &[("p.csv", file)]), points);
}

#[test]
fn mistakes_in_tables_name_file_row_and_column() {
    let cases: [(&str, &str, &[&str]); 14] = [
        (
            CYCLE,
            "t,x\n0,1\n",
            &["loads.A.cycle", "a.csv", "no column `torque`", "t, x"],
        ),
        (
            CYCLE,
            "torque\n1\nabc\n",
            &["row 3", "`torque`", "`abc`", "finite number"],
        ),
        (CYCLE, "torque\nNaN\n", &["row 2", "`torque`", "NaN"]),
        (CYCLE, "torque\n1e999\n2\n", &["row 2", "1e999"]),
        (CYCLE, "torque,b\n1,2\n3\n", &["row 3"]),
        (CYCLE, "torque\n", &["0 values", "at least 2"]),
        (CYCLE, "", &["a.csv", "first row is empty"]),
        (
            "cycle: {file: b.csv, column: torque}",
            "torque\n1\n",
            &["b.csv"],
        ),
        (
            "cycle: {file: a.csv}",
            "torque\n1\n2\n",
            &["loads.A.cycle", "column"],
        ),
        (
            "cycle: {file: a.csv, column: torque, unit: N}",
            "torque\n1\n2\n",
            &["loads.A.cycle.unit", "N"],
        ),
        (
            "cycle: {file: a.csv, column: torque, angle: x}",
            "x,torque\n0,1\n5,2\n3,3\n",
            &["row 4", "angle 3", "more than 5"],
        ),
        (
            "cycle: {file: a.csv, column: torque, angle: x}",
            "x,torque\n0,1\n180,2\n300,3\n",
            &["cycles", "angle_unit: deg"],
        ),
        (
            "profile: {file: a.csv, time: t, column: torque}",
            "t,torque\n0,1\n2,1\n1,3\n",
            &["row 4", "`t`", "found 1", "at least 2"],
        ),
        (
            "profile: {points: [[0, 1], [2, 3, 4]]}",
            "",
            &["profile.points.1", "3 values", "an instant and a value"],
        ),
    ];
    for (load, text, words) in cases {
        let place = Place::with(&model(&format!("{{{load}}}")));
        place.write("a.csv", text);
        place.run(&["check", "m.yaml"]).ends_with(2).says(words);
    }
}

#[test]
fn amplitudes_against_speed_are_read_and_mistakes_named() {
    let harmonic = |h: &str| model(&format!("{{harmonics: [{{order: 1, {h}}}]}}"));
    for good in [
        "amplitude: 3 N m, speed_power: 2, at: 600 rpm",
        "amplitude: {speed: [600 rpm, 4000 rpm], values: [50 N m, 90 N m]}",
        "amplitude: {speed: [0, 10], values: [1, 2]}, phase: 10 deg",
    ] {
        Place::with(&harmonic(good))
            .run(&["check", "m.yaml"])
            .ends_with(0);
    }
    for (bad, word) in [
        ("amplitude: 3, speed_power: 2", "belong together"),
        ("amplitude: 3, at: 600 rpm", "belong together"),
        ("amplitude: 3, speed_power: 2, at: 0", "> 0"),
        ("amplitude: 3, speed_power: 2, at: 3 m", "at"),
        ("amplitude: {speed: [1, 2], values: [1]}", "equally many"),
        ("amplitude: {speed: [2, 1], values: [1, 2]}", "ascend"),
        ("amplitude: {speed: [1, 2], values: [1 N, 2 N]}", "values.0"),
        ("amplitude: {speed: [1, 2], value: [1, 2]}", "value"),
        (
            "amplitude: {speed: [1, 2], values: [1, 2]}, at: 3",
            "excludes a table",
        ),
    ] {
        let place = Place::with(&harmonic(bad));
        place.run(&["check", "m.yaml"]).ends_with(2).says(&[word]);
    }
}

/// What a table holds is part of the input: another table, another hash.
#[test]
fn tables_are_part_of_the_hash() {
    let hash = |text: &str| {
        let place = Place::with(&model(
            "{cycle: {file: a.csv, column: torque, revolutions: 2}}",
        ));
        place.write("a.csv", text);
        place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
        let manifest: serde_json::Value =
            serde_json::from_str(&place.read("out/manifest.json")).unwrap();
        manifest["inputs"].clone()
    };
    let [a, b] = ["torque\n1\n2\n", "torque\n1\n3\n"].map(hash);
    assert!(a.to_string().contains("a.csv"), "{a}");
    assert_ne!(a, b);
}
