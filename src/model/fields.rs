//! Reading maps key by key and collecting the errors.

use crate::error::{Diagnostic, did_you_mean};
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::{Entry, Node, Value, join, unknown_keys};
use indexmap::IndexMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(super) use crate::element::ParameterRange as Range;

/// Mistakes kept: more of them say nothing more, and a hostile file has millions.
const KEPT: usize = 1000;

/// Mistakes found so far.
#[derive(Default)]
pub(super) struct Mistakes {
    list: Vec<Diagnostic>,
    /// Mistakes beyond those kept.
    more: usize,
    /// What is allowed but looks like a slip.
    warnings: Vec<String>,
    /// Every number that is read, by path, where somebody wants to know.
    numbers: Option<IndexMap<String, FoundNumber>>,
    /// Tables beside the model file that were read.
    files: Vec<PathBuf>,
    /// Their columns by file and name, for what is read twice.
    tables: Vec<KnownTable>,
}

/// Columns of a file, by name.
struct KnownTable {
    path: PathBuf,
    names: Vec<String>,
    columns: Arc<Vec<Vec<f64>>>,
}

/// A number as the reader found it.
#[derive(Debug, Clone, Copy)]
pub(super) struct FoundNumber {
    /// SI, or nondimensional in a reduced model.
    pub value: f64,
    pub dimension: Option<UnitDimension>,
    /// Whether the unit is written.
    pub has_unit: bool,
    pub range: Range,
}

impl Mistakes {
    /// The value; `None` after adding an error.
    pub(super) fn note<T>(&mut self, result: Result<T, Diagnostic>) -> Option<T> {
        result.map_err(|mistake| self.add(mistake)).ok()
    }

    pub(super) fn add(&mut self, mistake: Diagnostic) {
        if self.list.len() < KEPT {
            self.list.push(mistake);
        } else {
            self.more += 1;
        }
    }

    pub(super) fn count(&self) -> usize {
        self.list.len() + self.more
    }

    /// A reader's notes that keep every number.
    pub(super) fn with_numbers() -> Mistakes {
        Mistakes {
            numbers: Some(IndexMap::new()),
            ..Mistakes::default()
        }
    }

    /// The numbers read so far.
    pub(super) fn take_numbers(&mut self) -> IndexMap<String, FoundNumber> {
        self.numbers.take().unwrap_or_default()
    }

    /// The number of a node; `None` after adding an error.
    pub(super) fn number(
        &mut self,
        node: &Node,
        path: &str,
        measure: NumberMeasure,
        range: Range,
    ) -> Option<f64> {
        let value = self.note(number(node, path, measure, range));
        if let Some(numbers) = &mut self.numbers {
            let written = Quantity::from_node(node, path).ok();
            let unit = written.as_ref().and_then(|quantity| quantity.dimension);
            let found = FoundNumber {
                value: value.or(written.map(|w| w.value)).unwrap_or(f64::NAN),
                dimension: match measure {
                    NumberMeasure::Si(dimension) => Some(dimension),
                    NumberMeasure::AnySi => unit,
                    NumberMeasure::Bare => None,
                },
                has_unit: unit.is_some(),
                range,
            };
            numbers.insert(path.to_owned(), found);
        }
        value
    }

    /// Notes what is allowed but looks like a slip.
    pub(super) fn warn(&mut self, warning: String) {
        if self.warnings.len() < KEPT {
            self.warnings.push(warning);
        }
    }

    /// Notes a table that is part of the model.
    pub(super) fn note_file(&mut self, path: &Path) {
        if !self.files.iter().any(|known| known == path) {
            self.files.push(path.to_owned());
        }
    }

    /// Columns of a table that has been read before.
    pub(super) fn known_table(&self, path: &Path, names: &[&str]) -> Option<Arc<Vec<Vec<f64>>>> {
        let is_it = |known: &&KnownTable| known.path == path && known.names == names;
        Some(self.tables.iter().find(is_it)?.columns.clone())
    }

    /// Keeps the columns of a table.
    pub(super) fn keep_table(
        &mut self,
        path: &Path,
        names: &[&str],
        columns: Vec<Vec<f64>>,
    ) -> Arc<Vec<Vec<f64>>> {
        let columns = Arc::new(columns);
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        self.tables.push(KnownTable {
            path: path.to_owned(),
            names,
            columns: columns.clone(),
        });
        columns
    }

    pub(super) fn take_files(&mut self) -> Vec<PathBuf> {
        std::mem::take(&mut self.files)
    }

    pub(super) fn take_warnings(&mut self) -> Vec<String> {
        let mut list = std::mem::take(&mut self.warnings);
        let mut seen = std::collections::HashSet::new();
        list.retain(|warning| seen.insert(warning.clone()));
        list
    }

    /// The value if there is one and nothing was wrong.
    pub(super) fn conclude<T>(mut self, value: Option<T>) -> Result<T, Vec<Diagnostic>> {
        if self.more > 0 {
            let message = format!("{} mistakes; the first {KEPT} are kept", self.count());
            self.list.push(Diagnostic {
                location: None,
                path: String::new(),
                message,
                help: None,
            });
        }
        match value {
            Some(value) if self.list.is_empty() => Ok(value),
            _ => Err(self.list),
        }
    }
}

/// Dimension of a number.
#[derive(Debug, Clone, Copy)]
pub(super) enum NumberMeasure {
    /// SI units; a quantity with a unit is converted.
    Si(UnitDimension),
    /// SI units of whatever dimension is written.
    AnySi,
    /// A nondimensional number: a unit is an error.
    Bare,
}

/// A finite number of a scalar node.
fn number(
    node: &Node,
    path: &str,
    measure: NumberMeasure,
    range: Range,
) -> Result<f64, Diagnostic> {
    let quantity = Quantity::from_node(node, path)?;
    let value = match measure {
        NumberMeasure::Si(dimension) => quantity
            .si(dimension)
            .map_err(|message| Diagnostic::at(node, path, message))?,
        NumberMeasure::AnySi => quantity.value,
        NumberMeasure::Bare => bare(&quantity).map_err(|message| {
            Diagnostic::at(node, path, message).with_help(
                "reduced systems are nondimensional; use bodies and connections for SI units",
            )
        })?,
    };
    let Some(wanted) = range.refusal(value) else {
        return Ok(value);
    };
    let found: String = quantity.text.chars().take(LONGEST).collect();
    let message = format!("found {found}, must be {wanted}");
    Err(Diagnostic::at(node, path, message))
}

fn bare(quantity: &Quantity) -> Result<f64, String> {
    match quantity.dimension {
        Some(dimension) if dimension != UnitDimension::NUMBER => Err(format!(
            "`{}` has a unit, wanted a bare number",
            quantity.text
        )),
        _ => Ok(quantity.value),
    }
}

/// A whole number of a scalar node, at least 1 and at most `most`.
pub(super) fn count(node: &Node, path: &str, most: usize) -> Result<usize, Diagnostic> {
    let value: Result<u64, Diagnostic> = node.read(path);
    match value.map(usize::try_from) {
        Ok(Ok(value)) if value >= 1 && value <= most => Ok(value),
        _ => Err(Diagnostic::at(
            node,
            path,
            format!(
                "found {}, wanted a whole number from 1 to {most}",
                node.describe()
            ),
        )),
    }
}

/// A map with its path. Empty values (null) count as absent.
pub(super) struct Fields<'n> {
    /// The map's own node.
    pub(super) node: &'n Node,
    /// Its dotted path.
    pub(super) path: String,
    map: &'n IndexMap<String, Entry>,
}

impl<'n> Fields<'n> {
    /// The map of a node, any keys.
    pub(super) fn open(node: &'n Node, path: &str, mistakes: &mut Mistakes) -> Option<Fields<'n>> {
        let map = mistakes.note(node.as_map(path).map_err(|mistake| shaped(mistake, path)))?;
        let path = path.to_owned();
        Some(Fields { node, path, map })
    }

    /// The map of a node; keys that are not known are errors.
    pub(super) fn known(
        node: &'n Node,
        path: &str,
        keys: &[&str],
        mistakes: &mut Mistakes,
    ) -> Option<Fields<'n>> {
        let fields = Fields::open(node, path, mistakes)?;
        for mistake in unknown_keys(fields.map, keys, path) {
            mistakes.add(mistake);
        }
        Some(fields)
    }

    pub(super) fn entries(&self) -> impl Iterator<Item = (&'n str, &'n Entry)> + use<'n> {
        self.map.iter().map(|(key, entry)| (key.as_str(), entry))
    }

    pub(super) fn len(&self) -> usize {
        self.map.len()
    }

    pub(super) fn path_of(&self, key: &str) -> String {
        join(&self.path, key)
    }

    pub(super) fn get(&self, key: &str) -> Option<&'n Node> {
        let node = self.map.get(key).map(|entry| &entry.node);
        node.filter(|node| !node.is_null())
    }

    /// A key that must be there.
    pub(super) fn required(
        &self,
        key: &str,
        wanted: &str,
        mistakes: &mut Mistakes,
    ) -> Option<&'n Node> {
        let found = self.get(key);
        if found.is_none() {
            let message = format!("`{key}` is missing: wanted {wanted}");
            mistakes.add(Diagnostic::at(self.node, &self.path, message));
        }
        found
    }

    /// The number of a key; `None` when it is absent or wrong.
    pub(super) fn number(
        &self,
        key: &str,
        measure: NumberMeasure,
        range: Range,
        mistakes: &mut Mistakes,
    ) -> Option<f64> {
        let node = self.get(key)?;
        mistakes.number(node, &self.path_of(key), measure, range)
    }

    /// The one of several keys that is given; none or more than one is an error.
    pub(super) fn exactly_one(
        &self,
        keys: &[&'static str],
        what: &str,
        mistakes: &mut Mistakes,
    ) -> Option<(&'static str, &'n Node)> {
        let given: Vec<_> = (keys.iter())
            .filter_map(|key| Some((*key, self.get(key)?)))
            .collect();
        if let [one] = given.as_slice() {
            return Some(*one);
        }
        let found = match given.len() {
            0 => "none".to_owned(),
            _ => given.iter().map(|g| g.0).collect::<Vec<_>>().join(" and "),
        };
        let message = format!(
            "{what}: found {found}, wanted exactly one of {}",
            keys.join(", ")
        );
        mistakes.add(Diagnostic::at(self.node, &self.path, message));
        None
    }
}

/// Characters of a number that a message shows.
const LONGEST: usize = 60;

/// Examples for keys whose values are often written in another shape.
const SHAPES: [(&str, &str); 17] = [
    ("element", "{type: backlash, half_gap: 50 um}"),
    ("gear", "{A: 50 mm, B: 40 mm}"),
    ("internal_gear", "{A: 50 mm, B: 80 mm}"),
    ("acts_on", "{A: 0.05, B: -0.04}"),
    (
        "planet_gear",
        "{sun: S, planet: P, carrier: C, teeth: {S: 30, P: 21}, module: 2 mm}",
    ),
    (
        "planet_ring",
        "{ring: R, planet: P, carrier: C, teeth: {R: 72, P: 21}, module: 2 mm}",
    ),
    ("reference", "{body: crank, speed: 800 rpm}"),
    ("backlash", "{circumferential: 80 um}"),
    ("shaft", "[A, B]"),
    ("harmonics", "[{order: 1, amplitude: 20}]"),
    ("table", "[0.9, 1.0, 1.1, 1.0]"),
    ("rectangular", "{high: 1.1, low: 0.9, duty: 0.5}"),
    ("modal_ratios", "[0.05, 0.03]"),
    ("damping", "{modal_ratio: 0.05}"),
    ("report", "{units: si}"),
    ("scaling", "{frequency: first_mode}"),
    ("loads", "{A: {mean: 100 N m}}"),
];

/// A wrong shape with the right one for help.
fn shaped(mistake: Diagnostic, path: &str) -> Diagnostic {
    let key = path.rsplit('.').next().unwrap_or_default();
    match SHAPES.iter().find(|(known, _)| *known == key) {
        Some((key, example)) => mistake.with_help(format!("such as `{key}: {example}`")),
        None => mistake,
    }
}

/// The list of a node with the path of every entry.
pub(super) fn entries<'n>(
    node: &'n Node,
    path: &str,
    mistakes: &mut Mistakes,
) -> Vec<(String, &'n Node)> {
    let list = node.as_list(path).map_err(|mistake| shaped(mistake, path));
    let list = mistakes.note(list).unwrap_or_default();
    let numbered = list.iter().enumerate();
    numbered.map(|(k, node)| (join(path, k), node)).collect()
}

/// One of the known words.
pub(super) fn word<'w>(node: &Node, path: &str, words: &[&'w str]) -> Result<&'w str, Diagnostic> {
    let text = node.as_text(path)?;
    let found = words.iter().find(|word| **word == text);
    found.copied().ok_or_else(|| {
        let message = format!("found {}, wanted {}", node.describe(), words.join(" or "));
        Diagnostic::at(node, path, message).with_help(did_you_mean(text, words.iter().copied()))
    })
}

/// Checks a name that the user gives: `[A-Za-z_][A-Za-z0-9_-]*`.
///
/// # Errors
/// The name with its place.
pub fn check_name(entry: &Entry, name: &str, path: &str) -> Result<(), Diagnostic> {
    match is_name(name) {
        true => Ok(()),
        false => Err(Diagnostic::at_key(entry, path, format!("names {NAMES}"))),
    }
}

/// The rule of names, in words.
pub const NAMES: &str = "start with a letter or _ and continue with letters, digits, _ or -";

/// Whether a text follows the rule of names.
pub fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    let is_start = |c: char| c.is_ascii_alphabetic() || c == '_';
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    letters.next().is_some_and(is_start) && letters.all(is_part)
}

/// Whether a node is a scalar.
pub(super) fn is_scalar(node: &Node) -> bool {
    matches!(node.value, Value::Scalar { .. })
}
