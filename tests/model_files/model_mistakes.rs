//! Model files that are wrong: what is said, where, and how much of it at once.

use gearlash::assembly::assemble;
use gearlash::error::Diagnostic;
use gearlash::model::{locate, read};
use gearlash::yaml;

fn mistakes(text: &str) -> Vec<Diagnostic> {
    let root = yaml::parse(text, "m.yaml").unwrap();
    read(&root).map(|_| Vec::new()).unwrap_or_else(|list| list)
}

fn lines(text: &str) -> String {
    let list = mistakes(text);
    let lines: Vec<String> = list.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

/// A right train with one part replaced.
fn with(part: &str, by: &str) -> String {
    let text = "
bodies:
  A: {inertia: 1e-3}
  B: {inertia: 1e-3}
connections:
  mesh:
    gear: {A: 0.05, B: 0.04}
    stiffness: 1e8
    element: {type: backlash, half_gap: 4e-5}
loads:
  A: {mean: 1}
";
    assert!(text.contains(part), "{part}");
    text.replace(part, by)
}

fn says(text: &str, wanted: &[&str]) {
    let found = lines(text);
    for part in wanted {
        assert!(found.contains(part), "wanted {part:?} in:\n{found}");
    }
    assert_eq!(found.lines().count(), 1, "one mistake:\n{found}");
}

#[test]
fn the_right_train_is_right() {
    assert_eq!(lines(&with("1e8", "1e8")), "");
}

#[test]
fn top_level() {
    says(
        &with("loads:", "lods:"),
        &["m.yaml:10:1: lods: unknown key", "did you mean `loads`?"],
    );
    says(
        &with("bodies:", "schema: 2\nbodies:"),
        &["m.yaml:2:9: schema: found 2, wanted 1"],
    );
    says(
        "name: x",
        &["nothing to compute", "bodies and connections, or reduced"],
    );
    says("[1, 2]", &["found a list, wanted a map"]);
    says(
        &with("loads:", "report: {units: SI}\nloads:"),
        &["report.units", "did you mean `si`?"],
    );
    says(
        &with(
            "loads:",
            "reduced: {stiffness: [[1]], elements: {m: {type: linear}}}\nloads:",
        ),
        &["reduced: is given together with bodies, connections, loads"],
    );
}

#[test]
fn bodies() {
    says(
        &with("B: {inertia: 1e-3}", "B: {inertia: -1e-3}"),
        &["m.yaml:4:16: bodies.B.inertia: found -1e-3, must be > 0"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {inertia: 0}"),
        &["must be > 0"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {inertia: .nan}"),
        &["bodies.B.inertia", "not a finite number"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {inertia: 3 N}"),
        &["a force [N]", "moment of inertia [kg m^2]"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {inertai: 1e-3, inertia: 1}"),
        &["bodies.B.inertai: unknown key", "did you mean `inertia`?"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {}"),
        &["bodies.B: `inertia` is missing"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {inertia: 1}\n  C: {inertia: 1}"),
        &["m.yaml:5:6: bodies.C: nothing holds it"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {inertia: 1}\n  2x: {inertia: 1}")
            .replace("mesh:", "g: {ground: 2x, stiffness: 1}\n  mesh:"),
        &["bodies.2x: names start with a letter"],
    );
}

#[test]
fn empty_systems() {
    let found = lines("bodies: {}\nconnections: {}");
    assert!(found.contains("bodies: none"), "{found}");
    assert!(found.contains("connections: none"), "{found}");
    says("bodies: {A: {inertia: 1}}", &["`connections` is missing"]);
}

#[test]
fn geometry() {
    says(
        &with("gear: {A: 0.05, B: 0.04}", "gear: {A: 0.05, BB: 0.04}"),
        &[
            "connections.mesh.gear.BB: unknown body `BB`",
            "did you mean `B`?",
        ],
    );
    says(
        &with("gear: {A: 0.05, B: 0.04}", "gear: {A: 0.05}\n    length: 1")
            .replace("mesh:", "k: {shaft: [A, B], stiffness: 1}\n  mesh:"),
        &["connections.mesh.gear: found 1 bodies, wanted two"],
    );
    says(
        &with("gear: {A: 0.05, B: 0.04}", "gear: {A: 0.05, B: -0.04}"),
        &["found -0.04, must be > 0"],
    );
    says(
        &with("gear: {A: 0.05, B: 0.04}", "gear: {A: 0.05, B: 4 deg}"),
        &["an angle [rad]", "a length [m]"],
    );
    says(
        &with("gear: {A: 0.05, B: 0.04}", "shaft: [A, A]")
            .replace("mesh:", "k: {shaft: [A, B], stiffness: 1}\n  mesh:"),
        &["connections.mesh.shaft: both ends are the same body"],
    );
    says(
        &with("gear: {A: 0.05, B: 0.04}", "shaft: [A, B, A]"),
        &["found 3 bodies, wanted two: [A, B]"],
    );
    says(
        &with(
            "gear: {A: 0.05, B: 0.04}",
            "gear: {A: 1, B: 1}\n    shaft: [A, B]",
        )
        .replace("mesh:", "k: {shaft: [A, B], stiffness: 1}\n  mesh:"),
        &[
            "geometry: found gear and shaft, wanted exactly one of gear, internal_gear, planet_gear, planet_ring, shaft, ground, acts_on",
        ],
    );
    says(
        &with("gear: {A: 0.05, B: 0.04}", "acts_on: {A: 0, B: 1}"),
        &["acts_on.A: a lever arm of 0"],
    );
    says(
        &with("B: {inertia: 1e-3}", "B: {inertia: 1 kg}"),
        &["`B` is a translating mass", "use acts_on"],
    );
}

#[test]
fn connections() {
    says(
        &with("stiffness: 1e8", "stiffness: 0"),
        &["connections.mesh.stiffness: found 0, must be > 0"],
    );
    says(
        &with("stiffness: 1e8", "stiffness: 1e8 N m/rad"),
        &["a torsional stiffness [N m/rad]", "a stiffness [N/m]"],
    );
    says(
        &with("stiffness: 1e8", "damping: 1"),
        &["connections.mesh: `stiffness` is missing"],
    );
    says(
        &with("stiffness: 1e8", "stiffness: 1e8\n    damping: -1"),
        &["connections.mesh.damping: found -1, must be >= 0"],
    );
    says(
        &with("stiffness: 1e8", "stiffness: 1e8\n    length: 0"),
        &["length: found 0, must be > 0"],
    );
    says(
        &with("stiffness: 1e8", "stiffness: 1e8\n    stifness: 1"),
        &["unknown key `stifness`", "did you mean `stiffness`?"],
    );
    says(
        &with("stiffness: 1e8", "stiffness: 1e8\n    base_order: -2.5"),
        &["base_order: found -2.5, wanted an order above 0"],
    );
    let many: String = (0..4097)
        .map(|k| format!("  c{k}: {{ground: A, stiffness: 1}}\n"))
        .collect();
    says(
        &format!("bodies: {{A: {{inertia: 1}}}}\nconnections:\n{many}"),
        &["found 4097, wanted at most 4096"],
    );
}

#[test]
fn laws() {
    let law = |text: &str| with("{type: backlash, half_gap: 4e-5}", text);
    says(
        &law("{type: backlsh, half_gap: 1}"),
        &[
            "m.yaml:9:21: connections.mesh.element.type: unknown law",
            "known: backlash, clutch, cubic",
            "did you mean `backlash`?",
        ],
    );
    says(&law("{half_gap: 1}"), &["`type` is missing"]);
    says(
        &law("{type: backlash, halfgap: 1}"),
        &[
            "element.halfgap: law `backlash` has no parameter `halfgap`; it has: half_gap, gap,",
            "did you mean `half_gap`?",
        ],
    );
    says(
        &law("{type: linear, gap: 1}"),
        &["law `linear` has no parameter `gap`; it has: none"],
    );
    says(
        &law("{type: backlash, half_gap: -5 um}"),
        &["m.yaml:9:41: connections.mesh.element.half_gap: found -5 um, must be >= 0"],
    );
    says(
        &law("{type: backlash, half_gap: 5 kg}"),
        &["a mass [kg]", "a length [m]"],
    );
    says(
        &law("{type: backlash, half_gap: 5 deg}"),
        &["an angle [rad]", "a length [m]"],
    );
    says(
        &law("{type: backlash, half_gap: 1, gap: 2}"),
        &["half_gap and gap exclude each other"],
    );
    says(
        &law("{type: backlash, half_gap: .inf}"),
        &["element.half_gap", "finite"],
    );
    says(
        &law("{type: backlash, half_gap: 1, impact_damping_law: literl}"),
        &["did you mean `literal`?"],
    );
    says(
        &law("{type: piecewise_linear, breakpoints: [1, 2], slopes: [0, 1]}"),
        &["element.slopes", "3 values, one more than breakpoints"],
    );
    says(
        &law("{type: piecewise_linear, breakpoints: [1, 2 N], slopes: [0, 1, 1]}"),
        &["element.breakpoints.1", "a force [N]"],
    );
    says(
        &law("{type: cubic}"),
        &["connections.mesh.element", "cubic"],
    );
    says(
        &law("backlash"),
        &["connections.mesh.element: found the text `backlash`, wanted a map"],
    );
}

#[test]
fn series() {
    let add = |text: &str| with("stiffness: 1e8", &format!("stiffness: 1e8\n    {text}"));
    says(
        &add("stiffness_variation: {table: [1.1, 1.0]}"),
        &["stiffness_variation: mean 1.05, must be 1"],
    );
    says(
        &add("stiffness_variation: {mean: 2, harmonics: []}"),
        &["mean 2, must be 1"],
    );
    says(
        &add("stiffness_variation: {rectangular: {high: 1.1, low: 0.9, duty: 0.4}}"),
        &["mean 0.98"],
    );
    says(
        &add("stiffness_variation: {rectangular: {high: 1.1, low: 0.9, duty: 1.4}}"),
        &["duty: found 1.4, must be between 0 and 1"],
    );
    says(
        &add("stiffness_variation: {table: [1]}"),
        &["stiffness_variation.table: found 1 values, wanted at least 2"],
    );
    says(
        &add("stiffness_variation: {harmonics: [{order: 1, amplitude: 1.5}]}"),
        &["becomes negative"],
    );
    says(&add("transmission_error: {table: []}"), &["found 0 values"]);
    says(
        &add("transmission_error: {rectangular: {high: 1, low: 0, duty: 0.5}}"),
        &["unknown key `rectangular`"],
    );
    says(
        &add("transmission_error: {harmonics: [{order: 0, amplitude: 1}]}"),
        &["harmonics.0.order: found 0, wanted an order above 0"],
    );
    says(
        &add("transmission_error: {harmonics: [{amplitude: 1}]}"),
        &["`order` is missing"],
    );
    says(
        &add("transmission_error: {harmonics: [{order: 1, amplitude: 1 N}]}"),
        &["harmonics.0.amplitude", "a length [m]"],
    );
    says(
        &with(
            "A: {mean: 1}",
            "A: {harmonics: [{order: 1, amplitude: 1, phase: 3 m}]}",
        ),
        &["loads.A.harmonics.0.phase", "an angle [rad]"],
    );
}

#[test]
fn loads_damping_scaling() {
    says(
        &with("A: {mean: 1}", "a: {mean: 1}"),
        &[
            "m.yaml:11:3: loads.a: unknown body `a`",
            "did you mean `A`?",
        ],
    );
    says(
        &with("A: {mean: 1}", "A: {mean: 1 N/m}"),
        &["loads.A.mean", "a moment [N m]"],
    );
    let loose = lines(
        &with("A: {mean: 1}", "A: {mean: 1}\n  C: {mean: 1}").replace(
            "  B: {inertia: 1e-3}",
            "  B: {inertia: 1e-3}\n  C: {inertia: 1}",
        ),
    );
    assert!(loose.contains("bodies.C: nothing holds it"), "{loose}");
    assert!(
        loose.contains("loads.C: acts on `C`, which no connection holds"),
        "{loose}"
    );
    let add = |text: &str| with("loads:", &format!("{text}\nloads:"));
    says(
        &add("damping: {modal_ratio: -0.1}"),
        &["damping.modal_ratio: found -0.1, must be >= 0"],
    );
    says(
        &add("damping: {modal_ratio: 0.1, modal_ratios: [0.1]}"),
        &["exclude each other"],
    );
    says(&add("damping: {zeta: 0.1}"), &["damping.zeta: unknown key"]);
    says(
        &add("damping: {stiffness_proportional: 1 m}"),
        &["a time [s]"],
    );
    says(
        &add("scaling: {frequency: frist_mode}"),
        &["did you mean `first_mode`?"],
    );
    says(
        &add("scaling: {frequency: 0}"),
        &["scaling.frequency: found 0, must be > 0"],
    );
    says(
        &add("scaling: {length: 1 kg}"),
        &["scaling.length", "a length [m]"],
    );
}

#[test]
fn reduced_shapes_and_units() {
    let good = "reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {a: {type: backlash, half_gap: 1}, b: {type: linear}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0]}]}
";
    assert_eq!(lines(good), "");
    let with = |part: &str, by: &str| good.replace(part, by);
    says(
        &with("[1, 2]]", "[1, 2, 3]]"),
        &["m.yaml:2:14: reduced.stiffness: row 1 has 3 values"],
    );
    says(
        &with("  elements", "  element_map: [[1, 0]]\n  elements"),
        &["m.yaml:4:16: reduced.element_map: W is 1 x 2, wanted 2 x 2"],
    );
    says(
        &with("b: {type: linear}", "b: {type: linear}, c: {type: linear}"),
        &["kappa is 2 x 2, but there are 3 elements"],
    );
    says(
        &with("{modal_ratio: 0.05}", "{matrix: [[1]]}"),
        &["reduced.damping.matrix: Gam is 1 x 1, wanted 2 x 2"],
    );
    says(
        &with("{modal_ratio: 0.05}", "{modal_ratio: 0.05, matrix: [[1]]}"),
        &["found modal_ratio and matrix, wanted exactly one"],
    );
    says(
        &with("mean: [0.5, 0.5]", "mean: [0.5]"),
        &["reduced.loads.mean: found 1 values, wanted 2"],
    );
    says(
        &with("cos: [0.25, 0]", "cos: [0.25, 0, 1]"),
        &["reduced.loads.harmonics.0.cos: found 3 values"],
    );
    says(
        &with("half_gap: 1", "half_gap: 1 um"),
        &["reduced.elements.a.half_gap: `1 um` has a unit, wanted a bare number"],
    );
    says(
        &with("[1, 2]]", "[1, 2 N]]"),
        &["reduced.stiffness.1.1: `2 N` has a unit"],
    );
    says(
        &with("half_gap: 1", "half_gapp: 1"),
        &["did you mean `half_gap`?"],
    );
    says(
        &with("  stiffness: [[2, 1], [1, 2]]\n", ""),
        &["reduced: `stiffness` is missing"],
    );
    says(
        &with("b: {type: linear}", "b: linear"),
        &["reduced.elements.b: found the text `linear`, wanted a map"],
    );
    says(
        &with("[[2, 1], [1, 2]]", "[[2, 1, 0], [1, 2, 1]]")
            .replace("b: {", "c: {type: linear}, b: {"),
        &["element_map (W) is missing"],
    );
}

#[test]
fn independent_mistakes_are_reported_together_with_places() {
    let text = "
schema: 1
bodies:
  A: {inertia: -1}
  B: {inertia: 1, mass: 2}
conections: {}
connections:
  mesh: {gear: {A: 1, D: 1}, stiffness: -1 N/m, element: {type: backlash, half_gap: -1, beta: 2}}
loads: {Z: {mean: x}}
damping: {modal_ratio: .nan}
";
    let list = mistakes(text);
    let paths: Vec<&str> = list.iter().map(|m| m.path.as_str()).collect();
    for path in [
        "conections",
        "bodies.A.inertia",
        "bodies.B.mass",
        "connections.mesh.gear.D",
        "connections.mesh.stiffness",
        "connections.mesh.element.beta",
        "loads.Z",
        "loads.Z.mean",
        "damping.modal_ratio",
        "bodies.B",
    ] {
        assert!(paths.contains(&path), "{path} in {paths:?}");
    }
    assert!(list.iter().all(|m| m.location.is_some()));
}

#[test]
fn mistakes_of_the_assembly_find_their_place() {
    let text = "
bodies: {A: {inertia: 1}, B: {inertia: 1}, C: {inertia: 1}}
connections:
  ab: {gear: {A: 0.03, B: 0.04}, stiffness: 1}
  bc: {gear: {B: 0.04, C: 0.05}, stiffness: 1}
  ac: {internal_gear: {A: 0.03, C: 0.05001}, stiffness: 1}
damping: {modal_ratios: [0.1]}
";
    let root = yaml::parse(text, "m.yaml").unwrap();
    let model = read(&root).unwrap();
    let mut list = assemble(&model).unwrap_err();
    locate(&root, &mut list);
    let text = list[0].to_string();
    assert!(
        text.starts_with("m.yaml:6:7: connections.ac: nearly closes a loop with ab, bc"),
        "{text}"
    );
}
