//! Poincaré maps and bifurcation diagrams from the model file to the tables.

use crate::time_domain_support::*;

const SEEDED: &str = "{type: bifurcation_diagram, parameter: mesh_2.half_gap, at: 0.9, from: 0.05, to: 0.2, points: 3, \
    transient: 4, periods: 3, seeds: {count: 3, seed: 7, box: {q: [2, 1], v: [0.5, 0]}}}";
const FOLLOWED: &str = "{type: bifurcation_diagram, from: 0.9, to: 1.1, points: 3, direction: both, transient: 4, periods: 3}";
const MAPPED: &str = "{type: poincare_map, at: 0.9, transient: 4, periods: 3, initials: [{}, {q: [1, 1]}, {q: [2, 2]}]}";

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
