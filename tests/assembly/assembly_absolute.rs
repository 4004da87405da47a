//! The scaled reduced equation against the absolute equations, for random trains with loops, rad beside m, own scales.

use crate::assembly_support::*;
use gearlash::assembly::{body_damping, couple, elastic_modes};
use gearlash::element::Element;
use gearlash::model::*;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// A connected train with loops that close: every row of arms is orthogonal to one motion (or the train is grounded twice).
fn random_train(random: &mut Seeded, is_grounded: bool) -> Train {
    let n_b = 3 + random.below(4);
    // Angles of the rigid-body motion; every second body hangs on its neighbour by a shaft and shares its angle.
    let mut angle: Vec<f64> = (0..n_b).map(|_| random.between(0.3, 2.0)).collect();
    for k in (1..n_b).step_by(2) {
        angle[k] = angle[k - 1];
    }
    let mut list: Vec<Connection> = Vec::new();
    let link = |random: &mut Seeded, i: usize, j: usize| {
        let is_shaft = angle[i] == angle[j] && random.next() < 0.7;
        let arm = if is_shaft {
            1.0
        } else {
            random.between(0.02, 0.1)
        };
        let (l, k) = if is_shaft { (1e-3, 1e5) } else { (5e-5, 2e8) };
        let l = l * random.between(0.5, 2.0);
        let arms = [(i, arm), (j, -arm * angle[i] / angle[j])];
        let mut c = connection(&arms, k * random.between(0.5, 2.0), backlash(0.7 * l));
        c.length = Some(l);
        c.damping = if random.next() < 0.5 {
            1e-6 * c.stiffness
        } else {
            0.0
        };
        c
    };
    for j in 1..n_b {
        let i = if j % 2 == 1 { j - 1 } else { random.below(j) };
        list.push(link(random, i, j));
    }
    for _ in 0..2 {
        let i = random.below(n_b - 1);
        let j = i + 1 + random.below(n_b - 1 - i);
        list.push(link(random, i, j));
    }
    if is_grounded {
        for body in [0, n_b - 1] {
            let mut c = connection(&[(body, 1.0)], 1e5, backlash(1e-4));
            c.length = Some(random.between(1e-3, 2e-3));
            list.push(c);
        }
    }
    // Any order: the coordinates are the first independent rows.
    for k in (1..list.len()).rev() {
        list.swap(k, random.below(k + 1));
    }
    for c in &mut list {
        let harmonics = vec![Harmonic {
            order: 2,
            cos: 0.2,
            sin: -0.1,
        }];
        let series = Periodic::Fourier {
            mean: 0.1,
            harmonics,
        };
        let l = c.length.unwrap();
        c.transmission_error = (random.next() < 0.6).then(|| series.scaled(l));
    }
    let inertia: Vec<f64> = (0..n_b).map(|_| random.between(1e-3, 6e-3)).collect();
    let mut train = train(&inertia, list);
    train.damping.modal = (random.next() < 0.7).then_some(ModalDamping::Uniform(0.04));
    train.damping.stiffness_proportional = if random.next() < 0.5 { 1e-6 } else { 0.0 };
    for body in 0..n_b {
        let amplitude = random.between(-5.0, 5.0);
        load(
            &mut train,
            body,
            random.between(-20.0, 20.0),
            amplitude,
            3.0,
        );
    }
    train
}

/// P z'' from the absolute equations, built from the model alone (C by its own eigenvalue problem, body rates by
/// P^+), with z'' and the size of the terms that cancel in P z''.
fn absolute(
    train: &Train,
    p: &DMatrix<f64>,
    r: &DVector<f64>,
    v: &DVector<f64>,
    at: (f64, f64),
) -> (DVector<f64>, DVector<f64>, DVector<f64>) {
    let (phase, omega) = at;
    let (e, n_b) = (train.connections.len(), train.bodies.len());
    let b = DMatrix::from_fn(e, n_b, |k, body| {
        let arms = &train.connections[k].arms;
        arms.iter().find(|a| a.0 == body).map_or(0.0, |a| a.1)
    });
    let m: Vec<f64> = train.bodies.values().map(|x| x.inertia).collect();
    let diagonal = |f: &dyn Fn(&Connection) -> f64| {
        DMatrix::from_diagonal(&DVector::from_iterator(
            e,
            train.connections.values().map(f),
        ))
    };
    let k = b.transpose() * diagonal(&|c| c.stiffness) * &b;
    let s = DMatrix::from_fn(n_b, n_b, |i, j| k[(i, j)] / (m[i] * m[j]).sqrt());
    let eigen = SymmetricEigen::new(s);
    let mut c =
        b.transpose() * diagonal(&|c| c.damping) * &b + k * train.damping.stiffness_proportional;
    if train.damping.modal.is_some() {
        // Rigid-body eigenvalues are rounding, at times above n eps; elastic ones are above 1e-6 here.
        let floor = 1e-10 * eigen.eigenvalues.amax();
        let root = eigen
            .eigenvalues
            .map(|x| if x < floor { 0.0 } else { x.sqrt() });
        let modal = &eigen.eigenvectors
            * DMatrix::from_diagonal(&(root * 0.08))
            * eigen.eigenvectors.transpose();
        c += DMatrix::from_fn(n_b, n_b, |i, j| modal[(i, j)] * (m[i] * m[j]).sqrt());
    }
    let gram = (p * p.transpose()).cholesky().unwrap();
    let pseudo = p.transpose() * gram.inverse();
    let (z, rate) = (&pseudo * r, &pseudo * v);
    let error = |f: &dyn Fn(&Periodic) -> f64| {
        let list = train
            .connections
            .values()
            .map(|c| c.transmission_error.as_ref().map_or(0.0, f));
        DVector::from_iterator(e, list)
    };
    let slip = error(&|x| omega * x.derivative(phase));
    let deformation = &b * z - error(&|x| x.value(phase));
    let deformation_rate = &b * &rate - &slip;
    let force = DVector::from_fn(e, |j, _| {
        let c = &train.connections[j];
        let law: &dyn Element = c.element.as_ref();
        c.stiffness * law.eval(deformation[j], deformation_rate[j], phase).f
    });
    let dashpots = b.transpose() * diagonal(&|c| c.damping) * slip;
    let mut terms = c.abs() * rate.abs() + b.abs().transpose() * force.abs() + dashpots.abs();
    let mut total = dashpots - c * rate - b.transpose() * force;
    for (body, (name, _)) in train.bodies.iter().enumerate() {
        let load = train.loads[name].series.value(phase);
        total[body] += load;
        terms[body] += load.abs();
        total[body] /= m[body];
        terms[body] /= m[body];
    }
    (p * &total, total, p.abs() * terms)
}

#[test]
fn scaled_reduced_equation_is_p_times_the_absolute_one() {
    let mut random = Seeded(7);
    let (mut worst, mut worst_bodies, mut loops) = (0.0_f64, 0.0_f64, 0);
    for trial in 0..200 {
        let train = random_train(&mut random, trial % 2 == 1);
        let a = assembled(&train);
        let coupling = a.coupling.as_ref().unwrap();
        let (n, e) = (a.system.dof(), a.system.element_count());
        loops += usize::from(e > n);
        let rigid = usize::from(trial % 2 == 0);
        assert_eq!(coupling.rigid_body.ncols(), rigid);
        assert!((&coupling.incidence * &coupling.rigid_body).amax() < 1e-13);
        let mut system = a.system.clone();
        system.set_excitation_frequency(0.8);
        let state: Vec<f64> = (0..2 * n).map(|_| random.between(-2.0, 2.0)).collect();
        let tau = random.between(0.0, 6.0);
        let (mut scratch, mut found) = (system.scratch(), vec![0.0; n]);
        system.acceleration(tau, &state, &mut scratch, &mut found);

        let w_c = a.scales.frequency;
        let l = DVector::from_fn(n, |i, _| a.scales.displacement[coupling.coordinates[i]]);
        let r = DVector::from_column_slice(&state[..n]).component_mul(&l);
        let v = DVector::from_column_slice(&state[n..]).component_mul(&l) * w_c;
        let (wanted, bodies, terms) =
            absolute(&train, &coupling.transform, &r, &v, (tau, 0.8 * w_c));
        let found = DVector::from_vec(found).component_mul(&l) * (w_c * w_c);
        for i in 0..n {
            worst = worst.max((found[i] - wanted[i]).abs() / terms[i]);
        }
        let back = a
            .body_accelerations(&system, tau, &state, &mut scratch)
            .unwrap();
        let back = DVector::from_vec(back);
        worst_bodies = worst_bodies.max((back - &bodies).amax() / bodies.amax());
    }
    println!("worst {worst:.1e}, bodies {worst_bodies:.1e}, {loops} of 200 with loops");
    assert!(loops > 150);
    assert!(worst < 1e-13, "{worst:e}");
    assert!(worst_bodies < 1e-12, "{worst_bodies:e}");
}

#[test]
fn modal_damping_gives_every_elastic_mode_its_ratio_and_rigid_motion_none() {
    let mut random = Seeded(11);
    for trial in 0..40 {
        let train = random_train(&mut random, trial % 2 == 1);
        let mut bare = train.clone();
        bare.damping.stiffness_proportional = 0.0;
        bare.connections.values_mut().for_each(|c| c.damping = 0.0);
        let coupling = couple(&bare).unwrap();
        let modes = elastic_modes(&bare, &coupling).unwrap();
        let n = modes.eigenvalues.len();
        let ratios: Vec<f64> = (0..n).map(|k| 0.01 + 0.02 * k as f64).collect();
        let c = body_damping(&bare, &coupling, &modes, Some(&ratios));
        let found = modes.shapes.transpose() * &c * &modes.shapes;
        let wanted = DVector::from_fn(n, |k, _| 2.0 * ratios[k] * modes.eigenvalues[k].sqrt());
        assert!(distance(&found, &DMatrix::from_diagonal(&wanted)) < 1e-13);
        if coupling.rigid_body.ncols() > 0 {
            assert!((&c * &coupling.rigid_body).amax() < 1e-11 * c.amax());
        }
        bare.damping.modal = Some(ModalDamping::PerMode(ratios));
        let a = assembled(&bare);
        // Gam squared has eigenvalues (2 zeta_k omega_k)^2; its trace is the sum of the damping of the modes.
        let trace = wanted.sum() / a.scales.frequency;
        approx::assert_relative_eq!(a.system.damping().trace(), trace, max_relative = 1e-12);
    }
}
