//! Borders of narrow windows of instability: linear trains with varying stiffness, whose multipliers are known from Hill's
//! determinant and from matrix exponentials (`tests/data/narrow_windows.json`).

use crate::common::reference;
use crate::time_domain_support::{floats, run, texts};
use gearlash::report::Report;
use serde_json::Value;

/// Located events but grazings, by frequency.
fn borders(report: &Report) -> Vec<(String, f64, f64)> {
    let events = report.table("events").unwrap();
    let column = |name: &str| floats(events, name);
    let (omega, located, multiplicity) =
        (column("omega"), column("located"), column("multiplicity"));
    let kinds = texts(events, "kind");
    let rows = (0..omega.len()).filter(|k| located[*k] == 1.0 && kinds[*k] != "grazing");
    let mut list: Vec<_> = rows
        .map(|k| (kinds[k].clone(), omega[k], multiplicity[k]))
        .collect();
    list.sort_by(|a, b| a.1.total_cmp(&b.1));
    list
}

fn model(parameters: &Value) -> String {
    let matrix = |key: &str| parameters[key].to_string();
    let eps = parameters["eps"].as_array().unwrap();
    let elements: String = eps
        .iter()
        .enumerate()
        .map(|(i, eps)| {
            format!(
                "    m{i}: {{type: linear, stiffness_variation: {{harmonics: [{{order: 1, amplitude: {eps}}}]}}}}\n"
            )
        })
        .collect();
    let all = |x: &str| vec![x; eps.len()].join(", ");
    format!(
        "
schema: 1
reduced:
  stiffness: {}
  damping: {{matrix: {}}}
  elements:
{elements}  loads: {{mean: [{}], harmonics: [{{order: 1, cos: [{}], sin: [{}]}}]}}
",
        matrix("kappa"),
        matrix("Gamma"),
        all("0.1"),
        all("0.01"),
        all("0")
    )
}

/// No border is missed, none invented, from either end of the range, by either method. Where a multiplier is 1 the response is
/// infinite: the branch goes on behind.
#[test]
fn every_border_is_listed_from_either_end() {
    let data = reference("narrow_windows");
    let mut cases = 0;
    for case in data["cases"].as_array().unwrap() {
        if case["parameters"]["eps"].is_null() {
            continue;
        }
        cases += 1;
        let name = case["name"].as_str().unwrap();
        let range = floats_of(&case["range"]);
        for (from, to, keys) in [
            (range[1], range[0], ""),
            (range[0], range[1], ""),
            (range[1] - 0.013, range[0], ", method: shooting"),
        ] {
            let report = run(
                &model(&case["parameters"]),
                &format!("{{type: frequency_response, from: {from}, to: {to}{keys}}}"),
            );
            let found = borders(&report);
            let wanted = case["borders"].as_array().unwrap();
            assert_eq!(found.len(), wanted.len(), "{name}{keys}: {found:?}");
            for ((kind, omega, multiplicity), border) in found.iter().zip(wanted) {
                let exact = border["omega"].as_f64().unwrap();
                assert!(
                    (omega - exact).abs() < 1e-8,
                    "{name}{keys}: {omega} {exact}"
                );
                let pair = border["multipliers_at_border"] == "complex pair";
                let word = match border["multipliers_at_border"].as_str().unwrap() {
                    "-1" => "period_doubling",
                    "+1" => "branch_point",
                    _ => "neimark_sacker",
                };
                assert_eq!(kind, word, "{name}{keys}: {omega}");
                let crossing = border["how_many_cross"].as_f64().unwrap();
                let passing = if pair {
                    2.0 * multiplicity
                } else {
                    *multiplicity
                };
                assert_eq!(passing, crossing, "{name}{keys}: {omega}");
            }
            assert_eq!(report.ended_early, None, "{name}{keys}");
        }
    }
    assert_eq!(cases, 5);
}

fn floats_of(value: &Value) -> Vec<f64> {
    crate::common::floats(value)
}
