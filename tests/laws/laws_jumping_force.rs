//! Periodic responses of joints whose force jumps: the Galerkin method and shooting say the same.

use crate::common::{load, trace};
use gearlash::element::{Element, Linear, Preloaded};
use gearlash::postprocess::measures::Meter;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{Linearisation, PeriodicResidual, Residual};
use gearlash::solve::shooting::Shooting;
use gearlash::system::{Mount, System};
use nalgebra::{DMatrix, DVector};

/// Two coordinates, the first joint preloaded on both flanks.
fn system(half_gap: f64, preload: f64, mean: f64, cos: f64) -> System {
    let kappa = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
    let gamma = DMatrix::from_row_slice(2, 2, &[0.137, 0.037, 0.037, 0.137]);
    let joint: Box<dyn Element> = Box::new(Preloaded { half_gap, preload });
    let mounts = vec![Mount::new(joint), Mount::new(Box::new(Linear {}))];
    let loads = vec![load(2, 0, mean, cos), load(2, 1, mean, 0.0)];
    System::new(gamma, kappa, DMatrix::identity(2, 2), mounts, loads).unwrap()
}

/// Differences between the Galerkin solution and the fixed point of the exact flow: state at phase 0, multipliers, r.m.s.
/// deformation, mean and r.m.s. force; and the contacts made a period.
fn differences(system: &System, frequency: f64, harmonics: usize) -> ([f64; 5], f64) {
    let size = GalerkinOptions {
        harmonics,
        samples: 4096,
    };
    let range = (frequency, frequency + 0.01);
    let branch = trace(system, range, harmonics, Some(size.samples), &[]);
    let u = &branch.points[0].unknowns;
    let family = || FrequencyFamily::new(system.clone());
    let mut galerkin = Galerkin::new(family(), frequency, size).unwrap();
    let orbit = galerkin.orbit(u, frequency).unwrap();
    let mut guess = vec![0.0; 4];
    orbit.state(0.0, &mut guess);
    let mut shooting = Shooting::new(family(), frequency, IntegratorChoice::Auto).unwrap();
    assert_eq!(shooting.integrator(), "exact");
    let guess = DVector::from_vec(guess);
    let mut fixed = guess.clone();
    let options = NewtonOptions {
        tolerance: 1e-12,
        ..NewtonOptions::default()
    };
    let mut newton = Newton::new(&shooting.structure(), options);
    let outcome = newton.solve(&mut shooting, &mut fixed, frequency);
    let outcome = outcome.unwrap();
    // Quadratic convergence: Phi is the derivative of the map, jumps included.
    assert!(
        outcome.is_converged() && outcome.iterations <= 4,
        "{outcome:?}"
    );
    let [a, b] = [
        galerkin.multipliers(u, frequency).unwrap(),
        shooting.multipliers(&fixed, frequency).unwrap(),
    ];
    let multipliers = a.iter().zip(&b).map(|(a, b)| (a - b).norm());
    let exact = shooting.orbit(&fixed, frequency).unwrap();
    let mut meter = Meter::new(size.samples);
    let [m, n] = [orbit, exact].map(|orbit| meter.measure(system, &orbit)[0]);
    assert_eq!(m.contacts.impacts(), n.contacts.impacts());
    let list = [
        (&fixed - &guess).amax(),
        multipliers.fold(0.0, f64::max),
        (m.rms - n.rms).abs(),
        (m.force_mean - n.force_mean).abs(),
        (m.force_std - n.force_std).abs(),
    ];
    (list, n.contacts.impacts())
}

#[test]
fn galerkin_and_shooting_agree_on_orbits_and_multipliers() {
    // From flank to flank; separating from one flank; torn from side to side without a gap.
    for (half_gap, preload, mean, cos, frequency, contacts) in [
        (0.3, 0.2, 0.0, 1.2, 1.9, 2.0),
        (1.0, 0.15, 0.5, 0.9, 1.1, 1.0),
        (0.0, 0.2, 0.0, 1.5, 1.3, 0.0),
    ] {
        let mut system = system(half_gap, preload, mean, cos);
        system.set_excitation_frequency(frequency);
        let (coarse, _) = differences(&system, frequency, 20);
        let (fine, impacts) = differences(&system, frequency, 40);
        assert_eq!(impacts, contacts, "{half_gap}");
        // The acceleration jumps: coefficients of q fall like k^-3, those of v (in the state) like k^-2.
        for (gap, allowed) in fine.iter().zip([3e-4, 3e-3, 1e-6, 1e-6, 1e-6]) {
            assert!(gap < &allowed, "{half_gap}: {fine:?}");
        }
        assert!(
            fine[2] < 0.3 * coarse[2],
            "it converges: {coarse:?} {fine:?}"
        );
    }
}

/// A residual of 5 harmonics and few samples, and unknowns whose joint passes its jumps.
fn coarse() -> (Galerkin<FrequencyFamily>, DVector<f64>) {
    let system = system(0.3, 0.2, 0.1, 1.2);
    let size = GalerkinOptions {
        harmonics: 5,
        samples: 256,
    };
    let galerkin = Galerkin::new(FrequencyFamily::new(system), 1.3, size).unwrap();
    let u = |k, _| 0.7 / (1.0 + k as f64) * (3.0 * k as f64).cos();
    let u = DVector::from_fn(galerkin.dim(), u);
    (galerkin, u)
}

#[test]
fn the_derivative_of_the_residual_holds_across_jumps() {
    let (mut galerkin, u) = coarse();
    let n = galerkin.dim();
    let (mut here, mut there) = (Linearisation::of(&galerkin), Linearisation::of(&galerkin));
    galerkin.linearise(&u, 1.3, &mut here).unwrap();
    let jacobian = here.dr_du.to_dense();
    for k in 0..n {
        let h = 1e-5;
        let mut shifted = u.clone();
        shifted[k] += h;
        galerkin.linearise(&shifted, 1.3, &mut there).unwrap();
        let mut change = there.r.clone();
        shifted[k] -= 2.0 * h;
        galerkin.linearise(&shifted, 1.3, &mut there).unwrap();
        change -= &there.r;
        let gap = (change / (2.0 * h) - jacobian.column(k)).amax();
        // Central differences err by h^2 times a third derivative of some 1e4 (1 / x'^2 at a slow passage).
        assert!(gap < 5e-6, "{k}: {gap:e}");
    }
}

/// Uncorrected samples would make the residual a staircase with steps of 2 kappa preload / samples = 3e-3.
#[test]
fn the_residual_is_continuous_while_jumps_pass_samples() {
    let (mut galerkin, mut u) = coarse();
    // A large motion, so that no passage is slow.
    u[2] = 2.0;
    let mut work = Linearisation::of(&galerkin);
    let mut last: Option<DVector<f64>> = None;
    let mut steps = Vec::new();
    for _ in 0..3000 {
        u[1] += 1e-5;
        galerkin.linearise(&u, 1.3, &mut work).unwrap();
        if let Some(last) = &last {
            steps.push((&work.r - last).amax());
        }
        last = Some(work.r.clone());
    }
    steps.sort_by(f64::total_cmp);
    let (usual, largest) = (steps[steps.len() / 2], steps[steps.len() - 1]);
    assert!(largest < 3.0 * usual, "{usual:e} {largest:e}");
}
