//! The floors of `ARCHITECTURE.md`: who may import whom, read from the sources.

use std::path::{Path, PathBuf};

/// Lines a file may have.
const CEILING: usize = 450;

/// What anybody may name at the root of the crate: re-exports for macros.
const EVERYBODY: &[&str] = &["inventory", "serde", "typetag", "register_element"];

/// Modules of documentation and names for programs that use the library: they may show everything, and nobody imports them.
const SHOWN: &[&str] = &["prelude", "conventions"];

/// Modules at the root of the crate, lowest floor first, and what each may import.
const FLOORS: &[(&str, &[&str])] = &[
    // floor 0
    ("error", &[]),
    ("report", &[]),
    ("interrupt", &[]),
    ("machine", &[]),
    ("numeric", &["error", "interrupt"]),
    ("yaml", &["error"]),
    ("quantity", &["error", "yaml"]),
    // floor 1
    ("element", &["error", "yaml", "quantity", "numeric"]),
    // floor 2: siblings
    (
        "model",
        &["error", "yaml", "quantity", "numeric", "element"],
    ),
    ("system", &["error", "numeric", "element"]),
    // floor 3: siblings
    (
        "assembly",
        &["error", "quantity", "numeric", "element", "model", "system"],
    ),
    (
        "solve",
        &["error", "interrupt", "numeric", "element", "system"],
    ),
    // floor 4
    (
        "postprocess",
        &[
            "error",
            "interrupt",
            "numeric",
            "element",
            "system",
            "solve",
        ],
    ),
    (
        "measure",
        &[
            "report",
            "numeric",
            "element",
            "model",
            "system",
            "assembly",
            "solve",
            "postprocess",
        ],
    ),
    // floor 5: siblings
    (
        "analysis",
        &[
            "error",
            "report",
            "interrupt",
            "machine",
            "numeric",
            "yaml",
            "quantity",
            "element",
            "model",
            "system",
            "assembly",
            "solve",
            "postprocess",
            "measure",
        ],
    ),
    ("output", &["error", "report", "machine"]),
    // floor 6: siblings
    (
        "schema",
        &["report", "quantity", "element", "model", "analysis"],
    ),
    (
        "study",
        &[
            "error",
            "report",
            "interrupt",
            "machine",
            "yaml",
            "quantity",
            "model",
            "assembly",
            "analysis",
            "output",
        ],
    ),
    // floor 7
    (
        "cli",
        &[
            "error",
            "report",
            "interrupt",
            "machine",
            "element",
            "model",
            "assembly",
            "solve",
            "analysis",
            "output",
            "schema",
            "study",
        ],
    ),
];

/// A source file: path below `src`, with `/`, and its text.
struct Source {
    path: String,
    text: String,
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut folders, mut list) = (vec![root.clone()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let below = path.strip_prefix(&root).unwrap();
                let parts: Vec<&str> = below.iter().map(|p| p.to_str().unwrap()).collect();
                list.push(Source {
                    path: parts.join("/"),
                    text: std::fs::read_to_string(&path).unwrap(),
                });
            }
        }
    }
    assert!(list.len() > 50, "found {} files", list.len());
    list
}

/// The module at the root of the crate to which a file belongs; `None` for `lib.rs` and `main.rs`.
fn module(path: &str) -> Option<&str> {
    let first = path.split('/').next().unwrap();
    let name = first.trim_end_matches(".rs");
    (name != "lib" && name != "main").then_some(name)
}

/// The text without comments to the end of a line (documentation may link anywhere).
fn code(text: &str) -> String {
    let is_code = |line: &&str| !line.trim_start().starts_with("//");
    text.lines().filter(is_code).collect::<Vec<_>>().join("\n")
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// First names after every `crate::`, those in braces one by one.
fn imports(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, matched) in code.match_indices("crate::") {
        if code[..at].chars().next_back().is_some_and(is_word) {
            continue;
        }
        let rest = &code[at + matched.len()..];
        if let Some(list) = rest.strip_prefix('{') {
            let (mut depth, mut item) = (1, String::new());
            for c in list.chars() {
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    _ => {}
                }
                if (c == ',' && depth == 1) || depth == 0 {
                    found.push(first_word(&item));
                    item.clear();
                } else {
                    item.push(c);
                }
                if depth == 0 {
                    break;
                }
            }
        } else {
            found.push(first_word(rest));
        }
    }
    found.retain(|name| !name.is_empty());
    found
}

fn first_word(text: &str) -> String {
    text.trim_start()
        .chars()
        .take_while(|c| is_word(*c))
        .collect()
}

/// Whether `super::super::..` climbs to the root of the crate, round the table.
fn climbs_to_the_root(path: &str, code: &str) -> bool {
    // A file `a/b.rs` is two floors below the root, `a/mod.rs` one; a `mod tests` in it adds one, which has to be allowed.
    let parts: Vec<&str> = path.split('/').collect();
    let depth = parts.len() - usize::from(parts.last() == Some(&"mod.rs"));
    code.contains(&"super::".repeat(depth + 1))
}

/// First line of an indented block in documentation, counted from 1.
fn indented_block(text: &str) -> Option<usize> {
    let (mut is_fenced, mut is_open) = (false, true);
    for (k, line) in text.lines().enumerate() {
        let line = line.trim_start();
        let said = line
            .strip_prefix("///")
            .or_else(|| line.strip_prefix("//!"));
        let Some(said) = said.filter(|said| said.is_empty() || said.starts_with(' ')) else {
            (is_fenced, is_open) = (false, true);
            continue;
        };
        is_fenced ^= said.trim_start().starts_with("```");
        if !is_fenced && is_open && said.starts_with("     ") && !said.trim().is_empty() {
            return Some(k + 1);
        }
        is_open = said.trim().is_empty();
    }
    None
}

/// Everything in which a file breaks the rules.
fn violations(source: &Source) -> Vec<String> {
    let Source { path, text } = source;
    let code = code(text);
    let mut found = Vec::new();
    let lines = text.lines().count();
    if lines > CEILING {
        found.push(format!("{path}: {lines} lines, {CEILING} at most"));
    }
    for (word, home) in [("serde_yaml", "yaml"), ("faer", "numeric/dense.rs")] {
        let names_it = code.split(|c| !is_word(c)).any(|w| w == word);
        if names_it && path != home && module(path) != Some(home) {
            found.push(format!("{path}: names `{word}`, which only {home} may"));
        }
    }
    if let Some(line) = indented_block(text) {
        found.push(format!(
            "{path}:{line}: an indented block in documentation is a program to be tested; equations belong between ```text and ```"
        ));
    }
    let Some(own) = module(path).filter(|own| !SHOWN.contains(own)) else {
        return found;
    };
    let Some((_, allowed)) = FLOORS.iter().find(|(name, _)| *name == own) else {
        found.push(format!("{path}: `{own}` is on no floor"));
        return found;
    };
    for name in imports(&code) {
        let is_allowed =
            name == own || allowed.contains(&name.as_str()) || EVERYBODY.contains(&name.as_str());
        if !is_allowed {
            found.push(format!("{path}: `{own}` may not import `{name}`"));
        }
    }
    if climbs_to_the_root(path, &code) {
        found.push(format!("{path}: climbs to the root with `super::`"));
    }
    found
}

#[test]
fn imports_go_down_only() {
    let found: Vec<String> = sources().iter().flat_map(violations).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn the_table_itself_goes_down_only() {
    for (k, (name, allowed)) in FLOORS.iter().enumerate() {
        for import in *allowed {
            let below = FLOORS[..k].iter().any(|(lower, _)| lower == import);
            assert!(below, "{name} imports {import}, which is not below it");
        }
    }
}

#[test]
fn violations_are_noticed() {
    let found = |path: &str, text: &str| {
        violations(&Source {
            path: path.into(),
            text: text.into(),
        })
        .join("\n")
    };
    let block = "/// Sum.\n///\n///     a + b\n";
    assert!(found("solve/made_up.rs", block).contains("made_up.rs:3: an indented block"));
    let fenced = "/// Sum.\n///\n/// ```text\n///     a + b\n/// ```\n";
    assert_eq!(found("solve/made_up.rs", fenced), "");
    let use_model = "use crate::model::Model;\n";
    assert!(found("solve/made_up.rs", use_model).contains("`solve` may not import `model`"));
    assert!(found("system/mod.rs", use_model).contains("`system` may not import `model`"));
    assert!(found("output/x.rs", "fn f(x: &crate::solve::Orbit) {}").contains("import `solve`"));
    assert!(found("study.rs", "use crate::cli::main;").contains("import `cli`"));
    let nested = "use crate::{\n    error::{Error, render},\n    study::Study,\n};";
    assert_eq!(
        found("analysis/x.rs", nested),
        "analysis/x.rs: `analysis` may not import `study`"
    );
    assert!(found("model/x.rs", "use serde_yaml::from_str;").contains("names `serde_yaml`"));
    assert!(found("numeric/sparse.rs", "use faer::Mat;").contains("names `faer`"));
    assert!(found("novelty.rs", "").contains("is on no floor"));
    assert!(found("error.rs", &"\n".repeat(CEILING + 1)).contains("451 lines"));
    assert!(found("model/x.rs", "use super::super::super::solve::Orbit;").contains("climbs"));
    assert_eq!(found("analysis/x.rs", use_model), "");
    assert_eq!(
        found("output/x.rs", "// crate::solve\n/// [`crate::model`]"),
        ""
    );
    assert_eq!(found("yaml/x.rs", "use serde_yaml::from_str;"), "");
    assert_eq!(found("element/x.rs", "crate::register_element! {}"), "");
}
