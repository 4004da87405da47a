//! Reads a model file into a study and reports all errors before anything runs.

use super::{Built, Run, Texts, measured, plotting};
use crate::analysis::{self, Analysis, Control, Setting};
use crate::assembly::assemble;
use crate::error::{Diagnostic, did_you_mean};
use crate::model::{self, Model};
use crate::output::folder;
use crate::yaml::{self, Entry, Node};
use indexmap::IndexMap;

/// Reads and assembles the model of a document; errors of the assembly get the place of their path.
pub(super) fn build(root: &Node) -> Result<Built, Vec<Diagnostic>> {
    assembled(model::read(root)?)
}

/// Assembles a model; errors get the place of their path.
pub(super) fn assembled(model: Model) -> Result<Built, Vec<Diagnostic>> {
    let assembly = assemble(&model).map_err(|list| located(model.document(), list))?;
    Ok((model, assembly))
}

/// Gives errors of later stages the place of their path.
fn located(root: &Node, mut list: Vec<Diagnostic>) -> Vec<Diagnostic> {
    model::locate(root, &mut list);
    list
}

/// The chosen entries of `analyses:`, in the order of the file.
pub(super) fn analyses<'a>(
    root: &'a Node,
    only: &[String],
) -> Result<Vec<(&'a String, &'a Entry)>, Vec<Diagnostic>> {
    let empty = IndexMap::new();
    let map = match root.get("analyses") {
        None => None,
        Some(node) if node.is_null() => None,
        Some(node) => Some(node.as_map("analyses").map_err(|d| vec![d])?),
    };
    let known: Vec<&str> = map.unwrap_or(&empty).keys().map(String::as_str).collect();
    let unknown: Vec<Diagnostic> = only
        .iter()
        .filter(|name| !known.contains(&name.as_str()))
        .map(|name| Diagnostic {
            location: None,
            path: "--only".into(),
            message: format!("no analysis is called `{name}`"),
            help: Some(did_you_mean(name, known.iter().copied())),
        })
        .collect();
    if !unknown.is_empty() {
        return Err(unknown);
    }
    Ok(map
        .into_iter()
        .flatten()
        .filter(|(name, _)| only.is_empty() || only.contains(name))
        .collect())
}

/// Names of all analyses of a document that has been read.
pub(super) fn names(root: &Node) -> Vec<String> {
    let map = root
        .get("analyses")
        .and_then(|node| node.as_map("analyses").ok());
    map.map_or(Vec::new(), |map| map.keys().cloned().collect())
}

/// Reads one analysis and checks it against its model.
pub(super) fn load_run(
    root: &Node,
    name: &str,
    entry: &Entry,
    base: Option<&Built>,
) -> Result<Run, Vec<Diagnostic>> {
    let path = yaml::join("analyses", name);
    model::check_name(entry, name, &path).map_err(|d| vec![d])?;
    if let Some(message) = folder::name_fault(name) {
        return Err(vec![Diagnostic::at_key(entry, &path, message)]);
    }
    let node = &entry.node;
    let own = own_model(root, node, &path);
    let (texts, kind, analysis) = read_analysis(node, &path).map_err(|mut list| {
        // Mistakes in `set:` and in the other keys are independent.
        list.extend(own.as_ref().err().into_iter().flatten().cloned());
        list
    })?;
    let own = own?;
    let Some((model, assembly)) = own.as_ref().or(base) else {
        return Err(Vec::new());
    };
    let setting = Setting {
        name,
        model,
        assembly,
        control: &Unattended,
    };
    let mut faults = analysis::check(analysis.as_ref(), &setting);
    if let Some(plot) = texts.plot.as_ref().filter(|_| faults.is_empty()) {
        faults = plotting::check(plot, &analysis.tables(&setting), &assembly.connections);
    }
    let measured = measured::read(node, &path);
    if let (true, Ok(measured)) = (faults.is_empty(), &measured) {
        let measured = measured.clone();
        return Ok(Run {
            measured,
            name: name.to_string(),
            kind,
            texts,
            analysis,
            own,
        });
    }
    let mut list = diagnostics(root, name, faults);
    list.extend(measured.err().into_iter().flatten());
    Err(list)
}

/// Faults of an analysis with their paths and places.
pub(super) fn diagnostics(
    root: &Node,
    name: &str,
    faults: Vec<analysis::Fault>,
) -> Vec<Diagnostic> {
    let path = yaml::join("analyses", name);
    let diagnostic = |fault: analysis::Fault| Diagnostic {
        location: None,
        path: match fault.key.as_str() {
            "" => path.clone(),
            key => yaml::join(&path, key),
        },
        message: fault.message,
        help: None,
    };
    located(root, faults.into_iter().map(diagnostic).collect())
}

/// The model with the analysis's own `set:`, if it has one.
fn own_model(root: &Node, node: &Node, path: &str) -> Result<Option<Built>, Vec<Diagnostic>> {
    let Some(set) = node.get("set").filter(|set| !set.is_null()) else {
        return Ok(None);
    };
    let path = yaml::join(path, "set");
    let map = set.as_map(&path).map_err(|d| vec![d])?;
    let mut changed = root.clone();
    let mut faults = Vec::new();
    for (target, entry) in map {
        if let Err(mut fault) = changed.set(target, entry.node.clone()) {
            fault.location = entry.key_location.clone();
            faults.push(fault);
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    build(&changed).map(Some)
}

type ReadStudy = (Texts, String, Box<dyn Analysis>);

fn read_analysis(node: &Node, path: &str) -> Result<ReadStudy, Vec<Diagnostic>> {
    let parts = analysis::read::parts(node, path).map_err(|d| vec![d])?;
    let texts = parts.common.read::<Texts>(path);
    let analysis = parts.own.read::<Box<dyn Analysis>>(path);
    match (texts, analysis) {
        (Ok(texts), Ok(analysis)) => Ok((texts, parts.kind, analysis)),
        (texts, analysis) => Err(texts.err().into_iter().chain(analysis.err()).collect()),
    }
}

/// The same error, found in the model and again under an analysis's settings, is reported once.
pub(super) fn without_repetition(list: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut kept: Vec<Diagnostic> = Vec::new();
    for diagnostic in list {
        if !kept.contains(&diagnostic) {
            kept.push(diagnostic);
        }
    }
    kept
}

/// Control of checks, where nothing runs.
pub(super) struct Unattended;

impl Control for Unattended {}
