//! The top level of a model file.

use super::fields::{Fields, Mistakes, count, word};
use super::reduced::reduced;
use super::train::{self, train};
use super::{Model, ReportUnits, Structure};
use crate::element::Element;
use crate::error::{Diagnostic, did_you_mean};
use crate::yaml::Node;
use std::sync::Arc;

/// Version of the model file that this reader understands.
pub const SCHEMA: usize = 1;

const KEYS: [&str; 13] = [
    "schema",
    "name",
    "bodies",
    "matrices",
    "connections",
    "damping",
    "loads",
    "scaling",
    "reference",
    "balance",
    "reduced",
    "report",
    "analyses",
];

/// The model of a merged document, SI units; keys that start with `x-` are skipped, `analyses` is read elsewhere.
///
/// # Errors
/// Every independent error, with path, place, what was found, what was wanted and the nearest known name.
pub fn read(root: &Node) -> Result<Model, Vec<Diagnostic>> {
    let mut mistakes = Mistakes::default();
    let model = interpret(root, &mut mistakes);
    let model = mistakes.conclude(model)?;
    Ok(Model {
        document: Arc::new(root.clone()),
        ..model
    })
}

/// Gives diagnostics of later stages the place of their path, or of the nearest part of the path that the document has.
pub fn locate(root: &Node, list: &mut [Diagnostic]) {
    for mistake in list.iter_mut().filter(|m| m.location.is_none()) {
        let mut path = mistake.path.as_str();
        while !path.is_empty() {
            if let Some(node) = root.at(path) {
                mistake.location.clone_from(&node.location);
                break;
            }
            path = path.rsplit_once('.').map_or("", |(front, _)| front);
        }
    }
}

/// The model of a document, without the document itself.
pub(super) fn interpret(root: &Node, mistakes: &mut Mistakes) -> Option<Model> {
    let planets = super::planets::expanded(root, mistakes);
    let root = planets.as_ref().unwrap_or(root);
    let fields = Fields::open(root, "", mistakes)?;
    for (key, entry) in fields.entries() {
        if !KEYS.contains(&key) && !key.starts_with("x-") {
            let mistake = Diagnostic::at_key(entry, key, format!("unknown key `{key}`"));
            mistakes.add(mistake.with_help(did_you_mean(key, KEYS)));
        }
    }
    if let Some(node) = fields.get("schema") {
        mistakes.note(schema(node));
    }
    let name = fields.get("name");
    let name = name.and_then(|node| mistakes.note(node.as_text("name")));
    let report_units = fields.get("report").and_then(|node| units(node, mistakes));
    let (structure, mut warnings) = structure(&fields, mistakes)?;
    warnings.extend(mistakes.take_warnings());
    warnings.extend(cautions(&structure));
    // Whoever writes kilograms wants metres; a reduced system has no units.
    let usual = match &structure {
        Structure::Train(_) => ReportUnits::Si,
        Structure::Reduced(_) => ReportUnits::Nondimensional,
    };
    if usual == ReportUnits::Nondimensional && report_units == Some(ReportUnits::Si) {
        let node = fields.get("report").and_then(|r| r.get("units"))?;
        let message = "a reduced model is nondimensional; it cannot report in SI units";
        mistakes.add(Diagnostic::at(node, "report.units", message));
    }
    Some(Model {
        name: name.unwrap_or_default().to_owned(),
        structure,
        report_units: report_units.unwrap_or(usual),
        warnings,
        document: Arc::default(),
        files: mistakes.take_files(),
    })
}

/// What the laws have to say about themselves.
pub(super) fn cautions(structure: &Structure) -> Vec<String> {
    let laws: Vec<(String, &dyn Element)> = match structure {
        Structure::Train(train) => (train.connections.iter())
            .map(|(name, c)| (format!("connections.{name}.element"), c.element.as_ref()))
            .collect(),
        Structure::Reduced(reduced) => (reduced.elements.iter())
            .map(|(name, e)| (format!("reduced.elements.{name}"), e.element.as_ref()))
            .collect(),
    };
    let said = |(path, law): (String, &dyn Element)| {
        let list = law.cautions().into_iter();
        list.map(move |caution| format!("{path}.{caution}"))
    };
    laws.into_iter().flat_map(said).collect()
}

fn schema(node: &Node) -> Result<(), Diagnostic> {
    match count(node, "schema", usize::MAX) {
        Ok(SCHEMA) => Ok(()),
        _ => {
            let message = format!("found {}, wanted {SCHEMA}", node.describe());
            let help = "this program reads version 1 of the model file";
            Err(Diagnostic::at(node, "schema", message).with_help(help))
        }
    }
}

fn units(node: &Node, mistakes: &mut Mistakes) -> Option<ReportUnits> {
    let fields = Fields::known(node, "report", &["units"], mistakes)?;
    let node = fields.get("units")?;
    let found = word(node, "report.units", &["nondimensional", "si"]);
    Some(match mistakes.note(found)? {
        "si" => ReportUnits::Si,
        _ => ReportUnits::Nondimensional,
    })
}

fn structure(fields: &Fields<'_>, mistakes: &mut Mistakes) -> Option<(Structure, Vec<String>)> {
    let given: Vec<&str> = (train::KEYS.into_iter())
        .filter(|key| fields.get(key).is_some())
        .collect();
    let Some(node) = fields.get("reduced") else {
        if fields.get("bodies").is_none() && fields.get("connections").is_none() {
            let message = "nothing to compute: wanted bodies and connections, or reduced";
            mistakes.add(Diagnostic::at(fields.node, "", message));
            return None;
        }
        let (train, warnings) = train(fields, mistakes)?;
        return Some((Structure::Train(train), warnings));
    };
    if !given.is_empty() {
        let message = format!(
            "is given together with {}: wanted either reduced or a train of bodies and connections",
            given.join(", ")
        );
        mistakes.add(Diagnostic::at(node, "reduced", message));
    }
    let reduced = reduced(node, mistakes)?;
    Some((Structure::Reduced(reduced), Vec::new()))
}
