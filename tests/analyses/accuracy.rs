//! Errors that are known: estimates, the convergence check and harmonics chosen by a tolerance, against exact orbits.

use crate::common::reference;
use crate::time_domain_support::{PAIR, floats, main_table, refusal, run, texts};
use gearlash::report::{Report, Table};
use serde_json::Value;

fn respond(model: &str, keys: &str) -> Report {
    let report = run(model, &format!("{{type: frequency_response, {keys}}}"));
    assert_eq!(report.ended_early, None);
    report
}

fn accuracy(report: &Report) -> &Table {
    report.table("accuracy").expect("the table")
}

/// Figure 11 down to its second peak, all reference frequencies solved.
fn figure_11(keys: &str) -> Report {
    let marks = "[0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 2.0, 2.2]";
    respond(
        PAIR,
        &format!("from: 2.5, to: 0.77, marks: {marks}, {keys}"),
    )
}

/// Row of the nearest point and relative errors of the r.m.s. values there, for every reference solution.
fn errors(report: &Report) -> Vec<(usize, [f64; 2])> {
    let (data, table) = (reference("fig11_case1"), main_table(report));
    let (omega, mark) = (floats(table, "omega"), floats(table, "mark"));
    let rms = [floats(table, "rms.mesh_1"), floats(table, "rms.mesh_2")];
    let solutions = data["solutions"].as_array().unwrap().iter();
    let one = |solution: &Value| {
        let number = |value: &Value| value.as_f64().unwrap();
        let exact = [0, 1].map(|k| number(&solution["q_rms"][k]));
        let here = (0..omega.len()).filter(|row| {
            mark[*row] == 1.0 && (omega[*row] - number(&solution["omega"])).abs() < 1e-12
        });
        let error = |row: usize| [0, 1].map(|k| (rms[k][row] / exact[k] - 1.0).abs());
        let all = here.map(|row| (row, error(row)));
        let size = |e: &(usize, [f64; 2])| e.1[0].max(e.1[1]);
        all.min_by(|a, b| size(a).total_cmp(&size(b))).unwrap()
    };
    solutions.filter(|s| !s.is_null()).map(one).collect()
}

#[test]
fn the_estimate_is_the_error() {
    for keys in [
        "harmonics: 5",
        "harmonics: 12",
        "harmonics: 12, samples: 256",
        "harmonics: 12, quadrature: exact",
        "harmonics: 40, quadrature: exact",
    ] {
        let report = figure_11(&format!("{keys}, error_estimate: true"));
        let table = accuracy(&report);
        let mut compared = 0;
        for (row, exact) in errors(&report) {
            for (k, mesh) in ["mesh_1", "mesh_2"].into_iter().enumerate() {
                let rms = floats(main_table(&report), &format!("rms.{mesh}"))[row];
                let estimate = floats(table, &format!("error_rms.{mesh}"))[row] / rms;
                // Orbits of the reference are good to 1e-10.
                if exact[k] > 1e-9 {
                    compared += 1;
                    let ratio = estimate / exact[k];
                    assert!((0.1..10.0).contains(&ratio), "{keys}, row {row}: {ratio}");
                }
                assert!(estimate <= floats(table, "relative_error")[row] * 1.000001);
            }
        }
        assert!(compared >= 15, "{keys}: {compared}");
    }
}

#[test]
fn a_tolerance_is_kept_with_few_harmonics() {
    let fixed = figure_11("harmonics: 40, quadrature: exact");
    for (tolerance, quadrature) in [(1e-6, "exact"), (1e-6, "sampled"), (1e-4, "exact")] {
        let chosen = format!("harmonics: {{tolerance: {tolerance:e}}}, quadrature: {quadrature}");
        let report = figure_11(&chosen);
        assert!(report.warnings.is_empty(), "{:?}", report.warnings);
        for (row, exact) in errors(&report) {
            assert!(exact[0].max(exact[1]) < tolerance, "row {row}: {exact:?}");
        }
        let harmonics = floats(accuracy(&report), "harmonics");
        let most = harmonics.iter().copied().fold(0.0, f64::max);
        assert!(harmonics.contains(&5.0) && most < 60.0, "{chosen}: {most}");
        let largest = floats(accuracy(&report), "branch_error");
        assert!(largest.iter().all(|e| *e <= tolerance));
        let sampling = floats(accuracy(&report), "sampling_error");
        let is_exact = quadrature == "exact";
        assert!(
            sampling
                .iter()
                .all(|e| *e <= tolerance && !(is_exact && *e > 1e-8))
        );
        // No event is lost or doubled where the number changes.
        let kinds = |r: &Report| texts(r.table("events").unwrap(), "kind");
        assert_eq!(kinds(&report), kinds(&fixed), "{chosen}");
        let place = |r: &Report| floats(r.table("events").unwrap(), "omega");
        for (a, b) in place(&report).iter().zip(place(&fixed)) {
            assert!((a - b).abs() < 200.0 * tolerance, "{chosen}: {a} {b}");
        }
        assert_eq!(
            floats(main_table(&report), "branch")[..],
            vec![0.0; harmonics.len()]
        );
    }
}

#[test]
fn the_convergence_check_is_the_solution_with_twice_the_harmonics() {
    let few = figure_11("harmonics: 10, quadrature: sampled, convergence_check: true");
    // The check samples four times as finely.
    let many = figure_11("harmonics: 20, samples: 4096");
    let marked = |r: &Report| -> Vec<usize> {
        let marks = floats(main_table(r), "mark");
        (0..marks.len()).filter(|k| marks[*k] == 1.0).collect()
    };
    let pairs: Vec<_> = marked(&few).into_iter().zip(marked(&many)).collect();
    assert!(pairs.len() >= 13);
    let table = accuracy(&few);
    for mesh in ["mesh_1", "mesh_2"] {
        let of = |name: &str| floats(table, &format!("{name}.{mesh}"));
        let (own, exact) = (
            floats(main_table(&few), &format!("rms.{mesh}")),
            floats(main_table(&many), &format!("rms.{mesh}")),
        );
        for (row, other) in &pairs {
            let first = of("check_rms")[*row];
            let all = first / (1.0 - of("check_truncation")[*row]);
            assert!((all / exact[*other] - 1.0).abs() < 1e-8, "{all}");
            let difference = (own[*row] / first - 1.0).abs();
            assert!((difference - of("check_difference")[*row]).abs() < 1e-12);
        }
    }
    // Next to a fold twice the harmonics may have no solution at the same frequency any more.
    let converged = floats(table, "check_converged");
    assert!(pairs.iter().all(|(row, _)| converged[*row] == 1.0));
    assert!(converged.iter().filter(|c| **c == 0.0).count() <= 3);
    assert!(few.caption.contains("with twice the harmonics"));
}

#[test]
fn low_frequencies_get_through() {
    let keys = "from: 0.1, to: 0.05, stability: false, quadrature: exact, verify: 5";
    let report = respond(
        PAIR,
        &format!("{keys}, harmonics: {{tolerance: 1.0e-6, most: 400}}"),
    );
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    let verify = report.table("verify").unwrap();
    assert!(floats(verify, "converged").iter().all(|c| *c == 1.0));
    for mesh in ["rms.mesh_1", "rms.mesh_2"] {
        let rms = floats(main_table(&report), mesh);
        let points = floats(verify, "point");
        for (point, flow) in points.iter().zip(floats(verify, mesh)) {
            assert!((rms[*point as usize] / flow - 1.0).abs() < 1e-6, "{point}");
        }
    }
}

#[test]
fn what_cannot_be_reached_is_said() {
    for (keys, wanting) in [
        (
            "quadrature: exact, harmonics: {tolerance: 1.0e-7, most: 20}",
            "at most 20 harmonics",
        ),
        (
            "samples: 1024, harmonics: {tolerance: 1.0e-7, most: 60}",
            "the samples",
        ),
    ] {
        let report = respond(PAIR, &format!("from: 1.1, to: 0.85, {keys}"));
        let error = floats(accuracy(&report), "branch_error");
        let failing = error.iter().filter(|e| **e > 1e-7).count();
        assert!(failing > 0);
        let count = error.len();
        let told = format!("{failing} of {count} points have an estimated error above 1e-7");
        let is_said = |w: &String| w.contains(&told) && w.contains(wanting);
        assert!(report.warnings.iter().any(is_said), "{:?}", report.warnings);
    }
    // Where sampling is what is off, the harmonics do not grow in vain.
    let report = respond(
        PAIR,
        "from: 0.75, to: 0.65, stability: false, harmonics: {tolerance: 1.0e-6}",
    );
    assert!(!report.warnings.iter().any(|w| w.contains("suffice")));
    assert!(
        floats(accuracy(&report), "harmonics")
            .iter()
            .all(|h| *h < 70.0)
    );
}

/// The pair with a transmission error.
const ERROR: &str = "
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements:
    mesh_1: {type: backlash, half_gap: 1.0, transmission_error: {harmonics: [{order: 3, amplitude: 0.1}]}}
    mesh_2: {type: backlash, half_gap: 0.1}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0]}]}
";

#[test]
fn other_parameters_transmission_errors_and_doubled_periods() {
    let response = "type: frequency_response, from: 1.2, to: 0.95";
    let number = "type: parameter_response, at: 1.1, parameter: modal_ratio, from: 0.05, to: 0.2";
    let doubled = "type: frequency_response, from: 2.2, to: 1.5, branches: {depth: 1}";
    let chosen = "harmonics: {tolerance: 1.0e-5}, quadrature: exact";
    let table = ERROR.replace(
        "harmonics: [{order: 3, amplitude: 0.1}]",
        "table: [0.1, 0, -0.1]",
    );
    for (model, analysis) in [
        (ERROR, response),
        (&table, response),
        (PAIR, number),
        (PAIR, doubled),
    ] {
        // The table with sampled forces, whose number of samples is chosen too.
        let chosen = match model == table {
            true => "harmonics: {tolerance: 1.0e-5}",
            false => chosen,
        };
        let report = run(model, &format!("{{{analysis}, {chosen}, verify: 3}}"));
        assert_eq!(report.ended_early, None);
        let (points, verify) = (main_table(&report), report.table("verify").unwrap());
        let number = |t: &Table| -> Vec<_> {
            floats(t, "branch")
                .into_iter()
                .zip(floats(t, "point"))
                .collect()
        };
        let (all, verified) = (number(points), number(verify));
        for mesh in ["rms.mesh_1", "rms.mesh_2"] {
            for (here, flow) in verified.iter().zip(floats(verify, mesh)) {
                let row = all.iter().position(|n| n == here).unwrap();
                let rms = floats(points, mesh)[row];
                let estimate = floats(accuracy(&report), &format!("error_{mesh}"))[row];
                let error = (rms - flow).abs();
                assert!(
                    error < 3.0 * estimate + 1e-6 * rms,
                    "{analysis} {here:?}: {error:e}"
                );
            }
        }
        let count = floats(accuracy(&report), "harmonics");
        assert!(count.windows(2).any(|w| w[0] != w[1]), "{analysis}");
    }
}

#[test]
fn mistakes() {
    for (keys, wanted) in [
        ("harmonics: {tolerance: 0.5}", "harmonics.tolerance"),
        ("harmonics: {tolerance: 1.0e-9}", "a hundred times"),
        (
            "harmonics: {tolerance: 1.0e-5, least: 30, most: 20}",
            "harmonics.most",
        ),
        (
            "harmonics: {tolerance: 1.0e-5, least: 0}",
            "harmonics.least",
        ),
        ("harmonics: {least: 5}", "`tolerance`"),
        ("harmonics: -3", "a number of harmonics or {tolerance"),
        ("harmonics: 12.5", "a number of harmonics or {tolerance"),
        ("harmonics: {tolerance: 1.0e-5, samples: 5}", "`samples`"),
        (
            "harmonics: {tolerance: 1.0e-5}, samples: 1024",
            "at least 3200",
        ),
        (
            "harmonics: {tolerance: 1.0e-5}, method: shooting",
            "not selected",
        ),
        ("error_estimate: true, method: shooting", "error_estimate"),
        (
            "convergence_check: true, method: integration",
            "convergence_check",
        ),
    ] {
        let analysis = format!("{{type: frequency_response, from: 2, to: 1, {keys}}}");
        let message = refusal(PAIR, &analysis);
        assert!(message.contains(wanted), "{keys}: {message}");
    }
}

/// Half orders make the period two revolutions: harmonics count orders of the reference, in chosen sizes and in their judgement.
#[test]
fn sizes_are_chosen_for_half_orders_too() {
    let largest = |order: &str, range: [f64; 2]| {
        let load = format!("{{order: {order}, cos: [0.25, 0]");
        let model = PAIR.replace("{order: 1, cos: [0.25, 0]", &load);
        let [from, to] = range;
        let keys = format!("from: {from}, to: {to}, harmonics: {{tolerance: 1e-3, most: 60}}");
        let report = respond(&model, &keys);
        let errors = floats(accuracy(&report), "relative_error");
        assert!(errors.iter().all(|e| *e < 1e-3), "{errors:?}");
        floats(main_table(&report), "rms.mesh_1")
            .into_iter()
            .fold(0.0_f64, f64::max)
    };
    let (whole, half) = (largest("1", [2.4, 1.7]), largest("1/2", [4.8, 3.4]));
    assert!((half / whole - 1.0).abs() < 0.01, "{half} {whole}");
}
