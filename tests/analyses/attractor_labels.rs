//! Labels of synthetic Poincaré records, and Lyapunov exponents that are known.

use approx::assert_relative_eq;
use gearlash::analysis::flow::MapRecord;
use gearlash::element::{Backlash, Element, ImpactDampingLaw, Linear, Parameter, Response};
use gearlash::numeric::exponential::Exponential;
use gearlash::postprocess::attractor::{Label, label};
use gearlash::postprocess::lyapunov::{Exponents, Lyapunov};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

fn neutral(count: usize) -> Exponents {
    Exponents {
        values: vec![1e-7, -0.2],
        error: 1e-4,
        span: 5.0 * count as f64,
    }
}

fn cycle(n: usize, count: usize) -> Vec<f64> {
    let point = |k: usize| {
        let phase = TAU * (k % n) as f64 / n as f64;
        [1.0 + 0.3 * phase.cos(), 0.2 * (phase + 0.4).sin()]
    };
    (0..count).flat_map(point).collect()
}

fn rotation(winding: f64, count: usize) -> Vec<f64> {
    let point = |k: usize| {
        let phase = TAU * winding * k as f64;
        [
            1.0 + 0.3 * phase.cos() + 0.05 * (2.0 * phase).cos(),
            0.2 * phase.sin(),
        ]
    };
    (0..count).flat_map(point).collect()
}

#[test]
fn cycles_have_their_smallest_period() {
    for n in [1, 3, 7, 14, 50, 64] {
        assert_eq!(label(&cycle(n, 256), 2, None), Label::Period(n));
    }
    assert_eq!(Label::Period(7).to_string(), "period 7");
}

#[test]
fn a_cycle_without_three_repeats_is_undecided() {
    assert_eq!(label(&cycle(14, 55), 2, None), Label::Undecided);
    assert_eq!(label(&cycle(14, 56), 2, None), Label::Period(14));
    assert_eq!(label(&[], 2, None), Label::Undecided);
}

#[test]
fn a_cycle_with_a_positive_exponent_is_undecided() {
    let positive = Exponents {
        values: vec![0.1],
        error: 1e-3,
        span: 1000.0,
    };
    assert_eq!(label(&cycle(3, 200), 2, Some(&positive)), Label::Undecided);
}

#[test]
fn rotations_are_quasi_periodic() {
    for winding in [
        0.618_033_988_749_895,
        0.141_592_653_589_793,
        std::f64::consts::SQRT_2,
    ] {
        for count in [200, 300, 1000] {
            let points = rotation(winding, count);
            assert_eq!(
                label(&points, 2, Some(&neutral(count))),
                Label::QuasiPeriodic
            );
            assert_eq!(
                label(&points, 2, None),
                Label::QuasiPeriodic,
                "{winding} {count}"
            );
        }
    }
    let short = rotation(0.618_033_988_749_895, 90);
    assert_eq!(label(&short, 2, Some(&neutral(90))), Label::Undecided);
}

fn oscillator(gamma: f64, element: impl Element + 'static) -> System {
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let mounts = vec![Mount::new(Box::new(element))];
    System::new(one(gamma), one(1.0), one(1.0), mounts, Vec::new()).unwrap()
}

/// x^2 v - v, the damping of van der Pol's oscillator less that of the system.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct VanDerPol;

#[typetag::serde(name = "test_van_der_pol")]
impl Element for VanDerPol {
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        Response {
            f: q + (q * q - 1.0) * v,
            df_dq: 1.0 + 2.0 * q * v,
            df_dv: q * q - 1.0,
        }
    }
    fn visit_parameters(&mut self, _: &mut dyn FnMut(Parameter<'_>)) {}
    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }
}

/// The same record of a rotation in systems that can have made it and in systems that cannot.
#[test]
fn one_damped_coordinate_is_never_quasi_periodic() {
    let impacts = |law| Backlash {
        half_gap: 0.5,
        impact_damping: 0.1,
        impact_damping_law: law,
    };
    let record = MapRecord {
        points: rotation(0.618_033_988_749_895, 300),
        exponents: Some(neutral(300)),
        stop: None,
    };
    for (system, wanted) in [
        (oscillator(0.05, Linear {}), Label::Undecided),
        (
            oscillator(0.05, impacts(ImpactDampingLaw::Dissipative)),
            Label::Undecided,
        ),
        // Areas stay, or grow somewhere.
        (oscillator(0.0, Linear {}), Label::QuasiPeriodic),
        (
            oscillator(0.05, impacts(ImpactDampingLaw::Literal)),
            Label::QuasiPeriodic,
        ),
        (oscillator(0.05, VanDerPol), Label::QuasiPeriodic),
    ] {
        assert_eq!(record.label(&system), wanted, "{system:?}");
    }
}

#[test]
fn a_spiral_into_a_fixed_point_is_undecided() {
    let points: Vec<f64> = (0..300)
        .flat_map(|k| {
            let (r, phase) = (0.1 * 0.985_f64.powi(k), 0.618 * TAU * f64::from(k));
            [1.0 + r * phase.cos(), r * phase.sin()]
        })
        .collect();
    assert_eq!(label(&points, 2, None), Label::Undecided);
    assert_eq!(label(&points, 2, Some(&neutral(300))), Label::Undecided);
}

#[test]
fn a_slow_approach_to_a_doubled_cycle_is_undecided() {
    // At a period doubling deviations fall like the inverse root of time, not exponentially.
    let mut points = cycle(7, 300);
    for (k, point) in points.chunks_exact_mut(2).enumerate() {
        let sign = if k / 7 % 2 == 0 { 1.0 } else { -1.0 };
        point[0] += sign * 1e-2 / (100.0 + k as f64).sqrt();
    }
    assert_eq!(label(&points, 2, None), Label::Undecided);
    assert_eq!(label(&points, 2, Some(&neutral(300))), Label::Undecided);
}

/// x <- a x (1 - x) with its exponent ln|a (1 - 2 x)| through the accumulator.
fn logistic(a: f64, count: usize) -> (Vec<f64>, Exponents) {
    let (mut x, mut deviations) = (0.312, Lyapunov::new(1));
    for _ in 0..500 {
        x = a * x * (1.0 - x);
    }
    let mut points = Vec::new();
    for _ in 0..count {
        *deviations.frame_mut() *= a * (1.0 - 2.0 * x);
        deviations.count();
        x = a * x * (1.0 - x);
        points.push(x);
    }
    (points, deviations.exponents(1.0).unwrap())
}

#[test]
fn the_logistic_map_is_chaotic_and_periodic_where_it_is_known_to_be() {
    let (points, exponents) = logistic(4.0, 2000);
    assert_relative_eq!(
        exponents.values[0],
        2.0_f64.ln(),
        epsilon = 4.0 * exponents.error
    );
    assert!(exponents.error < 0.02);
    assert_eq!(label(&points, 1, Some(&exponents)), Label::Chaotic);
    // Without an exponent chaos is never claimed.
    assert_eq!(label(&points, 1, None), Label::Undecided);
    for (a, n) in [(3.2, 2), (3.5, 4), (3.55, 8), (3.83, 3)] {
        let (points, exponents) = logistic(a, 200);
        assert!(exponents.values[0] < 0.0);
        assert_eq!(label(&points, 1, Some(&exponents)), Label::Period(n));
    }
    let (points, exponents) = logistic(3.8, 300);
    assert_eq!(label(&points, 1, Some(&exponents)), Label::Chaotic);
}

#[test]
fn records_that_are_not_finite_are_undecided() {
    assert_eq!(label(&[1.0, f64::NAN, 1.0, 1.0], 1, None), Label::Undecided);
}

/// x'' + 2 zeta w x' + w^2 x = 0 twice: exponents -zeta w in pairs, bounded fluctuation around them.
#[test]
fn a_linear_system_has_pairs_of_exponents_minus_zeta_omega() {
    let (zeta, omega) = ([0.05, 0.03], [1.0, 3.0_f64.sqrt()]);
    let mut a = DMatrix::zeros(4, 4);
    for i in 0..2 {
        a[(i, i + 2)] = 1.0;
        a[(i + 2, i)] = -omega[i] * omega[i];
        a[(i + 2, i + 2)] = -2.0 * zeta[i] * omega[i];
    }
    let period = TAU / 1.3;
    let phi = Exponential::new(4).of(&(a * period)).clone();
    let mut deviations = Lyapunov::new(4);
    let count = 2000;
    for k in 0..count + 50 {
        let next = &phi * &*deviations.frame_mut();
        deviations.frame_mut().copy_from(&next);
        if k < 50 {
            deviations.skip()
        } else {
            deviations.count()
        }
    }
    let found = deviations.exponents(period).unwrap();
    let mut expected = [0, 0, 1, 1].map(|i| -zeta[i] * omega[i]);
    expected.sort_by(|a, b| b.total_cmp(a));
    // Frames turn on ellipses whose axes differ by the factor omega: ln(omega) over the whole span.
    for (value, wanted) in found.values.iter().zip(expected) {
        assert!(
            (value - wanted).abs() < 2.0 / found.span,
            "{value} {wanted}"
        );
    }
    assert_relative_eq!(
        found.values.iter().sum::<f64>(),
        expected.iter().sum::<f64>(),
        epsilon = 1e-12
    );
    assert_relative_eq!(found.span, period * f64::from(count), max_relative = 1e-14);
    assert!(found.error < 1e-2);
}

#[test]
fn real_exponents_come_out_sorted_and_short_records_have_no_error() {
    let mut deviations = Lyapunov::new(2);
    assert!(deviations.exponents(1.0).is_none());
    for _ in 0..5 {
        let next = DMatrix::from_row_slice(2, 2, &[0.5, 0.0, 0.0, 3.0]) * &*deviations.frame_mut();
        deviations.frame_mut().copy_from(&next);
        deviations.count();
    }
    let found = deviations.exponents(2.0).unwrap();
    assert_relative_eq!(found.values[0], 3.0_f64.ln() / 2.0, max_relative = 1e-14);
    assert_relative_eq!(found.values[1], 0.5_f64.ln() / 2.0, max_relative = 1e-14);
    assert!(found.error.is_infinite());
}
