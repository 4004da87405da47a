//! `branches: all` in analyses: what begins at the events of a branch, in tables and summary.

use crate::time_domain_support::{PAIR, floats, refusal, run, texts};
use gearlash::report::{Report, Table};
use serde_json::json;

fn table<'r>(report: &'r Report, name: &str) -> &'r Table {
    report.table(name).expect("the table")
}

fn respond(method: &str, branches: &str) -> Report {
    let range = "from: 2.5, to: 1.3";
    run(
        PAIR,
        &format!("{{type: frequency_response, {range}, method: {method}, branches: {branches}}}"),
    )
}

#[test]
fn doubled_branches_connect_the_period_doublings() {
    for method in ["galerkin", "shooting"] {
        let report = respond(method, "{depth: 1}");
        assert_eq!(report.ended_early, None);
        let branches = table(&report, "branches");
        let kinds = texts(branches, "kind");
        assert_eq!(kinds, ["start", "period_doubling", "period_doubling"]);
        assert_eq!(
            texts(branches, "end"),
            ["range_reached", "joined", "joined"],
            "{method}"
        );
        assert_eq!(floats(branches, "subharmonic"), [1.0, 2.0, 2.0]);
        assert!(floats(branches, "parent")[0].is_nan());
        assert_eq!(floats(branches, "parent")[1..], [0.0, 0.0]);
        // Every branch begins at its event.
        let (points, events) = (table(&report, ""), table(&report, "events"));
        let (number, omega) = (floats(points, "branch"), floats(points, "omega"));
        for (branch, event) in floats(branches, "event").iter().enumerate().skip(1) {
            let row = number.iter().position(|b| *b == branch as f64).unwrap();
            let event = *event as usize;
            // On the branch of the method itself; `omega` is the value of the flow.
            let own = match method {
                "galerkin" => floats(events, "omega_method")[event],
                _ => floats(events, "omega")[event],
            };
            assert_eq!(omega[row], own);
            assert_eq!(texts(events, "kind")[event], "period_doubling");
        }
        assert_eq!(report.summary["branches"][1]["subharmonic"], json!(2));
        assert_eq!(report.summary["branches"][1]["parent"], json!(0));
        // Once more, to the bit.
        let again = respond(method, "{depth: 1}");
        assert_eq!(
            floats(table(&again, ""), "rms.mesh_1"),
            floats(points, "rms.mesh_1")
        );
    }
}

#[test]
fn limits_are_kept_and_said() {
    let report = respond("shooting", "{depth: 1, limit: 2}");
    assert_eq!(floats(table(&report, "branches"), "branch"), [0.0, 1.0]);
    let told = report
        .warnings
        .iter()
        .any(|w| w.contains("were not followed"));
    assert!(told, "{:?}", report.warnings);
    let primary = respond("shooting", "primary");
    assert!(primary.tables.iter().all(|t| t.name != "branches"));
}

/// Parameters of the period doublings of every branch, by branch.
fn doublings(report: &Report) -> Vec<(f64, f64)> {
    let events = table(report, "events");
    let (kinds, branch) = (texts(events, "kind"), floats(events, "branch"));
    let value = floats(events, "parameter");
    (0..kinds.len())
        .filter(|k| kinds[*k] == "period_doubling")
        .map(|k| (branch[k], value[k]))
        .collect()
}

/// Figure 7's cascade: the doubled branch is doubled again, along a number of the model.
#[test]
fn a_doubled_branch_is_doubled_again_by_both_methods() {
    let model = PAIR.replace("half_gap: 0.1", "half_gap: 1.0");
    let respond = |method: &str| {
        let range = "at: 0.2, parameter: cos.0, from: 0.274, to: 0.2811";
        let text = format!(
            "{{type: parameter_response, {range}, method: {method}, branches: {{depth: 2}}}}"
        );
        let report = run(&model, &text);
        let branches = table(&report, "branches");
        assert_eq!(floats(branches, "subharmonic"), [1.0, 2.0, 4.0], "{method}");
        assert_eq!(floats(branches, "parent")[1..], [0.0, 1.0], "{method}");
        let events = table(&report, "events");
        for (branch, event) in floats(branches, "event").iter().enumerate().skip(1) {
            let row = *event as usize;
            assert_eq!(texts(events, "kind")[row], "period_doubling");
            assert_eq!(floats(events, "branch")[row], (branch - 1) as f64);
        }
        doublings(&report)
    };
    let shooting = respond("shooting");
    assert_eq!(shooting.len(), 2);
    assert!((shooting[0].1 - 0.2754).abs() < 1e-4 && (shooting[1].1 - 0.2810).abs() < 1e-4);
    let galerkin = respond("galerkin, harmonics: 40, quadrature: exact");
    assert_eq!(galerkin.len(), shooting.len());
    for (g, s) in galerkin.iter().zip(&shooting) {
        assert_eq!(g.0, s.0);
        // Truncation: 1.2e-5 with 48 harmonics, 1.5e-6 with 80.
        assert!((g.1 - s.1).abs() < 5e-5, "{g:?} {s:?}");
    }
}

/// Subharmonic index, kind of origin and value of the origin of every side branch whose origin lies between two values.
fn origins(report: &Report, (low, high): (f64, f64)) -> Vec<(f64, String, f64)> {
    let branches = table(report, "branches");
    let values = floats(table(report, "events"), "parameter");
    let (nu, kinds) = (floats(branches, "subharmonic"), texts(branches, "kind"));
    let rows = floats(branches, "event").into_iter().enumerate();
    let origins = rows.filter(|(_, event)| event.is_finite());
    let mut list: Vec<_> = origins
        .map(|(k, event)| (nu[k], kinds[k].clone(), values[event as usize]))
        .filter(|(_, _, value)| (low..=high).contains(value))
        .collect();
    list.sort_by(|a, b| a.2.total_cmp(&b.2));
    list
}

/// Figures 7 and 11: the branches do not depend on how wide the range around them is.
#[test]
fn branches_do_not_depend_on_the_width_of_the_range() {
    let figure_7 = PAIR.replace("half_gap: 0.1", "half_gap: 1.0");
    let along = "type: parameter_response, at: 0.2, parameter: cos.0, branches: {depth: 2}";
    let frequency = "type: frequency_response, branches: {depth: 1}";
    let cases = [
        (
            figure_7.as_str(),
            along,
            [
                (0.2745, 0.2811),
                (0.274, 0.282),
                (0.272, 0.283),
                (0.27, 0.285),
                (0.26, 0.29),
            ],
            (0.2746, 0.28105),
        ),
        (
            PAIR,
            frequency,
            // The branch that joins the main one at 1.4159 begins at 1.9201.
            [
                (1.95, 1.3),
                (2.1, 1.25),
                (2.5, 1.2),
                (3.0, 1.15),
                (4.0, 1.1),
            ],
            (1.31, 1.94),
        ),
    ];
    for (model, keys, ranges, window) in cases {
        let mut first: Option<Vec<(f64, String, f64)>> = None;
        for (from, to) in ranges {
            let keys = format!("{{{keys}, method: shooting, from: {from}, to: {to}}}");
            let found = origins(&run(model, &keys), window);
            assert!(!found.is_empty(), "{from}..{to}");
            let first = first.get_or_insert_with(|| found.clone());
            assert_eq!(
                found.len(),
                first.len(),
                "{from}..{to}: {found:?} {first:?}"
            );
            for (a, b) in found.iter().zip(first.iter()) {
                assert_eq!((a.0, &a.1), (b.0, &b.1), "{from}..{to}");
                assert!((a.2 - b.2).abs() < 1e-8, "{from}..{to}: {} {}", a.2, b.2);
            }
        }
    }
}

#[test]
fn a_narrow_s_of_a_doubled_branch_is_followed_through() {
    // Its folds are 2e-4 apart, between grazings at which the branch bends sharply.
    let model = PAIR.replace("half_gap: 0.1", "half_gap: 1.0");
    let folds = |more: &str| -> Vec<f64> {
        let report = run(
            &model,
            &format!(
                "{{type: parameter_response, at: 0.2, parameter: cos.0, from: 0.274, to: 0.2811, method: shooting, \
                 branches: {{depth: 1}}{more}}}"
            ),
        );
        let events = table(&report, "events");
        let all = floats(events, "parameter").into_iter();
        let kinds = texts(events, "kind").into_iter();
        let folds = all.zip(kinds).filter(|(_, kind)| kind == "fold");
        folds.map(|(parameter, _)| parameter).collect()
    };
    let (found, slowly) = (folds(""), folds(", max_step: 0.002"));
    assert_eq!(found.len(), 3);
    assert!((found[1] - 0.280_436_9).abs() < 1e-7 && (found[2] - 0.280_248_5).abs() < 1e-7);
    for (a, b) in found.iter().zip(&slowly) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

/// p x + x^2 + x^3 with x = q - shift: rest at x = 0 for every p crosses the parabola p = -x - x^2 at p = 0, and both arms of the
/// parabola are there on both sides: one turns at x = -1/2.
#[test]
fn both_arms_leave_a_transcritical_crossing() {
    // The second rests without load, where every term of the equation vanishes.
    for (shift, load, methods) in [
        (0.8, 1.0, &["shooting", "galerkin, harmonics: 3"][..]),
        (0.0, 0.0, &["shooting"]),
    ] {
        let model = format!(
            "\nschema: 1\nreduced:\n  stiffness: [[1]]\n  damping: {{matrix: [[0.2]]}}\n  elements: {{spring: {{type: expression, \
             force: {load} + p*(q - {shift}) + (q - {shift})^2 + (q - {shift})^3, parameters: {{p: 0.3}}}}}}\n  loads: {{mean: [{load}]}}\n"
        );
        for method in methods {
            let report = run(
                &model,
                &format!(
                    "{{type: parameter_response, at: 1.3, parameter: elements.spring.parameters.p, from: 0.3, to: -0.3, \
                     marks: [0.1, -0.1], method: {method}, branches: all}}"
                ),
            );
            let events = table(&report, "events");
            let crossing = texts(events, "kind")
                .iter()
                .position(|k| k == "branch_point");
            let parameter = floats(events, "parameter")[crossing.expect("a crossing")];
            assert!(parameter.abs() < 1e-7, "{method}: {parameter:e}");
            let points = table(&report, "");
            let (branch, p) = (floats(points, "branch"), floats(points, "parameter"));
            let mean = floats(points, "mean.spring");
            let x_at = |number: f64, mark: f64| -> Vec<f64> {
                let rows = (0..branch.len()).filter(|r| branch[*r] == number && p[*r] == mark);
                rows.map(|r| mean[r] - shift).collect()
            };
            let root = |mark: f64, sign: f64| 0.5 * (-1.0 + sign * (1.0 - 4.0 * mark).sqrt());
            // Forward: x > 0, to the end of the range. Backward: round the turn and through both marks.
            for (number, expected) in [
                (1.0, vec![(-0.1, root(-0.1, 1.0))]),
                (
                    2.0,
                    vec![
                        (0.1, root(0.1, 1.0)),
                        (0.1, root(0.1, -1.0)),
                        (-0.1, root(-0.1, -1.0)),
                    ],
                ),
            ] {
                let found = [0.1, -0.1].map(|mark| x_at(number, mark)).concat();
                assert_eq!(found.len(), expected.len(), "{method}, {number}: {found:?}");
                for (x, (_, wanted)) in found.iter().zip(&expected) {
                    assert!((x - wanted).abs() < 1e-8, "{method}: {x} {wanted}");
                }
            }
        }
    }
}

#[test]
fn mistakes() {
    for (extra, wanted) in [
        ("branches: some", "branches"),
        ("branches: {depth: 0}", "branches.depth"),
        ("branches: {limit: 0}", "branches.limit"),
        ("branches: all, stability: false", "stability: false"),
        ("branches: all, method: integration", "attractors"),
    ] {
        let analysis = format!("{{type: frequency_response, from: 2, to: 1, {extra}}}");
        let message = refusal(PAIR, &analysis);
        assert!(message.contains(wanted), "{extra}: {message}");
    }
}
