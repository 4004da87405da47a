//! The loader on damaged models and on documents grown from the schema: never a panic, and what it takes the schema takes too.
//!
//! `GEARLASH_FUZZ_CASES` sets the number of documents (a few thousand here, three hundred thousand in `.ci/run`). Every case has a seed of its
//! own; a failure prints the document.

use gearlash::analysis::{Analysis, Setting};
use gearlash::error::{Colour, Error, render};
use gearlash::{assembly, model, schema, yaml};
use jsonschema::Validator;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng as Random;
use rayon::prelude::*;
use serde_json::Value;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Words of models, of YAML, and numbers at the ends of what numbers can be.
const WORDS: &[&str] = &[
    "bodies",
    "connections",
    "reduced",
    "analyses",
    "loads",
    "damping",
    "scaling",
    "report",
    "extends",
    "schema",
    "set",
    "gear",
    "internal_gear",
    "shaft",
    "ground",
    "acts_on",
    "stiffness",
    "element",
    "type",
    "backlash",
    "one_sided",
    "cubic",
    "piecewise_linear",
    "preloaded",
    "tanh_friction",
    "expression",
    "half_gap",
    "gap",
    "breakpoints",
    "slopes",
    "mean",
    "harmonics",
    "order",
    "amplitude",
    "phase",
    "table",
    "rectangular",
    "high",
    "low",
    "duty",
    "base_order",
    "modal_ratio",
    "frequency_response",
    "time_history",
    "poincare_map",
    "bifurcation_diagram",
    "modes",
    "from",
    "to",
    "at",
    "parameter",
    "points",
    "periods",
    "samples",
    "marks",
    "initial",
    "seeds",
    "A",
    "B",
    "mesh",
    "shaft_1",
    "null",
    "~",
    "true",
    "no",
    "[]",
    "{}",
    "[[1]]",
    "*a",
    "&a ",
    "<<: ",
    "!!str ",
    "!x ",
    "'",
    "\"",
    "|\n ",
    ">-\n ",
    "# ",
    "? ",
    "- ",
    ": ",
    ", ",
    "\n",
    "\n  ",
    "0",
    "-1",
    "1",
    "2",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "1e309",
    ".nan",
    ".inf",
    "-0",
    "0x10",
    "1e3",
    "0.5",
    "18446744073709551616",
    "1_000",
    "50 um",
    "3 kN m/rad",
    "300 rpm",
    "25 Hz",
    "1 N/(m s)",
    "30 °",
    "5 kgm^2",
    "µm",
    "\u{feff}",
    "\u{0}",
    "\u{85}",
    "\u{2028}",
    "nü",
    "/",
    "^",
    "**",
    "e",
    ".",
    "..",
    "0.0.0",
    "a.b",
    "y",
    "on",
];

fn pick<'t>(random: &mut Random, list: &[&'t str]) -> &'t str {
    list[random.random_range(0..list.len())]
}

/// A model with some of its words, lines and characters changed, moved or missing.
fn damaged(random: &mut Random, text: &str) -> String {
    let mut text = text.to_owned();
    for _ in 0..random.random_range(1..6) {
        let mut at = random.random_range(0..=text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        let is_part = |c: char| c.is_alphanumeric() || "_.-+".contains(c);
        let word = text[at..]
            .find(|c| !is_part(c))
            .map_or(text.len(), |n| at + n);
        let line = text[at..].find('\n').map_or(text.len(), |n| at + n);
        match random.random_range(0..7) {
            0 | 1 => text.replace_range(at..word, pick(random, WORDS)),
            2 => text.insert_str(at, pick(random, WORDS)),
            3 => text.replace_range(at..word, ""),
            4 => text.replace_range(at..line, ""),
            5 => {
                let copy = text[at..line].to_owned();
                let mut to = random.random_range(0..=text.len());
                while !text.is_char_boundary(to) {
                    to -= 1;
                }
                text.insert_str(to, &copy);
            }
            _ => text.truncate(at),
        }
    }
    text
}

/// A document that the schema would take, but for some places where something else stands.
struct Grown<'a, 'r> {
    root: &'a Value,
    random: &'r mut Random,
}

impl Grown<'_, '_> {
    fn chance(&mut self, share: f64) -> bool {
        self.random.random_bool(share)
    }

    fn grow(&mut self, schema: &Value, depth: usize) -> String {
        if depth > 12 || self.chance(0.01) {
            return pick(self.random, WORDS).to_owned();
        }
        if let Some(name) = schema["$ref"].as_str() {
            let name = name.strip_prefix("#/definitions/").unwrap();
            return self.grow(&self.root["definitions"][name], depth + 1);
        }
        for key in ["const", "default"] {
            if schema.get(key).is_some() && (key == "const" || self.chance(0.2)) {
                return schema[key].to_string();
            }
        }
        for key in ["enum", "anyOf", "oneOf"] {
            if let Some(list) = schema[key]
                .as_array()
                .filter(|_| schema.get("properties").is_none())
            {
                let chosen = &list[self.random.random_range(0..list.len())];
                return if key == "enum" {
                    chosen.to_string()
                } else {
                    self.grow(chosen, depth + 1)
                };
            }
        }
        match schema["allOf"].as_array() {
            Some(list) if schema.get("properties").is_none() => {
                return self.grow(&list[0], depth + 1);
            }
            _ => {}
        }
        let kinds = schema["type"]
            .as_array()
            .cloned()
            .unwrap_or_else(|| vec![schema["type"].clone()]);
        let kind = kinds[self.random.random_range(0..kinds.len())].clone();
        match kind.as_str() {
            Some("object") => self.map(schema, depth),
            Some("array") => {
                let least = schema["minItems"].as_u64().unwrap_or(0) as usize;
                let count = least + self.random.random_range(0..3);
                let items: Vec<String> = (0..count)
                    .map(|_| self.grow(&schema["items"], depth + 1))
                    .collect();
                format!("[{}]", items.join(", "))
            }
            Some("integer") => {
                pick(self.random, &["1", "2", "3", "12", "64", "1024", "1e2"]).to_owned()
            }
            Some("number") => pick(
                self.random,
                &["1", "0.5", "2", "1e-3", "2e8", "0.05", "1e5", "0"],
            )
            .to_owned(),
            Some("string") if schema.get("pattern").is_some() => {
                let quantities = [
                    "50 um",
                    "2e8 N/m",
                    "1e-3 kg m^2",
                    "25 Hz",
                    "3 N m",
                    "30 deg",
                    "1e4 N m/rad",
                    "0.1",
                    "5 kg",
                    "1 ms",
                ];
                pick(self.random, &quantities).to_owned()
            }
            Some("string") => pick(self.random, &["A", "B", "mesh", "\"q + 1e3*q^3\""]).to_owned(),
            Some("boolean") => pick(self.random, &["true", "false"]).to_owned(),
            _ => "null".to_owned(),
        }
    }

    fn map(&mut self, schema: &Value, depth: usize) -> String {
        let mut entries = Vec::new();
        let required: Vec<&str> = schema["required"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_str)
            .collect();
        for (key, value) in schema["properties"].as_object().into_iter().flatten() {
            if required.contains(&key.as_str()) || self.chance(0.3) {
                entries.push(format!("{key}: {}", self.grow(value, depth + 1)));
            }
        }
        if let Some(value) = schema.get("additionalProperties").filter(|v| v.is_object()) {
            for name in ["A", "B", "mesh"] {
                if self.chance(0.7) {
                    entries.push(format!("{name}: {}", self.grow(value, depth + 1)));
                }
            }
        }
        format!("{{{}}}", entries.join(", "))
    }
}

/// Takes a text as far as it goes; whether the loader took all of it.
fn take(text: &str, validator: &Validator) -> bool {
    let root = match yaml::parse(text, "fuzz.yaml") {
        Ok(root) => root,
        Err(Error::Input(list)) => {
            assert!(!list.is_empty() && !render(&list, Colour::Plain).is_empty());
            return false;
        }
        Err(other) => panic!("{other}"),
    };
    let _ = yaml::apply_override(&mut root.clone(), "connections.mesh.stiffness=5 um");
    let json = root.to_json();
    let analyses = root.get("analyses").filter(|node| !node.is_null()).cloned();
    let read = match model::read(&root) {
        Ok(model) => model,
        Err(list) => {
            assert!(!list.is_empty() && !render(&list, Colour::Plain).is_empty());
            return false;
        }
    };
    let assembly = match assembly::assemble(&read) {
        Ok(assembly) => assembly,
        Err(mut list) => {
            model::locate(&root, &mut list);
            assert!(!list.is_empty());
            return false;
        }
    };
    let control = AtomicBool::new(false);
    let mut is_whole = true;
    for (name, entry) in analyses
        .iter()
        .flat_map(|node| node.as_map("").ok())
        .flatten()
    {
        let mut own = entry.node.clone();
        for common in ["set", "title", "caption", "assumed"] {
            if own.get(common).is_some() {
                own.set(common, yaml::Node::scalar("null")).unwrap();
            }
        }
        match own.read::<Box<dyn Analysis>>(name) {
            Ok(analysis) => {
                let setting = Setting {
                    name,
                    model: &read,
                    assembly: &assembly,
                    control: &control,
                };
                is_whole &= analysis.check(&setting).is_empty();
            }
            Err(_) => is_whole = false,
        }
    }
    let is_plain = analyses.is_none() && root.get("extends").is_none();
    if is_plain && !validator.is_valid(&json) {
        let faults: Vec<String> = validator
            .iter_errors(&json)
            .map(|e| format!("{e} at {}", e.instance_path()))
            .collect();
        panic!("the loader takes what the schema refuses: {faults:?}");
    }
    is_whole
}

fn seeds() -> Vec<String> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    paths.sort();
    let mut list: Vec<String> = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap();
        // Comments teach nothing here, and long texts take long.
        let lines = text
            .lines()
            .filter(|line| !line.trim_start().starts_with('#'));
        list.push(lines.map(|line| format!("{line}\n")).collect());
    }
    list.push("reduced:\n  stiffness: [[2, 1], [1, 2]]\n  damping: {modal_ratio: 0.05}\n  elements: {mesh: {type: backlash, half_gap: 1}, m: {type: cubic, cubic: 1}}\n  loads: {mean: [1, 2], harmonics: [{order: 1, cos: [1, 0]}]}\nanalyses: {fr: {type: frequency_response, from: 2, to: 1}}\n".into());
    list
}

#[test]
fn damaged_and_grown_documents_do_not_panic() {
    let cases: u64 = std::env::var("GEARLASH_FUZZ_CASES").map_or(4000, |n| n.parse().unwrap());
    let (root, seeds) = (schema::schema(), seeds());
    let validator = jsonschema::draft7::new(&root).unwrap();
    let (taken, whole) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let failure = (0..cases).into_par_iter().find_map_first(|case| {
        let mut random = Random::seed_from_u64(case);
        let text = if case % 4 == 0 {
            let mut grown = Grown {
                root: &root,
                random: &mut random,
            };
            grown.grow(&root["definitions"]["model"], 0)
        } else {
            let seed = &seeds[random.random_range(0..seeds.len())];
            damaged(&mut random, seed)
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| take(&text, &validator)));
        taken.fetch_add(1, Ordering::Relaxed);
        match outcome {
            Ok(is_whole) => {
                whole.fetch_add(usize::from(is_whole), Ordering::Relaxed);
                None
            }
            Err(panic) => {
                let said = panic.downcast_ref::<String>().cloned();
                let said = said.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
                Some(format!("case {case}: {}\n{text}", said.unwrap_or_default()))
            }
        }
    });
    if let Some(failure) = failure {
        panic!("{failure}");
    }
    println!("{taken:?} documents, {whole:?} of them whole");
    // A fuzzer whose documents are all refused at the door would test nothing.
    assert!(whole.into_inner() as u64 > cases / 100);
}
