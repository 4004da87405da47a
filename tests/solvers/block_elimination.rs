//! Elimination by blocks against dense elimination: solutions, tangents, signs of determinants, whole paths; linear cost.

use crate::common;
use gearlash::error::SolveError;
use gearlash::numeric::block::BlockLu;
use gearlash::numeric::factors::Factors;
use gearlash::numeric::jacobian::{Jacobian, JacobianStructure};
use gearlash::numeric::pattern::Pattern;
use gearlash::solve::continuation::{
    Advance, Continuation, ContinuationOptions, Crossings, Started,
};
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions, stored_blocks};
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{Linearisation, Residual};
use gearlash::system::System;
use nalgebra::{DMatrix, DVector};
use proptest::test_runner::{Config, RngSeed, TestRunner};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Numbers in (-1, 1), the same on every machine.
struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Random {
        Random(ChaCha8Rng::seed_from_u64(seed))
    }

    fn next(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.0.next_u64() % n as u64) as usize
    }
}

/// A train of n meshes, each hung on an earlier one, with some loops, in relative coordinates.
fn train(n: usize, loops: usize, random: &mut Random) -> System {
    let mut map = DMatrix::zeros(n + loops, n);
    map.view_mut((0, 0), (n, n)).fill_with_identity();
    let mut inverse_inertia = DMatrix::identity(n, n) * 2.0;
    for k in 1..n {
        let other = k - 1 - random.below(k.min(3));
        let coupling = 0.3 * random.next() - 0.5;
        inverse_inertia[(k, other)] = coupling;
        inverse_inertia[(other, k)] = coupling;
    }
    for k in 0..loops {
        let (a, b) = (random.below(n - 1), random.below(n - 1));
        map[(n + k, a)] = 0.5 + 0.3 * random.next();
        map[(n + k, b + 1)] -= 0.5;
    }
    let kappa = &inverse_inertia * map.transpose();
    let gamma = 0.08 * &kappa * &map;
    let gaps = (0..n + loops).map(|_| 0.3 + 0.2 * random.next());
    let mounts = gaps.map(common::backlash).collect();
    let loads = (0..n)
        .map(|i| common::load(n, i, 0.3, if i == n / 2 { 0.4 } else { 0.0 }))
        .collect();
    System::new(gamma, kappa, map, mounts, loads).unwrap()
}

/// The same train with every mode damped by every other.
fn fully_damped(train: &System) -> System {
    let n = train.dof();
    let (kappa, map) = (train.stiffness().clone(), train.element_map().clone());
    let (mounts, loads) = (train.mounts().to_vec(), train.loads().to_vec());
    System::new(DMatrix::from_element(n, n, 0.01), kappa, map, mounts, loads).unwrap()
}

fn galerkin(system: System, frequency: f64) -> Galerkin<FrequencyFamily> {
    let size = GalerkinOptions {
        harmonics: 3,
        samples: 64,
    };
    Galerkin::new(FrequencyFamily::new(system), frequency, size).unwrap()
}

/// The same problem with a dense Jacobian.
struct Dense<R>(R, Linearisation);

impl<R: Residual> Dense<R> {
    fn new(problem: R) -> Dense<R> {
        let work = Linearisation::of(&problem);
        Dense(problem, work)
    }
}

impl<R: Residual> Residual for Dense<R> {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        self.0.linearise(u, lambda, &mut self.1)?;
        out.r.copy_from(&self.1.r);
        out.dr_dlambda.copy_from(&self.1.dr_dlambda);
        out.magnitude = self.1.magnitude;
        out.dr_du = Jacobian::Dense(self.1.dr_du.to_dense());
        Ok(())
    }
}

fn is_block(structure: &JacobianStructure) -> bool {
    matches!(structure, JacobianStructure::Block(_))
}

/// Solves both ways; the largest difference relative to the solution, and the two signs.
fn compare(matrix: &Jacobian, rhs: &DVector<f64>) -> (f64, i8, i8) {
    let dense = Jacobian::Dense(matrix.to_dense());
    let solved = |matrix: &Jacobian| {
        let mut factors = Factors::new(&matrix.structure());
        let mut x = rhs.clone();
        assert!(factors.factorise(matrix));
        assert!(factors.solve(matrix, &mut x));
        assert_eq!(factors.exchanges(), 0);
        (x, factors.determinant_sign())
    };
    let ((x, sign), (y, expected)) = (solved(matrix), solved(&dense));
    ((&x - &y).amax() / y.amax(), sign, expected)
}

#[test]
fn random_trains_with_and_without_border() {
    let mut signs = [0, 0];
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let (n, loops) = (24 + random.below(20), random.below(4));
        let mut problem = galerkin(train(n, loops, &mut random), 0.7);
        assert!(is_block(&problem.structure()), "seed {seed}");
        let dim = problem.dim();
        let u = DVector::from_fn(dim, |_, _| random.next());
        let mut at = Linearisation::of(&problem);
        problem
            .linearise(&u, 0.5 + 0.04 * seed as f64, &mut at)
            .unwrap();
        let rhs = DVector::from_fn(dim, |_, _| random.next());
        let (gap, sign, expected) = compare(&at.dr_du, &rhs);
        assert!(gap < 1e-9, "seed {seed}: {gap:e}");
        assert_eq!(sign, expected, "seed {seed}");
        signs[usize::from(sign > 0)] += 1;
        let mut bordered = Jacobian::new(&problem.structure().bordered());
        let row = DVector::from_fn(dim, |_, _| random.next());
        bordered.take_bordered(&mut at.dr_du, &at.dr_dlambda, |k| row[k], 0.3);
        let (gap, sign, expected) = compare(&bordered, &rhs.push(0.7));
        assert!(gap < 1e-9, "seed {seed}, bordered: {gap:e}");
        assert_eq!(sign, expected, "seed {seed}, bordered");
    }
    assert!(signs[0] > 5 && signs[1] > 5, "both signs occur: {signs:?}");
}

#[test]
fn a_singular_matrix_with_a_border_loses_no_digit() {
    // A chain whose motion at the singularity dies out by 0.1 a coordinate from its first end: whichever coordinate is
    // last by default, far ones see nothing of the singularity.
    for (n, size) in [(20, 1), (30, 3)] {
        let pattern = Pattern::new(n, size, (1..n).map(|k| (k - 1, k)));
        let structure = JacobianStructure::Block(pattern.into());
        let mut matrix = Jacobian::new(&structure);
        for k in 0..n * size {
            matrix[(k, k)] = 10.1;
            if k >= size {
                matrix[(k, k - size)] = -1.0;
                matrix[(k - size, k)] = -1.0;
            }
        }
        // The leading entry that makes the determinant vanish, by continued fractions from the far end.
        let mut pivot = 10.1;
        for _ in 1..n - 1 {
            pivot = 10.1 - 1.0 / pivot;
        }
        matrix[(0, 0)] = 1.0 / pivot;
        let null = {
            let svd = matrix.to_dense().svd(false, true);
            assert!(svd.singular_values.min() < 1e-15);
            let v = svd.v_t.unwrap();
            v.row(svd.singular_values.imin()).transpose()
        };
        let mut bordered = Jacobian::new(&structure.bordered());
        bordered.take_bordered(&mut matrix, &null, |k| null[k], 0.0);
        let rhs = DVector::from_fn(n * size + 1, |k, _| (k as f64).sin());
        let (gap, sign, expected) = compare(&bordered, &rhs);
        assert!(gap < 1e-13, "{n} x {size}: {gap:e}");
        assert_eq!(sign, expected);
    }
}

#[test]
fn where_blocks_fail_rows_are_exchanged() {
    // Zero on the diagonal: no block of one row can be a pivot, yet the matrix is a permutation.
    let n = 12;
    let pattern = Pattern::new(n, 1, (1..n).map(|k| (k - 1, k)));
    let mut matrix = Jacobian::new(&JacobianStructure::Block(pattern.into()));
    for k in (0..n).step_by(2) {
        matrix[(k, k + 1)] = 1.0;
        matrix[(k + 1, k)] = 2.0;
    }
    let mut factors = Factors::new(&matrix.structure());
    assert!(factors.factorise(&matrix));
    assert_eq!(factors.exchanges(), 1);
    let mut x = DVector::from_fn(n, |k, _| k as f64);
    assert!(factors.solve(&matrix, &mut x));
    assert_eq!((x[0], x[1]), (0.5, 0.0));
    assert_eq!(
        factors.determinant_sign(),
        if (n / 2) % 2 == 0 { 1 } else { -1 }
    );
    // Almost zero: elimination runs through and returns nothing of use.
    for k in 0..n {
        matrix[(k, k)] = 1e-18;
    }
    assert!(factors.factorise(&matrix));
    let mut x = DVector::from_fn(n, |k, _| 1.0 + k as f64);
    assert!(factors.solve(&matrix, &mut x));
    assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12);
    // A matrix of zeros has no solution either way.
    matrix.fill(0.0);
    assert!(!factors.factorise(&matrix));
}

#[test]
fn the_same_path_through_folds() {
    let system = train(20, 1, &mut Random::new(7));
    let (from, to) = (3.0, 0.7);
    let options = ContinuationOptions {
        range: (from, to),
        step: 0.02,
        min_step: 1e-8,
        max_step: 0.1,
        max_points: 200,
        weight: 0.1,
        newton: NewtonOptions::default(),
        crossings: Crossings::Expected,
    };
    let mut block = galerkin(system.clone(), from);
    assert!(is_block(&block.structure()));
    let mut dense = Dense::new(galerkin(system, from));
    let mut guess = DVector::zeros(block.dim());
    guess
        .iter_mut()
        .step_by(block.coefficients())
        .for_each(|q| *q = 0.6);
    let outcome = Newton::new(&block.structure(), options.newton)
        .solve(&mut block, &mut guess, from)
        .unwrap();
    assert!(outcome.is_converged(), "{outcome:?}");
    let start =
        |problem: &mut dyn Residual| match Continuation::start(problem, guess.clone(), options)
            .unwrap()
        {
            Started::Path(path) => path,
            Started::Failed(outcome) => panic!("{outcome:?}"),
        };
    let (mut a, mut b) = (start(&mut block), start(&mut dense));
    let (mut points, mut folds) = (0, 0);
    loop {
        let direction = a.point().tangent_lambda;
        match (
            a.advance(&mut block).unwrap(),
            b.advance(&mut dense).unwrap(),
        ) {
            (Advance::End(x), Advance::End(y)) => {
                assert_eq!(x, y);
                break;
            }
            (Advance::Point(p), Advance::Point(q)) => {
                points += 1;
                folds += usize::from(direction * p.tangent_lambda < 0.0);
                assert!((p.lambda - q.lambda).abs() < 1e-8, "point {points}");
                assert!((&p.u - &q.u).amax() < 1e-8 * q.u.amax(), "point {points}");
                assert!((&p.tangent_u - &q.tangent_u).amax() < 1e-7 * q.tangent_u.amax());
                assert_eq!(p.orientation, q.orientation);
            }
            other => panic!("one path ends before the other: {other:?}"),
        }
    }
    assert!(points > 30 && folds >= 2, "{points} points, {folds} folds");
    assert_eq!(a.exchanges(), 0);
}

#[test]
fn a_tree_of_any_shape_fills_nothing() {
    let mut runner = TestRunner::new(Config {
        rng_seed: RngSeed::Fixed(3),
        cases: 64,
        ..Config::default()
    });
    let parents = proptest::collection::vec(0..usize::MAX, 2..300);
    runner
        .run(&parents, |parents| {
            let pairs = parents
                .iter()
                .enumerate()
                .map(|(k, p)| (k + 1, p % (k + 1)));
            let pattern = Pattern::new(parents.len() + 1, 2, pairs);
            let structure = JacobianStructure::Block(pattern.clone().into());
            let Jacobian::Block(matrix) = Jacobian::new(&structure) else {
                panic!("blocks were asked for")
            };
            assert_eq!(BlockLu::new(&matrix).stored(), pattern.stored());
            Ok(())
        })
        .unwrap();
}

#[test]
fn factors_of_a_train_grow_with_its_length() {
    let stored = |n: usize| {
        let mut random = Random::new(1);
        let problem = galerkin(train(n, 3, &mut random), 1.0);
        let Jacobian::Block(matrix) = Jacobian::new(&problem.structure().bordered()) else {
            panic!("a long train is eliminated by blocks")
        };
        BlockLu::new(&matrix).stored() as f64 / n as f64
    };
    let (short, long) = (stored(40), stored(400));
    assert!(
        long < 5.0 && long < 1.1 * short,
        "{short} and {long} blocks a mesh"
    );
}

#[test]
fn short_trains_and_full_damping_take_the_dense_path() {
    let is_dense = |system: &System| stored_blocks(system).is_none();
    assert!(is_dense(&train(4, 0, &mut Random::new(2))));
    let n = 40;
    let long = train(n, 0, &mut Random::new(2));
    assert!(is_dense(&fully_damped(&long)));
    assert!(!is_dense(&long));
}
