//! Fixtures shared by the tests: published systems and reference values.

#![allow(dead_code)] // every test binary uses a part of it

use gearlash::element::{Backlash, ImpactDampingLaw};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::postprocess::measures::Meter;
use gearlash::solve::branch::{self, Begin, Branch, Recorder, TraceOptions};
use gearlash::solve::continuation::{ContinuationOptions, Crossings};
use gearlash::solve::events::Resolution;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::solve::newton::NewtonOptions;
use gearlash::solve::orbit::Orbit;
use gearlash::solve::residual::PeriodicResidual;
use gearlash::solve::shooting::Shooting;
use gearlash::solve::start::{self, Start, StartMode};
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
        contact_damping: 0.0,
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

/// The system of `one_dof_backlash.json`: q'' + 2 zeta q' + f(q) = Fm + Fa cos(Om T), unit gap.
pub fn one_dof(data: &Value) -> System {
    let number = |key: &str| data[key].as_f64().unwrap();
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let loads = vec![load(1, 0, number("Fm"), number("Fa"))];
    let mounts = vec![backlash(1.0)];
    System::new(one(2.0 * number("zeta")), one(1.0), one(1.0), mounts, loads).unwrap()
}

/// A branch traced with the settings of an analysis: start, Galerkin, continuation.
pub fn trace(
    system: &System,
    range: (f64, f64),
    harmonics: usize,
    samples: Option<usize>,
    marks: &[f64],
) -> Branch {
    let samples = samples.unwrap_or(GalerkinOptions::default_samples(
        harmonics,
        system.subharmonic(),
    ));
    balance(
        system,
        range,
        GalerkinOptions { harmonics, samples },
        marks,
        0.1,
    )
}

/// As above, with a given largest step.
pub fn balance(
    system: &System,
    range: (f64, f64),
    size: GalerkinOptions,
    marks: &[f64],
    max_step: f64,
) -> Branch {
    let problem = Galerkin::new(FrequencyFamily::new(system.clone()), range.0, size).unwrap();
    balance_problem(system, problem, range, size, marks, max_step)
}

/// As above, with forces integrated in closed form.
pub fn balance_exactly(
    system: &System,
    range: (f64, f64),
    harmonics: usize,
    marks: &[f64],
    max_step: f64,
) -> Branch {
    let samples = GalerkinOptions::default_samples(harmonics, system.subharmonic());
    let size = GalerkinOptions { harmonics, samples };
    let problem = Galerkin::new(FrequencyFamily::new(system.clone()), range.0, size)
        .and_then(|p| p.with_exact_quadrature(range.0))
        .unwrap();
    balance_problem(system, problem, range, size, marks, max_step)
}

fn balance_problem(
    system: &System,
    mut problem: Galerkin<FrequencyFamily>,
    range: (f64, f64),
    size: GalerkinOptions,
    marks: &[f64],
    max_step: f64,
) -> Branch {
    let u = first_solution(system, range.0, size);
    let mut options = trace_options(system, range, marks, max_step);
    options.continuation.weight = 1.0 / system.dof() as f64;
    let meter = Meter::new(size.samples);
    branch::trace(
        &mut problem,
        Begin::Guess(u),
        &options,
        &mut RecordMeasures { meter },
    )
    .unwrap()
    .unwrap()
}

/// A branch traced by shooting, started from a Galerkin orbit.
pub fn shoot(
    system: &System,
    range: (f64, f64),
    marks: &[f64],
    choice: IntegratorChoice,
    max_step: f64,
) -> Branch {
    let size = GalerkinOptions {
        harmonics: 12,
        samples: 1024,
    };
    let u = first_solution(system, range.0, size);
    let family = || FrequencyFamily::new(system.clone());
    let mut state = vec![0.0; 2 * system.dof()];
    let orbit = Galerkin::new(family(), range.0, size)
        .unwrap()
        .orbit(&u, range.0)
        .unwrap();
    orbit.state(0.0, &mut state);
    let mut problem = Shooting::new(family(), range.0, choice).unwrap();
    let mut options = trace_options(system, range, marks, max_step);
    options.continuation.newton.tolerance = 1e-12;
    let meter = Meter::new(16);
    branch::trace(
        &mut problem,
        Begin::Guess(DVector::from_vec(state)),
        &options,
        &mut RecordMeasures { meter },
    )
    .unwrap()
    .unwrap()
}

fn first_solution(system: &System, frequency: f64, size: GalerkinOptions) -> DVector<f64> {
    let newton = NewtonOptions::default();
    match start::find(system, frequency, size, StartMode::Auto, newton).unwrap() {
        Start::Found { u, .. } => u,
        Start::Failed(reasons) => panic!("no start: {reasons:?}"),
    }
}

/// Settings with multipliers and no known crossings.
pub fn trace_options(
    system: &System,
    range: (f64, f64),
    marks: &[f64],
    max_step: f64,
) -> TraceOptions {
    let continuation = ContinuationOptions {
        range,
        step: max_step.min(0.02),
        min_step: 1e-8,
        max_step,
        max_points: 100_000,
        weight: 0.5 / system.dof() as f64,
        newton: NewtonOptions::default(),
        crossings: Crossings::Expected,
    };
    TraceOptions {
        continuation,
        marks: marks.to_vec(),
        stability: true,
        resolution: Resolution {
            share: 1e-3,
            zero: 0.0,
            range: range.1 - range.0,
        },
        known: None,
        bounds: Vec::new(),
    }
}

/// Columns of [`RecordMeasures`] a connection.
pub const MEASURES: usize = 8;

/// Records mean, rms, rms velocity, k_a, k_dc, contact ratio, impacts and mean force of every connection.
pub struct RecordMeasures {
    pub meter: Meter,
}

impl Recorder for RecordMeasures {
    fn record(&mut self, _lambda: f64, system: &System, orbit: &Orbit, values: &mut Vec<f64>) {
        for m in self.meter.measure(system, orbit) {
            let [k_a, k_dc] =
                [m.effective_stiffness, m.effective_stiffness_dc].map(|k| k.unwrap_or(f64::NAN));
            values.extend([
                m.mean,
                m.rms,
                m.rms_velocity,
                k_a,
                k_dc,
                m.contacts.ratio(),
                m.contacts.impacts(),
                m.force_mean,
            ]);
        }
    }
}
