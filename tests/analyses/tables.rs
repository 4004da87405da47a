//! The key `tables`: what is computed and written.

use crate::time_domain_support::{LINEAR, PAIR, refusal, run};
use gearlash::report::Report;

fn tables(model: &str, keys: &str) -> (Report, Vec<String>) {
    let report = run(
        model,
        &format!("{{type: frequency_response, from: 2.5, to: 2.3, harmonics: 3{keys}}}"),
    );
    let list = report.tables.iter().map(|t| t.name.clone()).collect();
    (report, list)
}

#[test]
fn usual_tables_have_rattle_where_a_law_has_a_gap() {
    assert_eq!(tables(PAIR, "").1, ["", "multipliers", "events", "rattle"]);
    assert_eq!(tables(LINEAR, "").1, ["", "multipliers", "events"]);
    // Without stability there are no multipliers.
    assert_eq!(
        tables(PAIR, ", stability: false").1,
        ["", "events", "rattle"]
    );
}

#[test]
fn a_gap_at_either_end_of_the_range_counts() {
    let closed = PAIR
        .replace("half_gap: 1.0", "half_gap: 0")
        .replace("half_gap: 0.1", "half_gap: 0");
    let report = run(
        &closed,
        "{type: parameter_response, parameter: mesh_1.half_gap, at: 2.0, from: 0, to: 0.2, harmonics: 3}",
    );
    assert!(report.table("rattle").is_some());
    let (_, none) = tables(&closed, "");
    assert!(!none.contains(&"rattle".to_string()), "{none:?}");
}

#[test]
fn listed_tables_and_all() {
    assert_eq!(tables(PAIR, ", tables: [main]").1, [""]);
    assert_eq!(tables(PAIR, ", tables: [rattle]").1, ["", "rattle"]);
    let all = [
        "",
        "multipliers",
        "multiplier_estimates",
        "events",
        "rattle",
    ];
    assert_eq!(tables(PAIR, ", tables: all").1, all);
    assert_eq!(tables(LINEAR, ", tables: all").1, all);
    // What is left out changes nothing in the rest.
    let (full, _) = tables(PAIR, ", tables: all");
    let (part, _) = tables(PAIR, ", tables: [main, rattle]");
    for name in ["", "rattle"] {
        // Empty cells are NaN, which equals nothing.
        let [a, b] = [&full, &part].map(|report| format!("{:?}", report.table(name)));
        assert!(a == b, "{name}");
    }
    // Events stay in the summary.
    assert_eq!(part.summary["events"], full.summary["events"]);
}

#[test]
fn mistakes_in_the_list_are_named() {
    for (written, part) in [
        ("tables: [main, rattel]", "rattel"),
        ("tables: most", "`all`, or a list of tables"),
        ("tables: 3", "`all`, or a list of tables"),
    ] {
        let analysis = format!("{{type: frequency_response, from: 2.5, to: 2.3, {written}}}");
        let message = refusal(PAIR, &analysis);
        assert!(message.contains(part), "{written}: {message}");
    }
}
