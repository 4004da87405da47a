//! Trains built by hand for the tests of the assembly.
#![allow(dead_code)] // Every test file takes its own share.

use gearlash::assembly::{Assembly, assemble};
use gearlash::element::{Backlash, Element, ImpactDampingLaw, Linear};
use gearlash::model::*;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use indexmap::IndexMap;
use nalgebra::DMatrix;

pub fn backlash(half_gap: f64) -> Box<dyn Element> {
    Box::new(Backlash {
        half_gap,
        impact_damping: 0.0,
        impact_damping_law: ImpactDampingLaw::Dissipative,
        contact_damping: 0.0,
    })
}

pub fn connection(arms: &[(usize, f64)], stiffness: f64, element: Box<dyn Element>) -> Connection {
    Connection {
        arms: arms.to_vec(),
        unit: DeformationUnit::Metre,
        teeth: None,
        stiffness,
        damping: 0.0,
        element,
        stiffness_variation: None,
        transmission_error: None,
        length: None,
    }
}

pub fn spring(arms: &[(usize, f64)], stiffness: f64) -> Connection {
    connection(arms, stiffness, Box::new(Linear {}))
}

/// Bodies B0, B1, .. and connections c0, c1, ..
pub fn train(inertia: &[f64], connections: Vec<Connection>) -> Train {
    let motion = Motion::Rotation;
    let body = |(k, m): (usize, &f64)| {
        let (inertia, drag) = (*m, Drag::default());
        (
            format!("B{k}"),
            Body {
                inertia,
                motion,
                drag,
            },
        )
    };
    let named = connections.into_iter().enumerate();
    Train {
        bodies: inertia.iter().enumerate().map(body).collect(),
        connections: named.map(|(k, c)| (format!("c{k}"), c)).collect(),
        damping: Damping::default(),
        loads: IndexMap::new(),
        motions: Vec::new(),
        scaling: Scaling {
            frequency: FrequencyScale::FirstMode,
            length: None,
        },
        mean_motion: None,
        balanced: Vec::new(),
        revolutions: 1,
        parts: Vec::new(),
    }
}

pub fn load(train: &mut Train, body: usize, mean: f64, cos: f64, sin: f64) {
    let harmonics = vec![Harmonic { order: 1, cos, sin }];
    let series = Periodic::Fourier { mean, harmonics };
    let others = Vec::new();
    train
        .loads
        .insert(format!("B{body}"), Load { series, others });
}

pub fn model(structure: Structure) -> Model {
    Model::of("test", structure, ReportUnits::Nondimensional)
}

pub fn assembled(train: &Train) -> Assembly {
    assemble(&model(Structure::Train(train.clone()))).unwrap()
}

pub fn refusal(train: &Train) -> String {
    let list = assemble(&model(Structure::Train(train.clone()))).unwrap_err();
    let lines = list.iter().map(ToString::to_string).collect::<Vec<_>>();
    lines.join("\n")
}

pub fn reference(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

pub fn numbers(value: &serde_json::Value) -> Vec<f64> {
    let list = value.as_array().unwrap();
    list.iter().map(|x| x.as_f64().unwrap()).collect()
}

pub fn matrix(value: &serde_json::Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(numbers).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// Largest difference relative to the largest entry.
pub fn distance(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    (a - b).amax() / b.amax()
}

/// A small generator with a fixed sequence (splitmix64), uniform in [0, 1).
pub struct Seeded(pub u64);

impl Seeded {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }
}

/// Matrix from its rows.
#[macro_export]
macro_rules! dmatrix {
    ($($($x:expr),+);+) => {{
        let rows: &[&[f64]] = &[$(&[$($x),+]),+];
        nalgebra::DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
    }};
}

/// Vector from its entries.
#[macro_export]
macro_rules! dvector {
    ($($x:expr),+) => { nalgebra::DVector::from_vec(vec![$($x),+]) };
}
