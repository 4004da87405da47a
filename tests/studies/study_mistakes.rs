//! Mistakes in parameter studies: found before anything runs, at the right line, with the nearest known name.

use crate::program::{Place, REDUCED};

const ANALYSIS: &str = "analysis: {type: frequency_response, from: 2.0, to: 1.9, harmonics: 3}";
const COLLECT: &str = "collect: {peak: {column: rms.mesh, reduce: max}}";
const GRID: &str = "grid: {mesh.half_gap: [1, 2]}";

#[track_caller]
fn refused(parts: &[&str], says: &[&str]) {
    let body: String = parts.iter().map(|part| format!("    {part}\n")).collect();
    let place = Place::with(&format!(
        "{REDUCED}  study:\n    type: parameter_study\n{body}"
    ));
    place.run(&["run", "m.yaml"]).ends_with(2).says(says);
    assert_eq!(place.names("."), ["m.yaml"], "nothing is written");
}

#[test]
fn paths_and_values() {
    for (parameters, says) in [
        (
            "grid: {mush.half_gap: [1]}",
            &["`mush.half_gap` is neither", "mesh.half_gap"][..],
        ),
        ("grid: {mesh.half_gap: []}", &["an empty list", "m.yaml:13"]),
        ("grid: {}", &["nothing varies"]),
        (
            "grid: {mesh.half_gap: {from: 1, to: 2, points: 1}}",
            &["1 must be at least 2"],
        ),
        (
            "grid: {mesh.half_gap: {from: 1, to: 2}}",
            &["`points` is missing"],
        ),
        (
            "grid: {mesh.half_gap: {from: 0, to: 2, points: 3, spacing: logarithmic}}",
            &["two ends of one sign"],
        ),
        (
            "grid: {mesh.half_gap: [1, -1]}",
            &["grid.mesh.half_gap.1", "found -1.0, must be >= 0"],
        ),
        (
            "grid: {mesh.half_gap: [5 um]}",
            &["has a unit, wanted a bare number"],
        ),
        (
            "grid: {mesh.half_gap: [1], reduced.elements.mesh.half_gap: [2]}",
            &["leads to the same place"],
        ),
        (
            "grid: {frequency: [1]}",
            &["does not run at one frequency", "analysis.from"],
        ),
        (
            "grid: {analysis.form: [1]}",
            &["unknown key `form`", "did you mean `from`?"],
        ),
        ("grid: {analysis.type: [modes]}", &["cannot vary"]),
        (
            "grid: {analysis.harmonics: [3, many]}",
            &["the text `many`", "a number of harmonics"],
        ),
        (
            "grid: {analyses.lines.points: [3]}",
            &["only settings of the analysis that the study runs"],
        ),
        ("list: []", &["nothing to run"]),
        (
            "list: [{mesh.half_gap: 1}, {mesh.half_gap: 2, damping.modal_ratio: 0.1}]",
            &["the first row has no `damping.modal_ratio`"],
        ),
        (
            "list: [{mesh.half_gap: 1, damping.modal_ratio: 0.1}, {mesh.half_gap: 2}]",
            &["`damping.modal_ratio` is missing", "every row"],
        ),
        (
            "plot: {x: mesh.half_gap, y: [peak]}",
            &["exactly one of `grid`, `list` and `sample`"],
        ),
    ] {
        refused(&[parameters, ANALYSIS, COLLECT], says);
    }
    refused(
        &[GRID, "list: [{mesh.half_gap: 1}]", ANALYSIS, COLLECT],
        &["exactly one of"],
    );
}

#[test]
fn samples() {
    let sample = |text: &str| {
        format!("sample: {{count: 10, seed: 1, parameters: {{mesh.half_gap: {{{text}}}}}}}")
    };
    for (text, says) in [
        (
            "distribution: gauss",
            &["`gauss` is not known here", "uniform, normal, lognormal"][..],
        ),
        ("distribution: uniform, low: 1", &["high", "missing"]),
        (
            "distribution: uniform, low: 2, high: 1",
            &["must be above `low`"],
        ),
        (
            "distribution: uniform, low: 1, high: 2, mean: 1",
            &["given by `low` and `high`"],
        ),
        ("distribution: normal, mean: 1", &["deviation", "missing"]),
        (
            "distribution: normal, mean: 1, deviation: 0",
            &["must be > 0"],
        ),
        (
            "distribution: normal, mean: 1, deviation: 0.01, low: 3",
            &["nothing of the distribution"],
        ),
        (
            "distribution: lognormal, mean: -1, deviation: 1",
            &["must be > 0 for a lognormal"],
        ),
        (
            "distribution: normal, mean: 1, deviation: 1, low: -2, high: 3",
            &["half_gap", ">= 0"],
        ),
    ] {
        refused(&[&sample(text), ANALYSIS, COLLECT], says);
    }
    let zero = "sample: {count: 0, seed: 1, parameters: {mesh.half_gap: {distribution: uniform, low: 1, high: 2}}}";
    refused(
        &[zero, ANALYSIS, COLLECT],
        &["sample.count", "0 must be from 1"],
    );
    let unseeded =
        "sample: {count: 3, parameters: {mesh.half_gap: {distribution: uniform, low: 1, high: 2}}}";
    refused(&[unseeded, ANALYSIS, COLLECT], &["`seed` is missing"]);
    refused(
        &[
            "sample: {count: 3, seed: 1, parameters: {}}",
            ANALYSIS,
            COLLECT,
        ],
        &["nothing varies"],
    );
}

#[test]
fn analyses() {
    for (analysis, says) in [
        (
            "analysis: respose",
            &[
                "no analysis is called `respose`",
                "did you mean `response`?",
            ][..],
        ),
        ("analysis: study", &["a study cannot run a study"]),
        (
            "analysis: {type: parameter_study}",
            &["a study cannot run a study"],
        ),
        (
            "analysis: {type: frequency_respnse}",
            &["did you mean `frequency_response`?"],
        ),
        ("analysis: {from: 1}", &["needs a `type`"]),
        ("analysis: 3", &["found 3, wanted the name of an analysis"]),
        (
            "analysis: {type: frequency_response, from: 2, too: 1}",
            &["unknown key `too`", "m.yaml:14"],
        ),
        (
            "analysis: {type: frequency_response, from: 2, to: 1, harmonics: 0}",
            &["analysis.harmonics", "at least 1"],
        ),
        (
            "analysis: {type: modes, title: nice}",
            &["belongs to the study"],
        ),
    ] {
        refused(&[GRID, analysis, COLLECT], says);
    }
}

#[test]
fn quantities() {
    let collect = |text: &str| format!("collect: {{it: {{{text}}}}}");
    for (text, says) in [
        (
            "column: rms.mush, reduce: max",
            &["no column `rms.mush`", "did you mean `rms.mesh`?"][..],
        ),
        (
            "table: event, column: omega, reduce: first",
            &["no table `event`", "did you mean `events`?"],
        ),
        (
            "column: rms.mesh, reduce: biggest",
            &["`biggest` is not known here"],
        ),
        ("column: rms.mesh", &["`reduce` is missing"]),
        ("reduce: max", &["missing: which column?"]),
        ("column: method, reduce: max", &["holds words"]),
        (
            "column: rms.mesh, reduce: argmax, by: method",
            &["holds words"],
        ),
        (
            "column: rms.mesh, reduce: argmax, by: omga",
            &["did you mean `omega`?"],
        ),
        (
            "column: rms.mesh, reduce: {at: 5 Hz}",
            &["has a unit, but a reduced model"],
        ),
        (
            "table: events, reduce: count, where: {kind: folds}",
            &["no event is called `folds`", "did you mean `fold`?"],
        ),
        (
            "table: events, reduce: count, where: {knd: fold}",
            &["did you mean `kind`?"],
        ),
    ] {
        refused(&[GRID, ANALYSIS, &collect(text)], says);
    }
    refused(&[GRID, ANALYSIS, "collect: {}"], &["nothing to collect"]);
    refused(
        &[GRID, ANALYSIS, "collect: {run: {reduce: count}}"],
        &["another column", "has this name"],
    );
    refused(
        &[
            GRID,
            ANALYSIS,
            COLLECT,
            "plot: {x: mesh.half_gap, y: [pek]}",
        ],
        &["did you mean `peak`?"],
    );
    refused(
        &[GRID, ANALYSIS, COLLECT, "plot: {x: status}"],
        &["holds words, wanted numbers"],
    );
    // Independent mistakes come in one go.
    refused(
        &[
            "grid: {mesh.half_gap: []}",
            "analysis: {type: modes, points: x}",
            COLLECT,
        ],
        &["an empty list", "the text `x`"],
    );
}

#[test]
fn shards_and_merges() {
    let place = Place::with(REDUCED);
    for (arguments, says) in [
        (
            &["run", "m.yaml", "--shard", "0/2"][..],
            &["counts from 1"][..],
        ),
        (&["run", "m.yaml", "--shard", "3/2"], &["no part 3 of 2"]),
        (&["run", "m.yaml", "--shard", "half"], &["INDEX/COUNT"]),
        (
            &["run", "m.yaml", "--shard", "1/2"],
            &["no parameter_study to run"],
        ),
        (&["merge", "--out", "x"], &["DIR"]),
        (
            &["merge", "nowhere", "--out", "x"],
            &["cannot read", "manifest.json"],
        ),
        (&["merge", ".", "--out", "."], &["is one of the parts"]),
    ] {
        place.run(arguments).ends_with(2).says(says);
    }
    assert_eq!(place.names("."), ["m.yaml"]);
    place.run(&["run", "m.yaml", "--out", "plain"]).ends_with(0);
    place
        .run(&["merge", "plain", "--out", "x"])
        .ends_with(2)
        .says(&["holds no part of a study"]);
}
