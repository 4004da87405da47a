//! A model in words and numbers, for the page, for drawings and for comparisons of runs.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Parts of a model as written.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Description {
    /// Name of the model.
    pub name: String,
    /// Bodies in the order of the file; none for reduced models.
    pub bodies: Vec<BodyNote>,
    /// Connections in the order of the file.
    pub connections: Vec<ConnectionNote>,
    /// Every value of the model but those of the analyses, by dotted path.
    pub values: Map<String, Value>,
}

/// A body.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BodyNote {
    /// Name.
    pub name: String,
    /// Inertia with its unit.
    pub inertia: String,
    /// Loads, one text each.
    pub loads: Vec<String>,
    /// Mean speed in rpm, where a reference gives it.
    pub speed_rpm: Option<f64>,
    /// Whether it slides instead of turning.
    pub slides: bool,
}

/// A connection.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ConnectionNote {
    /// Name.
    pub name: String,
    /// Key of its geometry: `gear`, `internal_gear`, `shaft`, ...
    pub kind: String,
    /// Bodies with their lever arms.
    pub arms: Vec<ArmNote>,
    /// Stiffness with its unit; empty where there is none.
    pub stiffness: String,
    /// Tag of the law.
    pub law: String,
    /// Parameters of the law as written.
    pub parameters: String,
    /// Teeth, damping, variation and what else was written.
    pub further: String,
}

/// A body of a connection.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ArmNote {
    /// Name of the body.
    pub body: String,
    /// Lever arm, m (1 for shafts).
    pub length: f64,
}
