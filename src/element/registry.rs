//! The table of laws, read by `gearlash elements`, the schema, the loader and the conformance tests.
//!
//! The registry of typetag is private: it has no list of tags and no documentation. `register_element!` adds a separate
//! entry.

use super::{Dimension, Element, InvalidParameter};
use crate::yaml;

/// Kind of values of a parameter of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// One number or quantity.
    Number,
    /// A list of numbers or quantities.
    List,
    /// One of the words.
    Choice(&'static [&'static str]),
    /// Any text.
    Text,
    /// A map from names to numbers or quantities of any dimension, interpreted by the law. It receives SI values; in
    /// nondimensional systems bare numbers only.
    Map,
    /// `true` or `false`.
    Switch,
    /// A list of maps with these parameters.
    Records(&'static [ParameterInfo]),
}

/// Range of a parameter, of every number of a list or a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub enum ParameterRange {
    /// Any finite number.
    #[default]
    #[serde(rename = "any")]
    Any,
    /// >= 0.
    #[serde(rename = ">= 0")]
    NotNegative,
    /// > 0.
    #[serde(rename = "> 0")]
    Positive,
}

impl ParameterRange {
    /// Requirement violated by a number outside the range; `None` inside. No range contains infinities and NaN.
    pub fn refusal(self, value: f64) -> Option<&'static str> {
        match self {
            _ if !value.is_finite() => Some("finite"),
            ParameterRange::Positive if value <= 0.0 => Some("> 0"),
            ParameterRange::NotNegative if value < 0.0 => Some(">= 0"),
            _ => None,
        }
    }
}

/// Description of one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterInfo {
    /// Name, as in YAML.
    pub name: &'static str,
    /// One line.
    pub doc: &'static str,
    /// What it accepts.
    pub kind: ParameterKind,
    /// Dimension of a number.
    pub dimension: Dimension,
    /// Default as YAML text; `None` when the parameter is required (or one of several must be given).
    pub default: Option<&'static str>,
    /// Allowed numbers.
    pub range: ParameterRange,
    /// Names of the parameters, this one included, exactly one of which must be given; empty if there is only this one.
    pub one_of: &'static [&'static str],
}

impl ParameterInfo {
    /// A parameter with any range and no alternatives.
    pub const fn new(
        name: &'static str,
        doc: &'static str,
        kind: ParameterKind,
        dimension: Dimension,
        default: Option<&'static str>,
    ) -> ParameterInfo {
        ParameterInfo {
            name,
            doc,
            kind,
            dimension,
            default,
            range: ParameterRange::Any,
            one_of: &[],
        }
    }

    /// Restricts the range.
    #[must_use]
    pub const fn within(self, range: ParameterRange) -> ParameterInfo {
        ParameterInfo { range, ..self }
    }

    /// Marks the parameter as one of several that exclude each other.
    #[must_use]
    pub const fn one_of(self, names: &'static [&'static str]) -> ParameterInfo {
        ParameterInfo {
            one_of: names,
            ..self
        }
    }

    /// Whether it is required by itself.
    pub fn is_required(&self) -> bool {
        self.default.is_none() && self.one_of.is_empty()
    }
}

/// Description of one law.
pub struct ElementInfo {
    /// Value of `type:` in YAML.
    pub tag: &'static str,
    /// One line, with the formula.
    pub doc: &'static str,
    /// Parameters, in the order of the documentation.
    pub parameters: &'static [ParameterInfo],
    /// A valid example as a YAML flow map, with SI numbers.
    pub example: &'static str,
}

impl ElementInfo {
    /// The law of the example; `None` where it cannot be read.
    pub fn example_law(&self) -> Option<Box<dyn Element>> {
        read_example(self).ok()
    }
}

inventory::collect!(ElementInfo);

/// Every registered law, plugins included, by tag.
pub fn registered() -> Vec<&'static ElementInfo> {
    let mut list: Vec<_> = inventory::iter::<ElementInfo>.into_iter().collect();
    list.sort_by_key(|info| info.tag);
    list
}

/// The law of that tag.
pub fn find(tag: &str) -> Option<&'static ElementInfo> {
    inventory::iter::<ElementInfo>
        .into_iter()
        .find(|info| info.tag == tag)
}

/// Errors in the tables of laws, one sentence each.
///
/// A tag with two entries, a tag for which typetag has two laws or none, an example that is not an instance of its law.
pub fn table_mistakes() -> Vec<String> {
    let list = registered();
    let mut found = Vec::new();
    for (k, info) in list.iter().enumerate() {
        let tag = info.tag;
        if k > 0 && list[k - 1].tag == tag {
            found.push(format!(
                "law `{tag}` is registered more than once: two entries"
            ));
            continue;
        }
        match read_example(info) {
            Err(message) => found.push(format!("law `{tag}`: its example is not read: {message}")),
            Ok(law) if law.typetag_name() != tag => {
                let name = law.typetag_name();
                found.push(format!("law `{tag}`: its example is the law `{name}`"));
            }
            Ok(_) => {}
        }
    }
    found
}

/// Checks that the parameters of a law are within the ranges of its entry.
///
/// # Errors
/// The first parameter outside its range.
pub(super) fn within_ranges(tag: &str, mut law: Box<dyn Element>) -> Result<(), InvalidParameter> {
    let parameters = find(tag).map_or(&[][..], |info| info.parameters);
    let mut wrong = None;
    law.visit_parameters(&mut |p| {
        let range = parameters.iter().find(|info| info.name == p.name);
        let range = range.map_or(ParameterRange::Any, |info| info.range);
        if let (None, Some(wanted)) = (&wrong, range.refusal(*p.value)) {
            let name = match p.index {
                Some(k) => format!("{}[{k}]", p.name),
                None => p.name.to_owned(),
            };
            wrong = Some(InvalidParameter::new(name, *p.value, wanted));
        }
    });
    wrong.map_or(Ok(()), Err)
}

/// The law of the example of an entry.
pub(super) fn read_example(info: &ElementInfo) -> Result<Box<dyn Element>, String> {
    let node = yaml::parse(info.example, info.tag).map_err(|e| e.to_string())?;
    node.read("").map_err(|e| e.message)
}

/// Adds a law to the table read by `gearlash elements`, the schema, the loader and the conformance tests.
///
/// Use it beside `#[typetag::serde(name = "tag")] impl Element for Law`, with the same tag; `conformance::check_registered`
/// compares the two. For each parameter `range` and `one_of` are optional, in this order.
#[macro_export]
macro_rules! register_element {
    (
        tag: $tag:literal,
        doc: $doc:literal,
        parameters: [ $( {
            name: $name:literal, doc: $pdoc:literal, kind: $kind:expr, dimension: $dim:expr, default: $default:expr
            $(, range: $range:expr)? $(, one_of: [ $( $other:literal ),+ ])? $(,)?
        } ),* $(,)? ],
        example: $example:literal $(,)?
    ) => {
        $crate::inventory::submit! {
            $crate::element::ElementInfo {
                tag: $tag,
                doc: $doc,
                parameters: &[ $(
                    $crate::element::ParameterInfo::new($name, $pdoc, $kind, $dim, $default)
                        $( .within($range) )? $( .one_of(&[ $( $other ),+ ]) )?
                ),* ],
                example: $example,
            }
        }
    };
}
