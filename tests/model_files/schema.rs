//! The JSON schema: every model and the starter validate, what is wrong does not, and it knows the keys that the loader knows.

use crate::program;
use crate::program::Place;
use gearlash::error::Error;
use gearlash::{analysis, element, model, schema, yaml};
use jsonschema::Validator;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

fn validator() -> Validator {
    jsonschema::draft7::new(&schema::schema()).unwrap()
}

fn tree(text: &str) -> Value {
    yaml::parse(text, "m.yaml").unwrap().to_json()
}

fn faults(validator: &Validator, value: &Value) -> Vec<String> {
    let shown = |e: jsonschema::ValidationError<'_>| format!("{} at {}", e, e.instance_path());
    validator.iter_errors(value).map(shown).collect()
}

/// Every model file below a folder of the project.
fn texts(folder: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut list = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "yaml") {
            let text = std::fs::read_to_string(&path).unwrap();
            list.push((path.display().to_string(), text));
        }
    }
    assert!(!list.is_empty());
    list
}

#[test]
fn is_a_schema_of_its_draft() {
    assert!(jsonschema::meta::is_valid(&schema::schema()));
    let place = Place::with("");
    let ended = place.run(&["schema"]).ends_with(0);
    let printed: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(printed, schema::schema());
}

#[test]
fn models_and_starter_validate() {
    let validator = validator();
    let mut all = texts("models");
    all.extend(texts("benches/problems"));
    all.push(("TRAIN".into(), program::TRAIN.into()));
    all.push(("REDUCED".into(), program::REDUCED.into()));
    all.push(("EVERYTHING".into(), EVERYTHING.into()));
    all.push(("starter".into(), Place::with("").run(&["new"]).out));
    for (name, text) in all {
        let found = faults(&validator, &tree(&text));
        assert!(found.is_empty(), "{name}: {found:#?}");
    }
}

/// A train that uses every key of a train.
const EVERYTHING: &str = "\
schema: 1
name: 12
x-anything: {whatever: [1, 2]}
bodies: {A: {inertia: 1.0e-3}, B: {inertia: '2e-3'}, C: {inertia: 3 kg}, D: {inertia: 5 g mm^2}}
connections:
  mesh:
    gear: {A: 50 mm, B: 2 in}
    stiffness: 2.4e8 N/m
    damping: 20 N/(m/s)
    length: 50 µm
    base_order: 20
    element: {type: backlash, gap: 100 um, impact_damping: 0.1 s/m, impact_damping_law: literal}
    transmission_error: {mean: 0, harmonics: [{order: 1, amplitude: 1 um, phase: 30 deg}], base_order: 1e1}
    stiffness_variation: {rectangular: {high: 1.1, low: 0.9, duty: 0.5, phase: 0.1}}
  inner: {internal_gear: {A: 50 mm, D: 0.2}, stiffness: 1 kN/mm, stiffness_variation: {table: [0.9, 1.1]}}
  shaft: {shaft: [B, D], stiffness: 1e4 N·m/rad, element: null, transmission_error: {table: [0, 1 mrad, -1 mrad]}}
  spring: {ground: C, stiffness: 5 lbf/in, damping: null}
  lever: {acts_on: {A: 0.05, C: -1}, stiffness: 1e6, stiffness_variation: {mean: 1, harmonics: []}}
damping: {modal_ratios: [0.1, 0.1], stiffness_proportional: 1 us}
loads: {A: {mean: -3 kN m, harmonics: [{order: 2, amplitude: 1.5e+2}]}, C: {}}
scaling: {frequency: 25 Hz, length: 1e-4}
report: {units: si}
analyses:
  response:
    {type: frequency_response, from: 300 rpm, to: '25 Hz', harmonics: 12.0, marks: [10 Hz], orbits: marks, title: 3,
     caption: null, assumed: [a, 2], set: {bodies.A.inertia: 1}, samples: null, methods: [galerkin, shooting], start: rest}
  known:
    {type: parameter_response, at: 20 Hz, parameter: B.inertia, from: 2.0e-3, to: 3.0e-3, error_estimate: true,
     harmonics: {tolerance: 1.0e-5, least: 4, most: 50}, convergence_check: true,
     starts: {count: 3, seed: 1, at: [2.5e-3], box: 1}}
";

/// Changes of EVERYTHING that are mistakes: what is replaced by what.
const MISTAKES: [(&str, &str); 38] = [
    ("schema: 1", "schema: 2"),
    ("x-anything", "y-anything"),
    ("{inertia: 1.0e-3}", "{inertia: -1.0e-3}"),
    ("{inertia: 1.0e-3}", "{inertia: 0 kg m^2}"),
    ("{inertia: 1.0e-3}", "{mass: 1.0e-3}"),
    ("{inertia: 1.0e-3}", "{inertia: 1 kgm^2}"),
    ("{inertia: 1.0e-3}", "{}"),
    ("{A: {inertia", "{2A: {inertia"),
    ("gear: {A: 50 mm, B: 2 in}", "gears: {A: 50 mm, B: 2 in}"),
    ("gear: {A: 50 mm, B: 2 in}", "gear: {A: 50 mm}"),
    ("gear: {A: 50 mm, B: 2 in}", "gear: {A: 50 mm, B: 2 inches}"),
    (
        "gear: {A: 50 mm, B: 2 in}",
        "gear: {A: 1, B: 1}\n    ground: A",
    ),
    ("    stiffness: 2.4e8 N/m\n", ""),
    ("stiffness: 2.4e8 N/m", "stiffness: .nan"),
    ("base_order: 20", "base_order: 0"),
    ("base_order: 20", "base_order: -2"),
    ("base_order: 20", "order_unit: twenty"),
    ("type: backlash", "type: baklash"),
    ("type: backlash, gap: 100 um", "type: backlash"),
    ("gap: 100 um", "gap: 100 um, half_gap: 50 um"),
    ("gap: 100 um", "gap: -100 um"),
    (
        "impact_damping_law: literal",
        "impact_damping_law: literally",
    ),
    ("impact_damping: 0.1 s/m", "impact: 0.1 s/m"),
    ("order: 1, amplitude: 1 um", "amplitude: 1 um"),
    ("high: 1.1, low: 0.9", "high: 1.1, low: -0.9"),
    ("{table: [0.9, 1.1]}", "{table: [1]}"),
    ("[B, D]", "[B, D, C]"),
    (
        "modal_ratios: [0.1, 0.1]",
        "modal_ratio: 0.1, modal_ratios: [0.1, 0.1]",
    ),
    ("frequency: 25 Hz", "frequency: first_mod"),
    ("units: si", "units: SI"),
    ("type: frequency_response, ", ""),
    ("type: frequency_response", "type: frequency_responses"),
    ("harmonics: 12.0", "harmonics: 12.5"),
    ("orbits: marks", "orbits: all"),
    ("start: rest", "stat: rest"),
    ("least: 4", "fewest: 4"),
    ("seed: 1, ", ""),
    ("at: [2.5e-3]", "at: [[2.5e-3]]"),
];

#[test]
fn mistakes_are_refused_by_loader_and_schema() {
    let validator = validator();
    for (good, bad) in MISTAKES {
        assert_eq!(EVERYTHING.matches(good).count(), 1, "{good}");
        let text = EVERYTHING.replace(good, bad);
        let place = Place::with(&text);
        place.run(&["check", "m.yaml"]).ends_with(2);
        assert!(!validator.is_valid(&tree(&text)), "{bad}");
    }
}

/// What a base holds may be left out or removed, and lists are whole all the same.
#[test]
fn files_that_extend_others_are_partial() {
    let validator = validator();
    for good in [
        "extends: b.yaml\n",
        "extends: b.yaml\nconnections: {mesh: {element: {half_gap: 5 um}}, shaft: null}\n",
        "extends: b.yaml\nbodies: {A: null, B: {inertia: 2 kg}}\nanalyses: {one: null, two: {from: 3.0}}\n",
        "extends: b.yaml\nreduced: {loads: {mean: [1, 2]}}\nx-more: 1\n",
        "extends: b.yaml\nconnections: {mesh: {transmission_error: {harmonics: [{order: 1, amplitude: 2 um}]}}}\n",
    ] {
        assert!(
            validator.is_valid(&tree(good)),
            "{good}: {:#?}",
            faults(&validator, &tree(good))
        );
    }
    for bad in [
        "extends: [b.yaml]\n",
        "extends: b.yaml\nconections: {}\n",
        "extends: b.yaml\nconnections: {mesh: {element: {halfgap: 5 um}}}\n",
        "extends: b.yaml\nbodies: {B: {inertia: -2}}\n",
        "extends: b.yaml\nanalyses: {two: {frm: 3.0}}\n",
        "extends: b.yaml\nconnections: {mesh: {transmission_error: {harmonics: [{amplitude: 2 um}]}}}\n",
    ] {
        assert!(!validator.is_valid(&tree(bad)), "{bad}");
    }
}

/// The schemas that may describe the value at a path: references, alternatives and maps of names resolved.
fn at<'s>(root: &'s Value, schemas: Vec<&'s Value>, step: &str) -> Vec<&'s Value> {
    let mut found = Vec::new();
    for schema in expanded(root, schemas) {
        let named = schema["properties"].get(step);
        let other = schema.get("additionalProperties").filter(|s| s.is_object());
        let entry = schema
            .get("items")
            .filter(|_| step.parse::<usize>().is_ok());
        found.extend(named.or(other).or(entry));
    }
    found
}

fn expanded<'s>(root: &'s Value, mut open: Vec<&'s Value>) -> Vec<&'s Value> {
    let mut found = Vec::new();
    while let Some(schema) = open.pop() {
        if let Some(name) = schema["$ref"].as_str() {
            open.push(&root["definitions"][name.strip_prefix("#/definitions/").unwrap()]);
        }
        for key in ["anyOf", "oneOf", "allOf"] {
            open.extend(schema[key].as_array().into_iter().flatten());
        }
        found.push(schema);
    }
    found
}

/// Keys of the schema at a path; of alternatives with a `type`, only those of this type.
fn known_to_the_schema(root: &Value, path: &str, tag: Option<&str>) -> BTreeSet<String> {
    let mut schemas = vec![&root["definitions"]["model"]];
    for step in path.split('.').filter(|s| !s.is_empty()) {
        schemas = at(root, schemas, step);
    }
    let mut keys = BTreeSet::new();
    for schema in expanded(root, schemas) {
        let own = schema["properties"]["type"]["const"].as_str();
        if tag.is_none_or(|tag| own == Some(tag)) && schema.get("additionalProperties").is_some() {
            keys.extend(
                schema["properties"]
                    .as_object()
                    .into_iter()
                    .flatten()
                    .map(|(k, _)| k.clone()),
            );
        }
    }
    keys
}

const PROBE: &str = "zzzzzzzzzzzz";

/// Keys that the loader lists when it meets one that nobody knows.
fn known_to_the_loader(text: &str, path: &str) -> BTreeSet<String> {
    let mut root = yaml::parse(text, "m.yaml").unwrap();
    root.set(&format!("{path}.{PROBE}"), yaml::Node::scalar("1"))
        .unwrap();
    let list = match model::read(&root) {
        Err(list) if !path.starts_with("analyses") => list,
        _ => {
            let own = root.at(path).unwrap();
            vec![own.read::<Box<dyn analysis::Analysis>>(path).unwrap_err()]
        }
    };
    let about = list
        .iter()
        .find(|d| d.path.ends_with(PROBE))
        .unwrap_or_else(|| panic!("{path}: {list:?}"));
    let help = about.help.as_deref().unwrap();
    let names = help.strip_prefix("known: ").or_else(|| {
        help.strip_prefix("the only known name is `")?
            .strip_suffix('`')
    });
    names
        .unwrap_or_else(|| panic!("{path}: {help}"))
        .split(", ")
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_key_of_the_model_is_in_the_schema() {
    let root = schema::schema();
    for path in [
        "bodies.A",
        "connections.mesh",
        "connections.mesh.transmission_error",
        "connections.mesh.transmission_error.harmonics.0",
        "connections.mesh.stiffness_variation",
        "connections.mesh.stiffness_variation.rectangular",
        "damping",
        "loads.A",
        "loads.A.harmonics.0",
        "scaling",
        "report",
    ] {
        let wanted = known_to_the_loader(EVERYTHING, path);
        assert_eq!(known_to_the_schema(&root, path, None), wanted, "{path}");
    }
    let mut top = yaml::parse(EVERYTHING, "m.yaml").unwrap();
    top.set(PROBE, yaml::Node::scalar("1")).unwrap();
    let list = model::read(&top).unwrap_err();
    let help = list[0]
        .help
        .as_deref()
        .unwrap()
        .strip_prefix("known: ")
        .unwrap();
    let mut wanted: BTreeSet<String> = help.split(", ").map(str::to_owned).collect();
    wanted.insert("extends".into());
    assert_eq!(known_to_the_schema(&root, "", None), wanted);
}

#[test]
fn every_key_of_a_reduced_system_is_in_the_schema() {
    let text = "\
reduced:
  stiffness: [[1]]
  damping: {modal_ratio: 0.05}
  elements: {m: {type: backlash, half_gap: 1, transmission_error: {harmonics: [{order: 1, amplitude: 1}]}}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.25]}]}
";
    let root = schema::schema();
    for path in [
        "reduced",
        "reduced.damping",
        "reduced.loads",
        "reduced.loads.harmonics.0",
        "reduced.elements.m.transmission_error",
        "reduced.elements.m.transmission_error.harmonics.0",
    ] {
        let wanted = known_to_the_loader(text, path);
        assert_eq!(known_to_the_schema(&root, path, None), wanted, "{path}");
    }
    let keys = known_to_the_schema(&root, "reduced.elements.m", Some("backlash"));
    for key in [
        "type",
        "half_gap",
        "transmission_error",
        "stiffness_variation",
        "base_order",
    ] {
        assert!(keys.contains(key), "{key}");
    }
}

#[test]
fn every_law_is_in_the_schema_and_its_example_validates() {
    let validator = validator();
    let root = schema::schema();
    for law in element::registered() {
        let keys = known_to_the_schema(&root, "connections.mesh.element", Some(law.tag));
        let own = law.parameters.iter().map(|p| p.name.to_owned());
        // The backlash of a drawing stands for the half gap.
        let is_drawn = law.parameters.iter().any(|p| p.name == "half_gap");
        let drawn = is_drawn.then(|| "backlash".to_owned());
        let wanted: BTreeSet<String> = own.chain(["type".to_owned()]).chain(drawn).collect();
        assert_eq!(keys, wanted, "{}", law.tag);
        let mut model = tree(EVERYTHING);
        model["connections"]["mesh"]["element"] = tree(law.example);
        assert!(
            validator.is_valid(&model),
            "{}: {:#?}",
            law.tag,
            faults(&validator, &model)
        );
        model["connections"]["mesh"]["element"]["nothing"] = json!(1);
        assert!(!validator.is_valid(&model), "{}", law.tag);
    }
}

/// Every analysis type that typetag knows is in the schema, with the keys that its settings know and those of all.
#[test]
fn every_analysis_is_in_the_schema() {
    let root = schema::schema();
    let unknown = yaml::parse("{type: nothing_like_it}", "a.yaml").unwrap();
    let help = unknown
        .read::<Box<dyn analysis::Analysis>>("a")
        .unwrap_err()
        .to_string();
    let common = [
        "type", "set", "title", "caption", "assumed", "plot", "compare",
    ];
    for (tag, _, _) in analysis::TYPES {
        assert!(
            help.contains(tag) || !help.contains("modes"),
            "{tag}: {help}"
        );
        let text = format!("analyses: {{one: {{type: {tag}}}}}\n");
        let mut wanted = known_to_the_loader(&text, "analyses.one");
        let keys = known_to_the_schema(&root, "analyses.one", Some(tag));
        wanted.extend(common.map(str::to_owned));
        assert_eq!(keys, wanted, "{tag}");
        let settings = &root["definitions"]["analysis"]["oneOf"];
        let own = settings
            .as_array()
            .unwrap()
            .iter()
            .find(|s| s["title"] == *tag)
            .unwrap();
        for (key, value) in own["properties"].as_object().unwrap() {
            assert!(
                value.get("description").is_some(),
                "{tag}.{key} has no description"
            );
        }
    }
}

#[test]
fn the_starter_runs_and_is_never_overwritten() {
    let place = Place::with("");
    let ended = place.run(&["new", "mine.yaml"]).ends_with(0);
    assert!(ended.out.contains("gearlash.schema.json"), "{}", ended.out);
    assert_eq!(
        place.read("mine.yaml"),
        place.run(&["new"]).ends_with(0).out
    );
    assert!(
        place
            .read("mine.yaml")
            .starts_with("# yaml-language-server: $schema=gearlash.schema.json\n")
    );
    place.run(&["check", "mine.yaml"]).ends_with(0);
    place.run(&["run", "mine.yaml"]).ends_with(0);
    place.write("mine.yaml", "a: 1\n");
    place
        .run(&["new", "mine.yaml"])
        .ends_with(2)
        .says(&["mine.yaml", "exists"]);
    assert_eq!(place.read("mine.yaml"), "a: 1\n");
    let error = gearlash::study::Study::load(&place.path("mine.yaml"), &[], &[]).unwrap_err();
    assert!(matches!(error, Error::Input(_)));
}
