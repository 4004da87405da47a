//! Labels of maps and records whose attractors are known, and Lyapunov exponents that are known.

use approx::assert_relative_eq;
use gearlash::element::{Backlash, Element, ImpactDampingLaw, Linear, Parameter, Response};
use gearlash::numeric::exponential::Exponential;
use gearlash::solve::attractor::lyapunov::Lyapunov;
use gearlash::solve::attractor::{
    Attractor, Label, LabelOptions, Lengths, Map, MapSize, Tori, attractor, tori,
};
use gearlash::solve::integrate::IntegrationEnd;
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Image of a state and the derivative there.
type Step = (Vec<f64>, Vec<f64>);

/// A map given by its image and its derivative, row by row.
struct Formula<F>(usize, F);

impl<F: FnMut(&[f64]) -> (Vec<f64>, Vec<f64>)> Map for Formula<F> {
    fn size(&self) -> usize {
        self.0
    }
    fn advance(&mut self, state: &mut [f64]) -> IntegrationEnd {
        state.copy_from_slice(&(self.1)(state).0);
        IntegrationEnd::Reached
    }
    fn advance_with_variation(
        &mut self,
        state: &mut [f64],
        frame: &mut DMatrix<f64>,
    ) -> IntegrationEnd {
        let (image, derivative) = (self.1)(state);
        let next = DMatrix::from_row_slice(self.0, self.0, &derivative) * &*frame;
        frame.copy_from(&next);
        state.copy_from_slice(&image);
        IntegrationEnd::Reached
    }
}

/// A record played back: a map of which nothing but the points is known.
struct Playback(Vec<f64>, usize);

impl Map for Playback {
    fn size(&self) -> usize {
        2
    }
    fn advance(&mut self, state: &mut [f64]) -> IntegrationEnd {
        let count = self.0.len() / 2;
        let k = self.1 % count;
        state.copy_from_slice(&self.0[2 * k..2 * k + 2]);
        self.1 += 1;
        IntegrationEnd::Reached
    }
    fn advance_with_variation(
        &mut self,
        state: &mut [f64],
        frame: &mut DMatrix<f64>,
    ) -> IntegrationEnd {
        frame.fill(f64::NAN);
        self.advance(state)
    }
    fn has_variation(&self) -> bool {
        false
    }
}

fn found(map: &mut dyn Map, start: &[f64], transient: usize, periods: usize) -> Attractor {
    let size = MapSize {
        transient,
        periods,
        exponents: Lengths::Followed,
    };
    let options = LabelOptions::default();
    attractor(map, &mut start.to_vec(), size, options, &mut |_| true)
}

/// Label of a record, which is not extended.
fn label_of(points: Vec<f64>) -> Label {
    let size = MapSize {
        transient: 0,
        periods: points.len() / 2,
        exponents: Lengths::Ignored,
    };
    let options = LabelOptions {
        extend: 1,
        ..LabelOptions::default()
    };
    let mut map = Playback(points, 0);
    attractor(&mut map, &mut [0.0; 2], size, options, &mut |_| true).label
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
fn recorded_cycles_have_their_smallest_period() {
    for n in [1, 3, 7, 14, 50, 64, 112, 256] {
        assert_eq!(label_of(cycle(n, 4 * n + 100)), Label::Period(n));
    }
    assert_eq!(label_of(cycle(257, 1200)), Label::Undecided);
    assert_eq!(Label::Period(7).to_string(), "period 7");
    assert_eq!(label_of(cycle(14, 55)), Label::Undecided);
    assert_eq!(label_of(cycle(14, 56)), Label::Period(14));
}

#[test]
fn recorded_rotations_are_quasi_periodic() {
    for winding in [
        0.618_033_988_749_895,
        0.141_592_653_589_793,
        std::f64::consts::SQRT_2,
    ] {
        for count in [200, 300, 1000] {
            assert_eq!(label_of(rotation(winding, count)), Label::QuasiPeriodic);
        }
    }
    assert_eq!(
        label_of(rotation(0.618_033_988_749_895, 90)),
        Label::Undecided
    );
    // A long period looks like a rotation to a test that asks for regularity only.
    for (p, n) in [(43.0, 112.0), (45.0, 64.0)] {
        assert_ne!(
            label_of(rotation(p / n, 250)),
            Label::QuasiPeriodic,
            "{p}/{n}"
        );
    }
}

/// Distances that shrink make neither a torus nor a cycle of twice or three times the period.
#[test]
fn recorded_transients_are_undecided() {
    for (factor, winding) in [
        (0.985, 0.618),
        (1.0 - 3e-7, 0.5),
        (1.0 - 3e-7, 1.0 / 3.0),
        (1.0 - 1e-6, 0.618),
    ] {
        let point = |k: usize| {
            let r = 0.1 * f64::powi(factor, k as i32);
            let phase = winding * TAU * k as f64;
            [1.0 + r * phase.cos(), r * phase.sin()]
        };
        let points: Vec<f64> = (0..300).flat_map(point).collect();
        assert_eq!(label_of(points), Label::Undecided, "{factor} {winding}");
    }
    // At a period doubling deviations fall like the inverse root of time, not exponentially.
    let mut points = cycle(7, 300);
    for (k, point) in points.chunks_exact_mut(2).enumerate() {
        let sign = if k / 7 % 2 == 0 { 1.0 } else { -1.0 };
        point[0] += sign * 1e-2 / (100.0 + k as f64).sqrt();
    }
    assert_eq!(label_of(points), Label::Undecided);
}

#[test]
fn records_that_are_not_finite_or_empty_are_undecided() {
    let mut map = Formula(1, |x: &[f64]| (vec![x[0] * x[0]], vec![2.0 * x[0]]));
    let diverged = found(&mut map, &[2.0], 0, 100);
    assert_eq!(diverged.label, Label::Undecided);
    assert!(diverged.record.stop.is_some());
    assert_eq!(label_of(Vec::new()), Label::Undecided);
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

#[test]
fn one_damped_coordinate_has_no_tori() {
    let impacts = |law| Backlash {
        half_gap: 0.5,
        impact_damping: 0.1,
        impact_damping_law: law,
        contact_damping: 0.0,
    };
    let dissipative = impacts(ImpactDampingLaw::Dissipative);
    let literal = impacts(ImpactDampingLaw::Literal);
    assert_eq!(tori(&oscillator(0.05, Linear {})), Tori::Excluded);
    assert_eq!(tori(&oscillator(0.05, dissipative)), Tori::Excluded);
    // Areas stay, or grow somewhere.
    assert_eq!(tori(&oscillator(0.0, Linear {})), Tori::Conservative);
    assert_eq!(tori(&oscillator(0.05, literal)), Tori::Possible);
    assert_eq!(tori(&oscillator(0.05, VanDerPol)), Tori::Possible);
}

fn logistic(a: f64) -> Formula<impl FnMut(&[f64]) -> Step> {
    Formula(1, move |x: &[f64]| {
        (vec![a * x[0] * (1.0 - x[0])], vec![a * (1.0 - 2.0 * x[0])])
    })
}

/// Periods of the logistic map: the cascade (its accumulation is at 3.569945672) and windows, superstable and near their ends.
#[test]
fn the_logistic_map_has_its_periods() {
    for (a, n) in [
        (3.2, 2),
        (3.5, 4),
        (3.55, 8),
        (3.566, 16),
        (3.569, 32),
        (3.5697, 64),
        (3.569_91, 128),
        (3.569_938, 256),
        (3.83, 3),
        (3.845, 6),
        (3.7389, 5),
        (3.7017, 7),
        (3.9057, 5),
        (3.9602, 4),
    ] {
        for start in [0.312, 0.77, 0.123] {
            let found = found(&mut logistic(a), &[start], 2000, 400);
            assert_eq!(found.label, Label::Period(n), "{a} from {start}");
            let orbit = found.cycle.unwrap();
            // x -> a x (1 - x): product of a (1 - 2 x) along the orbit.
            let product: f64 = orbit.points.iter().map(|x| a * (1.0 - 2.0 * x)).product();
            assert!((orbit.multipliers[0].norm() - product.abs()).abs() < 1e-6);
            assert!(product.abs() < 1.0);
        }
    }
}

/// Beyond the longest period of a cascade, and at its end, where the exponent is 0 and nothing is a torus.
#[test]
fn longer_periods_of_a_cascade_are_undecided() {
    for a in [3.569_944_5, 3.569_945_672] {
        let found = found(&mut logistic(a), &[0.312], 2000, 400);
        assert_eq!(found.label, Label::Undecided, "{a}");
        assert_eq!(found.extension, 7 * 400);
    }
}

#[test]
fn the_logistic_map_is_chaotic_where_it_is_known_to_be() {
    let full = found(&mut logistic(3.999_999_9), &[0.312], 200, 2000);
    assert_eq!(full.label, Label::Chaotic);
    let exponents = full.record.exponents.unwrap();
    assert_relative_eq!(
        exponents.values[0],
        2.0_f64.ln(),
        epsilon = 4.0 * exponents.error + 1e-3
    );
    assert!(exponents.error < 0.02);
    // Misiurewicz points, where the attractor is chaotic for certain: the critical orbit ends on an unstable cycle.
    for (a, periods) in [(3.678_573_510_428_322, 400), (3.927_737_001_786_722, 400)] {
        for start in [0.312, 0.77, 0.123] {
            assert_eq!(
                found(&mut logistic(a), &[start], 200, periods).label,
                Label::Chaotic,
                "{a}"
            );
        }
    }
    // Without exponents chaos is never claimed.
    let size = MapSize {
        transient: 100,
        periods: 300,
        exponents: Lengths::Ignored,
    };
    let options = LabelOptions::default();
    let silent = attractor(
        &mut logistic(3.9277),
        &mut [0.3],
        size,
        options,
        &mut |_| true,
    );
    assert_eq!(silent.label, Label::Undecided);
}

/// Windows a few thousandths wide: motion is chaotic for hundreds of periods before it settles.
#[test]
fn long_transients_in_windows_are_not_called_chaotic() {
    let (mut settled, mut wrong) = (0, 0);
    let starts = (0..40).map(|k| 0.05 + 0.9 * (f64::from(k) * 0.618_033_988_749_895).fract());
    let size = MapSize {
        transient: 200,
        periods: 200,
        exponents: Lengths::Followed,
    };
    let options = LabelOptions {
        effort: 2000,
        ..LabelOptions::default()
    };
    for start in starts {
        for (a, n) in [(3.7382, 5), (3.7017, 7), (3.6267, 6), (3.9057, 5)] {
            let found = attractor(&mut logistic(a), &mut [start], size, options, &mut |_| true);
            let label = found.label;
            wrong += usize::from(![Label::Period(n), Label::Undecided].contains(&label));
            settled += usize::from(label == Label::Period(n));
        }
    }
    // One motion in fifty never repeats nearly enough within the record for the orbit to be found: it looks chaotic in every respect.
    assert!(
        settled >= 152 && wrong <= 3,
        "{settled} of 160, {wrong} wrong"
    );
}

/// x' = a x (1 - y), y' = x loses its fixed point at a = 2 to an invariant circle with rotation number 1/6 there.
fn delayed_logistic(a: f64) -> Formula<impl FnMut(&[f64]) -> Step> {
    Formula(2, move |u: &[f64]| {
        let (x, y) = (u[0], u[1]);
        (
            vec![a * x * (1.0 - y), x],
            vec![a * (1.0 - y), -a * x, 1.0, 0.0],
        )
    })
}

#[test]
fn the_delayed_logistic_map_has_fixed_points_and_circles() {
    for a in [1.7, 1.95, 1.99] {
        let found = found(&mut delayed_logistic(a), &[0.45, 0.4], 200, 200);
        assert_eq!(found.label, Label::Period(1), "{a}");
        assert_relative_eq!(
            found.cycle.unwrap().points[0],
            1.0 - 1.0 / a,
            max_relative = 1e-10
        );
    }
    for a in [2.01, 2.02, 2.05, 2.07, 2.1, 2.13] {
        let found = found(&mut delayed_logistic(a), &[0.45, 0.4], 300, 300);
        assert_eq!(found.label, Label::QuasiPeriodic, "{a}");
    }
    let broken = found(&mut delayed_logistic(2.27), &[0.45, 0.4], 300, 400);
    assert_eq!(broken.label, Label::Chaotic);
}

/// Angles that are drawn to n of them, theta' = theta + p / n - c sin(2 pi n theta) / (2 pi n), on an attracting circle: slow as it is,
/// that is no rotation.
#[test]
fn a_locked_circle_is_no_torus() {
    let locked = |p: f64, n: f64, c: f64| {
        Formula(2, move |u: &[f64]| {
            let theta = u[1].atan2(u[0]);
            let radius = u[0].hypot(u[1]);
            let next = theta + TAU * p / n - c * (n * theta).sin() / n;
            let longer = 1.0 + 0.5 * (radius - 1.0);
            let (s, k) = next.sin_cos();
            let slope = 1.0 - c * (n * theta).cos();
            let turned = [-u[1] / radius / radius, u[0] / radius / radius];
            let outwards = [u[0] / radius, u[1] / radius];
            let entry = |direction: f64, along: f64, j: usize| {
                0.5 * direction * outwards[j] + longer * along * slope * turned[j]
            };
            let derivative = vec![
                entry(k, -s, 0),
                entry(k, -s, 1),
                entry(s, k, 0),
                entry(s, k, 1),
            ];
            (vec![longer * k, longer * s], derivative)
        })
    };
    for (p, n) in [(11.0, 31.0), (23.0, 62.0), (7.0, 17.0)] {
        for c in [3e-3, 1e-2] {
            let found = found(&mut locked(p, n, c), &[1.1, 0.04], 200, 120);
            assert_ne!(found.label, Label::QuasiPeriodic, "{p}/{n} {c}");
        }
    }
    // Without the pull the same circle is a torus.
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let found = found(&mut locked(golden, 1.0, 0.0), &[1.1, 0.04], 200, 120);
    assert_eq!(found.label, Label::QuasiPeriodic);
}

/// Henon's map: chaos at a = 1.4, b = 0.3, period 7 at a = 1.25.
#[test]
fn henons_map_has_chaos_and_period_7() {
    let henon = |a: f64| {
        Formula(2, move |u: &[f64]| {
            let (x, y) = (u[0], u[1]);
            (
                vec![1.0 - a * x * x + y, 0.3 * x],
                vec![-2.0 * a * x, 1.0, 0.3, 0.0],
            )
        })
    };
    let chaos = found(&mut henon(1.4), &[0.1, 0.1], 200, 1000);
    assert_eq!(chaos.label, Label::Chaotic);
    let exponents = chaos.record.exponents.unwrap();
    assert!((exponents.values[0] - 0.419).abs() < 0.03);
    assert_relative_eq!(
        exponents.values.iter().sum::<f64>(),
        0.3_f64.ln(),
        epsilon = 1e-12
    );
    assert_eq!(
        found(&mut henon(1.25), &[0.1, 0.1], 200, 200).label,
        Label::Period(7)
    );
}

/// A spiral that falls by 3e-7 per turn, linear and with a frequency that depends on its size.
#[test]
fn slow_decay_is_period_1_where_that_is_established() {
    let spiral = |angle: f64, twist: f64| {
        Formula(2, move |u: &[f64]| {
            let (x, y) = (u[0], u[1]);
            let r2 = x * x + y * y;
            let r = 1.0 - 3e-7;
            let (s, c) = (angle + twist * r2).sin_cos();
            let (dx, dy) = (2.0 * twist * x, 2.0 * twist * y);
            let (ds, dc) = (-s * x - c * y, c * x - s * y);
            let image = vec![r * (c * x - s * y), r * (s * x + c * y)];
            let derivative = vec![
                r * (c + ds * dx),
                r * (-s + ds * dy),
                r * (s + dc * dx),
                r * (c + dc * dy),
            ];
            (image, derivative)
        })
    };
    for angle in [0.5, 1.0 / 3.0, 0.618_034, 0.123_456] {
        let linear = found(&mut spiral(TAU * angle, 0.0), &[0.3, 0.1], 200, 200);
        assert_eq!(linear.label, Label::Period(1), "{angle}");
        let twisted = found(&mut spiral(TAU * angle, 0.5), &[0.3, 0.1], 200, 200);
        assert!(
            [Label::Period(1), Label::Undecided].contains(&twisted.label),
            "{angle}"
        );
    }
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

/// Where the record cannot become long enough for a label that rests on exponents, deviations are followed only to look for an orbit:
/// the label is the same.
#[test]
fn short_records_do_not_follow_deviations() {
    struct Counted<M>(M, usize);
    impl<M: Map> Map for Counted<M> {
        fn size(&self) -> usize {
            self.0.size()
        }
        fn advance(&mut self, state: &mut [f64]) -> IntegrationEnd {
            self.0.advance(state)
        }
        fn advance_with_variation(
            &mut self,
            state: &mut [f64],
            frame: &mut DMatrix<f64>,
        ) -> IntegrationEnd {
            self.1 += 1;
            self.0.advance_with_variation(state, frame)
        }
    }
    for (a, periods, is_short) in [(3.9, 10, true), (3.2, 10, true), (3.9, 20, false)] {
        let labels = [Lengths::Followed, Lengths::ForLabels].map(|exponents| {
            let size = MapSize {
                transient: 30,
                periods,
                exponents,
            };
            let mut map = Counted(logistic(a), 0);
            let options = LabelOptions::default();
            let found = attractor(&mut map, &mut [0.3], size, options, &mut |_| true);
            (found.label, map.1, found.record.points)
        });
        assert_eq!(labels[0].0, labels[1].0, "{a}");
        assert_eq!(labels[0].2, labels[1].2, "{a}");
        assert_eq!(labels[1].1 < labels[0].1, is_short, "{a}: {labels:?}");
    }
}
