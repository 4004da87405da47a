//! Loops, rigid-body modes, scales, warnings and refusals of the assembly.

use crate::assembly_support::*;
use approx::assert_relative_eq;
use gearlash::assembly::{assemble, refuse_damped_rigid_body, summary};
use gearlash::element::Linear;
use gearlash::model::*;
use gearlash::numeric::periodic::Periodic;
use gearlash::system::LoadKind;
use indexmap::IndexMap;
use nalgebra::DMatrix;

fn ring(last: f64) -> Train {
    let gear = |i, a, j, b| spring(&[(i, a), (j, b)], 1e8);
    let list = vec![
        gear(0, 0.03, 1, 0.06),
        gear(1, 0.025, 2, 0.05),
        gear(2, 0.04, 3, 0.02),
        gear(3, 0.03, 0, last),
    ];
    train(&[1e-3, 2e-3, 3e-3, 1e-3], list)
}

/// Arm that closes the ring: theta = (1, -1/2, 1/4, -1/2), so 0.03 (-1/2) + last = 0.
const CLOSED: f64 = 0.015;

#[test]
fn a_loop_that_closes_is_dependent_and_one_that_nearly_closes_is_refused() {
    assert_eq!(assembled(&ring(CLOSED)).system.dof(), 3);
    for relative in [1e-8, 1e-6, 1e-4, 1e-3] {
        let text = refusal(&ring(CLOSED * (1.0 + relative)));
        assert!(
            text.starts_with("connections.c3: nearly closes a loop with c0, c1, c2"),
            "{text}"
        );
        assert!(text.contains("exactly"), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
    // A train that does not close by far is locked, on purpose: four coordinates.
    let locked = assembled(&ring(0.02));
    assert_eq!(locked.system.dof(), 4);
    assert_eq!(locked.coupling.unwrap().rigid_body.ncols(), 0);
}

/// Judged on inertias alone, a light idler between heavy wheels looks like a loop that nearly closes.
#[test]
fn a_light_idler_between_heavy_wheels_is_a_tree() {
    let list = vec![
        spring(&[(0, 0.05), (1, 0.05)], 1e8),
        spring(&[(1, 0.05), (2, 0.05)], 1e8),
    ];
    let a = assembled(&train(&[1e3, 1e-5, 1e4], list));
    assert!(a.system.is_tree());
    assert_eq!(a.natural_frequencies.len(), 2);
}

/// Two reductions 1 : 4096 written from their ends, joined last: the slow ends hardly move, and still no loop.
#[test]
fn a_tree_written_from_its_ends_is_never_a_loop() {
    let mut list = Vec::new();
    for side in [0, 13] {
        for k in 0..12 {
            list.push(spring(&[(side + k, 0.02), (side + k + 1, 0.04)], 1e8));
        }
    }
    list.push(spring(&[(12, 0.02), (25, 0.02)], 1e8));
    let a = assembled(&train(&[1e-3; 26], list));
    assert!(a.system.is_tree());
    assert_eq!(a.coupling.unwrap().rigid_body.ncols(), 1);
}

#[test]
fn several_trains_have_several_rigid_body_motions() {
    let list = vec![
        spring(&[(0, 0.05), (1, 0.1)], 1e8),
        spring(&[(2, 1.0), (3, -1.0)], 1e4),
        spring(&[(4, 1.0)], 1e4),
    ];
    let mut t = train(&[1e-3; 5], list);
    t.damping.modal = Some(ModalDamping::Uniform(0.05));
    load(&mut t, 0, 10.0, 0.0, 0.0);
    load(&mut t, 1, 20.0, 0.0, 0.0);
    let a = assembled(&t);
    let wanted = dmatrix![1.0, 0.0; -0.5, 0.0; 0.0, 1.0; 0.0, 1.0; 0.0, 0.0];
    assert_relative_eq!(a.coupling.unwrap().rigid_body, wanted, epsilon = 1e-14);
    assert_eq!(a.system.dof(), 3);
    assert!(a.warnings.is_empty(), "{:?}", a.warnings);
}

#[test]
fn unbalanced_mean_loads_are_reported_with_the_acceleration() {
    let mut t = train(&[1e-3, 3e-3], vec![spring(&[(0, 1.0), (1, -1.0)], 1e4)]);
    load(&mut t, 0, 10.0, 0.0, 0.0);
    load(&mut t, 1, -6.0, 0.0, 0.0);
    let warnings = assembled(&t).warnings;
    // 4 N m on 4e-3 kg m^2.
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("B0 1.0000e3, B1 1.0000e3"),
        "{}",
        warnings[0]
    );
}

#[test]
fn damped_rigid_body_motion_is_refused_by_name() {
    let bodies = ["motor", "wheel", "mass"].map(String::from);
    let motion = dmatrix![1.0; 1.0; 0.0];
    let damper = dmatrix![0.2, 0.0, 0.0; 0.0, 0.0, 0.0; 0.0, 0.0, 0.5];
    let list = refuse_damped_rigid_body(&damper, &dvector![1.0, 2.0, 1.0], &motion, &bodies);
    let text = list.unwrap_err()[0].to_string();
    assert!(text.contains("rigid-body motion of motor:"), "{text}");
    assert!(text.contains("mean drag torque"), "{text}");
    let between = dmatrix![0.2, -0.2, 0.0; -0.2, 0.2, 0.0; 0.0, 0.0, 0.5];
    assert!(refuse_damped_rigid_body(&between, &dvector![1.0, 2.0, 1.0], &motion, &bodies).is_ok());
}

#[test]
fn scales_are_own_length_then_common_then_first_breakpoint_then_one() {
    let list = vec![
        connection(&[(0, 0.05), (1, 0.05)], 1e8, backlash(4e-5)),
        spring(&[(1, 0.05), (2, 0.05)], 1e8),
        spring(&[(2, 0.05), (3, 0.05)], 1e8),
    ];
    let mut t = train(&[1e-3; 4], list);
    t.connections[2].length = Some(7e-5);
    t.scaling.frequency = FrequencyScale::Value(123.0);
    let a = assembled(&t);
    assert_eq!(a.scales.displacement, [4e-5, 1.0, 7e-5]);
    assert_eq!(a.scales.frequency, 123.0);
    assert_relative_eq!(
        a.system.mounts()[0].element.breakpoints()[1],
        1.0,
        max_relative = 1e-15
    );
    t.scaling.length = Some(1e-5);
    t.scaling.frequency = FrequencyScale::FirstConnection;
    let a = assembled(&t);
    assert_eq!(a.scales.displacement, [1e-5, 1e-5, 7e-5]);
    // K (R^2/I + R^2/I)
    assert_relative_eq!(
        a.scales.frequency,
        (1e8 * 2.0 * 2.5_f64).sqrt(),
        max_relative = 1e-15
    );
}

#[test]
fn stiffness_proportional_damping_keeps_the_pattern_and_dashpots_feel_the_transmission_error() {
    let gear = |i| spring(&[(i, 0.03), (i + 1, 0.05)], 1e8);
    let mut t = train(&[1e-3; 41], (0..40).map(gear).collect());
    t.damping.stiffness_proportional = 1e-6;
    t.connections[3].damping = 50.0;
    let values = vec![0.0, 1e-5, 2e-5, 1e-5];
    let table = Periodic::Table {
        values,
        base_order: 3,
    };
    t.connections[3].transmission_error = Some(table);
    let a = assembled(&t);
    let gam = a.system.damping();
    for i in 0..40 {
        for j in 0..40 {
            assert_eq!(gam[(i, j)] == 0.0, i.abs_diff(j) > 1, "entry {i}, {j}");
        }
    }
    let rates = a.system.loads().iter().filter(|l| l.kind == LoadKind::Rate);
    assert_eq!(rates.count(), 1);
    assert!(a.warnings.is_empty());
    t.damping.modal = Some(ModalDamping::Uniform(0.02));
    assert!(assembled(&t).warnings[0].contains("Gam is a full matrix"));
    t.damping.modal = Some(ModalDamping::PerMode(vec![0.02; 3]));
    assert!(refusal(&t).contains("damping.modal_ratios: found 3 ratios, wanted 40"));
}

#[test]
fn models_built_by_hand_are_checked() {
    assert!(refusal(&train(&[1.0], Vec::new())).contains("nothing can deform"));
    let t = train(&[-1.0, f64::NAN], vec![spring(&[(0, 0.0), (7, 1.0)], 0.0)]);
    let text = refusal(&t);
    for part in [
        "bodies.B0.inertia: found -1",
        "bodies.B1.inertia: found NaN",
        "connections.c0.stiffness: found 0",
        "connections.c0: lever arms",
    ] {
        assert!(text.contains(part), "{text}");
    }
    let t = train(&[1e-300, 1.0], vec![spring(&[(0, 1e200), (1, 1.0)], 1e300)]);
    assert!(refusal(&t).contains("range of a 64-bit number"));
}

fn reduced(stiffness: DMatrix<f64>, element_map: DMatrix<f64>, damping: ReducedDamping) -> Model {
    let law = |k| {
        let element = ReducedElement {
            element: Box::new(Linear {}),
            stiffness_variation: None,
            transmission_error: None,
        };
        (format!("m{k}"), element)
    };
    let e = stiffness.ncols();
    let elements: IndexMap<_, _> = (0..e).map(law).collect();
    model(Structure::Reduced(Reduced {
        stiffness,
        element_map,
        damping,
        elements,
        loads: Vec::new(),
        revolutions: 1,
    }))
}

#[test]
fn reduced_systems() {
    let id = |n| DMatrix::identity(n, n);
    let zeta = ReducedDamping::ModalRatio(0.05);
    // Semidefinite: one rigid-body motion, left undamped.
    let m = reduced(dmatrix![1.0, -1.0; -1.0, 1.0], id(2), zeta.clone());
    let a = assemble(&m).unwrap();
    assert_relative_eq!(
        a.natural_frequencies,
        dvector![2.0_f64.sqrt()],
        max_relative = 1e-14
    );
    assert!((a.system.damping() * dvector![1.0, 1.0]).amax() < 1e-15);
    assert_eq!(summary(&m, &a)["rigid_body_modes"], 1);
    let bad = assemble(&reduced(dmatrix![1.0, 2.0; -2.0, 1.0], id(2), zeta.clone()));
    assert!(
        bad.unwrap_err()[0]
            .to_string()
            .contains("complex eigenvalues 1.000000 +- 2.000000 i")
    );
    let bad = assemble(&reduced(dmatrix![1.0, 2.0; 2.0, 1.0], id(2), zeta));
    assert!(
        bad.unwrap_err()[0]
            .to_string()
            .contains("negative eigenvalue -1.0")
    );
    let c = ReducedDamping::StiffnessProportional(0.1);
    let a = assemble(&reduced(
        dmatrix![2.0, 1.0; 1.0, 2.0],
        dmatrix![0.0, 1.0; 0.5, 0.5],
        c,
    ))
    .unwrap();
    assert_eq!(a.coordinates, ["q1", "m0"]);
    assert_relative_eq!(a.system.damping()[(0, 1)], 0.25, max_relative = 1e-15);
}

#[test]
fn summary_lists_what_check_needs() {
    let m = model(Structure::Train(ring(CLOSED)));
    let a = assemble(&m).unwrap();
    let s = summary(&m, &a);
    assert_eq!(s["bodies"].as_array().unwrap().len(), 4);
    assert_eq!(s["connections"].as_array().unwrap().len(), 4);
    assert_eq!(
        s["relative_coordinates"],
        serde_json::json!(["c0", "c1", "c2"])
    );
    assert_eq!(s["rigid_body_modes"], 1);
    assert_eq!(matrix(&s["stiffness"]).shape(), (3, 4));
    assert_eq!(matrix(&s["element_map"]).shape(), (4, 3));
    let w = numbers(&s["natural_frequencies_rad_s"]);
    assert_relative_eq!(w[0], s["omega_c"].as_f64().unwrap(), max_relative = 1e-15);
    assert!(s["static_displacement"].is_null());
}

#[test]
fn long_trains_are_assembled_in_reasonable_time() {
    let gear = |i| spring(&[(i, 0.05), (i + 1, 0.05)], 1e8);
    let start = std::time::Instant::now();
    let mut t = train(&[1e-3; 401], (0..400).map(gear).collect());
    t.damping.stiffness_proportional = 1e-6;
    let a = assembled(&t);
    // Free chain of equal masses: omega_k^2 = 4 K R^2/I sin^2(pi k / (2 n_b)).
    let wanted =
        |k: f64| (std::f64::consts::PI * k / 802.0).sin() * 2.0 * (2.5e5_f64 / 1e-3).sqrt();
    for k in [1, 2, 200, 400] {
        let found = a.natural_frequencies[k - 1] * a.scales.frequency;
        assert_relative_eq!(found, wanted(k as f64), max_relative = 1e-8);
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("400 meshes in {seconds:.2} s");
    assert!(seconds < 20.0, "{seconds} s");
}
