//! Fixtures shared by the tests: published systems and reference values.

#![allow(dead_code)] // every test binary uses a part of it

use gearlash::element::Backlash;
use gearlash::element::ImpactDampingLaw;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;

/// A reference file.
pub fn reference(name: &str) -> Value {
    let path = format!("{}/tests/data/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

pub fn floats(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

pub fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(floats).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

pub fn backlash(half_gap: f64) -> Mount {
    let law = Backlash {
        half_gap,
        impact_damping: 0.0,
        impact_damping_law: ImpactDampingLaw::Dissipative,
    };
    Mount::new(Box::new(law))
}

/// mean + cos part cos(phase) in one coordinate.
pub fn load(dof: usize, coordinate: usize, mean: f64, cos: f64) -> LoadSource {
    let mut direction = DVector::zeros(dof);
    direction[coordinate] = 1.0;
    let series = Periodic::Fourier {
        mean,
        harmonics: vec![Harmonic {
            order: 1,
            cos,
            sin: 0.0,
        }],
    };
    LoadSource {
        direction,
        series,
        kind: LoadKind::Value,
    }
}

/// The system of a reference record (kappa_B, Gamma, W, b, Q0, Qcos).
pub fn system(record: &Value) -> System {
    let (gamma, kappa, w) = (
        matrix(&record["Gamma"]),
        matrix(&record["kappa_B"]),
        matrix(&record["W"]),
    );
    let mounts = floats(&record["b"]).into_iter().map(backlash).collect();
    let (mean, cos) = (floats(&record["Q0"]), floats(&record["Qcos"][0]));
    let loads = (0..gamma.nrows())
        .map(|i| load(gamma.nrows(), i, mean[i], cos[i]))
        .collect();
    System::new(gamma, kappa, w, mounts, loads).unwrap()
}
