//! Documents as trees of nodes with places: reading, merging, overriding, deserialising.
//!
//! A derive on the whole file would stop at the first error and lose positions inside laws. The loader therefore keeps
//! the raw scalars and their places, and the model reads each body, connection and law from its own node, collecting
//! the errors. Scalars keep their text, so that `y`, `no` and `N` are names and `4e-05` is a number when the reader wants one.

mod edit;
mod load;
mod parse;
mod read;
pub mod scalar;

pub use crate::error::{did_you_mean, nearest};
pub use edit::{apply_override, unknown_keys};
pub use load::{Document, load};

pub use parse::{MAX_TEXT, parse};

use crate::error::{Diagnostic, Location};
use indexmap::IndexMap;

/// A value of a document with its place in the text.
#[derive(Debug, Clone)]
pub struct Node {
    /// The value.
    pub value: Value,
    /// Its place in the file; `None` if it was made by a program.
    pub location: Option<Location>,
}

/// Kinds of values. Maps keep their order.
#[derive(Debug, Clone)]
pub enum Value {
    /// A scalar as written; `plain` when it was not quoted, so that it may be null or a boolean.
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
    /// Place of the key.
    pub key_location: Option<Location>,
    /// The value.
    pub node: Node,
}

impl From<Node> for Entry {
    fn from(node: Node) -> Self {
        Entry {
            key_location: None,
            node,
        }
    }
}

/// Nothing (null).
impl Default for Node {
    fn default() -> Self {
        Node::scalar("")
    }
}

impl From<Value> for Node {
    fn from(value: Value) -> Self {
        Node {
            value,
            location: None,
        }
    }
}

impl Node {
    /// A scalar as if written without quotes, without a place.
    pub fn scalar(text: impl Into<String>) -> Node {
        Value::Scalar {
            text: text.into(),
            plain: true,
        }
        .into()
    }

    /// A scalar as if written in quotes, without a place.
    pub(crate) fn quoted(text: impl Into<String>) -> Node {
        Value::Scalar {
            text: text.into(),
            plain: false,
        }
        .into()
    }

    /// A number, written so that it reads back exactly.
    pub fn number(value: f64) -> Node {
        Node::scalar(if value.is_nan() {
            ".nan".to_owned()
        } else if value.is_infinite() {
            if value > 0.0 { ".inf" } else { "-.inf" }.to_owned()
        } else {
            format!("{value:?}")
        })
    }

    /// A list, without a place.
    pub fn list(nodes: impl IntoIterator<Item = Node>) -> Node {
        Value::List(nodes.into_iter().collect()).into()
    }

    /// A map, without places.
    pub fn map<K: Into<String>>(entries: impl IntoIterator<Item = (K, Node)>) -> Node {
        let entries = entries.into_iter().map(|(k, n)| (k.into(), n.into()));
        Value::Map(entries.collect()).into()
    }

    /// The same values without places; JSON strings become quoted scalars.
    pub fn from_json(json: &serde_json::Value) -> Node {
        use serde_json::Value as Json;
        match json {
            Json::Null => Node::scalar("null"),
            Json::Bool(b) => Node::scalar(b.to_string()),
            Json::Number(n) => Node::scalar(n.to_string()),
            Json::String(s) => Node::quoted(s.as_str()),
            Json::Array(list) => Node::list(list.iter().map(Node::from_json)),
            Json::Object(map) => {
                Node::map(map.iter().map(|(k, v)| (k.as_str(), Node::from_json(v))))
            }
        }
    }

    /// The values as JSON: unquoted scalars become null, booleans or (finite) numbers where they look like them.
    pub fn to_json(&self) -> serde_json::Value {
        use serde_json::Value as Json;
        match &self.value {
            Value::List(list) => Json::Array(list.iter().map(Node::to_json).collect()),
            Value::Map(map) => Json::Object(
                map.iter()
                    .map(|(key, entry)| (key.clone(), entry.node.to_json()))
                    .collect(),
            ),
            Value::Scalar { text, plain: false } => Json::String(text.clone()),
            Value::Scalar { text, .. } if scalar::is_null(text) => Json::Null,
            Value::Scalar { text, .. } => match (scalar::boolean(text), scalar::number(text)) {
                (Some(b), _) => Json::Bool(b),
                (_, Some(scalar::WrittenNumber::Unsigned(n))) => Json::from(n),
                (_, Some(scalar::WrittenNumber::Signed(n))) => Json::from(n),
                (_, Some(scalar::WrittenNumber::Float(x))) if x.is_finite() => Json::from(x),
                _ => Json::String(text.clone()),
            },
        }
    }

    /// Whether this is an unquoted null or an empty value.
    pub fn is_null(&self) -> bool {
        matches!(&self.value, Value::Scalar { text, plain: true } if scalar::is_null(text))
    }

    /// Description of the value for messages: ``the text `abc` ``, `a list`.
    pub fn describe(&self) -> String {
        match &self.value {
            Value::List(_) => "a list".to_owned(),
            Value::Map(_) => "a map".to_owned(),
            Value::Scalar { .. } if self.is_null() => "nothing (null)".to_owned(),
            Value::Scalar { text, plain: true }
                if scalar::boolean(text).is_some() || scalar::number(text).is_some() =>
            {
                read::cropped(text)
            }
            Value::Scalar { text, .. } => format!("the text `{}`", read::cropped(text)),
        }
    }

    /// The entries of a map.
    ///
    /// # Errors
    /// When it is not a map; `path` is the dotted path of this node.
    pub fn as_map(&self, path: &str) -> Result<&IndexMap<String, Entry>, Diagnostic> {
        match &self.value {
            Value::Map(map) => Ok(map),
            _ => Err(self.wanted(path, "a map")),
        }
    }

    /// The entries of a list.
    ///
    /// # Errors
    /// When it is not a list; `path` is the dotted path of this node.
    pub(crate) fn as_list(&self, path: &str) -> Result<&[Node], Diagnostic> {
        match &self.value {
            Value::List(list) => Ok(list),
            _ => Err(self.wanted(path, "a list")),
        }
    }

    /// The text of a scalar, quoted or not; numbers and booleans are text as well, null is not.
    ///
    /// # Errors
    /// When it is a list, a map or null; `path` is the dotted path of this node.
    pub fn as_text(&self, path: &str) -> Result<&str, Diagnostic> {
        match &self.value {
            Value::Scalar { text, .. } if !self.is_null() => Ok(text),
            _ => Err(self.wanted(path, "text")),
        }
    }

    /// The value of a key; `None` when this is not a map or has no such key.
    pub fn get(&self, key: &str) -> Option<&Node> {
        match &self.value {
            Value::Map(map) => map.get(key).map(|entry| &entry.node),
            _ => None,
        }
    }

    /// The node at a dotted path, such as `loads.A.harmonics.0`; list entries by index. The empty path is this node. Keys
    /// that are paths themselves, as those of `set:`, are found too.
    pub fn at(&self, path: &str) -> Option<&Node> {
        if path.is_empty() {
            return Some(self);
        }
        let dots = path.match_indices('.').map(|(dot, _)| dot);
        let mut ends = dots.chain([path.len()]);
        let rest = |end: usize| path.get(end + 1..).unwrap_or_default();
        match &self.value {
            Value::Scalar { .. } => None,
            Value::List(list) => {
                let end = ends.next()?;
                list.get(edit::list_index(&path[..end])?)?.at(rest(end))
            }
            Value::Map(map) => ends.find_map(|end| map.get(&path[..end])?.node.at(rest(end))),
        }
    }

    fn wanted(&self, path: &str, wanted: &str) -> Diagnostic {
        Diagnostic::at(
            self,
            path,
            format!("found {}, wanted {wanted}", self.describe()),
        )
    }
}

impl Diagnostic {
    /// An error at a node.
    pub fn at(node: &Node, path: &str, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            location: node.location.clone(),
            path: path.to_owned(),
            message: message.into(),
            help: None,
        }
    }

    /// An error at the key of an entry; at its value when the key has no place.
    pub fn at_key(entry: &Entry, path: &str, message: impl Into<String>) -> Diagnostic {
        let mut diagnostic = Diagnostic::at(&entry.node, path, message);
        if entry.key_location.is_some() {
            diagnostic.location.clone_from(&entry.key_location);
        }
        diagnostic
    }

    /// Adds the next step for the user.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help = Some(help.into());
        self
    }
}

/// The dotted path of an entry: `path.key`, or `key` at the top.
pub fn join(path: &str, key: impl std::fmt::Display) -> String {
    if path.is_empty() {
        key.to_string()
    } else {
        format!("{path}.{key}")
    }
}
