//! Time histories, Poincaré maps and bifurcation diagrams from the model file to the tables.

use gearlash::analysis::Control;
use gearlash::report::{Report, Table, Values};
use gearlash::study::{RunSettings, Study};
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// One linear mass: q'' + 0.1 q' + q = 0.5 + 0.3 cos(0.8 T).
const LINEAR: &str = "
schema: 1
reduced:
  stiffness: [[1]]
  damping: {matrix: [[0.1]]}
  elements: {spring: {type: linear}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.3], sin: [0]}]}
";

/// A motor mass on a shaft and a translating mass behind it.
const TRAIN: &str = "
schema: 1
bodies:
  A: {inertia: 2.0e-3}
  B: {inertia: 1.0e-3}
connections:
  mesh: {gear: {A: 50 mm, B: 40 mm}, stiffness: 2.0e8, element: {type: backlash, half_gap: 20 um}}
  shaft: {ground: B, stiffness: 1.0e5}
damping: {modal_ratio: 0.04}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 60}]}
";

/// The flagship pair, case 1.
const PAIR: &str = "
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {mesh_1: {type: backlash, half_gap: 1.0}, mesh_2: {type: backlash, half_gap: 0.1}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0], sin: [0, 0]}]}
";

struct Quiet;
impl Control for Quiet {}

fn load(model: &str, analyses: &str, folder: &Path) -> Result<Study, String> {
    let file = folder.join("model.yaml");
    std::fs::write(&file, format!("{model}\nanalyses:\n{analyses}\n")).unwrap();
    Study::load(&file, &[], &[]).map_err(|e| e.to_string())
}

fn run_with(model: &str, analyses: &str, jobs: usize, control: &dyn Control) -> Vec<Report> {
    let folder = tempfile::tempdir().unwrap();
    let study = load(model, analyses, folder.path()).unwrap();
    let settings = RunSettings {
        out: folder.path().join("out"),
        figures: vec![],
        jobs,
    };
    study.run(&settings, control).unwrap().reports
}

fn run(model: &str, analysis: &str) -> Report {
    run_with(model, &format!("  it: {analysis}"), 1, &Quiet).remove(0)
}

fn refusal(model: &str, analysis: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    load(model, &format!("  it: {analysis}"), folder.path())
        .err()
        .unwrap()
}

fn floats(table: &Table, name: &str) -> Vec<f64> {
    match &table
        .column(name)
        .unwrap_or_else(|| panic!("no column {name}"))
        .values
    {
        Values::Float(list) => list.clone(),
        Values::Integer(list) => list.iter().map(|x| *x as f64).collect(),
        Values::Text(_) => panic!("{name} holds words"),
    }
}

fn texts(table: &Table, name: &str) -> Vec<String> {
    match &table.column(name).unwrap().values {
        Values::Text(list) => list.clone(),
        _ => panic!("{name} holds numbers"),
    }
}

fn names(table: &Table) -> Vec<&str> {
    table.columns.iter().map(|c| c.name.as_str()).collect()
}

fn main_table(report: &Report) -> &Table {
    report.table("").unwrap()
}

/// Solution of LINEAR from q0, v0.
fn exact(t: f64, q0: f64, v0: f64) -> [f64; 2] {
    let (w, d, om) = (1.0_f64, 0.05, 0.8);
    let wd = (w - d * d).sqrt();
    let det = (w - om * om).powi(2) + (0.1 * om).powi(2);
    let (a, b) = (0.3 * (w - om * om) / det, 0.3 * 0.1 * om / det);
    let forced = |t: f64| {
        let (s, c) = (om * t).sin_cos();
        [0.5 + a * c + b * s, om * (b * c - a * s)]
    };
    let [f0, g0] = forced(0.0);
    let (x, y) = (q0 - f0, (v0 - g0 + d * (q0 - f0)) / wd);
    let (s, c) = (wd * t).sin_cos();
    let decay = (-d * t).exp();
    let [f, g] = forced(t);
    [
        f + decay * (x * c + y * s),
        g + decay * (-d * (x * c + y * s) + wd * (y * c - x * s)),
    ]
}

#[test]
fn a_linear_oscillator_follows_its_closed_form() {
    let report = run(
        LINEAR,
        "{type: time_history, at: 0.8, periods: 3, transient: 2, samples_per_period: 50, \
          initial: {q: [0.7], v: [-0.4]}}",
    );
    assert_eq!(report.ended_early, None);
    let table = main_table(&report);
    assert_eq!(names(table), ["T", "q.spring", "v.spring", "f.spring"]);
    let t = floats(table, "T");
    assert_eq!(t.len(), 151);
    let period = TAU / 0.8;
    // The transient is not written, the time goes on counting.
    assert!((t[0] - 2.0 * period).abs() < 1e-13);
    assert!((t[150] - 5.0 * period).abs() < 1e-13);
    let (q, v, f) = (
        floats(table, "q.spring"),
        floats(table, "v.spring"),
        floats(table, "f.spring"),
    );
    for k in 0..t.len() {
        let [x, y] = exact(t[k], 0.7, -0.4);
        assert!(
            (q[k] - x).abs() < 2e-9 && (v[k] - y).abs() < 2e-8,
            "row {k}: {} {x}, {} {y}",
            q[k],
            v[k]
        );
        assert_eq!(f[k], q[k]);
    }
    assert_eq!(report.table("switches").unwrap().rows(), 0);
    assert!(report.summary.contains_key("integrator"));
}

#[test]
fn the_last_row_is_the_state_of_the_integrator() {
    // The same motion sampled coarsely and finely: rows at the ends of periods are equal to the last bit.
    let at = |samples: usize| {
        let text = format!(
            "{{type: time_history, at: 1.1, periods: 4, transient: 1, samples_per_period: {samples}}}"
        );
        run(PAIR, &text)
    };
    let (coarse, fine) = (at(1), at(128));
    for name in ["T", "q.mesh_1", "v.mesh_2", "f.mesh_1"] {
        let (a, b) = (
            floats(main_table(&coarse), name),
            floats(main_table(&fine), name),
        );
        assert_eq!((a.len(), b.len()), (5, 513));
        for (k, x) in a.iter().enumerate() {
            assert_eq!(*x, b[128 * k], "{name} after {k} periods");
        }
    }
    // And the Poincaré map sees the same states.
    let map = run(
        PAIR,
        "{type: poincare_map, at: 1.1, transient: 1, periods: 4, lyapunov: false}",
    );
    let table = main_table(&map);
    assert_eq!(
        names(table),
        [
            "run", "period", "q.mesh_1", "q.mesh_2", "v.mesh_1", "v.mesh_2"
        ]
    );
    assert_eq!(floats(table, "period"), [2.0, 3.0, 4.0, 5.0]);
    assert_eq!(
        floats(table, "v.mesh_2"),
        floats(main_table(&coarse), "v.mesh_2")[1..]
    );
}

#[test]
fn the_default_start_is_the_static_equilibrium() {
    let report = run(LINEAR, "{type: time_history, at: 0.8, periods: 1}");
    let table = main_table(&report);
    assert_eq!(table.rows(), 201);
    assert!((floats(table, "q.spring")[0] - 0.5).abs() < 1e-12);
    assert_eq!(floats(table, "v.spring")[0], 0.0);
}

#[test]
fn si_and_nondimensional_columns_agree() {
    let of = |units: &str, at: &str, initial: &str| {
        let model = format!("{TRAIN}\nreport: {{units: {units}}}");
        let text = format!(
            "{{type: time_history, at: {at}, periods: 2, samples_per_period: 20, initial: {initial}}}"
        );
        run(&model, &text)
    };
    let start = "{q: [30 um, 0.5 mrad], v: [0.02 m/s, 3 rad/s]}";
    let si = of("si", "800 Hz", start);
    let bare = of("si", "800 Hz", "{q: [3e-5, 5e-4], v: [0.02, 3]}");
    let plain = of("nondimensional", "800 Hz", start);
    assert_eq!(si.tables, bare.tables);
    let w = si.summary["scales"]["omega_c"].as_f64().unwrap();
    let l = |c: &str| si.summary["scales"]["displacement"][c].as_f64().unwrap();
    let (a, b) = (main_table(&si), main_table(&plain));
    let expected = [
        ("t", "s", "T", "", 1.0 / w),
        ("q.mesh", "m", "q.mesh", "", l("mesh")),
        ("q.shaft", "rad", "q.shaft", "", l("shaft")),
        ("v.mesh", "m/s", "v.mesh", "", l("mesh") * w),
        ("v.shaft", "rad/s", "v.shaft", "", l("shaft") * w),
        ("f.mesh", "N", "f.mesh", "", 2.0e8 * l("mesh")),
        ("f.shaft", "N m", "f.shaft", "", 1.0e5 * l("shaft")),
        (
            "acceleration.A",
            "rad/s^2",
            "acceleration.A",
            "rad/T^2",
            w * w,
        ),
        (
            "acceleration.B",
            "rad/s^2",
            "acceleration.B",
            "rad/T^2",
            w * w,
        ),
    ];
    assert_eq!(names(a), expected.map(|e| e.0));
    assert_eq!(names(b), expected.map(|e| e.2));
    for (x, unit_x, y, unit_y, factor) in expected {
        assert_eq!(
            (
                a.column(x).unwrap().unit.as_str(),
                b.column(y).unwrap().unit.as_str()
            ),
            (unit_x, unit_y)
        );
        for (x, y) in floats(a, x).iter().zip(floats(b, y)) {
            assert!(
                (x - y * factor).abs() <= 1e-13 * (y * factor).abs(),
                "{x} {}",
                y * factor
            );
        }
    }
    assert!((floats(a, "q.mesh")[0] - 30e-6).abs() < 1e-18);
    assert!((floats(a, "v.shaft")[0] - 3.0).abs() < 1e-12);
    // t of the last row: two periods of 800 Hz.
    assert!((floats(a, "t")[40] - 2.0 / 800.0).abs() < 1e-17);
}

#[test]
fn the_absolute_accelerations_are_those_of_the_equation_of_motion() {
    let model =
        format!("{TRAIN}\nreport: {{units: si}}").replace("modal_ratio: 0.04", "modal_ratio: 0");
    let report = run(
        &model,
        "{type: time_history, at: 800 Hz, periods: 1, samples_per_period: 16}",
    );
    let table = main_table(&report);
    let (t, mesh, shaft) = (
        floats(table, "t"),
        floats(table, "f.mesh"),
        floats(table, "f.shaft"),
    );
    let (a, b) = (
        floats(table, "acceleration.A"),
        floats(table, "acceleration.B"),
    );
    for k in 0..t.len() {
        let torque = 100.0 + 60.0 * (TAU * 800.0 * t[k]).cos();
        let expected = [
            (torque - 0.05 * mesh[k]) / 2.0e-3,
            (-0.04 * mesh[k] - shaft[k]) / 1.0e-3,
        ];
        for (found, wanted) in [a[k], b[k]].iter().zip(expected) {
            assert!((found - wanted).abs() < 1e-9 * 1e5, "{found} {wanted}");
        }
    }
}

#[test]
fn a_linear_oscillator_has_period_1_and_its_exponents() {
    let report = run(
        LINEAR,
        "{type: poincare_map, at: 0.8, transient: 60, periods: 100, \
        initials: [{q: [2]}, {q: [0], v: [1]}]}",
    );
    let table = main_table(&report);
    assert_eq!(table.rows(), 200);
    assert_eq!(floats(table, "run")[99..101], [0.0, 1.0]);
    assert_eq!(floats(table, "period")[99..101], [160.0, 61.0]);
    let q = floats(table, "q.spring");
    assert!((q[99] - q[199]).abs() < 1e-8);
    let runs = report.summary["runs"].as_array().unwrap();
    for run in runs {
        assert_eq!(run["label"], "period 1");
        for value in run["lyapunov"].as_array().unwrap() {
            // -zeta w = -0.05, to a bounded fluctuation over 100 periods.
            assert!((value.as_f64().unwrap() + 0.05).abs() < 2e-3, "{value}");
        }
    }
    let figure = report.figure.as_ref().unwrap();
    assert_eq!((figure.panels.len(), figure.panels[0].curves.len()), (1, 2));
}

#[test]
fn a_bifurcation_diagram_over_the_frequency_meets_the_closed_form() {
    let report = run(
        LINEAR,
        "{type: bifurcation_diagram, from: 0.6, to: 1.2, points: 3, direction: both, \
        transient: 80, periods: 30}",
    );
    let table = main_table(&report);
    assert_eq!(
        names(table),
        ["parameter", "run", "period", "q.spring", "v.spring"]
    );
    assert_eq!(table.rows(), 2 * 3 * 30);
    let (om, q) = (floats(table, "parameter"), floats(table, "q.spring"));
    for (om, q) in om.iter().zip(q) {
        let det = (1.0 - om * om).powi(2) + (0.1 * om).powi(2);
        assert!(
            (q - 0.5 - 0.3 * (1.0 - om * om) / det).abs() < 1e-7,
            "{om} {q}"
        );
    }
    let summary = report.table("summary").unwrap();
    assert_eq!(
        names(summary),
        ["parameter", "run", "label", "lyapunov_1", "lyapunov_2"]
    );
    let values = floats(summary, "parameter");
    for (value, wanted) in values.iter().zip([0.6, 0.9, 1.2, 1.2, 0.9, 0.6]) {
        assert!((value - wanted).abs() < 1e-15);
    }
    assert_eq!(floats(summary, "run"), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    for (a, b) in floats(summary, "lyapunov_1")
        .iter()
        .zip(floats(summary, "lyapunov_2"))
    {
        assert!((a + b + 0.1).abs() < 1e-7);
    }
}

#[test]
fn any_number_of_the_model_can_be_varied_with_the_scales_frozen() {
    // Points stand in SI units; the gap is the displacement scale of the model as written, and would change it.
    let model = format!("{TRAIN}\nreport: {{units: nondimensional}}");
    let of = |parameter: &str| {
        let text = format!(
            "{{type: bifurcation_diagram, parameter: {parameter}, at: 0.5, from: 10 um, to: 40 um, points: 4, \
              transient: 5, periods: 2, lyapunov: false}}"
        );
        run(&model, &text)
    };
    let (long, short) = (of("connections.mesh.element.half_gap"), of("mesh.half_gap"));
    // Debug text: the empty cells of the exponents are NaN.
    assert_eq!(format!("{:?}", long.tables), format!("{:?}", short.tables));
    assert_eq!(
        short.summary["parameter"],
        "connections.mesh.element.half_gap"
    );
    let summary = short.table("summary").unwrap();
    assert_eq!(summary.columns[0].unit, "m");
    let values = floats(summary, "parameter");
    for (value, wanted) in values.iter().zip([1e-5, 2e-5, 3e-5, 4e-5]) {
        assert!((value - wanted).abs() < 1e-19);
    }
    assert!(floats(summary, "lyapunov_1").iter().all(|x| x.is_nan()));
    // With a heavy mean load the train rests on the flank: q - b is the same for every gap, b over the frozen 20 um.
    let text = "{type: bifurcation_diagram, parameter: mesh.half_gap, at: 0.5, from: 10 um, to: 40 um, points: 2, \
                 transient: 40, periods: 1, lyapunov: false}";
    let q = floats(
        main_table(&run(&model.replace("amplitude: 60", "amplitude: 6"), text)),
        "q.mesh",
    );
    assert!((q[1] - q[0] - 1.5).abs() < 1e-6, "{q:?}");
}

#[test]
fn a_default_that_is_not_written_can_be_varied() {
    let text = "{type: bifurcation_diagram, parameter: mesh.damping, at: 0.5, from: 0, to: 10, points: 2, transient: 1, \
                 periods: 1}";
    assert_eq!(
        run(&format!("{TRAIN}\nreport: {{units: nondimensional}}"), text).summary["parameter"],
        "connections.mesh.damping"
    );
    let text = "{type: bifurcation_diagram, parameter: cos.0, at: 0.5, from: 0, to: 0.1, points: 2, transient: 1, \
                 periods: 1}";
    assert_eq!(
        run(PAIR, text).summary["parameter"],
        "reduced.loads.harmonics.0.cos.0"
    );
}

const SEEDED: &str = "{type: bifurcation_diagram, parameter: mesh_2.half_gap, at: 0.9, from: 0.05, to: 0.2, points: 3, \
    transient: 4, periods: 3, seeds: {count: 3, seed: 7, box: {q: [2, 1], v: [0.5, 0]}}}";
const FOLLOWED: &str = "{type: bifurcation_diagram, from: 0.9, to: 1.1, points: 3, direction: both, transient: 4, periods: 3}";
const MAPPED: &str = "{type: poincare_map, at: 0.9, transient: 4, periods: 3, initials: [{}, {q: [1, 1]}, {q: [2, 2]}]}";

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let analyses = format!("  a: {SEEDED}\n  b: {FOLLOWED}\n  c: {MAPPED}");
    let of = |jobs| run_with(PAIR, &analyses, jobs, &Quiet);
    for (one, two) in of(1).iter().zip(of(2)) {
        // Debug text: NaN cells are equal to themselves.
        assert_eq!(format!("{:?}", one.tables), format!("{:?}", two.tables));
    }
}

#[test]
fn random_states_come_from_their_seed_alone() {
    let report = run(PAIR, SEEDED);
    let table = main_table(&report);
    assert_eq!(table.rows(), 27);
    assert_eq!(
        floats(table, "run")[..7],
        [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0]
    );
    let q = floats(table, "q.mesh_1");
    assert!(
        q[0] != q[3] && q[0] != q[9],
        "every value and every seed has its own state"
    );
    let other = run(PAIR, &SEEDED.replace("seed: 7", "seed: 8"));
    assert!(floats(main_table(&other), "q.mesh_1") != q);
    assert_eq!(
        floats(report.table("summary").unwrap(), "run"),
        [0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 0.0, 1.0, 2.0]
    );
}

/// Interrupts after so many questions.
struct Impatient(AtomicUsize, AtomicBool);

impl Control for Impatient {
    fn is_interrupted(&self) -> bool {
        let left = self.0.load(Ordering::Relaxed);
        if left == 0 {
            self.1.store(true, Ordering::Relaxed);
        } else {
            self.0.store(left - 1, Ordering::Relaxed);
        }
        self.1.load(Ordering::Relaxed)
    }
}

#[test]
fn an_interruption_keeps_what_is_finished() {
    let of = |text: &str, questions| {
        let control = Impatient(AtomicUsize::new(questions), AtomicBool::new(false));
        run_with(PAIR, &format!("  it: {text}"), 1, &control).remove(0)
    };
    let history = of(
        "{type: time_history, at: 0.9, periods: 6, samples_per_period: 10}",
        4,
    );
    assert_eq!(history.ended_early.as_deref(), Some("interrupted"));
    assert_eq!(main_table(&history).rows(), 31);
    let map = of("{type: poincare_map, at: 0.9, transient: 0, periods: 9}", 4);
    assert_eq!(map.ended_early.as_deref(), Some("run 0: interrupted"));
    assert_eq!(main_table(&map).rows(), 3);
    let diagram = of(FOLLOWED, 20);
    assert_eq!(
        diagram.ended_early.as_deref(),
        Some("interrupted after 2 of 6 points")
    );
    assert_eq!(
        (
            main_table(&diagram).rows(),
            diagram.table("summary").unwrap().rows()
        ),
        (6, 2)
    );
}

#[test]
fn a_divergence_is_reported_with_what_there_is() {
    // Negative damping.
    let model = LINEAR.replace("[[0.1]]", "[[-20]]");
    let history = run(
        &model,
        "{type: time_history, at: 0.1, periods: 9, samples_per_period: 4}",
    );
    let reason = history.ended_early.unwrap();
    assert!(reason.contains("in period"), "{reason}");
    assert!(main_table_of(&history.tables).rows() >= 1);
    let diagram = run(
        &model,
        "{type: bifurcation_diagram, from: 0.1, to: 0.2, points: 3, transient: 0, periods: 9}",
    );
    let reason = diagram.ended_early.unwrap();
    assert!(
        reason.starts_with("run 0 at 1.000000e-1: ") && reason.contains("in period"),
        "{reason}"
    );
    assert_eq!(texts(&diagram.tables[1], "label"), ["undecided"]);
}

fn main_table_of(tables: &[Table]) -> &Table {
    tables.iter().find(|t| t.name.is_empty()).unwrap()
}

#[test]
fn mistakes_are_named_with_their_key() {
    let si = format!("{TRAIN}\nreport: {{units: si}}");
    let sweep = "type: bifurcation_diagram, transient: 1, periods: 1, points: 2";
    for (model, analysis, wanted) in [
        (
            LINEAR,
            "{type: time_history, at: -1}".to_string(),
            "analyses.it.at: -1 must be a frequency > 0",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, periods: 0}".into(),
            "analyses.it.periods: 0 must be at least 1",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, samples_per_period: 0}".into(),
            "samples_per_period: 0 must be at least 1",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, periods: 1000000}".into(),
            "1000000 periods of 200 samples are more than 50000000 rows",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, initial: {q: [1, 2]}}".into(),
            "analyses.it.initial.q: 2 values for 1 relative coordinates (spring)",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, initial: {v: [1 m/s]}}".into(),
            "analyses.it.initial.v.0: `1 m/s` has a unit, but a reduced model is nondimensional",
        ),
        (
            &si,
            "{type: time_history, at: 1 Hz, initial: {q: [1 um, 1 um]}}".into(),
            "analyses.it.initial.q.1: `1 um` is a length",
        ),
        (
            &si,
            "{type: time_history, at: 3}".into(),
            "the bare number 3 is ambiguous in an SI report",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, periods: 0}".into(),
            "analyses.it.periods: 0 must be at least 1",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, periods: 60000000}".into(),
            "60000000 in each of 1 runs are more than 50000000 points",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, initials: []}".into(),
            "analyses.it.initials: an empty list: nothing to run",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, initial: {}, initials: [{}]}".into(),
            "give `initial` for one run or `initials` for several, not both",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, initials: [{}, {q: []}]}".into(),
            "analyses.it.initials.1.q: 0 values for 1 relative coordinates",
        ),
        (
            LINEAR,
            "{type: bifurcation_diagram, from: 1, to: 2, points: 1}".into(),
            "analyses.it.points: 1 must be at least 2",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 1}}"),
            "analyses.it.to: 1 is where the sweep starts",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 0, to: 1}}"),
            "analyses.it.from: 0 must be a frequency > 0",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, at: 1}}"),
            "analyses.it.at: the excitation frequency is the parameter; leave `at` out",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: mesh_2.half_gap, from: 1, to: 2}}"),
            "analyses.it.at: missing: the excitation frequency at which reduced.elements.mesh_2.half_gap is varied",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: half_gap, at: 1, from: 1, to: 2}}"),
            "`half_gap` could be any of 2 numbers of the model (reduced.elements.mesh_1.half_gap, reduced.elements.mesh_2.half_gap)",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: mesh_2.half_gpa, at: 1, from: 1, to: 2}}"),
            "`mesh_2.half_gpa` is neither `frequency` nor a path of the model",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: mesh_2.half_gap, at: 1, from: -1, to: 2}}"),
            "half_gap",
        ),
        (
            &si,
            format!("{{{sweep}, parameter: mesh.half_gap, at: 1 Hz, from: 1 N, to: 2 um}}"),
            "analyses.it.from: connections.mesh.element.half_gap",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 0, seed: 1}}}}"),
            "analyses.it.seeds.count: 0 must be at least 1",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, direction: up, seeds: {{count: 1, seed: 1}}}}"),
            "with `seeds` every value is a run of its own; leave `direction` out",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, initial: {{}}, seeds: {{count: 1, seed: 1}}}}"),
            "with `seeds` the initial states are random; leave `initial` out",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 1, seed: 1, box: -1}}}}"),
            "analyses.it.seeds.box: -1 must be >= 0: a half width",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 1, seed: 1, box: {{q: [-1]}}}}}}"),
            "analyses.it.seeds.box.q.0: must be >= 0: a half width",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 1}}}}"),
            "seed",
        ),
    ] {
        let found = refusal(model, &analysis);
        assert!(
            found.contains(wanted),
            "{analysis}\n  found  {found}\n  wanted {wanted}"
        );
    }
}

#[test]
fn the_exact_flow_is_refused_with_the_connection_and_the_reason() {
    let model = LINEAR.replace("type: linear", "type: cubic, cubic: 0.1");
    for kind in [
        "time_history, at: 1",
        "poincare_map, at: 1",
        "bifurcation_diagram, from: 1, to: 2, points: 2",
    ] {
        let found = refusal(&model, &format!("{{type: {kind}, integrator: exact}}"));
        assert!(
            found.contains("integrator") && found.contains("spring"),
            "{found}"
        );
        let report = run(
            &model,
            &format!("{{type: {kind}, integrator: dopri5, periods: 1, transient: 1}}"),
        );
        assert_eq!(report.summary["integrator"], "dopri5");
    }
}
