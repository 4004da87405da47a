//! Many trajectories at once: what each of them does depends on its start alone.

use crate::common::{backlash, load};
use crate::exact_flow::idler;
use gearlash::element::{
    Backlash, Cubic, Element, Expression, ImpactDampingLaw, OneSided, PiecewiseLinear, Side,
};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::attractor::{
    HeadStart, LabelOptions, Lengths, MapSize, Stroboscopic, attractor_from, head_starts,
};
use gearlash::solve::ensemble::{Ensemble, Next};
use gearlash::solve::integrate::{IntegrationEnd, IntegratorChoice, automatic, choose, is_flow};
use gearlash::system::{LoadSource, Mount, System};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Starts spread over a box, the same ones every time.
fn starts(dof: usize, count: usize) -> Vec<f64> {
    let mut x = 0.5_f64;
    let mut next = || {
        x = (x + 0.618_033_988_749_895).fract();
        3.0 * (2.0 * x - 1.0)
    };
    (0..2 * dof * count).map(|_| next()).collect()
}

fn one(x: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, x)
}

fn single(mount: Mount) -> System {
    let loads = vec![load(1, 0, 0.2, 0.3)];
    System::new(one(0.1), one(1.0), one(1.0), vec![mount], loads).unwrap()
}

/// A closed form, two meshes; impact damping; a stiffness that varies; a force that only DOPRI5 integrates.
fn systems() -> Vec<(System, IntegratorChoice)> {
    let damped = Mount::new(Box::new(Backlash {
        half_gap: 0.4,
        impact_damping: 0.1,
        impact_damping_law: ImpactDampingLaw::Dissipative,
        contact_damping: 0.0,
    }) as Box<dyn Element>);
    let mut varying = backlash(0.4);
    varying.stiffness_variation = Some(Periodic::Fourier {
        mean: 1.0,
        harmonics: vec![Harmonic {
            order: 1,
            cos: 0.2,
            sin: 0.1,
        }],
    });
    let switching = Expression::new("q + 0.1*(phase > 2)", &[]).unwrap();
    let mut pair = idler(2, 0.0285, &[1.0, 0.3]);
    pair.set_excitation_frequency(1.2);
    vec![
        (pair, IntegratorChoice::Exact),
        (single(damped), IntegratorChoice::Series),
        (single(varying), IntegratorChoice::Series),
        (
            single(Mount::new(Box::new(switching))),
            IntegratorChoice::Dopri5,
        ),
    ]
}

#[test]
fn trajectories_are_those_of_one_at_a_time_to_the_bit() {
    for (system, expected) in systems() {
        assert_eq!(automatic(&system), expected);
        assert_eq!(is_flow(&system), expected != IntegratorChoice::Dopri5);
        let (count, periods) = (13, 9);
        let size = 2 * system.dof();
        let starts = starts(system.dof(), count);
        let mut seen = vec![Vec::new(); count];
        let mut ensemble = Ensemble::new(&system, IntegratorChoice::Auto).unwrap();
        // Every third trajectory is seen enough of after four periods.
        let ends = ensemble.run(&system, &starts, periods, &mut |visit| {
            assert_eq!(visit.period, seen[visit.trajectory].len() + 1);
            seen[visit.trajectory].push(visit.state.to_vec());
            match visit.trajectory % 3 == 0 && visit.period == 4 {
                true => Next::Stop,
                false => Next::GoOn,
            }
        });
        assert_eq!(ends, vec![IntegrationEnd::Reached; count]);
        let mut single = choose(&system, IntegratorChoice::Auto).unwrap();
        for (k, start) in starts.chunks_exact(size).enumerate() {
            assert_eq!(seen[k].len(), if k % 3 == 0 { 4 } else { periods });
            let mut state = start.to_vec();
            for point in &seen[k] {
                single.advance(&system, (0.0, TAU), &mut state, &mut ());
                assert_eq!(&state, point, "{expected:?}, trajectory {k}");
            }
        }
    }
}

/// A record whose transient was gone through together with others is that of a motion on its own, deviations included; one that fails
/// underway starts at its begin.
#[test]
fn transients_gone_through_together_lead_to_the_same_records() {
    let size = MapSize {
        transient: 180,
        periods: 20,
        exponents: Lengths::Followed,
    };
    let options = LabelOptions {
        extend: 1,
        ..LabelOptions::default()
    };
    for (system, _) in systems() {
        let starts = starts(system.dof(), 5);
        let mut states: Vec<Vec<f64>> = (starts.chunks_exact(2 * system.dof()))
            .map(<[f64]>::to_vec)
            .collect();
        states[3][0] = f64::NAN;
        let begins = states.clone();
        let mut ensemble = Ensemble::new(&system, IntegratorChoice::Auto).unwrap();
        let heads = head_starts(&mut ensemble, &system, &mut states, 180, &mut || true);
        assert!(heads[3].is_none() && heads.iter().flatten().count() == 4);
        assert!(states[3][0].is_nan() && states[2] != begins[2]);
        let record = |mut state: Vec<f64>, head: HeadStart| {
            let mut integrator = choose(&system, IntegratorChoice::Auto).unwrap();
            let mut map = Stroboscopic {
                system: &system,
                integrator: integrator.as_mut(),
            };
            let begin = (state.as_mut_slice(), head);
            let found = attractor_from(&mut map, begin, size, options, &mut |_| true);
            (
                found.label,
                found.record.points,
                found.record.exponents,
                state,
            )
        };
        for (k, head) in heads.into_iter().enumerate().filter(|(k, _)| *k != 3) {
            let together = record(states[k].clone(), head.unwrap());
            let alone = record(begins[k].clone(), HeadStart::default());
            assert_eq!(format!("{together:?}"), format!("{alone:?}"), "{k}");
        }
    }
}

/// One that diverges or has no series ends alone.
#[test]
fn a_trajectory_that_fails_leaves_the_others_alone() {
    let law = Cubic { cubic: -0.01 };
    let system = single(Mount::new(Box::new(law)));
    let starts = [0.1, 0.0, 40.0, 10.0, 0.05, -0.1];
    let mut ensemble = Ensemble::new(&system, IntegratorChoice::Auto).unwrap();
    let mut visits = [0; 3];
    let ends = ensemble.run(&system, &starts, 5, &mut |visit| {
        visits[visit.trajectory] += 1;
        Next::GoOn
    });
    assert_eq!((visits[0], visits[2]), (5, 5));
    assert!(
        visits[1] == 0 && ends[1] != IntegrationEnd::Reached,
        "{ends:?}"
    );
    assert_eq!(
        (ends[0], ends[2]),
        (IntegrationEnd::Reached, IntegrationEnd::Reached)
    );
}

/// A chain of 1 to 4 meshes: gaps, stages, one-sided contacts, a stop 10^5 times as stiff as its mesh; two harmonics.
fn chain(draw: &mut dyn FnMut(f64, f64) -> f64) -> System {
    let n = 1 + draw(0.0, 4.0) as usize;
    let ratio = draw(0.2, 2.0);
    let kappa = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => 1.0 + ratio,
        1 => -ratio,
        _ => 0.0,
    });
    let damping = draw(0.01, 0.1) * &kappa;
    let mut mount = |kind: f64| match kind as usize {
        0 => Mount::new(Box::new(PiecewiseLinear {
            breakpoints: vec![-draw(0.2, 1.0), draw(0.1, 1.0), draw(1.2, 2.0)],
            slopes: vec![1.0, draw(0.0, 0.3), draw(0.5, 1.5), 1e5],
        }) as Box<dyn Element>),
        1 => Mount::new(Box::new(OneSided {
            gap: draw(0.0, 0.5),
            side: Side::Negative,
            contact_damping: 0.0,
        })),
        _ => backlash(draw(0.05, 1.0)),
    };
    let mounts = (0..n).map(|k| mount((1.7 * k as f64) % 4.0)).collect();
    let mut loads: Vec<LoadSource> = (0..n)
        .map(|i| load(n, i, draw(-0.3, 0.5), draw(0.0, 0.5)))
        .collect();
    loads[0].series = Periodic::Fourier {
        mean: draw(0.0, 0.5),
        harmonics: vec![
            Harmonic {
                order: 1,
                cos: draw(0.0, 0.5),
                sin: draw(0.0, 0.2),
            },
            Harmonic {
                order: 3,
                cos: 0.0,
                sin: draw(0.0, 0.2),
            },
        ],
    };
    let mut system = System::new(damping, kappa, DMatrix::identity(n, n), mounts, loads).unwrap();
    system.set_excitation_frequency(draw(0.2, 2.0));
    system
}

/// Starts on breakpoints and far away among them; ensembles of any size.
#[test]
fn chains_side_by_side_have_the_states_of_each_alone() {
    let mut random = ChaCha8Rng::seed_from_u64(18);
    let mut draw = |low: f64, high: f64| random.random_range(low..high);
    let mut together = 0;
    for case in 0..120 {
        let mut system = chain(&mut draw);
        if case % 5 == 0 {
            system.set_subharmonic(3);
        }
        let (size, count) = (2 * system.dof(), 3 + case % 20);
        let mut starts: Vec<f64> = (0..size * count).map(|_| draw(-1.5, 1.5)).collect();
        let on = system.mounts()[0].element.breakpoints()[0];
        (starts[0], starts[size]) = (on, on + 1e-16);
        starts[2 * size] *= 1e6;
        let mut ensemble = Ensemble::new(&system, IntegratorChoice::Auto).unwrap();
        let mut last = vec![Vec::new(); count];
        let periods = 4;
        let ends = ensemble.run(&system, &starts, periods, &mut |visit| {
            last[visit.trajectory] = visit.state.to_vec();
            together += 1;
            Next::GoOn
        });
        assert_eq!(ends, vec![IntegrationEnd::Reached; count]);
        let mut single = choose(&system, IntegratorChoice::Auto).unwrap();
        assert!(single.flight(&system).is_some(), "{case}");
        let span = (0.0, TAU / system.subharmonic() as f64);
        for (k, start) in starts.chunks_exact(size).enumerate() {
            let mut state = start.to_vec();
            for _ in 0..periods {
                single.advance(&system, span, &mut state, &mut ());
            }
            let bits = |list: &[f64]| list.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
            assert_eq!(bits(&state), bits(&last[k]), "{case}, trajectory {k}");
        }
    }
    assert!(together > 5000, "{together}");
}

/// Systems that have to fly alone say so.
#[test]
fn what_does_not_fly_together() {
    let alone: Vec<bool> = systems()
        .iter()
        .map(|(system, _)| {
            let integrator = choose(system, IntegratorChoice::Auto).unwrap();
            integrator.flight(system).is_none()
        })
        .collect();
    assert_eq!(alone, [false, true, true, true]);
}
