//! Exact condensation of linear coordinates against dense elimination: solutions, signs, cost.

use crate::common;
use gearlash::element::Linear;
use gearlash::numeric::factors::Factors;
use gearlash::numeric::jacobian::Jacobian;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{Linearisation, Residual};
use gearlash::system::{Mount, System};
use nalgebra::{DMatrix, DVector};

/// A chain whose connections are meshes with a gap at the given places and linear elsewhere, with damping at the connections, or of
/// every mode with every other.
fn chain(n: usize, meshes: &[usize], is_full: bool) -> System {
    let kappa = DMatrix::from_fn(n, n, |i: usize, j| match i.abs_diff(j) {
        0 => 2.0 + 0.1 * (i as f64).sin(),
        1 => -1.0,
        _ => 0.0,
    });
    let gamma = match is_full {
        true => 0.05 * &kappa + DMatrix::from_element(n, n, 0.002),
        false => 0.05 * &kappa,
    };
    let mount = |k: usize| match meshes.contains(&k) {
        true => common::backlash(0.3),
        false => Mount::new(Box::new(Linear {})),
    };
    let mounts = (0..n).map(mount).collect();
    let loads = (0..n)
        .map(|i| common::load(n, i, 0.3, if i == 0 { 0.4 } else { 0.0 }))
        .collect();
    System::new(gamma, kappa, DMatrix::identity(n, n), mounts, loads).unwrap()
}

fn galerkin(system: System) -> Galerkin<FrequencyFamily> {
    let size = GalerkinOptions {
        harmonics: 5,
        samples: 128,
    };
    Galerkin::new(FrequencyFamily::new(system), 0.7, size).unwrap()
}

/// A motion in which the gaps are crossed.
fn guess(dim: usize) -> DVector<f64> {
    DVector::from_fn(dim, |k, _| match k % 11 {
        0 => 0.3,
        1 => 0.8,
        order => (1.7 * k as f64).sin() / (2 * order) as f64,
    })
}

/// Coordinates condensed, and how far solution and sign are from dense elimination with row exchanges.
fn compare(matrix: &Jacobian) -> (usize, f64) {
    let rhs = DVector::from_fn(matrix.dim(), |k, _| (0.3 * k as f64).cos());
    let dense = matrix.to_dense();
    let expected = dense.clone().lu().solve(&rhs).unwrap();
    let mut factors = Factors::new(&matrix.structure());
    // The second look at the same matrix finds its buffers in place.
    for _ in 0..2 {
        let mut x = rhs.clone();
        assert!(factors.factorise(matrix));
        assert!(factors.solve(matrix, &mut x));
        assert!((&x - &expected).amax() < 1e-9 * expected.amax());
        let sign = Factors::determinant_sign(&factors);
        let mut whole = Factors::new(&Jacobian::Dense(dense.clone()).structure());
        assert!(whole.factorise(&Jacobian::Dense(dense.clone())));
        assert_eq!(sign, whole.determinant_sign());
    }
    assert_eq!(factors.exchanges(), 0);
    let mut x = rhs.clone();
    assert!(factors.solve(matrix, &mut x));
    (
        factors.condensed(),
        (&x - &expected).amax() / expected.amax(),
    )
}

#[test]
fn linear_coordinates_leave_the_system_exactly() {
    for (n, meshes) in [
        (6, vec![1]),
        (12, vec![0, 5]),
        (12, vec![4, 5, 6]),
        (40, vec![7, 20, 39]),
    ] {
        for is_full in [false, true] {
            let mut problem = galerkin(chain(n, &meshes, is_full));
            let mut at = Linearisation::of(&problem);
            let u = guess(problem.dim());
            problem.linearise(&u, 0.7, &mut at).unwrap();
            let (condensed, gap) = compare(&at.dr_du);
            assert_eq!(condensed, n - meshes.len(), "{n} {meshes:?} {is_full}");
            assert!(gap < 1e-11, "{n} {meshes:?} {is_full}: {gap:e}");
            // A border whose row moves nothing but a linear coordinate: that one stays in the rest.
            let mut bordered = Jacobian::new(&problem.structure().bordered());
            let row = |k: usize| if k / 11 == 2 { 0.1 } else { 0.0 };
            bordered.take_bordered(&mut at.dr_du, &at.dr_dlambda, row, 0.2);
            let (condensed, gap) = compare(&bordered);
            let stays = usize::from(!meshes.contains(&2));
            assert_eq!(
                condensed,
                n - meshes.len() - stays,
                "{n} {meshes:?} {is_full}"
            );
            assert!(gap < 1e-11, "{n} {meshes:?} {is_full}: {gap:e}");
        }
    }
}

#[test]
fn meshes_that_stay_in_contact_are_condensed_too() {
    let all: Vec<usize> = (0..30).collect();
    let mut problem = galerkin(chain(30, &all, true));
    let mut at = Linearisation::of(&problem);
    let mut u = DVector::zeros(problem.dim());
    u.iter_mut().step_by(11).for_each(|q| *q = 1.0);
    problem.linearise(&u, 0.7, &mut at).unwrap();
    let (condensed, gap) = compare(&at.dr_du);
    assert_eq!(condensed, 29);
    assert!(gap < 1e-11, "{gap:e}");
    // One of them begins to separate.
    u[13 * 11 + 2] = 0.9;
    problem.linearise(&u, 0.7, &mut at).unwrap();
    let mut factors = Factors::new(&at.dr_du.structure());
    assert!(factors.factorise(&at.dr_du));
    assert_eq!(factors.condensed(), 29);
    let (_, gap) = compare(&at.dr_du);
    assert!(gap < 1e-11, "{gap:e}");
}

#[test]
fn coordinates_that_come_and_go_are_not_condensed_every_time() {
    let all: Vec<usize> = (0..12).collect();
    let mut problem = galerkin(chain(12, &all, true));
    let mut at = Linearisation::of(&problem);
    let mut factors = Factors::new(&at.dr_du.structure());
    let mut look = |amplitude: f64| {
        let mut u = DVector::zeros(problem.dim());
        u.iter_mut().step_by(11).for_each(|q| *q = 1.0);
        u[3 * 11 + 2] = amplitude;
        u[8 * 11 + 2] = 0.9;
        problem.linearise(&u, 0.7, &mut at).unwrap();
        assert!(factors.factorise(&at.dr_du));
        factors.condensed()
    };
    assert_eq!(look(0.1), 11);
    assert_eq!(look(0.9), 10);
    let again = (0..200).position(|_| look(0.1) == 11).unwrap();
    assert!((50..80).contains(&again), "{again}");
}

#[test]
fn a_long_train_with_few_meshes_converges_as_its_dense_twin() {
    let system = chain(60, &[3, 30], true);
    let mut problem = galerkin(system);
    let mut u = DVector::zeros(problem.dim());
    u.iter_mut().step_by(11).for_each(|q| *q = 0.6);
    let mut newton = Newton::new(&problem.structure(), NewtonOptions::default());
    let outcome = newton.solve(&mut problem, &mut u, 0.7).unwrap();
    assert!(outcome.is_converged(), "{outcome:?}");
    let work = newton.linearisation();
    let step = work.dr_du.to_dense().lu().solve(&work.r).unwrap();
    assert!(step.amax() < 1e-9 * u.amax());
}
