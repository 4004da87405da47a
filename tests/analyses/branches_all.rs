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
            assert_eq!(omega[row], floats(events, "omega")[event]);
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
        .any(|w| w.contains("was not followed"));
    assert!(told, "{:?}", report.warnings);
    let primary = respond("shooting", "primary");
    assert!(primary.tables.iter().all(|t| t.name != "branches"));
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
