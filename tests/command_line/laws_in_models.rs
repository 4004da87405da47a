//! Laws in model files, through the real binary: formulas against the laws they spell out, what `check` and `elements` say.

use crate::program::Place;

/// A pair of gears in SI units with one law.
fn pair(element: &str, analyses: &str) -> String {
    format!(
        "schema: 1
name: pair
bodies:
  A: {{inertia: 1.0e-3}}
  B: {{inertia: 1.0e-3}}
connections:
  mesh:
    gear: {{A: 50 mm, B: 50 mm}}
    stiffness: 2.4e8
    length: 50 um
    element: {element}
damping: {{modal_ratio: 0.05}}
loads:
  A: {{mean: 100 N m, harmonics: [{{order: 1, amplitude: 180}}]}}
  B: {{mean: 100}}
analyses:
{analyses}"
    )
}

const ANALYSES: &str = "  response: {type: frequency_response, methods: [galerkin, shooting], from: 9 kHz, to: 7500 Hz, harmonics: 8}
  motion: {type: time_history, at: 6 kHz, periods: 3, transient: 2}
";

/// Largest difference of two tables in share of each column's size, text columns equal.
fn gap(a: &Place, b: &Place, file: &str) -> f64 {
    let (a, b) = (a.table(file), b.table(file));
    assert_eq!(a[0], b[0]);
    assert_eq!(a.len(), b.len(), "{file}: rows");
    let mut worst = 0.0_f64;
    // How Newton's iteration went is not a result.
    let is_result = |column: &usize| !["residual", "iterations"].contains(&a[0][*column].as_str());
    for column in (0..a[0].len()).filter(is_result) {
        let numbers = |t: &[Vec<String>]| -> Vec<Option<f64>> {
            t[1..].iter().map(|row| row[column].parse().ok()).collect()
        };
        let (x, y) = (numbers(&a), numbers(&b));
        let size = x.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        // A force that vanishes but for rounding has no size of its own.
        let size = size.max(1e-9);
        for row in 0..x.len() {
            match (x[row], y[row]) {
                (Some(p), Some(q)) => worst = worst.max((p - q).abs() / size),
                _ => assert_eq!(a[row + 1][column], b[row + 1][column]),
            }
        }
    }
    worst
}

/// Backlash, preloaded backlash and a clutch as formulas in SI units: the same responses and motions to rounding, grown by the
/// continuation (Newton's iteration stops at 1e-12 of the terms) and by the motion.
#[test]
fn formulas_give_the_results_of_the_laws_they_spell_out() {
    for (builtin, typed) in [
        (
            "{type: backlash, half_gap: 40 um}",
            "{type: expression, force: 'K*sign(q)*max(abs(q) - b, 0)', parameters: {K: 2.4e8 N/m, b: 40 um}}",
        ),
        (
            "{type: preloaded, half_gap: 5 um, preload: 300 N}",
            "{type: expression, force: 'if(q > b, K*(q - b) + P, if(q < -b, K*(q + b) - P, 0))', parameters: {K: 2.4e8, b: 5 um, P: 300 N}}",
        ),
        (
            "{type: piecewise_linear, breakpoints: [-20 um, 5 um, 10 um], slopes: [1, 0, 0.2, 1]}",
            "{type: expression, force: 'K*(min(q + a, 0) + 0.2*max(q - b, 0) + 0.8*max(q - c, 0))', parameters: {K: 2.4e8, a: 20 um, b: 5 um, c: 10 um}}",
        ),
    ] {
        let places = [builtin, typed].map(|element| {
            let place = Place::with(&pair(element, ANALYSES));
            place
                .run(&["run", "m.yaml", "--out", "r", "--quiet"])
                .ends_with(0);
            place
        });
        let [a, b] = &places;
        for (file, allowed) in [("r/response.csv", 1e-7), ("r/motion.csv", 1e-9)] {
            let gap = gap(a, b, file);
            println!("{builtin}: {file} {gap:e}");
            assert!(gap < allowed, "{builtin}: {file} {gap:e}");
        }
        // Impacts and contact ratios come from flanks, which formulas find themselves.
        assert_eq!(
            a.column("r/response.csv", "impacts.mesh"),
            b.column("r/response.csv", "impacts.mesh")
        );
        let integrator =
            |place: &Place| place.json("r/motion.json")["options"]["integrator"].clone();
        assert_eq!(integrator(a), integrator(b));
    }
}

#[test]
fn check_says_what_every_solver_can_do() {
    let solvers = |element: &str| {
        let place = Place::with(&pair(element, "  lines: {type: modes}\n"));
        let json = place.run(&["check", "m.yaml", "--json"]).ends_with(0).out;
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let list = json["solvers"]["mesh"].as_array().unwrap().clone();
        let reach: Vec<String> = list
            .iter()
            .map(|s| s["reach"].as_str().unwrap().to_owned())
            .collect();
        let text = place.run(&["check", "m.yaml"]).ends_with(0).out;
        let chosen = match json["integrator"].as_str().unwrap() {
            "dopri5" => "DOPRI5".to_owned(),
            flow => format!("{flow} flow"),
        };
        assert!(
            text.contains(&format!("integrator auto: {chosen}\n")),
            "{text}"
        );
        (reach.join(" "), text, json["warnings"].to_string())
    };
    let (reach, text, _) = solvers("{type: backlash, half_gap: 40 um}");
    assert_eq!(reach, "yes yes yes yes yes yes yes");
    assert!(text.contains("exact exponentials"), "{text}");
    assert!(text.contains("integrator auto: exact flow"), "{text}");
    let (reach, text, _) = solvers("{type: backlash, half_gap: 40 um, impact_damping: 0.5}");
    assert_eq!(reach, "no yes yes yes no yes yes");
    assert!(text.contains("integrator auto: series flow"), "{text}");
    assert!(text.contains("exact quadrature, no: "), "{text}");
    assert!(text.contains("exact flow, no: exact integration needs a piecewise-affine law (and impact_damping 0) (mesh)"), "{text}");
    let (reach, ..) = solvers("{type: preloaded, half_gap: 5 um, preload: 300 N}");
    // DOPRI5 does not hold a joint that rests on its jump.
    assert_eq!(reach, "yes yes limited yes yes yes yes");
    let (reach, text, warnings) = solvers("{type: expression, force: 2.4e8*q + 50*sign(v)}");
    assert_eq!(reach, "no no limited limited no no no");
    let why = "series flow, no: no series: its force may jump where no breakpoint is known (mesh)";
    assert!(
        text.contains(why) && text.contains("integrator auto: DOPRI5"),
        "{text}"
    );
    assert!(
        text.contains("shooting, no: no transition matrix"),
        "{text}"
    );
    assert!(
        warnings.contains(
            "connections.mesh.element.force: `sign` (character 14) switches on something"
        ),
        "{warnings}"
    );
}

#[test]
fn hidden_jumps_are_refused_by_shooting_and_leave_stability_open() {
    let friction = "{type: expression, force: 2.4e8*q + 20*sign(v)}";
    let shooting = "  a: {type: frequency_response, method: shooting, from: 9 kHz, to: 8900 Hz}\n";
    Place::with(&pair(friction, shooting))
        .run(&["run", "m.yaml"])
        .ends_with(2)
        .says(&["analyses.a.method", "mesh", "no breakpoint is known"]);
    let integration = "  a: {type: frequency_response, method: integration, from: 9 kHz, to: 8900 Hz, points: 2, transient: 5, periods: 5}
  b: {type: time_history, at: 9 kHz, periods: 2}
";
    let place = Place::with(&pair(friction, integration));
    place
        .run(&["run", "m.yaml", "--out", "r"])
        .says(&["switches on something"]);
    assert!(place.column("r/a.csv", "stable").iter().all(|x| x.is_nan()));
}

#[test]
fn parameters_of_formulas_can_be_set_and_swept() {
    let element = "{type: expression, force: 'K*sign(q)*max(abs(q) - b, 0)', parameters: {K: 2.4e8, b: 40 um}}";
    let sweep = "  sweep: {type: bifurcation_diagram, parameter: mesh.b, at: 6 kHz, from: 40 um, to: 20 um, points: 3, transient: 20, periods: 4, lyapunov: false}
  motion: {type: time_history, at: 6 kHz, periods: 1}
";
    let place = Place::with(&pair(element, sweep));
    let set = "connections.mesh.element.parameters.b=30 um";
    place
        .run(&["run", "m.yaml", "--out", "r", "--set", set])
        .ends_with(0);
    let builtin = Place::with(&pair(
        "{type: backlash, half_gap: 30 um}",
        &sweep.replace("mesh.b", "mesh.half_gap"),
    ));
    builtin.run(&["run", "m.yaml", "--out", "r"]).ends_with(0);
    for file in ["r/motion.csv", "r/sweep.csv"] {
        let gap = gap(&place, &builtin, file);
        assert!(gap < 1e-9, "{file} {gap:e}");
    }
}

#[test]
fn elements_lists_the_laws_with_their_parameters() {
    let place = Place::with("");
    let text = place.run(&["elements"]).ends_with(0).out;
    for part in [
        "half_gap [displacement] >= 0: half of the total backlash; exactly one of half_gap and gap",
        "preload [force] >= 0: force F0 on both flanks; required",
        "velocity [displacement/time] > 0: ",
        "parameters (map): named numbers of the formula; quantities are converted to SI units; default {}",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    let json = place.run(&["elements", "--json"]).ends_with(0).out;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let law = |tag: &str| {
        json.as_array()
            .unwrap()
            .iter()
            .find(|l| l["tag"] == tag)
            .unwrap()
            .clone()
    };
    let gap = &law("backlash")["parameters"][1];
    assert_eq!(gap["required"], false);
    assert_eq!(gap["one_of"], serde_json::json!(["half_gap", "gap"]));
    assert_eq!(gap["range"], ">= 0");
    assert_eq!(law("tanh_friction")["parameters"][1]["required"], true);
    assert_eq!(law("expression")["parameters"][1]["kind"], "map");
}

#[test]
fn the_tolerance_of_the_flow_is_a_key() {
    let law = "{type: cubic, cubic: 1e8}";
    let motion = |keys: &str| {
        let text = pair(
            law,
            &format!("  motion: {{type: time_history, at: 6 kHz, periods: 3, {keys}}}\n"),
        );
        Place::with(&text)
    };
    let last = |keys: &str| {
        let place = motion(keys);
        place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
        assert_eq!(place.json("out/motion.json")["integrator"], "series");
        *place.column("out/motion.csv", "q.mesh").last().unwrap()
    };
    let (exact, close, coarse) = (
        last("flow_tolerance: 1e-14"),
        last("transient: 0"),
        last("flow_tolerance: 1e-4"),
    );
    let error = |x: f64| (x / exact - 1.0).abs();
    assert!(error(close) < 1e-9, "{close} {exact}");
    assert!(
        error(coarse) > 1e-9 && error(coarse) < 1e-2,
        "{coarse} {exact}"
    );
    for (keys, what) in [
        ("flow_tolerance: 0.1", "0.1 must be from 1e-15 to 1e-3"),
        (
            "integrator: dopri5, flow_tolerance: 1e-9",
            "it belongs to the series flow",
        ),
    ] {
        let told = motion(keys).run(&["check", "m.yaml"]).ends_with(2).err;
        assert!(
            told.contains("flow_tolerance") && told.contains(what),
            "{told}"
        );
    }
}
