//! Loading YAML; the only file that names the YAML crate.

use crate::error::{Diagnostic, Location};
use indexmap::IndexMap;

/// A value of a document with its place in the text.
#[derive(Debug, Clone)]
pub struct Node {
    /// The value.
    pub value: Value,
    /// Where it stands; `None` when it was made by a program.
    pub location: Option<Location>,
}

/// Kinds of values. Maps keep their order.
#[derive(Debug, Clone)]
pub enum Value {
    /// A scalar as written; `plain` when it was not quoted, so that it may stand for null, a boolean or a number.
    Scalar {
        /// Text without quotes.
        text: String,
        /// Not quoted.
        plain: bool,
    },
    /// A list.
    List(Vec<Node>),
    /// A map with text keys; each key with its own place.
    Map(IndexMap<String, Entry>),
}

/// A value of a map with the place of its key.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Where the key stands.
    pub key_location: Option<Location>,
    /// The value.
    pub node: Node,
}
type _Unused = Diagnostic;
