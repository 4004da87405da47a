//! Regime maps: labels, refinement, coexistence, curves over them.

use crate::time_domain_support::*;

const QA: &str = "reduced.loads.harmonics.0.cos.0";

fn map(more: &str) -> String {
    format!(
        "{{type: regime_map, parameters: {{frequency: {{from: 1.85, to: 2.0, points: 4}}, {QA}: {{from: 0.24, to: 0.26, points: 2}}}}, \
         transient: 400, periods: 60, {more}}}"
    )
}

#[test]
fn labels_change_at_the_doubling_and_the_grid_is_refined_there() {
    let analyses = format!(
        "  it: {}",
        map("refine: 2, measures: [impacts, rms.mesh_1]")
    );
    let one = run_with(PAIR, &analyses, 1, &Quiet).remove(0);
    let three = run_with(PAIR, &analyses, 3, &Quiet).remove(0);
    assert_eq!(format!("{:?}", one.tables), format!("{:?}", three.tables));
    let table = main_table(&one);
    let (omega, qa) = (floats(table, "frequency"), floats(table, QA));
    let (labels, seed) = (texts(table, "label"), floats(table, "seed"));
    // 8 coarse cells, two seeds; refined cells beside the doubling at 1.9201 (for 0.25).
    assert!(omega.len() > 16 && omega.len() < 80, "{}", omega.len());
    for k in 0..omega.len() {
        if (qa[k] - 0.25).abs() < 1e-12
            && (omega[k] - 1.920117875889).abs() > 5e-3
            && seed[k] == 0.0
        {
            let wanted = if omega[k] > 1.92 {
                "period 1"
            } else {
                "period 2"
            };
            assert_eq!(labels[k], wanted, "{}", omega[k]);
        }
    }
    assert!(floats(table, "rms.mesh_1").iter().all(|x| *x > 0.0));
    assert!(table.column("impacts.mesh_2").is_some());
    let panels = one.figure.unwrap().panels;
    assert_eq!(panels.len(), 2);
}

#[test]
fn mistakes_are_named() {
    let unknown = refusal(PAIR, &map("measures: [impact]"));
    assert!(unknown.contains("is no column of a response"), "{unknown}");
    let curve = refusal(PAIR, &map("curves: [nope]"));
    assert!(curve.contains("no analysis is called `nope`"), "{curve}");
    let one = refusal(
        PAIR,
        "{type: regime_map, parameters: {frequency: {from: 1, to: 2, points: 4}}}",
    );
    assert!(one.contains("a map has two"), "{one}");
}

/// 20 periods beside a doubling decide nothing; the motions go on until the cells between equal neighbours have a label.
#[test]
fn cells_remain_undecided_only_where_neighbours_differ() {
    let report = run(
        PAIR,
        &format!(
            "{{type: regime_map, parameters: {{frequency: {{from: 1.9, to: 1.96, points: 13}}, {QA}: {{from: 0.25, to: 0.252, points: 2}}}}, \
             transient: 20, periods: 20, extend: 1, refine: 0, seeds: [rest], measures: []}}"
        ),
    );
    let table = main_table(&report);
    let (omega, labels) = (floats(table, "frequency"), texts(table, "label"));
    for k in 1..omega.len() - 1 {
        if labels[k] == "undecided" && omega[k - 1] < omega[k] && omega[k] < omega[k + 1] {
            let around = [&labels[k - 1], &labels[k + 1]];
            assert!(around[0] != around[1], "{} {around:?}", omega[k]);
        }
    }
    assert!(
        labels.iter().filter(|l| *l == "undecided").count() < 4,
        "{labels:?}"
    );
}

/// Cells whose motion was cut short where it had come close to an orbit have the labels of whole records.
#[test]
fn labels_are_those_of_whole_records() {
    let report = run(
        PAIR,
        &format!(
            "{{type: regime_map, parameters: {{frequency: {{from: 0.9, to: 2.1, points: 9}}, {QA}: {{from: 0.25, to: 0.3, points: 2}}}}, \
             refine: 0, seeds: [rest], measures: [impacts]}}"
        ),
    );
    let table = main_table(&report);
    let (omega, qa, labels) = (
        floats(table, "frequency"),
        floats(table, QA),
        texts(table, "label"),
    );
    let mut compared = 0;
    for k in (0..omega.len()).filter(|k| qa[*k] == 0.25 && labels[*k].starts_with("period")) {
        let whole = run(
            PAIR,
            &format!(
                "{{type: poincare_map, at: {}, transient: 2000, periods: 100}}",
                omega[k]
            ),
        );
        let wanted = &texts(whole.table("summary").unwrap(), "label")[0];
        assert_eq!(&labels[k], wanted, "{}", omega[k]);
        compared += 1;
    }
    assert!(compared > 3, "{labels:?}");
}

/// Contacts are measured alone where nothing else is wanted: the columns are the same to the bit, also of a stop, whose slow impacts do not
/// count, and of a mesh that never separates.
#[test]
fn contacts_measured_alone_are_the_same() {
    let stop = "
schema: 1
reduced:
  stiffness: [[1.0, 1.0]]
  damping: {matrix: [[0.1]]}
  elements: {spring: {type: linear}, stop: {type: rigid_stop, gap: 0.5, side: positive, restitution: 0.6}}
  element_map: [[1], [1]]
  loads: {mean: [0.1], harmonics: [{order: 1, cos: [0.5], sin: [0]}]}
";
    for (model, range) in [(PAIR, (0.9, 1.5)), (stop, (0.6, 1.4))] {
        let columns = |measures: &str| {
            let report = run(
                model,
                &format!(
                    "{{type: regime_map, parameters: {{frequency: {{from: {}, to: {}, points: 5}}, {QA}: {{from: 0.1, to: 0.5, points: 4}}}}, \
                     refine: 0, seeds: [rest], measures: {measures}}}",
                    range.0, range.1
                ),
            );
            let table = main_table(&report).clone();
            let names = table.columns.iter().map(|c| c.name.clone());
            let own = names.filter(|name| name.contains("impact") || name.contains("contact"));
            let own: Vec<String> = own.collect();
            own.into_iter()
                .map(|name| {
                    let bits = floats(&table, &name).into_iter().map(f64::to_bits);
                    (name, bits.collect::<Vec<u64>>())
                })
                .collect::<Vec<_>>()
        };
        let kinds = "impacts, impacts_back, impact_velocity_max, contact_front, contact_loss";
        let alone = columns(&format!("[{kinds}]"));
        assert_eq!(alone.len(), 10);
        assert!(alone[0].1.iter().chain(&alone[1].1).any(|x| *x > 0));
        assert_eq!(alone, columns(&format!("[{kinds}, rms]")));
    }
}
