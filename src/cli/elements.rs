//! `gearlash elements`.

use crate::element::{ElementInfo, ParameterInfo, ParameterKind, ParameterRange, registered};
use serde_json::{Value, json};

/// Every registered law as text or JSON.
pub fn list(as_json: bool) -> String {
    let laws = registered();
    if as_json {
        let list: Vec<Value> = laws.iter().map(|law| as_value(law)).collect();
        return format!("{:#}\n", Value::Array(list));
    }
    laws.iter()
        .map(|law| as_text(law))
        .collect::<Vec<_>>()
        .join("\n")
}

fn as_text(law: &ElementInfo) -> String {
    let mut text = format!("{}\n    {}\n", law.tag, law.doc);
    for p in law.parameters {
        let unit = p
            .dimension
            .unit()
            .map_or(String::new(), |u| format!(" [{u}]"));
        let kind = match p.kind {
            ParameterKind::Choice(words) => format!(" ({})", words.join(" | ")),
            ParameterKind::List => " (list)".to_string(),
            ParameterKind::Map => " (map)".to_string(),
            ParameterKind::Switch => " (true | false)".to_string(),
            ParameterKind::Records(fields) => {
                let names: Vec<&str> = fields.iter().map(|f| f.name).collect();
                format!(" (list of {{{}}})", names.join(", "))
            }
            ParameterKind::Number | ParameterKind::Text => String::new(),
        };
        let range = range(p.range).map_or(String::new(), |r| format!(" {r}"));
        let presence = presence(p);
        text.push_str(&format!(
            "    {}{unit}{kind}{range}: {}; {presence}\n",
            p.name, p.doc
        ));
    }
    text.push_str(&format!("    example: {}\n", law.example));
    text
}

/// `required`, `default 0`, `exactly one of half_gap and gap`.
fn presence(p: &ParameterInfo) -> String {
    match p.default {
        Some(default) => format!("default {default}"),
        None if p.is_required() => "required".to_string(),
        None => format!("exactly one of {}", p.one_of.join(" and ")),
    }
}

fn range(range: ParameterRange) -> Option<&'static str> {
    match range {
        ParameterRange::Any => None,
        ParameterRange::NotNegative => Some(">= 0"),
        ParameterRange::Positive => Some("> 0"),
    }
}

fn as_value(law: &ElementInfo) -> Value {
    let parameters: Vec<Value> = law
        .parameters
        .iter()
        .map(|p| {
            let choices = match p.kind {
                ParameterKind::Choice(words) => json!(words),
                _ => Value::Null,
            };
            json!({
                "name": p.name,
                "description": p.doc,
                "kind": kind(p.kind),
                "choices": choices,
                "unit": p.dimension.unit(),
                "range": range(p.range),
                "required": p.is_required(),
                "one_of": p.one_of,
                "default": p.default,
            })
        })
        .collect();
    json!({ "tag": law.tag, "description": law.doc, "parameters": parameters, "example": law.example })
}

fn kind(kind: ParameterKind) -> &'static str {
    match kind {
        ParameterKind::Number => "number",
        ParameterKind::List => "list",
        ParameterKind::Choice(_) => "choice",
        ParameterKind::Text => "text",
        ParameterKind::Map => "map",
        ParameterKind::Switch => "switch",
        ParameterKind::Records(_) => "records",
    }
}
