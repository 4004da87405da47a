//! An analysis as written in a document.

use super::TYPES;
use crate::error::{Diagnostic, did_you_mean};
use crate::yaml::{Node, Value, join};
use indexmap::IndexMap;

/// Keys that every analysis takes besides its own.
pub const COMMON_KEYS: [&str; 6] = ["set", "title", "caption", "assumed", "plot", "compare"];

/// The parts of an entry: [`Node::read`] makes a `Box<dyn Analysis>` of `own`.
#[derive(Debug, Clone)]
pub struct Parts {
    /// Type of the analysis.
    pub kind: String,
    /// The common keys but `set`.
    pub common: Node,
    /// All other keys, the type included.
    pub own: Node,
}

/// Divides the entry of an analysis; `path` is the dotted path of the node.
///
/// # Errors
/// Not a map, no type, or an unknown one.
pub fn parts(node: &Node, path: &str) -> Result<Parts, Diagnostic> {
    let map = node.as_map(path)?;
    let Some(kind) = map.get("type") else {
        let known: Vec<&str> = TYPES.iter().map(|t| t.0).collect();
        let help = format!("one of {}", known.join(", "));
        return Err(Diagnostic::at(node, path, "an analysis needs a `type`").with_help(help));
    };
    let type_path = join(path, "type");
    let word = kind.node.as_text(&type_path)?;
    if !TYPES.iter().any(|t| t.0 == word) {
        let message = format!("no analysis type is called `{word}`");
        let help = did_you_mean(word, TYPES.iter().map(|t| t.0));
        return Err(Diagnostic::at(&kind.node, &type_path, message).with_help(help));
    }
    let (mut common, mut own) = (IndexMap::new(), IndexMap::new());
    for (key, entry) in map.iter().filter(|(key, _)| *key != "set") {
        let part = if COMMON_KEYS.contains(&key.as_str()) {
            &mut common
        } else {
            &mut own
        };
        part.insert(key.clone(), entry.clone());
    }
    let with = |map| Node {
        value: Value::Map(map),
        location: node.location.clone(),
    };
    Ok(Parts {
        kind: word.to_string(),
        common: with(common),
        own: with(own),
    })
}
