//! dR/du and dR/dlambda of the Galerkin residual against central differences, on systems with everything in them.

use gearlash::element::{Backlash, Cubic, Element, ImpactDampingLaw, OneSided, Side};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::family::{ExcitationFamily, Family, FrequencyFamily};
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::residual::{Linearisation, Residual};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};

/// A loop (3 connections on 2 coordinates) with impact damping, stiffness variation, transmission error and a rate load.
fn everything() -> System {
    let gamma = DMatrix::from_row_slice(2, 2, &[0.2, 0.05, -0.03, 0.3]);
    let kappa = DMatrix::from_row_slice(2, 3, &[2.0, 0.5, 0.3, 0.4, 1.5, -0.6]);
    let w = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.7, -0.4]);
    let harmonic = |order, cos, sin| Harmonic { order, cos, sin };
    let series = |mean, harmonics: Vec<Harmonic>| Periodic::Fourier { mean, harmonics };
    let backlash = Backlash {
        half_gap: 0.3,
        impact_damping: 0.2,
        impact_damping_law: ImpactDampingLaw::Dissipative,
        contact_damping: 0.0,
    };
    let mount = |element: Box<dyn Element>| Mount::new(element);
    let mut mounts = vec![
        mount(Box::new(backlash)),
        mount(Box::new(Cubic { cubic: 0.3 })),
        mount(Box::new(OneSided {
            gap: 0.1,
            side: Side::Negative,
            contact_damping: 0.0,
        })),
    ];
    mounts[0].stiffness_variation = Some(series(
        1.0,
        vec![harmonic(1, 0.1, 0.0), harmonic(2, 0.0, 0.05)],
    ));
    mounts[1].transmission_error = Some(series(0.02, vec![harmonic(2, 0.03, -0.02)]));
    let direction = DVector::from_column_slice(&[1.0, 0.2]);
    let loads = vec![
        LoadSource {
            direction: direction.clone(),
            series: series(0.4, vec![harmonic(1, 0.3, 0.1)]),
            kind: LoadKind::Value,
        },
        LoadSource {
            direction,
            series: series(0.0, vec![harmonic(2, 0.03, -0.02)]),
            kind: LoadKind::Rate,
        },
    ];
    System::new(gamma, kappa, w, mounts, loads).unwrap()
}

fn compare<F: Family>(mut problem: Galerkin<F>, lambda: f64, smooth: f64) {
    let dim = problem.dim();
    let u = DVector::from_fn(dim, |k, _| {
        0.8 * ((k * k + 1) as f64).sin() / (1.0 + (k % 9) as f64)
    });
    let (mut at, mut plus, mut minus) = (
        Linearisation::of(&problem),
        Linearisation::of(&problem),
        Linearisation::of(&problem),
    );
    problem.linearise(&u, lambda, &mut at).unwrap();
    let jacobian = at.dr_du.to_dense();
    let h = 1e-6;
    for k in 0..dim {
        let shifted = |sign: f64| {
            let mut v = u.clone();
            v[k] += sign * h;
            v
        };
        problem.linearise(&shifted(1.0), lambda, &mut plus).unwrap();
        problem
            .linearise(&shifted(-1.0), lambda, &mut minus)
            .unwrap();
        let difference = (&plus.r - &minus.r) / (2.0 * h);
        let gap = (difference - jacobian.column(k)).amax();
        assert!(gap < smooth, "dR/du column {k}: {gap:e}");
    }
    problem.linearise(&u, lambda + h, &mut plus).unwrap();
    problem.linearise(&u, lambda - h, &mut minus).unwrap();
    let gap = ((&plus.r - &minus.r) / (2.0 * h) - &at.dr_dlambda).amax();
    assert!(gap < smooth, "dR/dlambda: {gap:e}");
}

#[test]
fn frequency_family() {
    for nu in [1, 2] {
        let mut system = everything();
        system.set_subharmonic(nu);
        let size = GalerkinOptions {
            harmonics: 4,
            samples: 2048,
        };
        // A sample that passes a breakpoint within the difference step changes the slope of the sampled residual by
        // about 1 / samples.
        compare(
            Galerkin::new(FrequencyFamily::new(system), 0.7, size).unwrap(),
            0.7,
            2e-3,
        );
    }
}

#[test]
fn excitation_family() {
    let size = GalerkinOptions {
        harmonics: 4,
        samples: 2048,
    };
    compare(
        Galerkin::new(ExcitationFamily::new(everything()), 0.6, size).unwrap(),
        0.6,
        2e-3,
    );
}

#[test]
fn smooth_laws_to_rounding() {
    let mut mounts = everything().mounts().to_vec();
    mounts[0].element = Box::new(Cubic { cubic: -0.05 });
    mounts[2].element = Box::new(Backlash {
        half_gap: 0.0,
        impact_damping: 0.1,
        impact_damping_law: ImpactDampingLaw::Literal,
        contact_damping: 0.0,
    });
    let base = everything();
    let (gamma, kappa, w) = (
        base.damping().clone(),
        base.stiffness().clone(),
        base.element_map().clone(),
    );
    let system = System::new(gamma, kappa, w, mounts, base.loads().to_vec()).unwrap();
    let size = GalerkinOptions {
        harmonics: 5,
        samples: 256,
    };
    compare(
        Galerkin::new(FrequencyFamily::new(system), 0.9, size).unwrap(),
        0.9,
        1e-7,
    );
}
