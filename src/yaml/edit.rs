//! Changing a tree: overlays (`extends`), overrides (`--set`), and the check for unknown keys.

use super::{Entry, Node, Value, did_you_mean, join, parse};
use crate::error::{Diagnostic, Location, Source};
use indexmap::IndexMap;
use std::sync::Arc;

/// Why a path leads nowhere: index of the step, what is wrong with it, next step.
struct Astray {
    step: usize,
    message: String,
    help: Option<String>,
}

impl Node {
    /// Sets the value at a dotted path; list entries by index.
    ///
    /// All steps but the last must exist (an empty value counts as an empty map). A last step that a map does not have is
    /// added, so that defaults can be changed; the check of the schema refuses keys it does not know. A null value removes
    /// the entry of a map.
    ///
    /// # Errors
    /// When the path leads nowhere; the diagnostic carries the place of the value.
    pub fn set(&mut self, path: &str, value: Node) -> Result<(), Diagnostic> {
        let location = value.location.clone();
        self.put(path, value.into()).map_err(|astray| Diagnostic {
            location,
            path: path.to_owned(),
            message: astray.message,
            help: astray.help,
        })
    }

    fn put(&mut self, path: &str, entry: Entry) -> Result<(), Astray> {
        let steps: Vec<&str> = path.split('.').collect();
        let mut node = self;
        for (index, step) in steps[..steps.len() - 1].iter().enumerate() {
            node = node.step(step, &steps[..index]).map_err(|mut astray| {
                astray.step = index;
                astray
            })?;
        }
        let last = steps.len() - 1;
        node.put_last(steps[last], &steps[..last], entry)
            .map_err(|mut astray| {
                astray.step = last;
                astray
            })
    }

    fn step(&mut self, step: &str, before: &[&str]) -> Result<&mut Node, Astray> {
        self.check_step(step, before)?;
        let found = match &mut self.value {
            Value::List(list) => list_index(step).and_then(|i| list.get_mut(i)),
            Value::Map(map) => map.get_mut(step).map(|entry| &mut entry.node),
            Value::Scalar { .. } => None,
        };
        // check_step has said why in every case that leads here.
        found.ok_or_else(|| astray(format!("`{step}` does not exist")))
    }

    fn check_step(&self, step: &str, before: &[&str]) -> Result<(), Astray> {
        let parent = match before {
            [] => "the document".to_owned(),
            steps => format!("`{}`", steps.join(".")),
        };
        match &self.value {
            Value::List(list) => match list_index(step) {
                Some(i) if i < list.len() => Ok(()),
                _ => Err(astray(format!(
                    "{parent} is a list of {}; `{step}` is not an index from 0 to {}",
                    list.len(),
                    list.len().saturating_sub(1)
                ))),
            },
            Value::Map(map) if map.contains_key(step) => Ok(()),
            Value::Map(map) => Err(Astray {
                help: Some(did_you_mean(step, map.keys())),
                ..astray(format!("{parent} has no entry `{step}`"))
            }),
            Value::Scalar { .. } => Err(astray(format!(
                "{parent} is {}, which has no entry `{step}`",
                self.describe()
            ))),
        }
    }

    fn put_last(&mut self, step: &str, before: &[&str], entry: Entry) -> Result<(), Astray> {
        if step.is_empty() {
            return Err(astray("the path has an empty step".to_owned()));
        }
        if self.is_null() {
            self.value = Value::Map(IndexMap::new());
        }
        match &mut self.value {
            Value::Map(map) if entry.node.is_null() => {
                // Removing what is not there must not pass silently; the null stays, and the schema check judges the key.
                if map.shift_remove(step).is_none() {
                    map.insert(step.to_owned(), entry);
                }
                Ok(())
            }
            Value::Map(map) => {
                map.insert(step.to_owned(), entry);
                Ok(())
            }
            _ => self.step(step, before).map(|node| *node = entry.node),
        }
    }

    /// Lays `over` upon this node: maps merge, anything else is replaced, null removes the entry that is there.
    pub(super) fn overlay(&mut self, over: Node) {
        match (&mut self.value, over.value) {
            (Value::Map(base), Value::Map(over)) => overlay_map(base, over),
            (base, value) => {
                *base = value;
                self.location = over.location;
            }
        }
    }
}

fn overlay_map(base: &mut IndexMap<String, Entry>, over: IndexMap<String, Entry>) {
    for (key, entry) in over {
        match base.get_mut(&key) {
            Some(_) if entry.node.is_null() => drop(base.shift_remove(&key)),
            Some(old) => {
                old.key_location = entry.key_location;
                old.node.overlay(entry.node);
            }
            None => drop(base.insert(key, entry)),
        }
    }
}

fn astray(message: String) -> Astray {
    Astray {
        step: 0,
        message,
        help: None,
    }
}

/// The index given by a step of a path: digits only.
pub(super) fn list_index(step: &str) -> Option<usize> {
    let digits = step.bytes().all(|b| b.is_ascii_digit());
    digits.then(|| step.parse().ok()).flatten()
}

/// Applies `PATH=VALUE`; VALUE is read as YAML. Places are in a source called `--set` that holds the assignment.
///
/// # Errors
/// When there is no `=`, VALUE is no YAML, or the path leads nowhere (see [`Node::set`]).
pub fn apply_override(root: &mut Node, assignment: &str) -> Result<(), Diagnostic> {
    let source = Arc::new(Source {
        name: "--set".to_owned(),
        text: assignment.to_owned(),
    });
    apply_from(root, &source)
}

/// The same for a source that holds the assignment.
pub(super) fn apply_from(root: &mut Node, source: &Arc<Source>) -> Result<(), Diagnostic> {
    let mistake = |byte: usize, path: &str, message: String| Diagnostic {
        location: Some(Location {
            source: Arc::clone(source),
            line: 1,
            column: source.text[..byte].chars().count() + 1,
        }),
        path: path.to_owned(),
        message,
        help: None,
    };
    let Some((path, value)) = source.text.split_once('=') else {
        let message = "found no `=`, wanted PATH=VALUE".to_owned();
        return Err(mistake(0, "", message)
            .with_help("such as `--set connections.mesh_1.element.half_gap=\"5 um\"`"));
    };
    let start = path.len() + 1;
    let (path, indent) = (path.trim(), path.len() - path.trim_start().len());
    if value.trim().is_empty() {
        let message = "found no value after `=`".to_owned();
        return Err(mistake(start, path, message).with_help("write `null` to remove an entry"));
    }
    let value = parse::compose(source, start, &mut 0).map_err(|list| {
        let mut first = list
            .into_iter()
            .next()
            .unwrap_or_else(|| mistake(start, path, "not valid YAML".to_owned()));
        path.clone_into(&mut first.path);
        first
    })?;
    let key_location = mistake(indent, path, String::new()).location;
    let entry = Entry {
        key_location,
        node: value,
    };
    root.put(path, entry).map_err(|astray| {
        let before: usize = path.split('.').take(astray.step).map(|s| s.len() + 1).sum();
        Diagnostic {
            help: astray.help,
            ..mistake(indent + before, path, astray.message)
        }
    })
}

/// Help for a key that is the rest of a number.
const DECIMAL_COMMA: &str = "a comma ends the value: write decimals with a point, such as 1.5";

/// An error for each key of a map that is not among the known ones; `path` is the dotted path of the map.
pub fn unknown_keys(map: &IndexMap<String, Entry>, known: &[&str], path: &str) -> Vec<Diagnostic> {
    map.iter()
        .filter(|(key, _)| !known.contains(&key.as_str()))
        .map(|(key, entry)| {
            let message = format!("unknown key `{}`", super::read::cropped(key));
            let help = if key.starts_with(|c: char| c.is_ascii_digit()) {
                DECIMAL_COMMA.to_owned()
            } else {
                did_you_mean(key, known.iter().copied())
            };
            Diagnostic::at_key(entry, &join(path, key), message).with_help(help)
        })
        .collect()
}
