//! Static equilibrium and the first solution of a branch.

use crate::common::{backlash, load};
use gearlash::element::{Backlash, ImpactDampingLaw, Linear};
use gearlash::numeric::periodic::Periodic;
use gearlash::solve::equilibrium::equilibrium;
use gearlash::solve::galerkin::GalerkinOptions;
use gearlash::solve::newton::NewtonOptions;
use gearlash::solve::start::{self, Start, StartMode};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};

fn two_meshes(mean: [f64; 2], gaps: [f64; 2]) -> System {
    let kappa = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
    let loads = (0..2).map(|i| load(2, i, mean[i], 0.2)).collect();
    let mounts = gaps.map(backlash).to_vec();
    System::new(
        DMatrix::identity(2, 2) * 0.1,
        kappa,
        DMatrix::identity(2, 2),
        mounts,
        loads,
    )
    .unwrap()
}

#[test]
fn loaded_meshes_rest_on_their_flanks() {
    // f = kappa^-1 Q = (1/6, 1/6): q = b + f.
    let rest = equilibrium(&two_meshes([0.5, 0.5], [1.0, 0.1])).unwrap();
    assert!(
        (rest.q[0] - (1.0 + 1.0 / 6.0)).abs() < 1e-12
            && (rest.q[1] - (0.1 + 1.0 / 6.0)).abs() < 1e-12
    );
    assert_eq!((rest.flank, rest.is_unique), (vec![1, 1], true));
    // Driving and coast side: f = (-1/3, 2/3).
    let rest = equilibrium(&two_meshes([0.0, 1.0], [1.0, 0.1])).unwrap();
    assert!(
        (rest.q[0] - (-1.0 - 1.0 / 3.0)).abs() < 1e-12
            && (rest.q[1] - (0.1 + 2.0 / 3.0)).abs() < 1e-12
    );
    assert_eq!((rest.flank, rest.is_unique), (vec![-1, 1], true));
}

#[test]
fn an_unloaded_mesh_rests_in_the_middle_of_its_gap() {
    // Q = kappa (0, 0.3): the first mesh carries nothing.
    let rest = equilibrium(&two_meshes([0.3, 0.6], [1.0, 0.1])).unwrap();
    assert!(rest.q[0].abs() < 1e-6, "{}", rest.q[0]);
    assert!((rest.q[1] - 0.4).abs() < 1e-9);
    assert_eq!((rest.flank, rest.is_unique), (vec![0, 1], false));
}

#[test]
fn sizes_do_not_matter() {
    // The same train in other units of displacement.
    for l in [1e-6, 1.0, 1e5] {
        let rest = equilibrium(&two_meshes([0.5 * l, 0.5 * l], [l, 0.1 * l])).unwrap();
        assert!((rest.q[0] / l - (1.0 + 1.0 / 6.0)).abs() < 1e-10);
        assert!(rest.is_unique);
    }
}

#[test]
fn loops_share_the_load() {
    // Two springs on one coordinate, one behind a gap: x + (x - 0.5) = 2, x = 1.25.
    let kappa = DMatrix::from_row_slice(1, 2, &[1.0, 1.0]);
    let w = DMatrix::from_row_slice(2, 1, &[1.0, 1.0]);
    let mounts = vec![Mount::new(Box::new(Linear {})), backlash(0.5)];
    let one = DMatrix::from_element(1, 1, 0.1);
    let system = System::new(one, kappa, w, mounts, vec![load(1, 0, 2.0, 0.0)]).unwrap();
    let rest = equilibrium(&system).unwrap();
    assert!((rest.q[0] - 1.25).abs() < 1e-12);
    // The mean transmission error shifts the contact: x + (x + 0.2 - 0.5) = 2.
    let mut mounts = system.mounts().to_vec();
    mounts[1].transmission_error = Some(Periodic::Fourier {
        mean: -0.2,
        harmonics: vec![],
    });
    let (gamma, kappa) = (system.damping().clone(), system.stiffness().clone());
    let shifted = System::new(
        gamma,
        kappa,
        system.element_map().clone(),
        mounts,
        vec![load(1, 0, 2.0, 0.0)],
    )
    .unwrap();
    assert!((equilibrium(&shifted).unwrap().q[0] - 1.15).abs() < 1e-12);
}

fn size(harmonics: usize) -> GalerkinOptions {
    GalerkinOptions {
        harmonics,
        samples: 1024,
    }
}

#[test]
fn every_mode_of_starting_finds_the_same_light_response() {
    let system = two_meshes([0.5, 0.5], [1.0, 0.1]);
    let modes = [StartMode::Auto, StartMode::FullContact, StartMode::Rest];
    let found = modes.map(|mode| {
        match start::find(&system, 2.4, size(12), mode, NewtonOptions::default()).unwrap() {
            Start::Found { u, .. } => u,
            Start::Failed(reasons) => panic!("{mode:?}: {reasons:?}"),
        }
    });
    assert!((&found[0] - &found[1]).amax() < 1e-8 && (&found[0] - &found[2]).amax() < 1e-8);
}

#[test]
fn a_start_in_the_middle_of_the_resonances_is_found() {
    // Far from any linear response; the last two leave a mesh without load.
    for (mean, frequency) in [([0.5, 0.5], 0.7), ([0.5, 0.5], 1.3), ([0.3, 0.6], 0.9)] {
        let system = two_meshes(mean, [1.0, 0.1]);
        let found = start::find(
            &system,
            frequency,
            size(12),
            StartMode::Auto,
            NewtonOptions::default(),
        )
        .unwrap();
        assert!(
            matches!(found, Start::Found { .. }),
            "{mean:?} at {frequency}: {found:?}"
        );
    }
}

#[test]
fn a_mesh_that_never_touches_has_no_definite_mean() {
    // Without load and with a motion smaller than the gap any position in the gap is a solution: this is said.
    let system = two_meshes([0.0, 0.0], [5.0, 5.0]);
    let found = start::find(
        &system,
        0.8,
        size(12),
        StartMode::Auto,
        NewtonOptions::default(),
    )
    .unwrap();
    match found {
        Start::Found { u, .. } => assert!(u[0].abs() < 5.0),
        Start::Failed(reasons) => assert!(reasons[0].contains("singular"), "{reasons:?}"),
    }
}

#[test]
fn a_load_beyond_the_harmonics_is_refused() {
    let series = Periodic::Fourier {
        mean: 0.0,
        harmonics: vec![gearlash::numeric::periodic::Harmonic {
            order: 5,
            cos: 1.0,
            sin: 0.0,
        }],
    };
    let loads = vec![LoadSource {
        direction: DVector::from_element(1, 1.0),
        series,
        kind: LoadKind::Value,
    }];
    let one = DMatrix::from_element(1, 1, 1.0);
    let law = Backlash {
        half_gap: 1.0,
        impact_damping: 0.0,
        impact_damping_law: ImpactDampingLaw::Dissipative,
        contact_damping: 0.0,
    };
    let system = System::new(
        one.clone(),
        one.clone(),
        one,
        vec![Mount::new(Box::new(law))],
        loads,
    )
    .unwrap();
    let error = start::find(
        &system,
        1.0,
        size(3),
        StartMode::Auto,
        NewtonOptions::default(),
    )
    .unwrap_err()
    .to_string();
    assert!(
        error.contains("at least 5, the highest order of the excitation"),
        "{error}"
    );
}

/// Sun, three equal planets, ring: six meshes on four coordinates, from zero all open.
#[test]
fn a_planetary_set_rests_on_all_its_flanks() {
    let text = "\
bodies: {sun: {inertia: 4e-4}, p1: {inertia: 3.5e-4}, p2: {inertia: 3.5e-4}, p3: {inertia: 3.5e-4}, ring: {inertia: 2.5e-2}}
x-mesh: &mesh {stiffness: 6.9e8, element: {type: backlash, half_gap: 60 um}}
connections:
  s1: {gear: {sun: 0.035, p1: 0.028}, <<: *mesh}
  s2: {gear: {sun: 0.035, p2: 0.028}, <<: *mesh}
  s3: {gear: {sun: 0.035, p3: 0.028}, <<: *mesh}
  r1: {internal_gear: {p1: 0.028, ring: 0.091}, <<: *mesh}
  r2: {internal_gear: {p2: 0.028, ring: 0.091}, <<: *mesh}
  r3: {internal_gear: {p3: 0.028, ring: 0.091}, <<: *mesh}
loads: {sun: {mean: 150}, ring: {mean: 390}}
scaling: {length: 1e-5}
";
    let model = gearlash::model::read(&gearlash::yaml::parse(text, "m.yaml").unwrap()).unwrap();
    let system = gearlash::assembly::assemble(&model).unwrap().system;
    let rest = equilibrium(&system).unwrap();
    assert_eq!(rest.flank, [1, 1, 1, -1, -1, -1]);
    assert!(rest.is_unique);
    // A third of the torque on each planet: 150/(3 x 0.035) N, on both its meshes.
    let wanted = 6.0 + 150.0 / (3.0 * 0.035) / 6.9e8 / 1e-5;
    for deformation in rest.deformation {
        assert!((deformation.abs() - wanted).abs() < 1e-9, "{deformation}");
    }
}
