//! `docs/keys.md` is the schema as a page: every key with its description and default.
//!
//! After a change of a key: `GEARLASH_WRITE_KEYS=1 cargo test --test model_files keys_page`.

use gearlash::schema;
use serde_json::Value;
use std::fmt::Write;
use std::path::PathBuf;

/// Parts of the model with a table of their own, in the order of the page.
const PARTS: [(&str, &str); 9] = [
    ("model", "Top level"),
    ("body", "A body"),
    ("connection", "A connection"),
    ("transmission_error", "`transmission_error`"),
    ("stiffness_variation", "`stiffness_variation`"),
    ("load", "A load"),
    ("damping", "`damping`"),
    ("scaling", "`scaling`"),
    ("reduced", "`reduced`"),
];

const HEAD: &str = "# Keys of the model file

Generated from the JSON schema (`gearlash schema`); laws with their parameters are listed by `gearlash elements`. `[]` denotes the
entries of a list, `NAME` a name that you choose. The manual explains the keys in context.
";

struct Row {
    key: String,
    text: String,
}

fn join(prefix: &str, key: &str) -> String {
    match prefix {
        "" => key.to_owned(),
        prefix => format!("{prefix}.{key}"),
    }
}

/// The keys below a node, depth first; parts with a table of their own are behind references, which are not followed.
fn collect(node: &Value, prefix: &str, rows: &mut Vec<Row>) {
    for (key, value) in node["properties"].as_object().into_iter().flatten() {
        let key = join(prefix, key);
        if rows.iter().all(|row| row.key != key) {
            let text = value["description"].as_str().unwrap_or_default();
            let mut text = text.replace('\n', " ").replace('|', "\\|");
            if let Some(default) = value.get("default").filter(|value| !value.is_null()) {
                let _ = write!(text, " Default `{default}`.");
            }
            let key = key.clone();
            rows.push(Row { key, text });
        }
        collect(value, &key, rows);
    }
    for word in ["anyOf", "allOf", "oneOf"] {
        for one in node[word].as_array().into_iter().flatten() {
            collect(one, prefix, rows);
        }
    }
    if node["items"].is_object() {
        collect(&node["items"], &join(prefix, "[]"), rows);
    }
    if node["additionalProperties"].is_object() {
        collect(&node["additionalProperties"], &join(prefix, "NAME"), rows);
    }
}

fn table(title: &str, node: &Value, text: &mut String) {
    let mut rows = Vec::new();
    collect(node, "", &mut rows);
    let _ = write!(text, "\n## {title}\n\n| Key | Meaning |\n|---|---|\n");
    for row in rows.iter().filter(|row| row.key != "type") {
        let _ = writeln!(text, "| `{}` | {} |", row.key, row.text);
    }
}

fn page() -> String {
    let schema = schema::schema();
    let parts = &schema["definitions"];
    let mut text = HEAD.to_owned();
    for (name, title) in PARTS {
        assert!(parts[name].is_object(), "{name}");
        table(title, &parts[name], &mut text);
    }
    for kind in parts["analysis"]["oneOf"].as_array().unwrap() {
        let name = kind["properties"]["type"]["const"].as_str().unwrap();
        table(&format!("Analysis `{name}`"), kind, &mut text);
    }
    text
}

#[test]
fn keys_page_is_the_schema() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/keys.md");
    let wanted = page();
    if std::env::var_os("GEARLASH_WRITE_KEYS").is_some() {
        std::fs::write(&path, &wanted).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap();
    for (k, (found, wanted)) in found.lines().zip(wanted.lines()).enumerate() {
        assert_eq!(
            found,
            wanted,
            "docs/keys.md:{}: see the head of this test",
            k + 1
        );
    }
    assert_eq!(
        found.len(),
        wanted.len(),
        "docs/keys.md: see the head of this test"
    );
}

/// Whether a text names a key as code.
fn names(manual: &str, key: &str) -> bool {
    let code = manual.split('`').skip(1).step_by(2);
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    code.into_iter()
        .any(|code| code.split(|c| !is_part(c)).any(|word| word == key))
}

#[test]
fn the_manual_explains_every_key() {
    let manual = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/manual.md");
    let manual = std::fs::read_to_string(manual).unwrap();
    let schema = schema::schema();
    let mut rows = Vec::new();
    for (name, part) in schema["definitions"].as_object().unwrap() {
        if !name.starts_with("partial") {
            collect(part, "", &mut rows);
        }
    }
    let keys: std::collections::BTreeSet<&str> = rows
        .iter()
        .filter_map(|row| row.key.rsplit('.').next())
        .filter(|key| !["[]", "NAME"].contains(key))
        .collect();
    let missing: Vec<&str> = keys
        .into_iter()
        .filter(|key| !names(&manual, key))
        .collect();
    assert!(
        missing.is_empty(),
        "docs/manual.md does not mention {missing:?}"
    );
}
