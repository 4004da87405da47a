//! Names of numbers: dotted paths, their short forms, and what the reader knows about the number at each.

use super::Model;
use super::fields::{FoundNumber, Mistakes};
use super::read::interpret;
use crate::element::{ParameterKind, find};
use crate::error::{did_you_mean, nearest};
use crate::quantity::Quantity;
use crate::yaml::{Node, Value, join};
use indexmap::IndexMap;

/// Parts of a document that hold numbers of the mechanics.
const ROOTS: [&str; 8] = [
    "bodies",
    "connections",
    "damping",
    "loads",
    "matrices",
    "reduced",
    "reference",
    "scaling",
];
/// Paths that an ambiguous short form lists.
const SHOWN: usize = 4;

impl Model {
    /// Full dotted path of a name: a path as for `--set`, or a short form of one: some of its steps in their order, the
    /// last one included, such as `mesh_2.half_gap`.
    ///
    /// # Errors
    /// A name that is not a path of the model, with the nearest one, or a short form of several.
    pub(crate) fn path_of(&self, written: &str) -> Result<String, String> {
        let steps: Vec<&str> = written.split('.').collect();
        // A reduced model has its own `damping` and `loads`: there these are short forms.
        if ROOTS.contains(&steps[0]) && self.document.get(steps[0]).is_some() {
            return Ok(written.into());
        }
        let mut known = Vec::new();
        for root in ROOTS {
            if let Some(node) = self.document.get(root) {
                leaves(node, root.into(), &mut known);
            }
        }
        let fits: Vec<&String> = known.iter().filter(|path| is_short(&steps, path)).collect();
        match fits.as_slice() {
            [one] => Ok((*one).clone()),
            [] => self.unwritten(&steps).ok_or_else(|| {
                // Whoever writes a short form means a short form.
                let short: Vec<String> = known.iter().map(|path| shortened(path)).collect();
                let hint = match nearest(written, &short) {
                    Some(name) => format!("did you mean `{name}`?"),
                    None => did_you_mean(written, &known),
                };
                format!("`{written}` is neither `frequency` nor a path of the model; {hint}")
            }),
            several => {
                let shown: Vec<&str> = several.iter().take(SHOWN).map(|p| p.as_str()).collect();
                Err(format!(
                    "`{written}` could be any of {} numbers of the model ({}{}); write the path in full",
                    several.len(),
                    shown.join(", "),
                    if several.len() > SHOWN { ", .." } else { "" }
                ))
            }
        }
    }

    /// What the reader knows of every written number, by path, in the order of reading.
    pub(super) fn written_numbers(&self) -> IndexMap<String, FoundNumber> {
        let mut numbers = recorded(&self.document);
        numbers.retain(|path, _| self.document.at(path).is_some());
        numbers
    }

    /// Numbers that have a default and are not written: damping and parameters of laws.
    pub(super) fn default_numbers(&self) -> IndexMap<String, FoundNumber> {
        let mut document = self.document.as_ref().clone();
        let mut added = Vec::new();
        for (path, value) in self.defaults() {
            if document.at(&path).is_none() && document.set(&path, Node::scalar(value)).is_ok() {
                added.push(path);
            }
        }
        let mut numbers = recorded(&document);
        let found = |path: String| numbers.shift_remove(&path).map(|found| (path, found));
        added.into_iter().filter_map(found).collect()
    }

    /// What the reader knows of one number, written or not.
    pub(super) fn number_at(&self, path: &str) -> Option<FoundNumber> {
        if self.document.at(path).is_some() {
            return recorded(&self.document).swap_remove(path);
        }
        let default = self.defaults().into_iter().find(|(known, _)| known == path);
        let mut document = self.document.as_ref().clone();
        let value = default.map_or("0", |(_, value)| value);
        document.set(path, Node::scalar(value)).ok()?;
        recorded(&document).swap_remove(path)
    }

    /// Paths of numbers with a default and the default as it would be written.
    fn defaults(&self) -> Vec<(String, &'static str)> {
        let mut list = Vec::new();
        for root in ["connections", "reduced.elements"] {
            let map = self.document.at(root).and_then(|node| node.as_map("").ok());
            for (name, entry) in map.into_iter().flatten() {
                let own = join(root, name);
                let (path, law) = match root {
                    "connections" => {
                        list.push((join(&own, "damping"), "0"));
                        (join(&own, "element"), entry.node.get("element"))
                    }
                    _ => (own, Some(&entry.node)),
                };
                let tag = law.and_then(|law| law.get("type")?.as_text("").ok());
                let parameters = tag.and_then(find).map_or(&[][..], |info| info.parameters);
                let numbers = parameters
                    .iter()
                    .filter(|p| p.kind == ParameterKind::Number);
                list.extend(numbers.filter_map(|p| Some((join(&path, p.name), p.default?))));
            }
        }
        list
    }

    /// Full path of a number that the document does not write, such as `mesh_1.impact_damping`: the first place of that name
    /// that the model takes a number in.
    fn unwritten(&self, steps: &[&str]) -> Option<String> {
        let (first, rest) = steps.split_first()?;
        let rest = rest.join(".");
        [
            format!("connections.{first}.element.{rest}"),
            format!("connections.{first}.{rest}"),
            format!("reduced.elements.{first}.{rest}"),
        ]
        .into_iter()
        .find(|path| !rest.is_empty() && self.number_at(path).is_some())
    }
}

/// The numbers that the reader meets in a document, right or wrong.
fn recorded(document: &Node) -> IndexMap<String, FoundNumber> {
    let mut mistakes = Mistakes::with_numbers();
    interpret(document, &mut mistakes);
    let mut numbers = IndexMap::new();
    for (path, mut found) in mistakes.take_numbers() {
        let path = match written_once(&path) {
            Some(one) if document.at(&path).is_none() && document.at(&one).is_some() => one,
            _ => path,
        };
        // The reader may have made something else of what is written.
        let written = document
            .at(&path)
            .and_then(|node| Quantity::from_node(node, &path).ok());
        found.value = written.map_or(found.value, |quantity| quantity.value);
        numbers.entry(path).or_insert(found);
    }
    numbers
}

/// The path of a number of one of several planets, `bodies.planet_2.inertia`, in the document, which has it once.
fn written_once(path: &str) -> Option<String> {
    let mut steps: Vec<&str> = path.split('.').collect();
    let (name, copy) = steps.get(1)?.rsplit_once('_')?;
    copy.parse::<usize>().ok()?;
    steps[1] = name;
    Some(steps.join("."))
}

/// Paths of all scalars below a node.
fn leaves(node: &Node, path: String, out: &mut Vec<String>) {
    match &node.value {
        Value::Scalar { .. } => out.push(path),
        Value::List(list) => {
            for (k, entry) in list.iter().enumerate() {
                leaves(entry, join(&path, k.to_string()), out);
            }
        }
        Value::Map(map) => {
            for (key, entry) in map {
                leaves(&entry.node, join(&path, key), out);
            }
        }
    }
}

/// Whether the steps occur in the path in order, the last one at its end.
fn is_short(steps: &[&str], path: &str) -> bool {
    let mut rest = steps.iter().rev();
    let mut wanted = rest.next();
    for (k, step) in path.rsplit('.').enumerate() {
        if wanted == Some(&step) {
            wanted = rest.next();
        } else if k == 0 {
            return false;
        }
    }
    wanted.is_none()
}

/// Names and keys of a path alone, such as `mesh_2.half_gap`: a short form of it.
fn shortened(path: &str) -> String {
    const UNSAID: [&str; 7] = [
        "bodies",
        "connections",
        "loads",
        "reduced",
        "elements",
        "element",
        "harmonics",
    ];
    let steps: Vec<&str> = path.split('.').collect();
    let last = steps.len() - 1;
    let is_said = |(k, step): &(usize, &&str)| {
        let is_index = step.bytes().all(|b| b.is_ascii_digit());
        *k == last || !(is_index || UNSAID.contains(*step))
    };
    let said = steps.iter().enumerate().filter(is_said);
    said.map(|(_, step)| *step).collect::<Vec<_>>().join(".")
}
