//! What the runs of a study do, and where in it a path leads.

use super::ParameterStudy;
use crate::analysis::parameter::{frozen, said};
use crate::analysis::read::{COMMON_KEYS, Parts, parts};
use crate::analysis::{Analysis, Fault, Setting};
use crate::assembly::{Assembly, assemble};
use crate::error::{Diagnostic, did_you_mean};
use crate::model::{Knob, Model};
use crate::yaml::{Node, Value};

/// Destination of a value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Destination {
    /// A number of the model.
    Number(Box<Knob>),
    /// Another part of the model, by its full path: words, and numbers in other units than those of the model.
    Part(String),
    /// A key of the analysis that runs.
    Analysis(String),
}

impl Destination {
    /// Path of the value in the model or, marked as such, in the analysis.
    pub fn path(&self) -> (bool, &str) {
        match self {
            Destination::Number(knob) => (false, knob.name()),
            Destination::Part(path) => (false, path),
            Destination::Analysis(path) => (true, path),
        }
    }
}

/// The analysis of every run, and the model before a run changes it.
#[derive(Debug)]
pub(super) struct Target {
    /// Name in the file; `None` when it is written in place.
    name: Option<String>,
    /// Type.
    pub kind: String,
    /// Its own keys.
    pub own: Node,
    /// The model as written: its scales are those of every run.
    pub model: Model,
    /// The same without analyses, as the runs change it.
    pub varied: Model,
    /// Its assembly.
    pub assembly: Assembly,
}

impl Target {
    /// What `analysis:` means.
    ///
    /// # Errors
    /// An unknown name or type, a study in a study, a `set:` that leads nowhere.
    pub fn new(study: &ParameterStudy, setting: &Setting<'_>) -> Result<Target, Vec<Fault>> {
        let (name, node) = entry(study, setting).map_err(|fault| vec![fault])?;
        let path = "analysis";
        let Parts { kind, common, own } =
            parts(&node, path).map_err(|mistake| faults_of(name.as_deref(), [mistake]))?;
        if kind == "parameter_study" {
            let message = "a study cannot run a study; vary all parameters in one study study";
            return Err(vec![Fault::new(path, message)]);
        }
        if let (None, Value::Map(map)) = (&name, &common.value)
            && let Some(key) = map.keys().next()
        {
            let message = format!("`{key}` belongs to the study: single runs do not show it");
            return Err(vec![Fault::new(format!("{path}.{key}"), message)]);
        }
        let (mut model, mut assembly) = (setting.model.clone(), setting.assembly.clone());
        if let Some(set) = node.get("set").filter(|set| !set.is_null()) {
            // The study's own `set:` is the last word, and has been spoken already.
            let own = format!("analyses.{}.set", setting.name);
            let own = setting.model.document().at(&own);
            let parts = parts_of([Some(set), own].into_iter().flatten())
                .map_err(|mistake| faults_of(name.as_deref(), [mistake]))?;
            (model, assembly) = (setting.model.with_parts(parts))
                .and_then(|model| assemble(&model).map(|assembly| (model, assembly)))
                .map_err(|list| faults_of(name.as_deref(), list))?;
        }
        Ok(Target {
            name,
            kind,
            own,
            varied: frozen(model.mechanics(), &assembly.scales),
            model,
            assembly,
        })
    }

    /// The analysis as the file has it.
    ///
    /// # Errors
    /// Errors in its keys.
    pub fn analysis(&self) -> Result<Box<dyn Analysis>, Vec<Fault>> {
        let read = self.own.read("analysis");
        read.map_err(|mistake| faults_of(self.name.as_deref(), [mistake]))
    }

    /// A fault of the analysis as a fault of the study.
    pub fn fault(&self, fault: &Fault) -> Fault {
        let key = if fault.key.is_empty() {
            "analysis".to_string()
        } else {
            format!("analysis.{}", fault.key)
        };
        let mistake = Diagnostic {
            location: None,
            path: key,
            message: fault.message.clone(),
            help: None,
        };
        fault_of(self.name.as_deref(), &mistake)
    }

    /// Where a path leads that a user names: as for `--set`, a short form of it, `analysis.KEY`, or `frequency` where the
    /// analysis runs at one.
    ///
    /// # Errors
    /// A path that leads nowhere, or a short form of several.
    pub fn place(&self, setting: &Setting<'_>, written: &str) -> Result<Destination, String> {
        let in_place = format!("analyses.{}.analysis.", setting.name);
        let by_name = self.name.as_ref().map(|name| format!("analyses.{name}."));
        let fronts = [Some("analysis.".to_string()), Some(in_place), by_name];
        let key = (fronts.iter().flatten()).find_map(|front| written.strip_prefix(front.as_str()));
        if let Some(key) = key {
            return match key {
                "type" => Err("the type of the analysis cannot vary".into()),
                key if COMMON_KEYS.contains(&key) || key.starts_with("set.") => Err(format!(
                    "`{key}` is not a setting of the analysis; name the path itself"
                )),
                key => Ok(Destination::Analysis(key.into())),
            };
        }
        if written.starts_with("analyses.") {
            return Err("only settings of the analysis that the study runs can vary".into());
        }
        match written {
            "frequency" if self.own.get("at").is_some() => Ok(Destination::Analysis("at".into())),
            "frequency" => Err(format!(
                "`{}` does not run at one frequency; vary its own keys, such as `analysis.from`",
                self.kind
            )),
            _ => setting.model.path_of(written).map(Destination::Part),
        }
    }
}

/// The entry that `analysis:` names or holds.
fn entry(study: &ParameterStudy, setting: &Setting<'_>) -> Result<(Option<String>, Node), Fault> {
    let written = match &study.analysis {
        serde_json::Value::String(name) => name,
        serde_json::Value::Object(_) => return Ok((None, Node::from_json(&study.analysis))),
        other => {
            let message =
                format!("found {other}, wanted the name of an analysis or {{type: .., ..}}");
            return Err(Fault::new("analysis", message));
        }
    };
    let known = setting.model.document().get("analyses");
    match known.and_then(|map| map.get(written)) {
        Some(node) => Ok((Some(written.clone()), node.clone())),
        None => {
            let names = known.and_then(|map| map.as_map("").ok());
            let names: Vec<&String> = (names.into_iter().flat_map(|map| map.keys()))
                .filter(|name| *name != setting.name)
                .collect();
            let hint = did_you_mean(written, names);
            let message = format!("no analysis is called `{written}`; {hint}");
            Err(Fault::new("analysis", message))
        }
    }
}

/// Paths and values of maps, one map after another.
fn parts_of<'n>(maps: impl Iterator<Item = &'n Node>) -> Result<Vec<(String, Node)>, Diagnostic> {
    let mut list = Vec::new();
    for set in maps {
        let map = set.as_map("analysis.set")?.iter();
        list.extend(map.map(|(path, entry)| (path.clone(), entry.node.clone())));
    }
    Ok(list)
}

fn faults_of(name: Option<&str>, list: impl IntoIterator<Item = Diagnostic>) -> Vec<Fault> {
    list.into_iter()
        .map(|mistake| fault_of(name, &mistake))
        .collect()
}

/// An error in the analysis: at its own key when it is written in place, else at the name.
fn fault_of(name: Option<&str>, mistake: &Diagnostic) -> Fault {
    let is_own = mistake.path == "analysis" || mistake.path.starts_with("analysis.");
    match name {
        None if is_own => {
            let message = match &mistake.help {
                Some(help) => format!("{}; {help}", mistake.message),
                None => mistake.message.clone(),
            };
            Fault::new(mistake.path.clone(), message)
        }
        None => Fault::new("analysis", said(mistake)),
        Some(name) => {
            let path = mistake.path.strip_prefix("analysis.").unwrap_or_default();
            let path = if is_own { path } else { &mistake.path };
            let own = Diagnostic {
                path: path.to_string(),
                ..mistake.clone()
            };
            Fault::new("analysis", format!("`{name}`: {}", said(&own)))
        }
    }
}
