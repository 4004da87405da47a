//! Parameters of a study and their values.

use super::place::Destination;
use crate::analysis::{Fault, Link, Setting};
use crate::model::Follower;
use crate::report::{Cell, Column};
use crate::yaml::Node;

/// A parameter of the study.
#[derive(Debug, Clone)]
pub(super) struct StudyParameter {
    /// Destinations of its values.
    pub place: Destination,
    /// Its column: name as written, SI unit, no values.
    pub column: Column,
    /// Unit that its values are written with; `None`: bare numbers.
    pub unit: Option<String>,
    /// Numbers of the model that follow it.
    pub followers: Vec<Follower>,
}

/// A value of a parameter: SI base units where it has a unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Coordinate {
    Number(f64),
    Word(String),
}

impl Coordinate {
    /// As in the table.
    pub fn cell(&self) -> Cell {
        match self {
            Coordinate::Number(value) => Cell::Float(*value),
            Coordinate::Word(word) => Cell::Text(word.clone()),
        }
    }
}

impl StudyParameter {
    /// As in a document.
    pub fn node(&self, value: &Coordinate) -> Node {
        match (value, &self.unit) {
            (Coordinate::Word(word), _) => Node::scalar(word.as_str()),
            (Coordinate::Number(value), None) => Node::number(*value),
            (Coordinate::Number(value), Some(unit)) => Node::quoted(format!("{value:?} {unit}")),
        }
    }
}

/// Gives every parameter the numbers that follow it.
///
/// # Errors
/// What is wrong with the key `link`.
pub(super) fn link(
    directions: &mut [StudyParameter],
    setting: &Setting<'_>,
    link: &Link,
) -> Result<(), Fault> {
    let names = directions.iter().map(|d| d.column.name.clone());
    let names: Vec<String> = names.collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    for direction in directions {
        let path = match &direction.place {
            Destination::Number(knob) => knob.name(),
            Destination::Part(path) => path,
            Destination::Analysis(_) => &direction.column.name,
        };
        let list = link.followers(setting, path, &names);
        let list = list.map_err(|message| Fault::new("link", message))?;
        direction.followers.extend(list);
    }
    Ok(())
}
