//! Many trajectories at once: what each of them does depends on its start alone.

use crate::common::{backlash, load};
use crate::exact_flow::idler;
use gearlash::element::{Backlash, Cubic, Element, Expression, ImpactDampingLaw};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::ensemble::{Ensemble, Next};
use gearlash::solve::integrate::{IntegrationEnd, IntegratorChoice, automatic, choose, is_flow};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
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
