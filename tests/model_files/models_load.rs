//! The models that come with the program: all of them load, and the paper's cases have the paper's numbers.

use gearlash::study::Study;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models")
}

fn load(name: &str) -> Study {
    Study::load(&folder().join(name), &[], &[]).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// kappa = [[1 + x, x], [x, 1 + x]] and mean loads (0.5, 0.5) to rounding.
fn is_the_papers(study: &Study, x: f64) {
    let kappa = study.assembly.system.stiffness();
    for i in 0..2 {
        for j in 0..2 {
            let wanted = x + if i == j { 1.0 } else { 0.0 };
            let found = kappa[(i, j)];
            assert!((found - wanted).abs() < 1e-12, "kappa[{i}, {j}] = {found}");
        }
    }
    let rest = gearlash::solve::equilibrium::equilibrium(&study.assembly.system).unwrap();
    // kappa (z - b) = (0.5, 0.5) has equal deflections beyond the gaps.
    let deflection = 0.5 / (1.0 + 2.0 * x);
    for (e, half_gap) in [1.0, 0.1].into_iter().enumerate() {
        let found = rest.deformation[e] - half_gap;
        assert!((found - deflection).abs() < 1e-12, "{e}: {found}");
    }
    let mean = &gearlash::assembly::summary(&study.model, &study.assembly)["mean_load"];
    for i in 0..2 {
        assert!((mean[i].as_f64().unwrap() - 0.5).abs() < 1e-12, "{mean}");
    }
}

#[test]
fn every_model_loads_without_warnings_and_rests_somewhere() {
    let mut count = 0;
    for entry in std::fs::read_dir(folder()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".yaml") {
            let study = load(&name);
            assert!(!study.runs.is_empty(), "{name} has no analyses");
            let warnings = (&study.model.warnings, &study.assembly.warnings);
            assert!(
                warnings.0.is_empty() && warnings.1.is_empty(),
                "{name}: {warnings:?}"
            );
            let rest = gearlash::solve::equilibrium::equilibrium(&study.assembly.system);
            assert!(rest.is_ok(), "{name} rests nowhere");
            count += 1;
        }
    }
    assert!(count >= 10, "{count} models");
}

#[test]
fn reverse_idler_is_case_1() {
    let study = load("reverse_idler.yaml");
    is_the_papers(&study, 1.0);
    let frequencies = &study.assembly.natural_frequencies;
    assert!((frequencies[0] - 1.0).abs() < 1e-12);
    assert!((frequencies[1] - 3f64.sqrt()).abs() < 1e-12);
    let names: Vec<&str> = study.runs.iter().map(|r| r.name.as_str()).collect();
    let figures = [
        "fig_02", "fig_03a", "fig_03b", "fig_04a", "fig_04b", "fig_07", "fig_08", "fig_10",
        "fig_11", "fig_12", "fig_16", "fig_17",
    ];
    assert_eq!(names, figures);
}

#[test]
fn heavy_idler_is_case_2() {
    let study = load("reverse_idler_heavy_idler.yaml");
    is_the_papers(&study, 0.4248);
    let frequencies = &study.assembly.natural_frequencies;
    assert!((frequencies[0] - 1.0).abs() < 1e-12);
    assert!((frequencies[1] - 1.36).abs() < 1e-12);
    let names: Vec<&str> = study.runs.iter().map(|r| r.name.as_str()).collect();
    let figures = [
        "fig_05a", "fig_05b", "fig_05c", "fig_06a", "fig_06b", "fig_06c", "fig_09", "fig_13",
        "fig_14", "fig_15",
    ];
    assert_eq!(names, figures);
}
