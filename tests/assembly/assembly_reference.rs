//! Matrices, natural frequencies and accelerations against an independent program, and the paper's cases in SI units.

use crate::assembly_support::*;
use approx::assert_relative_eq;
use gearlash::assembly::{Assembly, assemble};
use gearlash::model::*;
use nalgebra::DMatrix;
use serde_json::Value;

fn trains() -> Value {
    reference(include_str!("../data/trains_si.json"))
}

/// A train of the reference file: modal damping, backlash scaled by its own half gap.
fn reference_train(data: &Value) -> Train {
    let (b, k) = (numbers(&data["b"]), numbers(&data["k"]));
    let rows = data["G"].as_array().unwrap().iter().map(numbers);
    let connections = rows.enumerate().map(|(j, row)| {
        let arms: Vec<_> = row.into_iter().enumerate().filter(|a| a.1 != 0.0).collect();
        connection(&arms, k[j], backlash(b[j]))
    });
    let mut train = train(&numbers(&data["inertia"]), connections.collect());
    train.damping.modal = Some(ModalDamping::Uniform(data["zeta"].as_f64().unwrap()));
    let amplitude = numbers(&data["alternating_torque_cos"]);
    for (body, mean) in numbers(&data["mean_torque"]).into_iter().enumerate() {
        load(&mut train, body, mean, amplitude[body], 0.0);
    }
    train
}

#[test]
fn si_trains_have_the_reference_matrices() {
    for (name, data) in trains().as_object().unwrap() {
        let a = assembled(&reference_train(data));
        let coupling = a.coupling.as_ref().unwrap();
        let w_c = a.scales.frequency;
        let l = &a.scales.displacement;
        let l_r: Vec<f64> = coupling.coordinates.iter().map(|k| l[*k]).collect();
        let (n, e) = (l_r.len(), l.len());
        assert_eq!(*l, numbers(&data["b"]), "{name}: own half gap is the scale");
        let rows: Vec<f64> = coupling.coordinates.iter().map(|k| *k as f64).collect();
        assert_eq!(rows, numbers(&data["independent_rows"]));

        let kappa = DMatrix::from_fn(n, e, |i, j| {
            a.system.stiffness()[(i, j)] * w_c * w_c * l_r[i] / l[j]
        });
        let gamma = DMatrix::from_fn(n, n, |i, j| {
            a.system.damping()[(i, j)] * w_c * l_r[i] / l_r[j]
        });
        assert!(distance(&kappa, &matrix(&data["B_dim"])) < 1e-13, "{name}");
        assert!(
            distance(&gamma, &matrix(&data["Gamma_dim"])) < 1e-11,
            "{name}"
        );
        let w = &coupling.element_map;
        assert!(distance(w, &matrix(&data["W"])) < 1e-13, "{name}");
        assert!(distance(&(kappa * w), &matrix(&data["kappa_dim"])) < 1e-13);

        let elastic: Vec<f64> = numbers(&data["omega_n"]).split_off(1);
        assert_eq!(a.natural_frequencies.len(), elastic.len());
        for (mine, theirs) in a.natural_frequencies.iter().zip(elastic) {
            assert_relative_eq!(mine * w_c, theirs, max_relative = 1e-11);
        }
        assert!(a.warnings.is_empty(), "{name}: {:?}", a.warnings);
    }
}

#[test]
fn trees_have_exactly_the_identity_and_loops_exact_unit_rows() {
    let data = trains();
    let chain = assembled(&reference_train(&data["chain5_si"]));
    assert!(chain.system.is_tree());
    let looped = assembled(&reference_train(&data["loop4_si"]));
    let w = looped.coupling.unwrap().element_map;
    assert_eq!(w.rows(0, 3).clone_owned(), DMatrix::identity(3, 3));
    assert_relative_eq!(w[(3, 0)], -5.0 / 12.0, max_relative = 1e-14);
    assert_eq!(w[(3, 2)], 1.0);
    assert_eq!(looped.coordinates, ["c0", "c1", "c2"]);
}

/// Absolute accelerations at phase 0 of periodic solutions: eq. (6a) with modal damping, a tree and a loop.
#[test]
fn body_accelerations_are_those_of_the_reference() {
    for (name, data) in trains().as_object().unwrap() {
        let a = assembled(&reference_train(data));
        let coupling = a.coupling.as_ref().unwrap();
        for solution in data["solutions"].as_array().unwrap() {
            let scale = |key: &str, by: f64| -> Vec<f64> {
                let list = numbers(&solution[key])
                    .into_iter()
                    .zip(&coupling.coordinates);
                list.map(|(x, k)| x / a.scales.displacement[*k] / by)
                    .collect()
            };
            let mut state = scale("r0", 1.0);
            state.extend(scale("rdot0", a.scales.frequency));
            let mut system = a.system.clone();
            let omega = solution["omega"].as_f64().unwrap();
            system.set_excitation_frequency(omega / a.scales.frequency);
            let mut scratch = system.scratch();
            let found = a
                .body_accelerations(&system, 0.0, &state, &mut scratch)
                .unwrap();
            let wanted = numbers(&solution["theta_dd_t0"]);
            let size = wanted.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (x, y) in found.iter().zip(&wanted) {
                // The reference states are good to about 1e-13 of a gap, that is 1e-9 of these forces.
                assert!((x - y).abs() < 1e-8 * size, "{name}: {x} against {y}");
            }
        }
    }
}

/// Reverse-idler train of the paper, K = 2.4e8 N/m, R = 50 mm, I = 1e-3 kg m^2, l = 50 um.
fn paper(idler: f64, side_torque: f64) -> Assembly {
    let gears = |i, j, b| connection(&[(i, 0.05), (j, 0.05)], 2.4e8, backlash(b));
    let connections = vec![gears(0, 1, 50e-6), gears(1, 2, 5e-6)];
    let mut train = train(&[1e-3, idler, 1e-3], connections);
    train.damping.modal = Some(ModalDamping::Uniform(0.03));
    train.scaling.length = Some(50e-6);
    load(&mut train, 0, side_torque, 150.0, 0.0);
    load(&mut train, 1, 2.0 * side_torque, 0.0, 0.0);
    load(&mut train, 2, side_torque, 0.0, 0.0);
    assembled(&train)
}

#[test]
fn case_1_of_the_paper() {
    let a = paper(1e-3, 100.0);
    let data = reference(include_str!("../data/linear_cases.json"));
    let case = &data["case1"];
    // (5a) with three equal inertias.
    let kappa = a.system.stiffness();
    assert!(distance(kappa, &dmatrix![2.0, 1.0; 1.0, 2.0]) < 1e-14);
    assert!(distance(kappa, &matrix(&case["kappa"])) < 1e-14);
    assert!(distance(a.system.damping(), &matrix(&case["Gamma_zeta"])) < 1e-13);
    for (x, y) in a.natural_frequencies.iter().zip(numbers(&case["omega"])) {
        assert_relative_eq!(*x, y, max_relative = 1e-14);
    }
    assert_relative_eq!(
        a.system.mean_load(),
        dvector![0.5, 0.5],
        max_relative = 1e-14
    );
    assert_relative_eq!(alternating(&a), dvector![0.25, 0.0], max_relative = 1e-14);
    assert_eq!(a.system.mounts()[1].element.breakpoints().len(), 2);
    assert_relative_eq!(a.system.mounts()[1].element.breakpoints()[1], 0.1);
    let rigid = a.coupling.unwrap().rigid_body;
    assert_relative_eq!(rigid, dmatrix![1.0; -1.0; 1.0], epsilon = 1e-15);
}

/// Q at phase 0 without the mean.
fn alternating(a: &Assembly) -> nalgebra::DVector<f64> {
    let mut sum = -a.system.mean_load();
    for load in a.system.loads() {
        sum += &load.direction * load.series.value(0.0);
    }
    sum
}

#[test]
fn case_2_of_the_paper() {
    let x = (1.36_f64.powi(2) - 1.0) / 2.0;
    // Static force 0.5 / (1 + 2 x) = 0.270 each (THEORY section 8): torque 600 N m times that.
    let a = paper(1e-3 / x, 600.0 * 0.5 / (1.0 + 2.0 * x));
    let kappa = dmatrix![1.0 + x, x; x, 1.0 + x];
    assert!(distance(a.system.stiffness(), &kappa) < 1e-14);
    assert_relative_eq!(a.natural_frequencies[1], 1.36, max_relative = 1e-14);
    assert_relative_eq!(
        a.system.mean_load(),
        dvector![0.5, 0.5],
        max_relative = 1e-14
    );
    assert_relative_eq!(alternating(&a), dvector![0.25, 0.0], max_relative = 1e-14);
    assert!(a.warnings.is_empty(), "{:?}", a.warnings);
}

#[test]
fn reduced_form_of_a_train_has_the_same_damping_and_frequencies() {
    for (name, data) in trains().as_object().unwrap() {
        let a = assembled(&reference_train(data));
        let bare = |mount: &gearlash::system::Mount| ReducedElement {
            element: mount.element.clone(),
            stiffness_variation: None,
            transmission_error: None,
        };
        let laws = a.connections.iter().cloned();
        let reduced = Reduced {
            stiffness: a.system.stiffness().clone(),
            element_map: a.system.element_map().clone(),
            damping: ReducedDamping::ModalRatio(0.04),
            elements: laws.zip(a.system.mounts().iter().map(bare)).collect(),
            loads: Vec::new(),
            revolutions: 1,
        };
        let r = assemble(&model(Structure::Reduced(reduced))).unwrap();
        assert!(
            distance(r.system.damping(), a.system.damping()) < 1e-12,
            "{name}"
        );
        assert_relative_eq!(
            r.natural_frequencies,
            a.natural_frequencies,
            max_relative = 1e-12
        );
        assert_eq!(r.coordinates, a.coordinates);
    }
}
