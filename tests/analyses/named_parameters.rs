//! Numbers of a model as parameters: written into the mechanics, they give what reading the whole model again gives.

use gearlash::analysis::Setting;
use gearlash::analysis::parameter::{Systems, VariedParameter};
use gearlash::interrupt::Interrupt;
use gearlash::model::Model;
use gearlash::system::System;
use serde_json::{Value, json};
use std::path::PathBuf;

/// A train with everything that a number may stand in.
const TRAIN: &str = "
bodies:
  A: {inertia: 1e-3}
  B: {inertia: 2e-3, drag: {viscous: 1e-3}}
  C: {inertia: 3e-3}
reference: {body: A, speed: 600 rpm}
balance: C
connections:
  mesh:
    gear: {A: 50 mm, B: 60 mm}
    stiffness: 2e8
    damping: 30
    element: {type: backlash, gap: 80 um, impact_damping: 0.1}
    stiffness_variation: {harmonics: [{order: 2, amplitude: 0.1}]}
    transmission_error: {harmonics: [{order: 2, amplitude: 3 um, phase: 0.2}]}
  twist:
    shaft: [B, C]
    stiffness: 300
    element: {type: piecewise_linear, breakpoints: [-0.01, 0.02], slopes: [1, 0.2, 1]}
damping: {modal_ratios: [0.03, 0.05]}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 30, phase: 10 deg}, {order: 2, amplitude: 3}]}
  B: {mean: 2}
";

/// The model with its scales written out, so that no change of a number moves them.
fn with_own_scales(model: &Model) -> Model {
    let assembly = model.assemble().unwrap();
    if assembly.coupling.is_none() {
        return model.clone();
    }
    let written = model.to_tree();
    // One of several planets is written once for all.
    let once = |name: &String| match (&written["connections"][name], name.rsplit_once('_')) {
        (Value::Null, Some((front, _))) => front.to_owned(),
        _ => name.clone(),
    };
    let lengths: Vec<(String, Value)> = (assembly.connections.iter())
        .zip(&assembly.scales.displacement)
        .map(|(name, l)| (format!("connections.{}.length", once(name)), json!(l)))
        .collect();
    let mut changes: Vec<(&str, Value)> = lengths
        .iter()
        .map(|(p, l)| (p.as_str(), l.clone()))
        .collect();
    changes.push(("scaling", json!({"frequency": assembly.scales.frequency})));
    model.with(changes).unwrap()
}

fn text(system: &System) -> String {
    format!("{system:?}")
}

/// Compares every number of a model; how many the model took.
fn compare(model: &Model) -> usize {
    let model = with_own_scales(model);
    let assembly = model.assemble().unwrap();
    let setting = Setting {
        name: "it",
        model: &model,
        assembly: &assembly,
        control: &Interrupt::default(),
    };
    let mut taken = 0;
    for number in model.numbers() {
        let name = &number.name;
        // Scales are frozen along a parameter.
        if name.starts_with("scaling") || name.ends_with(".length") {
            continue;
        }
        let knob = model.knob(name).unwrap();
        let value = match number.value {
            0.0 => 0.01,
            value => 1.000_123 * value,
        };
        let mut other = model.clone();
        let whole = other.set(&knob, value).and_then(|()| other.assemble());
        let frequency = VariedParameter::Frequency(Vec::new());
        let parameters = [VariedParameter::Number(Box::new(knob)), frequency];
        let mut systems = Systems::new(&setting, &parameters, 1.0, 1);
        let found = systems.at(&[value, 0.7]);
        match (found, whole) {
            (Ok(found), Ok(whole)) => {
                let mut wanted = whole.system;
                wanted.set_reference_frequency(0.7);
                assert_eq!(text(found), text(&wanted), "{name}");
                taken += 1;
            }
            (Err(_), Err(_)) => {}
            (found, whole) => panic!("{name}: {:?}, {:?}", found.err(), whole.err()),
        }
    }
    taken
}

#[test]
fn writing_a_number_is_reading_the_model_again() {
    assert!(compare(&Model::from_yaml(TRAIN).unwrap()) > 25);
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("models");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "yaml") {
            let model = Model::load(&path).unwrap_or_else(|e| panic!("{e}"));
            assert!(compare(&model) > 5, "{}", path.display());
        }
    }
}

#[test]
fn several_parameters_move_at_once() {
    let model = Model::from_yaml(TRAIN).unwrap();
    let assembly = model.assemble().unwrap();
    let setting = Setting {
        name: "it",
        model: &model,
        assembly: &assembly,
        control: &Interrupt::default(),
    };
    let find = |name: &str| VariedParameter::find(&setting, name).unwrap();
    let parameters = [find("mesh.gap"), find("frequency"), find("A.inertia")];
    let mut systems = Systems::new(&setting, &parameters, 1.0, 2);
    let first = text(systems.at(&[60e-6, 0.8, 2e-3]).unwrap());
    let moved = text(systems.at(&[70e-6, 0.8, 2e-3]).unwrap());
    let tuned = systems.at(&[70e-6, 0.9, 2e-3]).unwrap();
    assert!((tuned.reference_frequency() - 0.9).abs() < 1e-15 && tuned.subharmonic() == 2);
    assert_ne!(first, moved);
    assert_eq!(text(systems.at(&[60e-6, 0.8, 2e-3]).unwrap()), first);
    let refused = systems.at(&[-1.0, 0.8, 0.0]).err().unwrap();
    assert_eq!(refused.len(), 2, "{refused:?}");
    assert_eq!(text(systems.at(&[60e-6, 0.8, 2e-3]).unwrap()), first);
}
