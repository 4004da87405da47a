//! Parameter studies: which runs there are, what they do, what is collected. Every row is checked against a run by hand.

use crate::program::{Place, REDUCED, TRAIN};
use crate::time_domain_support::{floats, main_table, names, run, texts};
use gearlash::analysis::TYPES;
use gearlash::report::{Report, Table};

/// A study of `REDUCED`'s frequency response.
fn with(study: &str) -> String {
    format!("{REDUCED}  study:\n    type: parameter_study\n{study}")
}

const PEAK: &str = "    collect: {peak: {column: rms.mesh, reduce: max}}\n";

#[test]
fn a_grid_runs_every_combination_the_last_path_fastest() {
    let grid = "    grid:
      mesh.half_gap: [0.5, 1.0]
      damping.modal_ratio: {from: 0.04, to: 0.06, points: 3}
    analysis: response
    collect:
      peak: {column: rms.mesh, reduce: max}
      where_it_is: {column: rms.mesh, reduce: argmax}
      mean: {column: mean.mesh, reduce: {at: 1.9}}
      points: {reduce: count}
";
    let place = Place::with(&with(grid));
    place
        .run(&["run", "m.yaml", "--only", "study"])
        .ends_with(0);
    let file = "results/m/study.csv";
    assert_eq!(
        place.table(file)[0],
        [
            "run",
            "mesh.half_gap",
            "damping.modal_ratio",
            "peak",
            "where_it_is",
            "mean",
            "points",
            "status",
            "reason",
            "warnings"
        ]
    );
    assert_eq!(place.column(file, "run"), [0., 1., 2., 3., 4., 5.]);
    let gaps = place.column(file, "mesh.half_gap");
    assert_eq!(gaps, [0.5, 0.5, 0.5, 1.0, 1.0, 1.0]);
    let ratios = place.column(file, "damping.modal_ratio");
    assert_eq!(ratios, [0.04, 0.05, 0.06, 0.04, 0.05, 0.06]);
    for (k, (gap, ratio)) in gaps.iter().zip(&ratios).enumerate() {
        let sets = [
            format!("reduced.elements.mesh.half_gap={gap}"),
            format!("reduced.damping.modal_ratio={ratio}"),
        ];
        let only = ["run", "m.yaml", "--only", "response", "--out", "by_hand"];
        let all: Vec<&str> = only
            .into_iter()
            .chain(sets.iter().flat_map(|set| ["--set", set.as_str()]))
            .collect();
        place.run(&all).ends_with(0);
        let file_of_run = "by_hand/response.csv";
        let rms = place.column(file_of_run, "rms.mesh");
        let omega = place.column(file_of_run, "omega");
        let peak = rms.iter().copied().fold(0.0, f64::max);
        let at = rms.iter().position(|x| *x == peak).unwrap();
        let marked = omega.iter().position(|x| *x == 1.9).unwrap();
        assert_eq!(place.column(file, "peak")[k], peak);
        assert_eq!(place.column(file, "where_it_is")[k], omega[at]);
        let mean = place.column(file_of_run, "mean.mesh")[marked];
        assert_eq!(place.column(file, "mean")[k], mean);
        assert_eq!(place.column(file, "points")[k], omega.len() as f64);
    }
    let data = place.json("results/m/study.json");
    assert_eq!(data["study"]["finished"], 6);
    assert_eq!(data["statistics"]["mesh.half_gap"]["mean"], 0.75);
    assert_eq!(data["tables"][0]["rows"], 6);
    assert!(place.read("results/m/study.svg").starts_with("<svg"));
    assert!(
        !place
            .names("results/m")
            .iter()
            .any(|n| n.ends_with(".journal"))
    );
}

#[test]
fn a_list_runs_row_by_row_with_units_words_and_settings() {
    let study = "  study:
    type: parameter_study
    list:
      - {mesh.half_gap: 20 um, analysis.method: galerkin, analysis.to: 8.2 kHz}
      - {mesh.half_gap: 4e-05, analysis.method: shooting, analysis.to: 8100 Hz}
    analysis: response
    collect:
      last: {column: frequency_hz, reduce: last}
      method: {column: method, reduce: first}
      middle: {column: mean.mesh, reduce: {at: 8.5 kHz}, by: frequency_hz}
      free: {column: contact_ratio.mesh, reduce: min}
";
    let place = Place::with(&format!("{TRAIN}{study}"));
    place
        .run(&["run", "m.yaml", "--only", "study"])
        .ends_with(0);
    let file = "results/m/study.csv";
    let table = place.table(file);
    // SI base units, whatever was written.
    assert_eq!(table[1][1..3], ["2e-5", "galerkin"]);
    let ends = place.column(file, "analysis.to");
    assert!((ends[0] / (std::f64::consts::TAU * 8200.0) - 1.0).abs() < 1e-15);
    assert_eq!(table[2][1..3], ["4e-5", "shooting"]);
    assert_eq!(table[2][5], "shooting");
    let last = place.column(file, "last");
    assert!((last[0] - 8200.0).abs() < 1e-8 && (last[1] - 8100.0).abs() < 1e-8);
    for (gap, mean) in [20e-6, 40e-6].into_iter().zip(place.column(file, "middle")) {
        // Force 2000 N on 2.4e8 N/m behind the gap, always in contact.
        assert!((mean - (gap + 2000.0 / 2.4e8)).abs() < 1e-13, "{mean}");
    }
    assert_eq!(place.column(file, "free"), [1.0, 1.0]);
    let columns = &place.json("results/m/study.json")["columns"];
    assert_eq!(
        columns[1],
        serde_json::json!({"name": "mesh.half_gap", "unit": "m"})
    );
    assert_eq!(columns[3]["unit"], "rad/s");
    assert_eq!(columns[4]["unit"], "Hz");
}

#[test]
fn scales_are_those_of_the_model_as_written() {
    // The half gap is also the displacement scale: it stays 50 um whatever a run sets.
    let study = "  study:
    type: parameter_study
    grid: {mesh.half_gap: [50 um, 100 um]}
    analysis: {type: frequency_response, from: 1.5, to: 1.4, harmonics: 3}
    collect: {mean: {column: mean.mesh, reduce: first}, omega: {column: omega, reduce: first}}
";
    let text = TRAIN.replace("units: si", "units: nondimensional").replace(
        "from: 9 kHz, to: 8000 Hz, harmonics: 5, marks: [8.5 kHz]",
        "from: 2, to: 1.9",
    );
    let place = Place::with(&format!("{text}{study}"));
    place
        .run(&["run", "m.yaml", "--only", "study"])
        .ends_with(0);
    let mean = place.column("results/m/study.csv", "mean");
    let deflection = 2000.0 / 2.4e8 / 50e-6;
    assert!((mean[0] - 1.0 - deflection).abs() < 1e-9, "{mean:?}");
    assert!((mean[1] - 2.0 - deflection).abs() < 1e-9, "{mean:?}");
    assert_eq!(place.column("results/m/study.csv", "omega"), [1.5, 1.5]);
}

#[test]
fn sets_of_the_analysis_and_of_the_study_come_before_the_parameters() {
    let study = "  wide: {type: frequency_response, from: 2.0, to: 1.9, harmonics: 3, set: {reduced.loads.mean: [0.25], reduced.elements.mesh.half_gap: 3}}
  study:
    type: parameter_study
    set: {reduced.elements.mesh.half_gap: 2}
    grid: {damping.modal_ratio: [0.05]}
    analysis: wide
    collect: {mean: {column: mean.mesh, reduce: first}}
  narrow:
    type: parameter_study
    grid: {mesh.half_gap: [1]}
    analysis: wide
    collect: {mean: {column: mean.mesh, reduce: first}}
";
    let place = Place::with(&format!("{REDUCED}{study}"));
    place.run(&["run", "m.yaml"]).ends_with(0);
    let mean = |name: &str| place.column(&format!("results/m/{name}.csv"), "mean")[0];
    assert!((mean("study") - 2.25).abs() < 1e-9);
    assert!((mean("narrow") - 1.25).abs() < 1e-9);
}

#[test]
fn samples_are_spread_as_they_were_asked_to() {
    const COUNT: usize = 500;
    let sample = |method: &str| {
        let text = format!(
            "{{type: parameter_study, sample: {{method: {method}, count: {COUNT}, seed: 5, parameters: {{
                damping.modal_ratio: {{distribution: uniform, low: 0.02, high: 0.06}},
                loads.mean.0: {{distribution: normal, mean: 0.5, deviation: 0.1, low: 0.4, high: 0.8}}}}}},
              analysis: {{type: modes, points: 2}}, collect: {{w: {{column: natural_frequency.1, reduce: max}}}}}}"
        );
        let model = "reduced:
  stiffness: [[1]]
  damping: {modal_ratio: 0.05}
  elements: {mesh: {type: backlash, half_gap: 1.0}}
  loads: {mean: [0.5]}
";
        let report = run(model, &text);
        assert_eq!(report.ended_early, None);
        report
    };
    let table = |report: &Report| main_table(report).clone();
    let cube = table(&sample("latin_hypercube"));
    let mut strata: Vec<usize> = floats(&cube, "damping.modal_ratio")
        .iter()
        .map(|x| ((x - 0.02) / 0.04 * COUNT as f64) as usize)
        .collect();
    strata.sort_unstable();
    assert_eq!(strata, (0..COUNT).collect::<Vec<_>>());
    // Quantiles of the truncated normal distribution lie a stratum apart: Phi(-1) = 0.158655, Phi(3) = 0.998650, so that
    // the median is at Phi^-1(0.578653) = 0.198422.
    let mut loads = floats(&cube, "loads.mean.0");
    loads.sort_by(f64::total_cmp);
    assert!(loads[0] >= 0.4 && loads[COUNT - 1] <= 0.8);
    let median = 0.519_842_2;
    assert!(
        loads[COUNT / 2 - 1] <= median && median <= loads[COUNT / 2],
        "{median}"
    );
    let again = table(&sample("latin_hypercube"));
    assert_eq!(again, cube);
    let plain = table(&sample("monte_carlo"));
    let ratios = floats(&plain, "damping.modal_ratio");
    assert!(ratios.iter().all(|x| (0.02..0.06).contains(x)));
    // Independent values of one distribution: mean within four standard errors.
    let mean = ratios.iter().sum::<f64>() / COUNT as f64;
    let error = 0.04 / 12f64.sqrt() / (COUNT as f64).sqrt();
    assert!((mean - 0.04).abs() < 4.0 * error, "{mean}");
}

#[test]
fn events_labels_and_interpolated_values_are_collected() {
    let study = "    grid: {loads.harmonics.0.cos.0: [0.25, 0.01]}
    analysis: {type: frequency_response, from: 1.4, to: 0.6, harmonics: 5, max_step: 0.01}
    collect:
      folds: {table: events, reduce: count, where: {kind: fold}}
      first_fold: {table: events, column: omega, reduce: first, where: {kind: fold}}
      stable: {column: stable, reduce: mean}
      unstable_points: {reduce: count, where: {stable: 0}}
      half: {column: rms.mesh, reduce: {at: 1.1234}}
      spread: {column: omega, reduce: range}
";
    let place = Place::with(&with(study));
    place
        .run(&["run", "m.yaml", "--only", "study"])
        .ends_with(0);
    let file = "results/m/study.csv";
    let column = |name: &str| place.column(file, name);
    // The large load makes the gap felt, the small one does not: no folds, and an empty cell for where the first one is.
    assert!(column("folds")[0] >= 2.0 && column("folds")[1] == 0.0);
    assert!((0.6..1.4).contains(&column("first_fold")[0]) && column("first_fold")[1].is_nan());
    assert!(column("unstable_points")[0] > 0.0 && column("stable")[0] < 1.0);
    assert_eq!(
        (column("unstable_points")[1], column("stable")[1]),
        (0.0, 1.0)
    );
    // Linear response about the deflected position; interpolation between neighbours of the branch.
    let omega: f64 = 1.1234;
    let rms = 0.01 / ((1.0 - omega * omega).powi(2) + (0.1 * omega).powi(2)).sqrt() / 2f64.sqrt();
    assert!(
        (column("half")[1] / rms - 1.0).abs() < 2e-3,
        "{:?}",
        column("half")
    );
    assert!((column("spread")[1] - 0.8).abs() < 1e-12);

    let labels = "{type: parameter_study, grid: {loads.mean.0: [0.5]},
        analysis: {type: poincare_map, at: 1.5, transient: 300, periods: 20},
        collect: {label: {table: summary, column: label, reduce: last}, largest: {table: summary, column: lyapunov_1, reduce: max}}}";
    let model = REDUCED.split("analyses:").next().unwrap();
    let report = run(model, labels);
    assert_eq!(texts(main_table(&report), "label"), ["period 1"]);
    // Damped linear oscillation: exponents -zeta omega_n; over T = 84 the turning of the axes leaves ln(1.05) / T.
    let largest = floats(main_table(&report), "largest")[0];
    assert!((largest + 0.05).abs() < 6e-4, "{largest}");
}

#[test]
fn failed_runs_are_rows_with_a_reason() {
    let study = "    list:
      - {loads.mean.0: 0.5, analysis.max_points: 3}
      - {loads.mean.0: 0.5, analysis.max_points: 1000}
    analysis: {type: frequency_response, from: 1.4, to: 0.6, harmonics: 5}
    collect: {points: {reduce: count}}
";
    let place = Place::with(&with(study));
    place
        .run(&["run", "m.yaml", "--only", "study"])
        .ends_with(1)
        .says(&["ended early: study: 1 of 2 runs failed"]);
    let table = place.table("results/m/study.csv");
    assert_eq!(table[1][3..5], ["3", "ended_early"]);
    assert!(table[1][5].contains("max_points was reached"), "{table:?}");
    assert_eq!(table[2][4..], ["complete", "", ""]);

    // Without a lower end some gaps are negative: the model refuses them, and the study goes on.
    let refused = format!(
        "    sample: {{count: 20, seed: 1, parameters: {{mesh.half_gap: {{distribution: normal, mean: 0.1, deviation: 0.2}}}}}}
    analysis: {{type: frequency_response, from: 2, to: 1.9, harmonics: 3}}\n{PEAK}"
    );
    let place = Place::with(&with(&refused));
    place
        .run(&["run", "m.yaml", "--only", "study"])
        .ends_with(1)
        .says(&["of 20 runs failed"]);
    let file = "results/m/study.csv";
    let (gaps, peaks) = (
        place.column(file, "mesh.half_gap"),
        place.column(file, "peak"),
    );
    for (row, (gap, peak)) in place.table(file)[1..].iter().zip(gaps.iter().zip(&peaks)) {
        let wanted = if *gap < 0.0 { "refused" } else { "complete" };
        assert_eq!(row[3], wanted);
        assert_eq!(peak.is_nan(), *gap < 0.0);
        assert_eq!(row[4].contains("half_gap"), *gap < 0.0, "{row:?}");
    }
    assert!(gaps.iter().any(|gap| *gap < 0.0));
}

#[test]
fn ten_billion_combinations_are_counted_not_listed() {
    let axis = "{from: 0.03, to: 0.07, points: 100000}";
    let study = format!(
        "    grid: {{damping.modal_ratio: {axis}, mesh.half_gap: {axis}}}
    analysis: response\n{PEAK}"
    );
    let place = Place::with(&with(&study));
    place.run(&["check", "m.yaml"]).ends_with(0);
    // Part 10^10 of as many has the last run alone: both parameters at their ends.
    let shard = "10000000000/10000000000";
    place
        .run(&[
            "run", "m.yaml", "--only", "study", "--shard", shard, "--out", "x",
        ])
        .ends_with(0);
    let row = &place.table("x/study.csv")[1];
    assert_eq!(row[..3], ["9999999999", "0.07", "0.07"]);
}

/// Types whose tables a study does not collect from this example: they need a reference shaft, a grid or an event to start from.
const LATER: [&str; 7] = [
    "parameter_study",
    "operating_point",
    "run_up",
    "basins",
    "bifurcation_curve",
    "regime_map",
    "torus",
];

/// What `tables` promises is what `run` delivers, for every other type; only multipliers cannot be known before.
#[test]
fn every_type_knows_its_tables_before_it_runs() {
    use gearlash::analysis::{Control, Setting};
    use gearlash::study::Study;
    struct Quiet;
    impl Control for Quiet {}
    let model = REDUCED.split("analyses:").next().unwrap();
    let settings = |kind: &str| match kind {
        "modes" => "points: 2",
        "effective_frequencies" => "amplitude: [0.1, 0.2], points: 2, mean_displacement: 0",
        "frequency_response" => {
            "from: 2.0, to: 1.9, harmonics: 3, orbits: true, methods: [galerkin, shooting]"
        }
        "parameter_response" => {
            "parameter: modal_ratio, at: 2.0, from: 0.06, to: 0.05, harmonics: 3, verify: true"
        }
        "time_history" => "at: 1.5, periods: 2",
        "poincare_map" => "at: 1.5, transient: 5, periods: 5",
        "bifurcation_diagram" => "from: 1.5, to: 1.4, points: 2, transient: 5, periods: 5",
        "parameter_study" => "",
        other => panic!("no example of {other}: give one"),
    };
    let shape = |table: &Table| -> Vec<(String, String, &'static str)> {
        let columns = table.columns.iter();
        columns
            .map(|c| (c.name.clone(), c.unit.clone(), c.values.kind()))
            .collect()
    };
    for units in ["nondimensional", "si"] {
        for (kind, ..) in TYPES.iter().filter(|(kind, ..)| !LATER.contains(kind)) {
            let settings = settings(kind);
            let model = match units {
                "si" => TRAIN.split("analyses:").next().unwrap().replace(
                    "mean: 100 N m, harmonics: [{order: 1, amplitude: 20}]",
                    "mean: 100 N m",
                ),
                _ => model.to_string(),
            };
            let settings = match units {
                "si" => (settings.replace("2.0", "9 kHz").replace("1.9", "8.9 kHz"))
                    .replace("[0.1, 0.2]", "[10 um, 20 um]"),
                _ => settings.to_string(),
            };
            let settings = match units {
                "si" => settings.replace("1.5", "7 kHz").replace("1.4", "6.9 kHz"),
                _ => settings,
            };
            let place = Place::with(&format!(
                "{model}analyses:\n  it: {{type: {kind}, {settings}}}\n"
            ));
            let study = Study::load(&place.path("m.yaml"), &[], &[]).unwrap();
            let report = &study.reports(&Quiet).unwrap()[0];
            let setting = Setting {
                name: "it",
                model: &study.model,
                assembly: &study.assembly,
                control: &Quiet,
            };
            let node = gearlash::yaml::Node::from_json(&study.model.to_tree()["analyses"]["it"]);
            let analysis: Box<dyn gearlash::analysis::Analysis> = node.read("").unwrap();
            let promised = analysis.tables(&setting);
            assert!(!promised.is_empty(), "{kind}");
            assert!(promised.iter().all(|t| t.rows() == 0), "{kind}");
            let delivered = (report.tables.iter()).filter(|t| !t.name.starts_with("multiplier"));
            let delivered: Vec<_> = delivered.map(|t| (t.name.clone(), shape(t))).collect();
            let promised: Vec<_> = promised
                .iter()
                .map(|t| (t.name.clone(), shape(t)))
                .collect();
            assert_eq!(promised, delivered, "{kind}, {units}");
        }
    }
    assert_eq!(names(&Table::default()), [""; 0]);
}
