//! The error of the deserializer: what was found, what was wanted, the nearest known name.

use crate::error::{Diagnostic, Location, did_you_mean};
use crate::yaml::Node;
use serde::de::{self, Expected, Unexpected};

/// An error without its place.
#[derive(Debug, Clone)]
pub(super) struct Failure {
    message: String,
    help: Option<String>,
}

impl Failure {
    pub fn diagnostic(&self, location: Option<Location>, path: String) -> Diagnostic {
        Diagnostic {
            location,
            path,
            message: self.message.clone(),
            help: self.help.clone(),
        }
    }

    /// A number that is infinite, not a number, or too large for a double.
    pub(crate) fn not_finite(node: &Node) -> Failure {
        Failure::plain(format!("found {}, wanted a finite number", node.describe()))
    }

    fn plain(message: String) -> Failure {
        Failure {
            message,
            help: None,
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

impl de::Error for Failure {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Failure::plain(message.to_string())
    }

    fn invalid_type(found: Unexpected<'_>, wanted: &dyn Expected) -> Self {
        let wanted = wanted.to_string();
        Failure {
            message: format!("found {}, wanted {}", describe(found), in_words(&wanted)),
            help: next_move(found, &wanted),
        }
    }

    fn invalid_value(found: Unexpected<'_>, wanted: &dyn Expected) -> Self {
        Failure::invalid_type(found, wanted)
    }

    fn invalid_length(length: usize, wanted: &dyn Expected) -> Self {
        let entries = if length == 1 { "entry" } else { "entries" };
        Failure::plain(format!(
            "found {length} {entries}, wanted {}",
            in_words(&wanted.to_string())
        ))
    }

    fn unknown_variant(variant: &str, known: &'static [&'static str]) -> Self {
        Failure {
            message: format!("`{}` is not known here", cropped(variant)),
            help: Some(did_you_mean(variant, known.iter().copied())),
        }
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        Failure {
            message: format!("unknown key `{}`", cropped(field)),
            help: Some(if known.is_empty() {
                "no further keys are known here".to_owned()
            } else {
                did_you_mean(field, known.iter().copied())
            }),
        }
    }

    fn missing_field(field: &'static str) -> Self {
        Failure::plain(format!("the key `{field}` is missing"))
    }

    fn duplicate_field(field: &'static str) -> Self {
        Failure::plain(format!("the key `{field}` is given twice"))
    }
}

/// What was found, in the words of the manual.
fn describe(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Bool(b) => b.to_string(),
        Unexpected::Unsigned(n) => n.to_string(),
        Unexpected::Signed(n) => n.to_string(),
        Unexpected::Float(x) => format!("{x:?}"),
        Unexpected::Char(c) => format!("the text `{c}`"),
        Unexpected::Str(text) => format!("the text `{}`", cropped(text)),
        Unexpected::Unit | Unexpected::Option => "nothing (null)".to_owned(),
        Unexpected::Seq => "a list".to_owned(),
        Unexpected::Map => "a map".to_owned(),
        Unexpected::UnitVariant => "a word alone".to_owned(),
        Unexpected::NewtypeVariant | Unexpected::TupleVariant | Unexpected::StructVariant => {
            "a word with a value".to_owned()
        }
        other => other.to_string(),
    }
}

/// What serde calls a type, in the words of the manual.
fn in_words(wanted: &str) -> String {
    let words = match wanted {
        "f64" | "f32" => "a number",
        "i8" | "i16" | "i32" | "i64" | "i128" | "isize" => "a whole number",
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" => "a whole number from 0 to 4294967295",
        "u64" | "u128" | "usize" => "a whole number >= 0",
        "a boolean" => "true or false",
        "a string" | "a borrowed string" | "string" => "text",
        "a sequence" => "a list",
        "unit" => "nothing (null)",
        _ if wanted.starts_with("struct ") || wanted.starts_with("unit struct ") => "a map",
        _ if wanted.starts_with("dyn ") => "a map with the key `type`",
        _ if wanted.starts_with("enum ") => "a word or a map with one key",
        _ if wanted.starts_with("tuple struct ") => "a list",
        _ => {
            return match wanted.strip_prefix("an array of length ") {
                Some(length) => format!("a list of {length}"),
                None => match wanted.strip_prefix("a tuple of size ") {
                    Some(length) => format!("a list of {length}"),
                    None => wanted.to_owned(),
                },
            };
        }
    };
    words.to_owned()
}

fn next_move(found: Unexpected<'_>, wanted: &str) -> Option<String> {
    let Unexpected::Str(text) = found else {
        return None;
    };
    let help = match (wanted, text.to_lowercase().as_str()) {
        ("a boolean", "true" | "yes" | "on" | "y") => "write `true`, without quotes".to_owned(),
        ("a boolean", "false" | "no" | "off" | "n") => "write `false`, without quotes".to_owned(),
        ("a boolean", _) => return None,
        _ if in_words(wanted).contains("number")
            && text.starts_with(|c: char| c.is_ascii_digit()) =>
        {
            "write a plain number, such as 12, 0.5 or 4e-5".to_owned()
        }
        _ => return None,
    };
    Some(help)
}

/// A text short enough for a message, on one line.
pub(in crate::yaml) fn cropped(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut short: String = text
        .chars()
        .take(LONGEST)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    short
}
