//! Laws in a model file: units first, then typetag.

use super::DeformationUnit;
use super::fields::{Fields, Mistakes, NumberMeasure, entries, word};
use crate::element::{
    Element, InvalidParameter, Linear, ParameterInfo, ParameterKind, find, registered,
};
use crate::error::{Diagnostic, Location, did_you_mean};
use crate::quantity::UnitDimension;
use crate::yaml::{Entry, Node, Value, join};
use indexmap::IndexMap;

/// The parameter given by the backlash of a drawing.
pub(super) const HALF_GAP: &str = "half_gap";
/// Key of the backlash of a drawing.
pub(super) const BACKLASH: &str = "backlash";

/// Units of a law's parameters.
#[derive(Debug, Clone, Copy)]
pub(super) enum LawUnits {
    /// SI, displacements in the unit of the connection.
    Si(DeformationUnit),
    /// Nondimensional: bare numbers only.
    Bare,
}

impl LawUnits {
    fn measure(self, parameter: &ParameterInfo) -> NumberMeasure {
        let LawUnits::Si(unit) = self else {
            return NumberMeasure::Bare;
        };
        if parameter.kind == ParameterKind::Map {
            return NumberMeasure::AnySi;
        }
        let d = parameter.dimension;
        let displacement = unit.dimension();
        NumberMeasure::Si(UnitDimension::of_law(
            d.displacement,
            d.time,
            d.force,
            displacement,
        ))
    }

    /// A displacement.
    pub(super) fn displacement(self) -> NumberMeasure {
        match self {
            LawUnits::Si(unit) => NumberMeasure::Si(unit.dimension()),
            LawUnits::Bare => NumberMeasure::Bare,
        }
    }
}

/// The law of a node; the linear one without a node. Keys in `aside` are read elsewhere.
pub(super) fn law(
    node: Option<&Node>,
    path: &str,
    units: LawUnits,
    aside: &[&str],
    mistakes: &mut Mistakes,
) -> Option<Box<dyn Element>> {
    let Some(node) = node else {
        return Some(Box::new(Linear {}));
    };
    let fields = Fields::open(node, path, mistakes)?;
    let wanted = "the tag of a law, such as `type: backlash`";
    let tag_node = fields.required("type", wanted, mistakes)?;
    let tag = mistakes.note(tag_node.as_text(&fields.path_of("type")))?;
    let Some(info) = find(tag) else {
        let tags: Vec<&str> = registered().iter().map(|info| info.tag).collect();
        let message = format!("unknown law `{tag}`; known: {}", tags.join(", "));
        let mistake = Diagnostic::at(tag_node, &fields.path_of("type"), message);
        mistakes.add(mistake.with_help(did_you_mean(tag, tags)));
        return None;
    };
    let before = mistakes.count();
    let mut plain = IndexMap::new();
    for (key, entry) in fields.entries().filter(|(key, _)| !aside.contains(key)) {
        let path = fields.path_of(key);
        let value = if key == "type" {
            Some(entry.node.clone())
        } else if let Some(parameter) = info.parameters.iter().find(|p| p.name == key) {
            in_si(&entry.node, &path, parameter, units, mistakes)
        } else {
            mistakes.add(unknown_parameter(
                entry,
                key,
                &path,
                info.tag,
                (info.parameters, units),
            ));
            None
        };
        if let Some(node) = value {
            let key_location = entry.key_location.clone();
            plain.insert(key.to_owned(), Entry { key_location, node });
        }
    }
    missing(&fields, info.tag, info.parameters, mistakes);
    if mistakes.count() > before {
        return None;
    }
    let plain = Node {
        value: Value::Map(plain),
        location: node.location.clone(),
    };
    let element: Box<dyn Element> = mistakes.note(plain.read(path))?;
    let checked = element.validate();
    mistakes.note(checked.map_err(|invalid| out_of_range(&fields, &invalid)))?;
    Some(element)
}

fn unknown_parameter(
    entry: &Entry,
    key: &str,
    path: &str,
    tag: &str,
    (parameters, units): (&[ParameterInfo], LawUnits),
) -> Diagnostic {
    let mut known: Vec<&str> = parameters.iter().map(|p| p.name).collect();
    if matches!(units, LawUnits::Si(_)) && known.contains(&HALF_GAP) {
        known.push(BACKLASH);
    }
    let list = match known.as_slice() {
        [] => "none".to_owned(),
        list => list.join(", "),
    };
    let message = format!("law `{tag}` has no parameter `{key}`; it has: {list}");
    // Within { } the commas of a formula end it.
    let is_rest_of_text = parameters.iter().any(|p| p.kind == ParameterKind::Text)
        && !key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let help = if is_rest_of_text {
        "a text with commas needs quotes within { }: {force: \"max(q, 0)\"}".to_owned()
    } else {
        did_you_mean(key, known)
    };
    Diagnostic::at_key(entry, path, message).with_help(help)
}

/// Parameters that must be given and are not.
fn missing(fields: &Fields<'_>, tag: &str, parameters: &[ParameterInfo], mistakes: &mut Mistakes) {
    let required = parameters.iter().filter(|p| p.is_required());
    for parameter in required.filter(|p| fields.get(p.name).is_none()) {
        let message = format!("law `{tag}` wants `{}`: {}", parameter.name, parameter.doc);
        mistakes.add(Diagnostic::at(fields.node, &fields.path, message));
    }
}

/// The node with every number in SI units.
fn in_si(
    node: &Node,
    path: &str,
    parameter: &ParameterInfo,
    units: LawUnits,
    mistakes: &mut Mistakes,
) -> Option<Node> {
    let measure = units.measure(parameter);
    let range = parameter.range;
    let converted = |node: &Node, path: &str, mistakes: &mut Mistakes| {
        let value = mistakes.number(node, path, measure, range)?;
        Some(Node {
            location: node.location.clone(),
            ..Node::number(value)
        })
    };
    let value = match parameter.kind {
        ParameterKind::Number if node.is_null() && parameter.default == Some("null") => {
            return Some(node.clone());
        }
        ParameterKind::Number => return converted(node, path, mistakes),
        ParameterKind::Text | ParameterKind::Switch => return Some(node.clone()),
        _ if node.is_null() => return Some(node.clone()),
        ParameterKind::Records(fields) => Value::List(
            entries(node, path, mistakes)
                .into_iter()
                .filter_map(|(path, node)| record(node, &path, fields, units, mistakes))
                .collect(),
        ),
        ParameterKind::Choice(words) => {
            mistakes.note(word(node, path, words))?;
            return Some(node.clone());
        }
        ParameterKind::List => Value::List(
            entries(node, path, mistakes)
                .into_iter()
                .filter_map(|(path, node)| converted(node, &path, mistakes))
                .collect(),
        ),
        ParameterKind::Map => {
            let fields = Fields::open(node, path, mistakes)?;
            let mut map = IndexMap::new();
            for (key, entry) in fields.entries() {
                if let Some(node) = converted(&entry.node, &fields.path_of(key), mistakes) {
                    let key_location = entry.key_location.clone();
                    map.insert(key.to_owned(), Entry { key_location, node });
                }
            }
            Value::Map(map)
        }
    };
    let location = node.location.clone();
    Some(Node { value, location })
}

/// One map of a list, with every number in SI units.
fn record(
    node: &Node,
    path: &str,
    parameters: &[ParameterInfo],
    units: LawUnits,
    mistakes: &mut Mistakes,
) -> Option<Node> {
    let names: Vec<&str> = parameters.iter().map(|p| p.name).collect();
    let fields = Fields::known(node, path, &names, mistakes)?;
    let mut map = IndexMap::new();
    for (key, entry) in fields.entries() {
        let parameter = parameters.iter().find(|p| p.name == key)?;
        let node = in_si(
            &entry.node,
            &fields.path_of(key),
            parameter,
            units,
            mistakes,
        )?;
        let key_location = entry.key_location.clone();
        map.insert(key.to_owned(), Entry { key_location, node });
    }
    missing(&fields, path, parameters, mistakes);
    Some(Node {
        value: Value::Map(map),
        location: node.location.clone(),
    })
}

/// A parameter that the law itself refuses, at the value that the user wrote or at a place within it.
fn out_of_range(fields: &Fields<'_>, invalid: &InvalidParameter) -> Diagnostic {
    let mut steps = invalid.name.split(['[', '.']);
    let key = steps.next().unwrap_or_default();
    let Some(node) = fields.get(key) else {
        return Diagnostic::at(fields.node, &fields.path, invalid.to_string());
    };
    // The path names the parameter already.
    let about = invalid.message.strip_prefix(": ").map(str::to_owned);
    let message = about.unwrap_or_else(|| invalid.to_string());
    let inner = steps.next().and_then(|step| Some((step, node.get(step)?)));
    if let Some((step, entry)) = inner {
        let path = join(&fields.path_of(key), step);
        return Diagnostic::at(entry, &path, message);
    }
    let mut mistake = Diagnostic::at(node, &fields.path_of(key), message);
    if let (Some(at), Some(place)) = (&mut mistake.location, invalid.place) {
        at.column += offset(node, at, place).unwrap_or(0);
    }
    mistake
}

/// Columns from the begin of a scalar to a place in its text; `None` where it is not written out in one line.
fn offset(node: &Node, at: &Location, place: usize) -> Option<usize> {
    let Value::Scalar { text, .. } = &node.value else {
        return None;
    };
    let line = at.source.text.lines().nth(at.line.checked_sub(1)?)?;
    let column = line.char_indices().nth(at.column.checked_sub(1)?)?.0;
    let quote = usize::from(line[column..].starts_with(['"', '\'']));
    line[column + quote..]
        .starts_with(text.as_str())
        .then_some(quote + place)
}
