//! What the page of a run holds for its interactive plots; `tests/browser` looks at the page itself.

use crate::program::Place;
use base64::Engine as _;
use serde_json::Value;

/// Figure 11 as scaled equations, and a wheel on a spring in SI.
const REDUCED: &str = "\
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {mesh_1: {type: backlash, half_gap: 1}, mesh_2: {type: backlash, half_gap: 0.1}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0]}]}
analyses:
  r: {type: frequency_response, from: 1.9, to: 1.5, methods: [galerkin, shooting], marks: [1.8, 1.7], orbits: marks}
";
const WHEEL: &str = "\
schema: 1
bodies: {a: {inertia: 1}}
connections: {spring: {ground: a, stiffness: 100}}
damping: {modal_ratio: 0.05}
loads: {a: {harmonics: [{order: 1, amplitude: 1}]}}
report: {units: si}
analyses:
  r: {type: frequency_response, from: 2 Hz, to: 1 Hz}
  b: {type: bifurcation_diagram, parameter: frequency, from: 9 rad/s, to: 12 rad/s, points: 3, transient: 5, periods: 4}
  p: {type: parameter_response, parameter: loads.a.harmonics.0.amplitude, at: 1 Hz, from: 1, to: 2}
";

/// Data of the plot of an analysis.
fn data(page: &str, name: &str) -> Value {
    let start = format!("<script type=\"application/json\" id=\"data-{name}\">");
    let (_, rest) = page.split_once(&start).expect("the page has the plot");
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn page(model: &str) -> (Place, String) {
    let place = Place::with(model);
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let page = place.read("o/report.html");
    (place, page)
}

#[test]
fn frequencies_have_units_where_the_scales_are_known() {
    let (_place, page) = page(WHEEL);
    for (name, written) in [("r", "Hz"), ("b", "rad/s")] {
        let axis = &data(&page, name)["panels"][0]["frequency"];
        assert_eq!(axis["written"], written);
        // omega_c = sqrt(100 N m/rad / 1 kg m^2)
        assert!((axis["omega_c"].as_f64().unwrap() - 10.0).abs() < 1e-12);
    }
    let range = &data(&page, "r")["panels"][0]["x_range"];
    let ends = [0, 1].map(|k| range[k].as_f64().unwrap());
    assert!(
        (ends[0] - 1.0).abs() < 1e-12 && (ends[1] - 2.0).abs() < 1e-12,
        "{ends:?}"
    );
    assert!(data(&page, "p")["panels"][0]["frequency"].is_null());
    assert!(data(&page, "p")["orbits"].is_null());
}

#[test]
fn two_methods_are_two_curves_with_their_own_abscissae() {
    let (_place, page) = page(REDUCED);
    let data = data(&page, "r");
    assert!(data["panels"][0]["frequency"].is_null());
    let curves = data["panels"][0]["curves"].as_array().unwrap();
    for curve in &curves[..2] {
        let values = |axis: &str| &data["columns"][curve[axis].as_str().unwrap()];
        let runs = curve["runs"].as_array().unwrap();
        assert!(!runs.is_empty());
        for run in runs {
            let rows = run[1].as_u64().unwrap() as usize..run[2].as_u64().unwrap() as usize;
            assert!(rows.clone().all(|row| values("x")[row].is_number()));
            assert!({ rows }.all(|row| values("y")[row].is_number()));
        }
    }
}

#[test]
fn kept_orbits_are_those_of_the_file() {
    let (place, page) = page(REDUCED);
    let kept = &data(&page, "r")["orbits"];
    assert_eq!(kept["kept"], 4, "two marks on two branches");
    let orbits = kept["orbits"].as_array().unwrap();
    let (branch, q) = (
        place.column("o/r.orbits.csv", "branch"),
        place.column("o/r.orbits.csv", "q.mesh_2"),
    );
    let at = |name: &str| {
        let names = kept["names"].as_array().unwrap();
        names.iter().position(|n| n == name).unwrap()
    };
    for (k, orbit) in orbits.iter().enumerate() {
        assert_eq!(orbit["branch"].as_f64(), Some(branch[256 * k]));
        let omega = orbit["omega"].as_f64().unwrap();
        assert!([1.8, 1.7].contains(&omega), "{omega}");
        let text = orbit["values"][at("q.mesh_2")].as_str().unwrap();
        let bytes = base64::engine::general_purpose::STANDARD
            .decode(text)
            .unwrap();
        let values = bytes.chunks_exact(4);
        let values = values.map(|b| f32::from_le_bytes(b.try_into().unwrap()));
        let expected = &q[256 * k..256 * (k + 1)];
        assert!(values.eq(expected.iter().map(|x| *x as f32)));
    }
}
