//! Closed forms: linear response, Duffing's first harmonic, grazing of the linear response, det Phi, sizes that must not matter.

use crate::common::{backlash, load};
use gearlash::element::{Cubic, Linear, PiecewiseLinear};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::numeric::trigonometric::{evaluate, mean_square};
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::floquet::{Floquet, multipliers};
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::newton::NewtonOptions;
use gearlash::solve::orbit::FourierOrbit;
use gearlash::solve::start::{self, Start, StartMode};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;

fn solve(system: &System, frequency: f64, harmonics: usize) -> FourierOrbit {
    let samples = GalerkinOptions::default_samples(harmonics, system.subharmonic());
    let size = GalerkinOptions { harmonics, samples };
    let found = start::find(
        system,
        frequency,
        size,
        StartMode::Auto,
        NewtonOptions::default(),
    )
    .unwrap();
    let Start::Found { u, .. } = found else {
        panic!("{found:?}")
    };
    Galerkin::new(FrequencyFamily::new(system.clone()), frequency, size)
        .unwrap()
        .fourier_orbit(&u, frequency)
        .unwrap()
}

fn linear(mounts: Vec<Mount>) -> System {
    let gamma = DMatrix::from_row_slice(2, 2, &[0.13, 0.02, 0.05, 0.2]);
    let kappa = DMatrix::from_row_slice(2, 2, &[2.0, 0.7, 1.1, 1.5]);
    let series = Periodic::Fourier {
        mean: 0.3,
        harmonics: vec![
            Harmonic {
                order: 1,
                cos: 0.2,
                sin: -0.1,
            },
            Harmonic {
                order: 3,
                cos: 0.0,
                sin: 0.4,
            },
            Harmonic {
                order: 7,
                cos: -0.3,
                sin: 0.05,
            },
        ],
    };
    let direction = DVector::from_column_slice(&[1.0, -0.4]);
    let loads = vec![LoadSource {
        direction,
        series,
        kind: LoadKind::Value,
    }];
    System::new(gamma, kappa, DMatrix::identity(2, 2), mounts, loads).unwrap()
}

/// Amplitudes of the linear response: (kappa - (k w)^2 I + i k w Gam) x_k = Q_k.
fn expected(
    system: &System,
    frequency: f64,
    order: usize,
    cos: f64,
    sin: f64,
) -> DVector<Complex<f64>> {
    let w = order as f64 * frequency;
    let matrix = DMatrix::from_fn(2, 2, |i, j| {
        let inertia = if i == j { w * w } else { 0.0 };
        Complex::new(
            system.stiffness()[(i, j)] - inertia,
            w * system.damping()[(i, j)],
        )
    });
    let load = system.loads()[0]
        .direction
        .map(|d| Complex::new(d * cos, -d * sin));
    matrix.lu().solve(&load).unwrap()
}

#[test]
fn linear_response_in_every_harmonic_and_subharmonic_index() {
    for nu in [1, 2, 3] {
        let mut system = linear(vec![
            Mount::new(Box::new(Linear {})),
            Mount::new(Box::new(Linear {})),
        ]);
        system.set_subharmonic(nu);
        let orbit = solve(&system, 0.6, 8);
        let mean = system
            .stiffness()
            .clone()
            .lu()
            .solve(&system.mean_load())
            .unwrap();
        for (order, cos, sin) in [(1, 0.2, -0.1), (3, 0.0, 0.4), (7, -0.3, 0.05)] {
            let x = expected(&system, 0.6, order, cos, sin);
            for i in 0..2 {
                let a = &orbit.coefficients[i];
                assert!((a[0] - mean[i]).abs() < 1e-13);
                assert!(
                    (a[2 * nu * order] - x[i].re).abs() < 1e-13,
                    "cos of order {order}, nu {nu}"
                );
                assert!(
                    (a[2 * nu * order - 1] + x[i].im).abs() < 1e-13,
                    "sin of order {order}, nu {nu}"
                );
            }
        }
        // Multipliers of the linear system over nu excitation periods.
        system.set_excitation_frequency(0.6);
        let phi = Floquet::default().monodromy(&system, &orbit);
        let period = nu as f64 * std::f64::consts::TAU / 0.6;
        let trace = system.damping().trace();
        let det = phi.determinant();
        assert!(
            (det / (-trace * period).exp() - 1.0).abs() < 1e-10,
            "nu {nu}: {det} {}",
            (-trace * period).exp()
        );
    }
}

#[test]
fn duffing_first_harmonic() {
    // One harmonic of x'' + 2 z x' + x + c x^3 = F cos(wt): ((1 - w^2) A + 3/4 c A^3)^2 + (2 z w A)^2 = F^2.
    let (damping, cubic, force) = (0.1, 0.4, 0.3);
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let mount = Mount::new(Box::new(Cubic { cubic }));
    let mut system = System::new(
        one(damping),
        one(1.0),
        one(1.0),
        vec![mount],
        vec![load(1, 0, 0.0, force)],
    )
    .unwrap();
    for w in [0.5_f64, 0.9, 1.1, 2.0] {
        let orbit = solve(&system, w, 1);
        let amplitude = (2.0 * mean_square(&orbit.coefficients[0])).sqrt();
        let restoring = (1.0 - w * w) * amplitude + 0.75 * cubic * amplitude.powi(3);
        let left = restoring.powi(2) + (damping * w * amplitude).powi(2);
        assert!((left.sqrt() - force).abs() < 1e-10, "w {w}: {left}");
        // Smooth law: the panels keep det Phi = exp(-trace Gam T).
        system.set_excitation_frequency(w);
        let det = Floquet::default().monodromy(&system, &orbit).determinant();
        let exact = (-damping * std::f64::consts::TAU / w).exp();
        assert!((det / exact - 1.0).abs() < 1e-10, "w {w}: {det} {exact}");
    }
}

#[test]
fn smooth_and_affine_roads_to_the_multipliers_agree() {
    // A broken line with slope 1 everywhere and a cubic with vanishing coefficient are the linear law by other roads.
    let mut affine = linear(vec![
        Mount::new(Box::new(Linear {})),
        Mount::new(Box::new(Linear {})),
    ]);
    let slope = PiecewiseLinear {
        breakpoints: vec![0.1],
        slopes: vec![1.0, 1.0],
    };
    let mut smooth = linear(vec![
        Mount::new(Box::new(Cubic { cubic: 0.0 })),
        Mount::new(Box::new(slope)),
    ]);
    affine.set_excitation_frequency(0.9);
    smooth.set_excitation_frequency(0.9);
    let exact = multipliers(&Floquet::default().monodromy(&affine, &solve(&affine, 0.9, 8)));
    let panels = multipliers(&Floquet::default().monodromy(&smooth, &solve(&smooth, 0.9, 8)));
    for (a, b) in exact.iter().zip(&panels) {
        assert!((a - b).norm() < 1e-10, "{a} {b}");
    }
}

#[test]
fn the_response_is_linear_until_it_grazes() {
    // x = Fm + A(w) cos(...): with gap b = 1 on top of the static point 1 + Fm the response stays linear while A < Fm.
    let (damping, mean, force) = (0.1, 0.1, 0.05);
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let system = System::new(
        one(damping),
        one(1.0),
        one(1.0),
        vec![backlash(1.0)],
        vec![load(1, 0, mean, force)],
    )
    .unwrap();
    let amplitude = |w: f64| force / ((1.0 - w * w).powi(2) + (damping * w).powi(2)).sqrt();
    // Grazing: amplitude(w) = mean, at w^2 = 1 - d^2/2 -+ sqrt((F/m)^2 - d^2 + d^4/4).
    let root = ((force / mean).powi(2) - damping * damping + damping.powi(4) / 4.0_f64).sqrt();
    let grazing = (1.0 - damping * damping / 2.0 + root).sqrt();
    assert!((amplitude(grazing) - mean).abs() < 1e-14);
    let above = solve(&system, grazing * 1.001, 10);
    let size = (2.0 * mean_square(&above.coefficients[0])).sqrt();
    assert!((size - amplitude(grazing * 1.001)).abs() < 1e-12);
    assert!(
        above
            .crossings(&system, 0, &above.deformation(&system, 0).extrema())
            .is_empty()
    );
    let below = solve(&system, grazing * 0.999, 10);
    assert_eq!(
        below
            .crossings(&system, 0, &below.deformation(&system, 0).extrema())
            .len(),
        2
    );
}

#[test]
fn extrema_and_crossings_of_a_known_polynomial() {
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let system = System::new(one(0.1), one(1.0), one(1.0), vec![backlash(0.5)], vec![]).unwrap();
    let orbit = FourierOrbit {
        coefficients: vec![vec![0.0, 0.0, 2.0]],
        omega: 0.7,
        subharmonic: 1,
    };
    let extrema = orbit.deformation(&system, 0).extrema();
    let values: Vec<f64> = extrema.iter().map(|x| x.1).collect();
    assert!(
        values.iter().all(|v| (v.abs() - 2.0).abs() < 1e-14),
        "{values:?}"
    );
    let crossings = orbit.crossings(&system, 0, &extrema);
    let angle = 0.25_f64.acos();
    let expected = [
        angle,
        std::f64::consts::PI - angle,
        std::f64::consts::PI + angle,
        std::f64::consts::TAU - angle,
    ];
    assert_eq!(crossings.len(), 4);
    for (c, tau) in crossings.iter().zip(expected) {
        assert!((c.tau - tau).abs() < 1e-14);
        assert!((c.velocity - 0.7 * -2.0 * tau.sin()).abs() < 1e-13);
        assert!((evaluate(&orbit.coefficients[0], c.tau)[0].abs() - 0.5).abs() < 1e-14);
    }
    let flanks: Vec<(i8, i8)> = crossings.iter().map(|c| (c.from, c.to)).collect();
    assert_eq!(flanks, [(1, 0), (0, -1), (-1, 0), (0, 1)]);
}
