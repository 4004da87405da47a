//! Switches found by DOPRI5: none missed, none twice.

use crate::common::{backlash, floats, load, reference};
use crate::dopri5_support::*;
use gearlash::element::{
    Backlash, Cubic, Element, ImpactDampingLaw, OneSided, PiecewiseLinear, Side,
};
use gearlash::numeric::periodic::Periodic;
use gearlash::solve::integrate::Dopri5Options;
use gearlash::system::{LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{PI, TAU};

#[test]
fn free_flight_and_impact_times() {
    // No load, no damping: x = v T inside the gap, half a sine of frequency 1 on either flank.
    let (b, v) = (0.3, 0.7);
    let system = single(0.0, backlash(b), 0.0, 0.0);
    let mut state = [0.0, v];
    let log = advance(&system, tight(), (0.0, 20.0), &mut state);
    let contact = b / v;
    let wanted: Vec<f64> = (0..6)
        .flat_map(|k| {
            let begin = contact + k as f64 * (2.0 * contact + PI);
            [begin, begin + PI]
        })
        .filter(|t| *t < 20.0)
        .collect();
    let taus: Vec<f64> = log.switches.iter().map(|s| s.tau).collect();
    assert_eq!(taus.len(), wanted.len());
    for (found, wanted) in taus.iter().zip(&wanted) {
        assert!((found - wanted).abs() < 1e-9, "{found} instead of {wanted}");
    }
    let flanks: Vec<(i8, i8)> = log.switches.iter().map(|s| (s.from, s.to)).collect();
    assert_eq!(flanks[..4], [(0, 1), (1, 0), (0, -1), (-1, 0)]);
    for (k, s) in log.switches.iter().enumerate() {
        let sign = if k.div_ceil(2) % 2 == 0 { 1.0 } else { -1.0 };
        assert!((s.velocity - sign * v).abs() < 1e-9, "{}", s.velocity);
        assert_eq!(s.level.abs(), b);
    }
    // Every segment stays on one side of every breakpoint.
    for (_, _, c) in &log.segments {
        let ends = [c[0], c.iter().sum::<f64>()];
        assert!(
            ends.iter().all(|x| x.abs() <= b + 1e-14) || ends.iter().all(|x| x.abs() >= b - 1e-14)
        );
    }
}

#[test]
fn bilinear_oscillator() {
    // slope 1 for x < 0 and 4 beyond: period pi + pi / 2
    let mount = Mount::new(Box::new(gearlash::element::PiecewiseLinear {
        breakpoints: vec![0.0],
        slopes: vec![1.0, 4.0],
    }));
    let system = single(0.0, mount, 0.0, 0.0);
    let mut state = [0.0, 1.0];
    let log = advance(&system, tight(), (0.0, 15.0 * PI), &mut state);
    assert!(
        state[0].abs() < 1e-9 && (state[1] - 1.0).abs() < 1e-9,
        "{state:?}"
    );
    // ten periods of two switches; the start on the breakpoint is none, the end on it may be one
    let count = log.switches.len();
    assert!(count == 19 || count == 20, "{count}");
}

/// Free flight under a constant load: x = x0 + v T + F T^2 / 2, highest at -v^2 / (2 F) above x0.
#[test]
fn graze_from_both_sides() {
    for sign in [1.0, -1.0] {
        for (height, count) in [(1e-6, 2), (1e-9, 2), (-1e-9, 0), (-1e-6, 0)] {
            let (force, b) = (-sign, 1.0);
            let v = sign * (2.0_f64 * (b + height)).sqrt();
            let system = single(0.0, backlash(b), force, 0.0);
            let mut state = [0.0, v];
            let log = advance(&system, tight(), (0.0, 2.5), &mut state);
            assert_eq!(log.switches.len(), count, "height {height:e}");
        }
        // An exact touch: with or without a pair of switches, the motion is the same.
        let system = single(0.0, backlash(1.0), -sign, 0.0);
        let mut state = [0.0, sign * 2.0_f64.sqrt()];
        let log = advance(&system, tight(), (0.0, 2.5), &mut state);
        assert!(log.switches.len().is_multiple_of(2));
        assert!((sign * state[0] - (2.0_f64.sqrt() * 2.5 - 3.125)).abs() < 1e-9);
    }
    // From inside the contact: the load holds x near 1.5, the orbit just reaches the breakpoint.
    for (height, count) in [(1e-6, 2), (-1e-6, 0)] {
        let system = single(0.0, backlash(1.0), 0.5, 0.0);
        let mut state = [2.0 + height, 0.0];
        let log = advance(&system, tight(), (0.0, TAU), &mut state);
        assert_eq!(log.switches.len(), count, "height {height:e}");
    }
}

#[test]
fn two_crossings_inside_one_step() {
    // Free flight is a parabola, exact in one step of any length: up through 1 and back, both ends inside the gap.
    let stop = Mount::new(Box::new(OneSided {
        gap: 1.0,
        side: Side::Positive,
        contact_damping: 0.0,
    }));
    let system = single(0.0, stop, -0.1, 0.0);
    let loose = Dopri5Options {
        relative: 1e-3,
        absolute: 1e-3,
        ..Default::default()
    };
    let v = 0.2_f64.sqrt() * (1.0 + 1e-4);
    let mut state = [0.0, v];
    let log = advance(&system, loose, (0.0, 2.0 * v / 0.1), &mut state);
    assert_eq!(log.switches.len(), 2);
    assert!(log.segments.iter().any(|s| s.1 > 3.0), "steps are long");
}

#[test]
fn start_on_a_breakpoint_and_restart() {
    for (state, count) in [([1.0, 0.5], 1), ([1.0, -0.5], 1), ([-1.0, -0.5], 1)] {
        let system = single(0.0, backlash(1.0), 0.0, 0.0);
        let mut state = state;
        // to the other end of the contact, or across the gap
        let log = advance(&system, tight(), (0.0, 4.2), &mut state);
        assert_eq!(log.switches.len(), count, "{:?}", log.switches);
        assert!(log.switches[0].tau > 3.0);
    }
    // Stopped at each switch and started again there: the same switches, none twice.
    let entry = &reference("flow_one_period")[2];
    let system = flow_system(entry);
    let whole = advance(&system, tight(), (0.0, TAU), &mut floats(&entry["u"]));
    let mut state = floats(&entry["u"]);
    let mut cuts: Vec<f64> = whole.switches.iter().map(|s| s.tau).collect();
    cuts.push(TAU);
    let (mut begin, mut pieces) = (0.0, Vec::new());
    for cut in cuts {
        pieces.extend(advance(&system, tight(), (begin, cut), &mut state).switches);
        begin = cut;
    }
    assert_eq!(pieces.len(), whole.switches.len());
    for (a, b) in pieces.iter().zip(&whole.switches) {
        assert_eq!((a.connection, a.from, a.to), (b.connection, b.from, b.to));
        assert!((a.tau - b.tau).abs() < 1e-9);
    }
}

#[test]
fn simultaneous_switches() {
    let system = System::new(
        DMatrix::zeros(2, 2),
        DMatrix::identity(2, 2),
        DMatrix::identity(2, 2),
        vec![backlash(1.0), backlash(1.0)],
        vec![load(2, 0, 0.0, 0.1), load(2, 1, 0.0, 0.1)],
    )
    .unwrap();
    let mut state = [0.2, 0.2, 0.9, 0.9];
    let log = advance(&system, tight(), (0.0, TAU), &mut state);
    assert_eq!(state[0], state[1]);
    assert!(log.switches.len() >= 4);
    for pair in log.switches.chunks(2) {
        assert_eq!(pair[0].tau, pair[1].tau);
        assert_eq!((pair[0].connection, pair[1].connection), (0, 1));
    }
}

#[test]
fn transmission_error_switches_an_idle_mesh() {
    // At rest, open: only e = 0.5 cos(20 phase) moves the deformation, through -0.4 twice a period of it.
    let mut mount = backlash(1.0);
    mount.element = Box::new(OneSided {
        gap: 0.4,
        side: Side::Negative,
        contact_damping: 0.0,
    });
    mount.transmission_error = Some(sine(0.0, 20, 0.5, 0.0));
    // a weak mesh: kappa = 0 keeps the mass at rest
    let zero = DMatrix::zeros(1, 1);
    let one = DMatrix::from_element(1, 1, 1.0);
    let system = System::new(
        zero.clone(),
        zero,
        one,
        vec![mount],
        Vec::<LoadSource>::new(),
    )
    .unwrap();
    let log = advance(
        &system,
        Dopri5Options::default(),
        (0.0, TAU),
        &mut [0.0, 0.0],
    );
    assert_eq!(log.switches.len(), 40);
    let first = 0.8_f64.acos() / 20.0;
    assert!((log.switches[0].tau - first).abs() < 1e-12);
    assert!(log.switches.iter().all(|s| s.velocity.abs() > 5.9));
}

/// A transmission error that jumps: the deformation jumps with it, and the call that ends on a jump has its switch.
#[test]
fn jumps_of_the_transmission_error() {
    let mut mount = Mount::new(Box::new(OneSided {
        gap: 0.4,
        side: Side::Negative,
        contact_damping: 0.0,
    }));
    mount.transmission_error = Some(Periodic::Rectangular {
        high: 0.5,
        low: 0.0,
        duty: 0.5,
        phase: 0.0,
        base_order: 1,
    });
    let zero = DMatrix::zeros(1, 1);
    let one = DMatrix::from_element(1, 1, 1.0);
    let system = System::new(zero.clone(), zero, one, vec![mount], Vec::new()).unwrap();
    for turn in 0..3 {
        let span = (f64::from(turn) * TAU, f64::from(turn + 1) * TAU);
        let log = advance(&system, Dopri5Options::default(), span, &mut [0.0, 0.0]);
        let found: Vec<(i8, i8)> = log.switches.iter().map(|s| (s.from, s.to)).collect();
        assert_eq!(found, [(-1, 0), (0, -1)], "turn {turn}");
        assert!((log.switches[0].tau - span.0 - PI).abs() < 1e-13);
        assert_eq!(log.switches[1].tau, span.1);
    }
}

/// Numbers in [-1, 1) from a seed.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn mount(&mut self) -> Mount {
        let gap = (0.5 * self.next()).max(0.0);
        let law: Box<dyn Element> = match ((self.next() + 1.0) * 2.5) as usize {
            0 => Box::new(Backlash {
                half_gap: gap,
                impact_damping: 0.3,
                impact_damping_law: ImpactDampingLaw::Dissipative,
                contact_damping: 0.0,
            }),
            1 => Box::new(OneSided {
                gap,
                side: Side::Negative,
                contact_damping: 0.0,
            }),
            2 => Box::new(PiecewiseLinear {
                breakpoints: vec![-0.3, 0.0, 0.1, 0.4],
                slopes: vec![1.0, 0.2, 0.0, 0.7, 1.5],
            }),
            3 => Box::new(Cubic { cubic: 0.2 }),
            _ => return backlash(gap),
        };
        let mut mount = Mount::new(law);
        if self.next() > 0.0 {
            mount.stiffness_variation = Some(sine(1.0, 2, 0.2 * self.next(), 0.2));
        }
        if self.next() > 0.0 {
            mount.transmission_error = Some(sine(0.0, 3, 0.1 * self.next(), 0.05));
        } else if self.next() > 0.5 {
            let values = vec![0.05, 0.0, -0.05, 0.02];
            mount.transmission_error = Some(Periodic::Table {
                values,
                base_order: 2,
            });
        }
        mount
    }

    /// Inertia 1, springs of random strength along the rows of W.
    fn system(&mut self, n: usize, e: usize) -> System {
        let w = DMatrix::from_fn(e, n, |k, j| {
            if k == j {
                1.0
            } else if k < n {
                0.0
            } else {
                self.next()
            }
        });
        let springs = DMatrix::from_diagonal(&DVector::from_fn(e, |_, _| 1.3 + self.next()));
        let kappa = w.transpose() * springs;
        let mut gamma: DMatrix<f64> = 0.1 * DMatrix::identity(n, n);
        gamma[(0, n - 1)] += 0.02;
        let mounts = (0..e).map(|_| self.mount()).collect();
        let loads = (0..n)
            .map(|i| load(n, i, 0.3 * self.next(), 0.5 * self.next()))
            .collect();
        let mut system = System::new(gamma, kappa, w, mounts, loads).unwrap();
        system.set_excitation_frequency(1.0 + 0.7 * self.next());
        system
    }
}

#[test]
fn random_systems_agree_at_two_tolerances() {
    let mut noise = Noise(7);
    let mut total = 0;
    for round in 0..60 {
        let n = 1 + round % 3;
        let system = noise.system(n, n + round % 2);
        let start: Vec<f64> = (0..2 * n).map(|_| noise.next()).collect();
        let [rough, sharp] = [Dopri5Options::default(), tight()]
            .map(|options| transition(&system, options, TAU, &mut start.clone()));
        let error = (&rough - &sharp).amax() / sharp.amax().max(1.0);
        assert!(error < 1e-8, "round {round}: Phi {error:e}");
        let (mut a, mut b) = (start.clone(), start);
        let coarse = advance(&system, Dopri5Options::default(), (0.0, 2.0 * TAU), &mut a);
        let fine = advance(&system, tight(), (0.0, 2.0 * TAU), &mut b);
        assert_eq!(coarse.switches.len(), fine.switches.len(), "round {round}");
        total += fine.switches.len();
        let error = a
            .iter()
            .zip(&b)
            .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(error < 1e-7, "round {round}: {error:e}");
        segments_stay_on_one_side(&system, &coarse);
    }
    assert!(total > 500, "{total}");
}

/// Samples every segment: no deformation is beyond a breakpoint its middle is not beyond.
fn segments_stay_on_one_side(system: &System, log: &Log) {
    let n = system.dof();
    let mut scratch = system.scratch();
    let mut state = vec![0.0; 2 * n];
    for (tau, width, coefficients) in &log.segments {
        let segment = log.segment_of(*tau, *width, coefficients);
        let mut low = vec![f64::INFINITY; system.element_count()];
        let mut high = vec![f64::NEG_INFINITY; system.element_count()];
        for s in 0..=16 {
            let x = f64::from(s) / 16.0;
            segment.state(x, system.omega(), &mut state);
            system.respond(tau + x * width, &state, &mut scratch);
            for (k, d) in scratch.deformation.iter().enumerate() {
                (low[k], high[k]) = (low[k].min(*d), high[k].max(*d));
            }
        }
        for (k, mount) in system.mounts().iter().enumerate() {
            for level in mount.element.breakpoints() {
                let is_inside = low[k] < level - 1e-8 && high[k] > level + 1e-8;
                assert!(!is_inside, "{level} between {} and {}", low[k], high[k]);
            }
        }
    }
}
