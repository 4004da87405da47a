//! Long trains: leading multipliers without the transition matrix.

use gearlash::solve::floquet::{Floquet, Spectrum, multipliers};
use gearlash::solve::orbit::FourierOrbit;
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;

/// A chain of n meshes with stiffness-proportional damping; laws as given, one after the other.
fn chain(n: usize, damping: f64, mounts: Vec<Mount>) -> System {
    let kappa = DMatrix::from_fn(n, n, |i: usize, j| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    });
    let load = LoadSource {
        direction: DVector::from_element(n, 1.0),
        series: gearlash::numeric::periodic::Periodic::Fourier {
            mean: 0.3,
            harmonics: Vec::new(),
        },
        kind: LoadKind::Value,
    };
    let map = DMatrix::identity(n, n);
    System::new(&kappa * damping, kappa, map, mounts, vec![load]).unwrap()
}

/// A motion in which every third mesh lifts off and the others stay in contact.
fn orbit(n: usize, omega: f64) -> FourierOrbit {
    let one = |k: usize| {
        let (sin, cos) = (0.7 * k as f64).sin_cos();
        let amplitude = if k.is_multiple_of(3) { 0.8 } else { 0.1 };
        vec![1.0, amplitude * sin, amplitude * cos, 0.05 * cos, 0.02]
    };
    FourierOrbit {
        coefficients: (0..n).map(one).collect(),
        omega,
        subharmonic: 1,
    }
}

/// Distance of each leading multiplier from the nearest of all, and whether none of larger modulus is missing.
fn compare(system: &System, orbit: &FourierOrbit) -> usize {
    let mut floquet = Floquet::default();
    let leading = floquet.multipliers(system, orbit, &orbit.extrema(system));
    let all = multipliers(&floquet.monodromy(system, orbit));
    assert_eq!(all.len(), 2 * system.dof());
    assert!(leading.len() >= 10 && leading.len() < all.len());
    let unit = all[0].norm().max(1.0);
    for (a, b) in leading.iter().zip(&all) {
        assert!((a.norm() - b.norm()).abs() < 1e-7 * unit, "{a} {b}");
        let gap = |mu: &Complex<f64>| (mu - a).norm();
        let nearest = all.iter().map(gap).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-7 * unit, "{a} is {nearest:e} from any");
    }
    leading.len()
}

#[test]
fn leading_multipliers_are_among_all_of_them() {
    let n = 70;
    assert_eq!(Spectrum::of(n), Spectrum::Leading);
    let system = |damping: f64| {
        let mut system = chain(
            n,
            damping,
            (0..n).map(|_| crate::common::backlash(0.5)).collect(),
        );
        system.set_excitation_frequency(0.8);
        system
    };
    compare(&system(0.3), &orbit(n, 0.8));
    // Hardly damped: many multipliers outside the unit circle, all of them are found.
    let count = compare(&system(0.02), &orbit(n, 0.8));
    let all = multipliers(&Floquet::default().monodromy(&system(0.02), &orbit(n, 0.8)));
    let outside = all.iter().filter(|mu| mu.norm() > 1.0).count();
    assert!(count > outside, "{count} of {outside} outside");
}

#[test]
fn smooth_laws_by_panels_agree_with_magnus() {
    let n = 66;
    let law = |k: usize| {
        let cubic = gearlash::element::Cubic {
            cubic: if k.is_multiple_of(4) { 0.3 } else { 0.0 },
        };
        Mount::new(Box::new(cubic))
    };
    let mut system = chain(n, 0.3, (0..n).map(law).collect());
    system.set_excitation_frequency(0.8);
    compare(&system, &orbit(n, 0.8));
}
