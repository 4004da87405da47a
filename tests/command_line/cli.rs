//! What a user types and gets: commands, options, files, columns, exit status.

use crate::program::{Place, REDUCED, TRAIN};
use serde_json::{Value, json};

const PER_CONNECTION: [&str; 12] = [
    "mean",
    "rms",
    "min",
    "max",
    "rms_velocity",
    "effective_stiffness",
    "effective_stiffness_dc",
    "contact_ratio",
    "impacts",
    "force_mean",
    "force_max",
    "force_std",
];

/// The header row of a frequency response.
fn header(is_si: bool, connections: &[&str], dof: usize) -> Vec<String> {
    let mut list: Vec<String> = ["branch", "point", "mark", "method", "omega"]
        .map(str::to_owned)
        .to_vec();
    if is_si {
        list.push("frequency_hz".into());
    }
    list.extend(
        [
            "parameter",
            "stable",
            "multiplier_modulus",
            "iterations",
            "residual",
        ]
        .map(str::to_owned),
    );
    for connection in connections {
        list.extend(PER_CONNECTION.map(|name| format!("{name}.{connection}")));
    }
    list.extend((1..=dof).map(|i| format!("effective_frequency.{i}")));
    list
}

#[test]
fn a_run_writes_its_files_and_a_short_table() {
    let place = Place::with(REDUCED);
    let ended = place.run(&["run", "m.yaml"]).ends_with(0);
    let files = [
        "lines.csv",
        "lines.json",
        "lines.svg",
        "manifest.json",
        "report.html",
        "response.csv",
        "response.events.csv",
        "response.json",
        "response.multipliers.csv",
        "response.rattle.csv",
        "response.rattle.svg",
        "response.svg",
        "timings.json",
    ];
    assert_eq!(place.names("results/m"), files);
    for part in [
        "lines",
        "response",
        "frequency_response",
        "complete",
        "13 files in results/m",
    ] {
        assert!(ended.out.contains(part), "{part}: {}", ended.out);
    }
    assert_eq!(ended.err, "");
    let table = place.table("results/m/response.csv");
    assert_eq!(table[0], header(false, &["mesh"], 1));
    assert_eq!(
        place.table("results/m/lines.csv")[0],
        ["effective_stiffness", "natural_frequency.1"]
    );
    assert_eq!(
        place.table("results/m/response.multipliers.csv")[0],
        ["branch", "point", "re.1", "im.1", "re.2", "im.2"]
    );
    let events = &place.table("results/m/response.events.csv")[0];
    let contract = [
        "kind",
        "omega",
        "parameter",
        "located",
        "bracket_low",
        "bracket_high",
        "branch",
        "after_point",
        "connection",
    ];
    assert_eq!(events[..9], contract);
}

#[test]
fn the_branch_goes_from_end_to_end_through_its_marks() {
    let place = Place::with(REDUCED);
    place.run(&["run", "m.yaml"]).ends_with(0);
    let file = "results/m/response.csv";
    let omega = place.column(file, "omega");
    assert_eq!((omega[0], omega[omega.len() - 1]), (2.0, 1.6));
    assert_eq!(omega, place.column(file, "parameter"));
    let marks = place.column(file, "mark");
    let marked: Vec<f64> = omega
        .iter()
        .zip(&marks)
        .filter(|(_, mark)| **mark == 1.0)
        .map(|(omega, _)| *omega)
        .collect();
    assert_eq!(marked, [1.9]);
    let points: Vec<f64> = (0..omega.len()).map(|k| k as f64).collect();
    assert_eq!(place.column(file, "point"), points);
    // Always in contact here: a linear response about the static deflection 0.5 + half_gap.
    for (k, omega) in omega.iter().enumerate() {
        let rms =
            0.25 / ((1.0 - omega * omega).powi(2) + (0.1 * omega).powi(2)).sqrt() / 2f64.sqrt();
        assert!((place.column(file, "rms.mesh")[k] - rms).abs() < 1e-9);
        assert!((place.column(file, "mean.mesh")[k] - 1.5).abs() < 1e-9);
    }
    assert!(place.column(file, "stable").iter().all(|s| *s == 1.0));
    let data = place.json("results/m/response.json");
    assert_eq!(data["branches"][0]["end"]["reason"], "range_reached");
    assert_eq!(data["branches"][0]["points"], omega.len());
    assert_eq!(data["branches"][0]["method"], "galerkin");
    assert_eq!(
        data["scales"],
        json!({"omega_c": 1.0, "displacement": {"mesh": 1.0}})
    );
    assert_eq!(data["columns"][4], json!({"name": "omega", "unit": ""}));
    assert_eq!(data["options"]["harmonics"], 5);
    for key in ["events", "warnings"] {
        assert_eq!(data[key], json!([]), "{key}");
    }
    // Equal results have equal files: times are elsewhere.
    assert!(data.get("timings").is_none() && data["ended_early"].is_null());
    let seconds = &place.json("results/m/timings.json")["response"]["seconds"];
    assert!(seconds.as_f64().is_some_and(|s| s > 0.0), "{seconds}");
}

#[test]
fn cells_read_back_and_write_the_same_again() {
    let place = Place::with(REDUCED);
    place.run(&["run", "m.yaml"]).ends_with(0);
    for file in ["response.csv", "response.multipliers.csv", "lines.csv"] {
        let table = place.table(&format!("results/m/{file}"));
        let cells = table[1..].iter().flatten();
        for cell in cells.filter(|c| !c.is_empty() && *c != "galerkin") {
            let x: f64 = cell.parse().unwrap();
            assert!(x.is_finite(), "{file}: {cell}");
            let again: f64 = format!("{x:.16e}").parse().unwrap();
            assert_eq!(x.to_bits(), again.to_bits(), "{file}: {cell}");
        }
    }
}

#[test]
fn si_reports_have_hertz_and_radians_a_second() {
    let place = Place::with(TRAIN);
    place.run(&["run", "m.yaml"]).ends_with(0);
    let file = "results/m/response.csv";
    assert_eq!(place.table(file)[0], header(true, &["mesh"], 1));
    let hertz = place.column(file, "frequency_hz");
    assert!((hertz[0] - 9000.0).abs() < 1e-8 && (hertz[hertz.len() - 1] - 8000.0).abs() < 1e-8);
    let data = place.json("results/m/response.json");
    let omega_c = data["scales"]["omega_c"].as_f64().unwrap();
    // Two equal gears: omega_c^2 = K (R^2/I + R^2/I).
    assert!((omega_c / 1.2e9_f64.sqrt() - 1.0).abs() < 1e-12);
    let (omega, parameter) = (place.column(file, "omega"), place.column(file, "parameter"));
    for k in 0..hertz.len() {
        let rate = hertz[k] * std::f64::consts::TAU;
        assert!((parameter[k] / rate - 1.0).abs() < 1e-12);
        assert!((omega[k] * omega_c / rate - 1.0).abs() < 1e-12);
    }
    // Static: force 100 N m / 0.05 m = 2000 N, deflection half_gap + F/K.
    let (force, mean) = (
        place.column(file, "force_mean.mesh"),
        place.column(file, "mean.mesh"),
    );
    assert!((force[0] - 2000.0).abs() < 1e-6, "{}", force[0]);
    assert!(
        (mean[0] - (50e-6 + 2000.0 / 2.4e8)).abs() < 1e-14,
        "{}",
        mean[0]
    );
    let natural = place.column(file, "effective_frequency.1");
    assert!((natural[0] - omega_c / std::f64::consts::TAU).abs() < 1e-6);
    let unit = |name: &str| {
        let columns = data["columns"].as_array().unwrap();
        columns.iter().find(|c| c["name"] == name).unwrap()["unit"].clone()
    };
    for (name, wanted) in [
        ("omega", ""),
        ("frequency_hz", "Hz"),
        ("parameter", "rad/s"),
        ("rms.mesh", "m"),
        ("rms_velocity.mesh", "m/s"),
        ("force_max.mesh", "N"),
        ("effective_stiffness.mesh", ""),
        ("effective_frequency.1", "Hz"),
    ] {
        assert_eq!(unit(name), wanted, "{name}");
    }
}

#[test]
fn orbits_of_the_marks_have_256_rows() {
    let place = Place::with(REDUCED);
    place
        .run(&["run", "m.yaml", "--set", "analyses.response.orbits=marks"])
        .ends_with(0);
    let file = "results/m/response.orbits.csv";
    let wanted = ["branch", "point", "tau", "q.mesh", "v.mesh", "f.mesh"];
    assert_eq!(place.table(file)[0], wanted);
    let tau = place.column(file, "tau");
    assert_eq!((tau.len(), tau[0]), (256, 0.0));
    assert!((tau[255] - std::f64::consts::TAU * 255.0 / 256.0).abs() < 1e-14);
}

#[test]
fn a_branch_that_ends_early_is_written_and_says_why() {
    let place = Place::with(REDUCED);
    let set = "analyses.response.max_points=3";
    place
        .run(&["run", "m.yaml", "--set", set])
        .ends_with(1)
        .says(&[
            "ended early: response: max_points was reached",
            "after 3 points",
        ]);
    assert_eq!(place.column("results/m/response.csv", "omega").len(), 3);
    let data = place.json("results/m/response.json");
    assert_eq!(data["branches"][0]["end"]["reason"], "max_points");
    assert!(data["ended_early"].as_str().unwrap().contains("max_points"));
    assert!(place.names("results/m").contains(&"lines.csv".to_string()));
}

#[test]
fn a_branch_without_a_first_solution_is_written_and_says_why() {
    // A stop that the mean load pulls away from: nothing holds it.
    let text = REDUCED
        .replace("type: backlash, half_gap: 1.0", "type: one_sided, gap: 0.5")
        .replace("mean: [0.5]", "mean: [-0.5]")
        .replace(", marks: [1.9]", "");
    let place = Place::with(&text);
    place
        .run(&["run", "m.yaml", "--only", "response"])
        .ends_with(1)
        .says(&["ended early: response: no first solution"]);
    assert_eq!(place.table("results/m/response.csv").len(), 1);
    let data = place.json("results/m/response.json");
    assert_eq!(data["branches"][0]["end"]["reason"], "no_start");
    assert_eq!(data["branches"][0]["points"], 0);
}

#[test]
fn bad_input_writes_nothing() {
    let place = Place::with(REDUCED);
    let cases: [(&[&str], &[&str]); 7] = [
        (&["run", "no.yaml"], &["cannot read no.yaml"]),
        (
            &["run", "m.yaml", "--only", "respnse"],
            &[
                "no analysis is called `respnse`",
                "did you mean `response`?",
            ],
        ),
        (
            &["run", "m.yaml", "--set", "reduced.elements.mush.half_gap=2"],
            &["no entry `mush`", "did you mean `mesh`?"],
        ),
        (
            &[
                "run",
                "m.yaml",
                "--set",
                "reduced.elements.mesh.half_gap=-2",
            ],
            &["half_gap", "-2", ">= 0", "--set:1:"],
        ),
        (&["run", "m.yaml", "--figures", "bmp"], &["svg, png, pdf"]),
        (&["run", "m.yaml", "--jobs", "0"], &["--jobs"]),
        (&["rum", "m.yaml"], &["unrecognized subcommand"]),
    ];
    for (arguments, parts) in cases {
        place.run(arguments).ends_with(2).says(parts);
    }
    assert_eq!(place.names("."), ["m.yaml"]);
}

#[test]
fn options_choose_replace_and_direct() {
    let place = Place::with(REDUCED);
    let ended = place
        .run(&[
            "run",
            "m.yaml",
            "--only",
            "response",
            "--set",
            "reduced.elements.mesh.half_gap=0.25",
            "--set",
            "analyses.response.to=1.7",
            "--out",
            "elsewhere/deep",
            "--quiet",
            "--figures",
            "png,svg,pdf",
        ])
        .ends_with(0);
    assert_eq!((ended.out.as_str(), ended.err.as_str()), ("", ""));
    let names = place.names("elsewhere/deep");
    assert!(!names.iter().any(|n| n.starts_with("lines")), "{names:?}");
    assert!(
        place
            .read("elsewhere/deep/response.svg")
            .starts_with("<svg")
    );
    let png = std::fs::read(place.path("elsewhere/deep/response.png")).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let pdf = std::fs::read(place.path("elsewhere/deep/response.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-") && pdf.trim_ascii_end().ends_with(b"%%EOF"));
    let file = "elsewhere/deep/response.csv";
    assert_eq!(place.column(file, "omega").last(), Some(&1.7));
    assert!((place.column(file, "mean.mesh")[0] - 0.75).abs() < 1e-9);
    assert!(!place.path("results").exists());
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let text = REDUCED.replace("to: 1.6", "to: 0.7")
        + "  other: {type: frequency_response, from: 2.5, to: 1.4}\n";
    let place = Place::with(&text);
    for jobs in ["1", "2"] {
        place
            .run(&["run", "m.yaml", "--jobs", jobs, "--out", jobs])
            .ends_with(0);
    }
    assert_eq!(place.names("1"), place.names("2"));
    for name in place
        .names("1")
        .iter()
        .filter(|n| n.ends_with(".csv") || n.ends_with(".svg"))
    {
        assert!(
            place.read(&format!("1/{name}")) == place.read(&format!("2/{name}")),
            "{name}"
        );
    }
}

#[test]
fn a_closed_pipe_is_no_mistake() {
    use std::process::{Command, Stdio};
    let place = Place::with(REDUCED);
    for arguments in [
        &["elements"][..],
        &["check", "m.yaml"],
        &["completions", "bash"],
    ] {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("gearlash"))
            .current_dir(place.folder.path())
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let ended = child.wait_with_output().unwrap();
        let err = String::from_utf8_lossy(&ended.stderr);
        assert_eq!((ended.status.code(), &*err), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn check_prints_the_system() {
    let place = Place::with(TRAIN);
    let ended = place.run(&["check", "m.yaml"]).ends_with(0);
    for part in [
        "pair",
        "A (0.001), B (0.001)",
        "relative coordinates:  mesh",
        "rigid-body modes:      1",
        "34641.02 rad/s",
        "backlash",
        "+ flank",
        "5513.289",
        "stiffness (kappa, n x e)",
        "analyses: response",
    ] {
        assert!(ended.out.contains(part), "{part}: {}", ended.out);
    }
    let ended = place.run(&["check", "m.yaml", "--json"]).ends_with(0);
    let data: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(data["bodies"], json!(["A", "B"]));
    assert_eq!(data["connections"], json!(["mesh"]));
    assert_eq!(data["relative_coordinates"], json!(["mesh"]));
    assert_eq!(data["rigid_body_modes"], 1);
    assert_eq!(data["element_map"], json!([[1.0]]));
    let close = |value: &Value, wanted: f64| {
        let found = value.as_f64().unwrap();
        assert!(
            (found / wanted - 1.0).abs() < 1e-12,
            "{found} is not {wanted}"
        );
    };
    close(&data["omega_c"], 1.2e9_f64.sqrt());
    close(&data["natural_frequencies_rad_s"][0], 1.2e9_f64.sqrt());
    close(&data["natural_frequencies"][0], 1.0);
    close(&data["stiffness"][0][0], 1.0);
    close(&data["damping"][0][0], 0.1);
    close(&data["displacement_scales"][0], 50e-6);
    close(&data["static_displacement"][0], 50e-6 + 2000.0 / 2.4e8);
    assert_eq!(data["warnings"], json!([]));
    assert_eq!(place.names("."), ["m.yaml"], "check writes nothing");
}

#[test]
fn check_of_a_reduced_model_has_no_dimensional_frequencies() {
    let place = Place::with(REDUCED);
    let ended = place.run(&[
        "check",
        "m.yaml",
        "--json",
        "--set",
        "reduced.loads.mean=[0]",
    ]);
    let data: Value = serde_json::from_str(&ended.ends_with(0).out).unwrap();
    assert_eq!(data["natural_frequencies_rad_s"], Value::Null);
    assert_eq!(data["omega_c"], 1.0);
    assert_eq!(data["static_displacement"], json!([0.0]));
    assert!(data["warnings"][0].as_str().unwrap().contains("not unique"));
}

#[test]
fn elements_lists_every_law() {
    let place = Place::with(REDUCED);
    let ended = place.run(&["elements", "--json"]).ends_with(0);
    let data: Value = serde_json::from_str(&ended.out).unwrap();
    let laws = data.as_array().unwrap();
    let tags: Vec<&str> = laws.iter().map(|l| l["tag"].as_str().unwrap()).collect();
    for tag in [
        "backlash",
        "cubic",
        "linear",
        "one_sided",
        "piecewise_linear",
    ] {
        assert!(tags.contains(&tag), "{tag}");
        assert!(place.run(&["elements"]).out.contains(tag));
    }
    for law in laws {
        assert!(law["description"].is_string(), "{law}");
        for parameter in law["parameters"].as_array().unwrap() {
            for key in ["name", "description", "unit", "default"] {
                assert!(parameter.get(key).is_some(), "{key}: {parameter}");
            }
        }
    }
    let shell = place.run(&["completions", "bash"]).ends_with(0);
    assert!(shell.out.contains("_gearlash()"));
}

#[test]
fn a_base_file_is_found_beside_the_file_that_extends_it() {
    let place = Place::with("name: nothing\n");
    place.write("models/base.yaml", REDUCED);
    place.write(
        "models/sub/own.yaml",
        "extends: ../base.yaml\nanalyses: {response: null}\n",
    );
    place.run(&["run", "models/sub/own.yaml"]).ends_with(0);
    assert_eq!(
        place.names("results/own"),
        [
            "lines.csv",
            "lines.json",
            "lines.svg",
            "manifest.json",
            "report.html",
            "timings.json"
        ]
    );
}

#[test]
fn the_manifest_names_every_file() {
    let place = Place::with(REDUCED);
    place.run(&["run", "m.yaml"]).ends_with(0);
    let text = place.read("results/m/manifest.json");
    for name in place
        .names("results/m")
        .iter()
        .filter(|n| !["manifest.json", "timings.json"].contains(&n.as_str()))
    {
        assert!(text.contains(&format!("\"{name}\"")), "{name}: {text}");
    }
    assert!(text.contains(env!("CARGO_PKG_VERSION")) && text.contains("m.yaml"));
}

#[test]
fn a_warning_is_given_once() {
    let mixed = TRAIN.replace(
        "damping:",
        "  rest: {ground: A, stiffness: 1e5}\nscaling: {length: 50 um}\ndamping:",
    );
    let place = Place::with(&mixed);
    let ended = place.run(&["check", "m.yaml"]).ends_with(0);
    assert_eq!(ended.out.matches("also scales").count(), 1, "{}", ended.out);
    let ended = place.run(&["run", "m.yaml", "--quiet"]).ends_with(0);
    assert_eq!(ended.err.matches("also scales").count(), 1, "{}", ended.err);
}

#[test]
fn check_lists_the_numbers_of_the_mechanics() {
    let place = Place::with(TRAIN);
    let ended = place.run(&["check", "m.yaml", "--numbers"]).ends_with(0);
    for wanted in [
        "connections.mesh.element.half_gap",
        "5e-5",
        "loads.A.harmonics.0.amplitude",
        "kg m^2",
        ">= 0",
        "default",
    ] {
        assert!(ended.out.contains(wanted), "{wanted}\n{}", ended.out);
    }
    let ended = place.run(&["check", "m.yaml", "--json"]).ends_with(0);
    let value: Value = serde_json::from_str(&ended.out).unwrap();
    let list = value["numbers"].as_array().unwrap();
    let gap = list
        .iter()
        .find(|n| n["name"] == "connections.mesh.element.half_gap");
    let wanted = json!({"name": "connections.mesh.element.half_gap", "value": 50e-6, "unit": "m", "range": ">= 0", "is_written": true});
    assert_eq!(gap, Some(&wanted));
}
