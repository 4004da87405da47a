//! The table of laws against the laws themselves.

use super::{Violations, check, first_difference};
use crate::element::registry::{read_example, table_mistakes};
use crate::element::{
    Dimension, Element, ElementInfo, ParameterInfo, ParameterKind, ParameterRange, registered,
};
use crate::yaml::{self, Entry, Node, Value};

/// Checks every registered law, plugins included, on its documented example: that tags are unique, that the example reads and
/// keeps the contract, and that the table of its parameters tells the truth: what is required is, defaults are the ones
/// that are taken, ranges are kept, words are known, dimensions are the visited ones.
///
/// # Errors
/// All violations found, with the tag in front.
pub fn check_registered() -> Result<(), Violations> {
    let mut found = table_mistakes();
    for info in registered() {
        let mut own = Vec::new();
        if let Ok(element) = read_example(info) {
            if let Err(Violations(list)) = check(element.as_ref()) {
                own = list;
            }
            dimensions(info, element.as_ref(), &mut own);
            for parameter in info.parameters {
                presence(info, parameter, &mut own);
                values(info, parameter, &mut own);
            }
        }
        found.extend(own.into_iter().map(|what| format!("{}: {what}", info.tag)));
    }
    Violations::conclude(found)
}

fn dimensions(info: &ElementInfo, element: &dyn Element, found: &mut Vec<String>) {
    element.clone_box().visit_parameters(&mut |p| {
        let documented = info.parameters.iter().find(|i| i.name == p.name);
        // A law may keep a parameter in another form than it is written in; the name then is not documented.
        if documented.is_some_and(|i: &ParameterInfo| i.dimension != p.dimension) {
            found.push(format!(
                "{}: the documented dimension is not the visited one",
                p.name
            ));
        }
    });
    let is_plain =
        |p: &&ParameterInfo| !matches!(p.kind, ParameterKind::Number | ParameterKind::List);
    for p in info.parameters.iter().filter(is_plain) {
        if p.dimension != Dimension::NONE {
            found.push(format!(
                "{}: texts, words and maps have no dimension",
                p.name
            ));
        }
    }
}

/// The law of the example without some parameters, and with one of a value; `None` when it is refused.
fn altered(
    info: &ElementInfo,
    without: &[&str],
    with: Option<(&str, Node)>,
) -> Option<Box<dyn Element>> {
    let mut node = yaml::parse(info.example, info.tag).ok()?;
    if let Value::Map(map) = &mut node.value {
        map.retain(|key, _| !without.contains(&key.as_str()));
        map.extend(with.map(|(name, value)| (name.to_owned(), Entry::from(value))));
    }
    let law: Box<dyn Element> = node.read("").ok()?;
    law.validate().is_ok().then_some(law)
}

fn presence(info: &ElementInfo, p: &ParameterInfo, found: &mut Vec<String>) {
    let Some(default) = p.default else {
        let group = if p.one_of.is_empty() {
            &[p.name]
        } else {
            p.one_of
        };
        if !group.contains(&p.name) {
            found.push(format!("{}: not among its own alternatives", p.name));
        }
        if altered(info, group, None).is_some() {
            found.push(format!(
                "{}: read without its required parameter",
                group.join(", ")
            ));
        }
        return;
    };
    let written = yaml::parse(default, info.tag).ok();
    let written = written.and_then(|node| altered(info, &[], Some((p.name, node))));
    match (altered(info, &[p.name], None), written) {
        (Some(without), Some(with)) if first_difference(&*without, &*with).is_none() => {}
        // A formula that names its parameters cannot do without them.
        (None, None) => {}
        _ => found.push(format!("{}: {default} is not its default", p.name)),
    }
}

fn values(info: &ElementInfo, p: &ParameterInfo, found: &mut Vec<String>) {
    let takes = |value: Node| altered(info, p.one_of, Some((p.name, value)));
    let is_number = p.kind == ParameterKind::Number;
    if is_number && p.range != ParameterRange::Any && takes(Node::number(-1.0)).is_some() {
        found.push(format!("{}: takes -1, against its range", p.name));
    }
    if is_number && p.range == ParameterRange::Positive && takes(Node::number(0.0)).is_some() {
        found.push(format!("{}: takes 0, against its range", p.name));
    }
    if let ParameterKind::Choice(words) = p.kind {
        for word in words.iter().filter(|w| takes(Node::scalar(**w)).is_none()) {
            found.push(format!("{}: does not know its word `{word}`", p.name));
        }
    }
}
