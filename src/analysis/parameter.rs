//! A parameter of the model that an analysis varies: the excitation frequency, or a number of the model file by its dotted
//! path. The document is read and assembled again with that number changed; the scales stay those of the model as written.

use super::Setting;
use crate::assembly::{Assembly, Scales, assemble};
use crate::error::Diagnostic;
use crate::model::{self, FrequencyScale, Model, Structure};
use crate::quantity::Quantity;
use crate::system::System;
use crate::yaml::Node;

/// What is varied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Parameter {
    /// The excitation frequency.
    Frequency,
    /// The number at a full dotted path of the document.
    Path(String),
}

/// Parts of a document that hold numbers of the mechanics.
const ROOTS: [&str; 5] = ["bodies", "connections", "damping", "loads", "reduced"];

impl Parameter {
    /// The parameter that a user names: `frequency`, a dotted path as for `--set`, or a short form of one: some of its steps in
    /// their order, the last one included, such as `mesh_2.half_gap`.
    ///
    /// # Errors
    /// A name that is no path of the model, or a short form of several.
    pub fn find(setting: &Setting<'_>, written: &str) -> Result<Parameter, String> {
        if written == "frequency" {
            return Ok(Parameter::Frequency);
        }
        setting.model.path_of(written).map(Parameter::Path)
    }

    /// A value of the parameter: omega/omega_c, or SI base units (nondimensional for reduced models).
    ///
    /// # Errors
    /// A frequency without or with a wrong unit.
    pub fn value(&self, setting: &Setting<'_>, written: &Quantity) -> Result<f64, String> {
        match self {
            Parameter::Frequency => setting.frequency(written),
            Parameter::Path(_) => Ok(written.value),
        }
    }

    /// Unit of the reported values, and the factor to them. `written`: one of the values in the model file.
    pub fn reported(&self, setting: &Setting<'_>, written: &Quantity) -> (String, f64) {
        match self {
            Parameter::Frequency if setting.is_si() => {
                ("rad/s".into(), setting.assembly.scales.frequency)
            }
            Parameter::Frequency => (String::new(), 1.0),
            Parameter::Path(_) => (written.dimension.map_or(String::new(), |d| d.unit()), 1.0),
        }
    }

    /// The system at a value, its excitation frequency `at` omega_c where that is not the parameter itself.
    ///
    /// # Errors
    /// A value that the model refuses.
    pub fn system(
        &self,
        setting: &Setting<'_>,
        value: f64,
        at: f64,
    ) -> Result<System, Vec<Diagnostic>> {
        match self {
            Parameter::Frequency => {
                let mut system = setting.assembly.system.clone();
                system.set_reference_frequency(value);
                Ok(system)
            }
            Parameter::Path(path) => {
                let mut system = rebuilt(setting, path, Node::number(value))?;
                system.set_reference_frequency(at);
                Ok(system)
            }
        }
    }

    /// Whether the model takes the value as it is written, unit included.
    ///
    /// # Errors
    /// What the model says about it.
    pub fn check(&self, setting: &Setting<'_>, written: &Quantity) -> Result<(), String> {
        let Parameter::Path(path) = self else {
            return setting.frequency(written).map(|_| ());
        };
        let node = match written.dimension {
            None => Node::number(written.value),
            Some(_) => Node::quoted(written.text.as_str()),
        };
        let refused = |list: Vec<Diagnostic>| joined(&list);
        rebuilt(setting, path, node).map(|_| ()).map_err(refused)
    }
}

/// Several mistakes in one text.
pub(super) fn joined(list: &[Diagnostic]) -> String {
    let texts: Vec<String> = list.iter().map(said).collect();
    texts.join("; ")
}

/// A mistake without its place in the file, which is that of the model and not of the analysis.
pub(super) fn said(mistake: &Diagnostic) -> String {
    let mut text = mistake.message.clone();
    if !mistake.path.is_empty() {
        text = format!("{}: {text}", mistake.path);
    }
    match &mistake.help {
        Some(help) => format!("{text}; {help}"),
        None => text,
    }
}

/// The model with one number of the document changed and everything else, its scales too, as written.
pub struct Variation<'a> {
    setting: &'a Setting<'a>,
    /// The mechanics of the document.
    root: Node,
    path: &'a str,
}

impl<'a> Variation<'a> {
    /// The model of a setting, to be varied at a full dotted path.
    pub fn new(setting: &'a Setting<'a>, path: &'a str) -> Variation<'a> {
        let kept = [
            "schema",
            "name",
            "report",
            "scaling",
            "reference",
            "balance",
        ];
        let kept = kept.into_iter().chain(ROOTS);
        let parts = kept.filter_map(|key| Some((key, setting.model.document().get(key)?.clone())));
        Variation {
            setting,
            root: Node::map(parts),
            path,
        }
    }

    /// The model with this value and its assembly.
    ///
    /// # Errors
    /// What the model says about it.
    pub fn at(&mut self, value: Node) -> Result<(Model, Assembly), Vec<Diagnostic>> {
        self.root.set(self.path, value).map_err(|d| vec![d])?;
        rebuild(&self.root, self.setting.assembly)
    }
}

/// The system with one number of the document changed and the scales frozen.
fn rebuilt(setting: &Setting<'_>, path: &str, value: Node) -> Result<System, Vec<Diagnostic>> {
    let (_, assembly) = Variation::new(setting, path).at(value)?;
    Ok(assembly.system)
}

/// The model of a changed document and its assembly, with the scales and relative coordinates of the unchanged one.
///
/// # Errors
/// What the model refuses, and a change of the relative coordinates.
pub(super) fn rebuild(
    root: &Node,
    unchanged: &Assembly,
) -> Result<(Model, Assembly), Vec<Diagnostic>> {
    let mut model = model::read(root)?;
    freeze(&mut model, &unchanged.scales);
    let assembly = assemble(&model)?;
    if assembly.coordinates != unchanged.coordinates {
        return Err(vec![Diagnostic {
            location: None,
            path: String::new(),
            message: format!(
                "the relative coordinates change from ({}) to ({})",
                unchanged.coordinates.join(", "),
                assembly.coordinates.join(", ")
            ),
            help: Some("vary something that keeps the topology".into()),
        }]);
    }
    Ok((model, assembly))
}

/// Characteristic frequency and displacements as given, whatever the model would choose.
fn freeze(model: &mut Model, scales: &Scales) {
    if let Structure::Train(train) = &mut model.structure {
        train.scaling.frequency = FrequencyScale::Value(scales.frequency);
        for (connection, l) in train.connections.values_mut().zip(&scales.displacement) {
            connection.length = Some(*l);
        }
    }
}
