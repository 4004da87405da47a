//! Models as values: read from a text, a file or a tree, with numbers that have names.

use super::fields::FoundNumber;
use super::slot::{Affected, Slot};
use super::{Model, matrices, measured, read};
use crate::element::{ParameterRange, Relation};
use crate::error::{Diagnostic, Error};
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::{self, Node};
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// A number of a model, resolved by name once ([`Model::knob`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Knob {
    pub(super) path: String,
    dimension: Option<UnitDimension>,
    has_unit: bool,
    range: ParameterRange,
    /// Value if the model does not state it.
    default: f64,
    /// Its place in the mechanics; `None` if several places depend on it.
    pub(super) slot: Option<Slot>,
    /// Numbers that move with it.
    followers: Vec<Follower>,
}

/// A number that follows another one.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower {
    /// The number.
    pub knob: Knob,
    /// Its value from that of the other one, SI units.
    pub relation: Relation,
}

impl Knob {
    /// Full dotted path, such as `connections.mesh_2.element.half_gap`.
    pub fn name(&self) -> &str {
        &self.path
    }

    /// Numbers that move with it.
    pub fn followers(&self) -> &[Follower] {
        &self.followers
    }

    /// Unit of the value, such as `m`; empty for pure numbers.
    pub fn unit(&self) -> String {
        self.dimension.map_or(String::new(), unit)
    }

    /// Allowed values.
    pub fn range(&self) -> ParameterRange {
        self.range
    }

    /// Whether a value in these units, or without any, is one of the number in its own unit.
    pub(crate) fn takes(&self, dimension: Option<UnitDimension>) -> bool {
        dimension.is_none() || dimension == self.dimension
    }

    /// Parts affected by a change; `None` if the document must be read again.
    pub(crate) fn reach(&self) -> Option<Affected> {
        let own = self.slot.map(Slot::reach)?;
        let mut others = self.followers.iter().map(|follower| follower.knob.reach());
        others.try_fold(own, |all, other| Some(all.max(other?)))
    }

    /// The number with others that follow it wherever it is varied.
    #[must_use]
    pub fn followed_by(mut self, followers: Vec<Follower>) -> Knob {
        self.followers.extend(followers);
        self
    }

    /// The number and all those that move with it, each with its value.
    pub(crate) fn spread(&self, value: f64) -> Vec<(&Knob, f64)> {
        let mut list = vec![(self, value)];
        for Follower { knob, relation } in &self.followers {
            list.extend(knob.spread(relation.value(value)));
        }
        list
    }

    /// The value as the document writes it. The unit stays: it decides what a stiffness or an inertia belongs to.
    pub(crate) fn node(&self, value: f64) -> Node {
        match self.dimension {
            Some(dimension) if self.has_unit => {
                Node::quoted(format!("{value:?} {}", dimension.unit()))
            }
            _ => Node::number(value),
        }
    }
}

/// A number of a model with name, value, unit and range.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct NamedNumber {
    /// Full dotted path.
    pub name: String,
    /// Value in SI units; nondimensional in a reduced model.
    pub value: f64,
    /// Unit of the value; empty for pure numbers.
    pub unit: String,
    /// Allowed values: `any`, `>= 0` or `> 0`.
    pub range: ParameterRange,
    /// Whether the model states it; otherwise it is a default.
    pub is_written: bool,
}

impl NamedNumber {
    fn new((name, found): (String, FoundNumber), is_written: bool) -> NamedNumber {
        NamedNumber {
            name,
            value: found.value,
            unit: found.dimension.map_or(String::new(), unit),
            range: found.range,
            is_written,
        }
    }
}

/// Unit of a dimension; empty for pure numbers.
fn unit(dimension: UnitDimension) -> String {
    match dimension {
        UnitDimension::NUMBER => String::new(),
        other => other.unit(),
    }
}

impl Model {
    /// Model of a YAML text. `extends` requires a file: see [`Model::load`].
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::from_yaml(
    ///     "bodies: {A: {inertia: 1e-3}}
    /// connections: {spring: {ground: A, stiffness: 400 N m/rad}}
    /// loads: {A: {mean: 1}}
    /// analyses: {lines: {type: modes}}",
    /// )?;
    /// assert_eq!(model.analyses(), ["lines"]);
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Input`] with all errors found.
    pub fn from_yaml(text: &str) -> Result<Model, Error> {
        let root = yaml::parse(text, "model.yaml")?;
        read(&root).map_err(Error::Input)
    }

    /// Model of a file and the files that it extends. The default `name` is that of the file.
    ///
    /// # Errors
    /// [`Error::File`] when a file cannot be read; [`Error::Input`] with all errors found.
    pub fn load(path: impl AsRef<Path>) -> Result<Model, Error> {
        let document = yaml::load(path.as_ref(), &[])?;
        let model = read(&document.root).map_err(Error::Input)?;
        Ok(model.called_after(path.as_ref()))
    }

    /// Model of a tree with the keys of a model file. Strings may be quantities: `{"half_gap": "50 um"}`.
    ///
    /// # Errors
    /// [`Error::Input`] with all errors found.
    pub fn from_tree(tree: &serde_json::Value) -> Result<Model, Error> {
        read(&Node::from_json(tree)).map_err(Error::Input)
    }

    /// Tree of the model with the keys of a model file, including analyses. Paths of files with loads are absolute.
    pub fn to_tree(&self) -> serde_json::Value {
        measured::anchored(&self.document).to_json()
    }

    /// Number with a name: a full dotted path, or a short form such as `mesh_2.half_gap`.
    ///
    /// # Errors
    /// [`Error::Input`]: an unknown name, with the nearest valid name; a name that matches several numbers, or not a number.
    pub fn knob(&self, name: &str) -> Result<Knob, Error> {
        let refuse = |message| Error::Input(vec![unknown(name, message)]);
        self.resolve(name).map_err(refuse)
    }

    /// The number of a name, or what is wrong with the name.
    pub(crate) fn resolve(&self, name: &str) -> Result<Knob, String> {
        let path = self.path_of(name)?;
        let Some(found) = self.number_at(&path) else {
            return Err(self.no_number(&path));
        };
        Ok(Knob {
            slot: Slot::of(self, &path, found.value),
            dimension: found.dimension,
            has_unit: found.has_unit,
            range: found.range,
            default: found.value,
            followers: self.twin(&path).into_iter().collect(),
            path,
        })
    }

    /// The entry of a symmetric matrix that is equal to the one at a path.
    fn twin(&self, path: &str) -> Option<Follower> {
        let path = matrices::mirrored(path)?;
        let found = self.number_at(&path)?;
        Some(Follower {
            relation: Relation::new("x").ok()?,
            knob: Knob {
                slot: None,
                dimension: found.dimension,
                has_unit: found.has_unit,
                range: found.range,
                default: found.value,
                followers: Vec::new(),
                path,
            },
        })
    }

    /// Why there is no number at a path, in the words of the reader where it has some.
    fn no_number(&self, path: &str) -> String {
        match self.document.at(path) {
            Some(node) if Quantity::from_node(node, path).is_ok() => {
                format!("{path} cannot be varied continuously: it is a count or an order")
            }
            Some(node) => format!("{path} is {}, wanted the path of a number", node.describe()),
            None => {
                let mut document = self.document.as_ref().clone();
                if let Err(lost) = document.set(path, Node::number(0.0)) {
                    return lost.to_string();
                }
                let refused = read(&document).err().unwrap_or_default();
                let about = refused.into_iter().find(|mistake| mistake.path == path);
                about.map_or_else(
                    || format!("the model has no number called {path}"),
                    |mistake| {
                        Diagnostic {
                            location: None,
                            ..mistake
                        }
                        .to_string()
                    },
                )
            }
        }
    }

    /// Value of a number, in SI units; nondimensional in a reduced model.
    pub fn get(&self, knob: &Knob) -> f64 {
        let written = self.document.at(&knob.path);
        let written = written.and_then(|node| Quantity::from_node(node, &knob.path).ok());
        written.map_or(knob.default, |quantity| quantity.value)
    }

    /// All numbers of the model: stated numbers in the order of reading, then defaults.
    pub fn numbers(&self) -> Vec<NamedNumber> {
        let written = self.written_numbers().into_iter();
        let written = written.map(|entry| NamedNumber::new(entry, true));
        let defaults = self.default_numbers().into_iter();
        written
            .chain(defaults.map(|entry| NamedNumber::new(entry, false)))
            .collect()
    }

    /// Tree from which the model was read.
    pub(crate) fn document(&self) -> &Arc<Node> {
        &self.document
    }

    /// The model, called after its file where it has no name.
    pub(crate) fn called_after(mut self, path: &Path) -> Model {
        if self.name.is_empty() {
            let stem = path.file_stem().unwrap_or_default();
            self.name = stem.to_string_lossy().into_owned();
        }
        self
    }
}

pub(super) fn unknown(name: &str, message: String) -> Diagnostic {
    Diagnostic {
        location: None,
        path: name.to_owned(),
        message,
        help: None,
    }
}
