//! The laws with memory keep the contract, and their models run: series flow, DOPRI5, shooting and Galerkin agree.

mod support;

use custom_element::{BoucWen, OneWayClutch};
use gearlash::element::conformance::check;
use std::collections::HashMap;
use std::path::PathBuf;
use std::process::Command;
use support::table;

#[test]
fn the_laws_keep_the_contract() {
    check(&OneWayClutch {}).unwrap();
    for (exponent, shape) in [(1.0, 0.5), (2.0, 0.8)] {
        let law = BoucWen {
            yield_deformation: 0.6,
            hardening: 0.2,
            exponent,
            shape,
        };
        check(&law).unwrap_or_else(|error| panic!("{law:?}: {error}"));
    }
}

fn run(model: &str) -> PathBuf {
    let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(model);
    let _ = std::fs::remove_dir_all(&out);
    let ended = Command::new(env!("CARGO_BIN_EXE_custom_element"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["run", model, "--quiet", "--out", out.to_str().unwrap()])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(0), "{said}");
    out
}

type Rows = Vec<HashMap<String, String>>;

fn values(rows: &Rows, column: &str) -> Vec<f64> {
    rows.iter().map(|r| r[column].parse().unwrap()).collect()
}

/// Largest difference of a column relative to its largest value.
fn gap(a: &Rows, b: &Rows, column: &str) -> f64 {
    let (a, b) = (values(a, column), values(b, column));
    let size = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let gaps = a.iter().zip(&b).map(|(x, y)| (x - y).abs());
    gaps.fold(0.0, f64::max) / size
}

#[test]
fn bouc_wen_by_flow_dopri5_shooting_and_galerkin() {
    let out = run("rubber_joint.yaml");
    let motion = table(&out.join("motion.csv"));
    let other = table(&out.join("second_opinion.csv"));
    for column in ["q.joint", "v.joint", "q.shaft"] {
        assert!(gap(&motion, &other, column) < 1e-8, "{column}");
    }
    let branch = table(&out.join("orbit.csv"));
    let at_mark = branch.iter().find(|r| r["mark"] == "1").unwrap();
    let at = |column: &str| -> f64 { at_mark[column].parse().unwrap() };
    assert!(at("multiplier_modulus") < 1.0 && at("stable") == 1.0 && at("neutral") == 0.0);
    // The series ends at 30 harmonics of a force with kinks.
    let series = table(&out.join("series.csv"));
    let of_series = series.iter().find(|r| r["mark"] == "1").unwrap();
    for (column, most) in [
        ("rms.joint", 1e-5),
        ("rms.shaft", 1e-5),
        ("energy_lost.joint", 1e-4),
        ("multiplier_modulus", 1e-3),
    ] {
        let value: f64 = of_series[column].parse().unwrap();
        let gap = (value / at(column) - 1.0).abs();
        assert!(gap < most, "{column}: {gap:e}");
    }
    let q = values(&motion, "q.joint");
    let q = &q[..q.len() - 1]; // the last row is the first of the next period
    let mean = q.iter().sum::<f64>() / q.len() as f64;
    let rms = (q.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / q.len() as f64).sqrt();
    assert!((rms / at("rms.joint") - 1.0).abs() < 1e-6, "{rms}");
    // Energy that the loop of the motion encloses, by the trapezoidal rule: 400 samples.
    let (x, f) = (values(&motion, "q.joint"), values(&motion, "f.joint"));
    let steps = 1..x.len();
    let work: f64 = steps
        .map(|k| 0.5 * (f[k] + f[k - 1]) * (x[k] - x[k - 1]))
        .sum();
    assert!(
        (work / at("energy_lost.joint") - 1.0).abs() < 1e-3,
        "{work}"
    );
}

#[test]
fn the_one_way_clutch_by_flow_and_dopri5() {
    let out = run("freewheel.yaml");
    let motion = table(&out.join("motion.csv"));
    let other = table(&out.join("second_opinion.csv"));
    for column in ["q.pulley", "v.pulley", "z.pulley"] {
        assert!(gap(&motion, &other, column) < 1e-8, "{column}");
    }
    // It overruns: the memory follows the deformation, to rounding, for part of the period and not for the rest.
    let (q, z) = (values(&motion, "q.pulley"), values(&motion, "z.pulley"));
    let free = q
        .iter()
        .zip(&z)
        .filter(|(q, z)| (*q - *z).abs() < 1e-12)
        .count();
    assert!(free > 50 && free < q.len() - 50, "{free} of {}", q.len());
}
