//! Model files that are right: units, geometry, laws, series, defaults.

use approx::assert_relative_eq;
use gearlash::assembly::assemble;
use gearlash::model::*;
use gearlash::numeric::periodic::Periodic;
use gearlash::yaml;
use std::f64::consts::PI;

fn model(text: &str) -> Model {
    let root = yaml::parse(text, "model.yaml").unwrap();
    read(&root).unwrap_or_else(|list| {
        let lines: Vec<String> = list.iter().map(ToString::to_string).collect();
        panic!("{}", lines.join("\n"))
    })
}

fn train(text: &str) -> Train {
    match model(text).structure {
        Structure::Train(train) => train,
        Structure::Reduced(_) => panic!("a train"),
    }
}

const IDLER: &str = "
schema: 1
name: reverse-idler gear pair
bodies:
  A: {inertia: 1.0e-3}
  B: {inertia: 1.0e-3 kg m^2}
  C: {inertia: 1.0e-3}
connections:
  mesh_1:
    gear: {A: 50 mm, B: 50 mm}
    stiffness: 2.4e8 N/m
    element: {type: backlash, half_gap: 50 um, impact_damping: 0}
  mesh_2:
    gear: {B: 50 mm, C: 50 mm}
    stiffness: 2.4e8
    element: {type: backlash, half_gap: 5 um}
damping: {modal_ratio: 0.05}
loads:
  A: {mean: 100 N m, harmonics: [{order: 1, amplitude: 150 N m, phase: 0 deg}]}
  B: {mean: 200}
  C: {mean: 100}
scaling: {frequency: first_mode, length: 50 um}
report: {units: nondimensional}
analyses:
  fig_11: {type: frequency_response, from: 2.5, to: 0.3, title: Figure 11}
";

#[test]
fn the_manuals_example_is_case_1_of_the_paper() {
    let model = model(IDLER);
    assert_eq!(model.name, "reverse-idler gear pair");
    let a = assemble(&model).unwrap();
    let q = a.system.mean_load();
    for (x, y) in q.iter().zip([0.5, 0.5]) {
        assert_relative_eq!(*x, y, max_relative = 1e-14);
    }
    assert_relative_eq!(a.system.stiffness()[(0, 1)], 1.0, max_relative = 1e-14);
    assert_relative_eq!(
        a.natural_frequencies[1],
        3.0_f64.sqrt(),
        max_relative = 1e-14
    );
    assert_eq!(a.coordinates, ["mesh_1", "mesh_2"]);
    // 2 zeta kappa^(1/2): zeta (sqrt 3 + 1) on the diagonal.
    let diagonal = 0.05 * (3.0_f64.sqrt() + 1.0);
    assert_relative_eq!(a.system.damping()[(0, 0)], diagonal, max_relative = 1e-13);
}

#[test]
fn every_geometry_has_its_arms_and_unit() {
    let t = train(
        "
bodies: {A: {inertia: 1}, B: {inertia: 2000 g mm^2}, m: {inertia: 3 kg}, n: {inertia: 500 g}}
connections:
  external: {gear: {B: 2 in, A: 50 mm}, stiffness: 1 N/um}
  internal: {internal_gear: {A: 0.1, B: 0.05}, stiffness: 1e8}
  shaft: {shaft: [A, B], stiffness: 1e4 N m/rad, damping: 0.5 N m s/rad, length: 1 deg}
  rod: {shaft: [m, n], stiffness: 1e4 N/m, damping: 3 N s/m}
  bearing: {ground: A, stiffness: 1e4}
  mount: {ground: m, stiffness: 1e4 N/mm, length: 10 um}
  rack: {acts_on: {A: 50 mm, m: -1}, stiffness: 1e8 N/m}
  twist: {acts_on: {A: 1, B: -2}, stiffness: 100 N m/rad}
",
    );
    assert_relative_eq!(t.bodies["B"].inertia, 2e-6, max_relative = 1e-15);
    assert_eq!(t.bodies["m"].motion, Motion::Translation);
    assert_eq!(t.bodies["n"].inertia, 0.5);
    let arms = |name: &str| t.connections[name].arms.clone();
    assert_eq!(arms("external"), [(1, 0.0508), (0, 0.05)]);
    assert_eq!(arms("internal"), [(0, 0.1), (1, -0.05)]);
    assert_eq!(arms("shaft"), [(0, 1.0), (1, -1.0)]);
    assert_eq!(arms("bearing"), [(0, 1.0)]);
    assert_eq!(arms("rack"), [(0, 0.05), (2, -1.0)]);
    assert_eq!(arms("twist"), [(0, 1.0), (1, -2.0)]);
    let radian: Vec<&str> = (t.connections.iter())
        .filter(|(_, c)| c.unit == DeformationUnit::Radian)
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(radian, ["shaft", "bearing", "twist"]);
    assert_relative_eq!(t.connections["external"].stiffness, 1e6);
    assert_relative_eq!(t.connections["shaft"].length.unwrap(), PI / 180.0);
    assert_relative_eq!(t.connections["mount"].stiffness, 1e7);
    assert_eq!(t.connections["rod"].damping, 3.0);
    assert_eq!(t.scaling.frequency, FrequencyScale::FirstMode);
}

#[test]
fn parameters_of_laws_are_read_in_the_unit_of_their_connection() {
    let t = train(
        "
bodies: {A: {inertia: 1}, B: {inertia: 1}}
connections:
  mesh: {gear: {A: 1, B: 1}, stiffness: 1, element: {type: backlash, gap: 80 um, impact_damping: 2 s/m}}
  clutch: {shaft: [A, B], stiffness: 1, element: {slopes: [1, '0', 0.5], breakpoints: [-2 deg, 0.1], type: piecewise_linear}}
  stop: {shaft: [A, B], stiffness: 1, element: {type: one_sided, gap: 3 deg, side: negative}}
",
    );
    let breakpoints = |name: &str| t.connections[name].element.breakpoints();
    assert_relative_eq!(breakpoints("mesh")[1], 40e-6, max_relative = 1e-15);
    assert_relative_eq!(breakpoints("clutch")[0], -PI / 90.0, max_relative = 1e-15);
    assert_eq!(breakpoints("clutch")[1], 0.1);
    let stop = &t.connections["stop"].element;
    assert_relative_eq!(stop.eval(-1.0, 0.0, 0.0).f, PI / 60.0 - 1.0);
}

#[test]
fn series_are_amplitude_times_cosine_of_order_phase_plus_phase() {
    let t = train(
        "
bodies: {A: {inertia: 1}, B: {inertia: 1}}
connections:
  mesh:
    gear: {A: 1, B: 1}
    stiffness: 1
    base_order: 23
    transmission_error: {harmonics: [{order: 2, amplitude: 3 um, phase: 30 deg}]}
    stiffness_variation: {harmonics: [{order: 1, amplitude: 0.2}]}
  other:
    shaft: [A, B]
    stiffness: 1
    stiffness_variation: {rectangular: {high: 1.2, low: 0.8, duty: 0.5, phase: 90 deg}}
    transmission_error: {table: [0, 1 deg, 0 deg]}
loads:
  A: {mean: 1, harmonics: [{order: 1, amplitude: 2, phase: 60 deg}, {order: 3, amplitude: -1}]}
",
    );
    let value = |series: &Periodic, phase: f64| series.value(phase);
    let load = &t.loads["A"].series;
    let error = t.connections["mesh"].transmission_error.as_ref().unwrap();
    let s = t.connections["mesh"].stiffness_variation.as_ref().unwrap();
    for phase in [0.0, 0.3, 2.0] {
        let wanted = 1.0 + 2.0 * (phase + PI / 3.0).cos() - (3.0 * phase).cos();
        assert_relative_eq!(value(load, phase), wanted, max_relative = 1e-14);
        let wanted = 3e-6 * (46.0 * phase + PI / 6.0).cos();
        assert_relative_eq!(value(error, phase), wanted, max_relative = 1e-13);
        assert_relative_eq!(value(s, phase), 1.0 + 0.2 * (23.0 * phase).cos());
    }
    let s = t.connections["other"].stiffness_variation.as_ref().unwrap();
    assert_eq!(value(s, 0.0), 0.8);
    assert_eq!(value(s, 2.0), 1.2);
    let e = t.connections["other"].transmission_error.as_ref().unwrap();
    assert_relative_eq!(value(e, 2.0 * PI / 3.0), PI / 180.0, max_relative = 1e-14);
}

#[test]
fn damping_scaling_names_and_the_keys_of_others() {
    let m = model(
        "
x-gear: &gear {inertia: 0.01}
x-anything: [1, 2]
bodies: {y: *gear, no: *gear, N: {<<: *gear}}
connections:
  on: {shaft: [y, no], stiffness: 10}
  off: {shaft: [no, N], stiffness: 10}
damping: {modal_ratios: [0.01, 0.02], stiffness_proportional: 3 us}
scaling: {frequency: 10 Hz}
report: {units: si}
",
    );
    assert_eq!(m.report_units, ReportUnits::Si);
    let Structure::Train(t) = &m.structure else {
        panic!("a train")
    };
    assert_eq!(t.bodies.keys().collect::<Vec<_>>(), ["y", "no", "N"]);
    let per_mode = ModalDamping::PerMode(vec![0.01, 0.02]);
    assert_eq!(t.damping.modal, Some(per_mode));
    assert_relative_eq!(t.damping.stiffness_proportional, 3e-6);
    let FrequencyScale::Value(value) = t.scaling.frequency else {
        panic!("a value")
    };
    assert_relative_eq!(value, 20.0 * PI, max_relative = 1e-15);
    assert_eq!(assemble(&m).unwrap().scales.frequency, value);
}

#[test]
fn a_length_in_metres_for_a_shaft_is_said() {
    let m = model(
        "
bodies: {A: {inertia: 1}, B: {inertia: 1}, C: {inertia: 1}}
connections: {mesh: {gear: {A: 1, B: 1}, stiffness: 1}, axle: {shaft: [B, C], stiffness: 1}}
scaling: {length: 50 um}
",
    );
    assert!(m.warnings[0].contains("also scales axle, whose deformation is in rad"));
    assert_eq!(assemble(&m).unwrap().warnings, m.warnings);
}

#[test]
fn reduced_systems_are_read() {
    let m = model(
        "
reduced:
  stiffness: [[2, 1, 0.5], [1, 2, 0]]
  element_map: [[1, 0], [0, 1], [0.5, -0.5]]
  damping: {matrix: [[0.1, 0], [0, 0.2]]}
  elements:
    mesh_1: {type: backlash, half_gap: 1.0, stiffness_variation: {table: [0.9, 1.1]}}
    mesh_2: {type: linear}
    mesh_3: {type: cubic, cubic: 0.1, transmission_error: {harmonics: [{order: 1, amplitude: 0.1, phase: 90 deg}]}}
  loads: {mean: [0.5, 0.25], harmonics: [{order: 1, cos: [0.25, 0], sin: [0, 0.1]}]}
",
    );
    let a = assemble(&m).unwrap();
    assert_eq!(a.coordinates, ["mesh_1", "mesh_2"]);
    assert_eq!(a.system.element_count(), 3);
    assert_eq!(a.system.mean_load().as_slice(), [0.5, 0.25]);
    assert_eq!(a.system.damping()[(1, 1)], 0.2);
    let error = a.system.mounts()[2].transmission_error.as_ref().unwrap();
    assert_relative_eq!(error.value(1.0), -0.1 * 1.0_f64.sin(), max_relative = 1e-14);
    let default = model("reduced: {stiffness: [[1]], elements: {m: {type: linear}}}");
    let a = assemble(&default).unwrap();
    assert_eq!(a.system.damping()[(0, 0)], 0.0);
    assert!(a.system.is_tree());
}
