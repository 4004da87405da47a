//! Licences and sources of all dependencies, by the lists of `deny.toml`.

use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Command;

/// Crates of which the program holds several versions at most: each is built and shipped twice.
const MOST_DUPLICATES: usize = 20;
const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// What cargo says of every package on this machine.
fn packages() -> Vec<Value> {
    let rustc = Command::new("rustc").arg("-vV").output().unwrap();
    let version = String::from_utf8(rustc.stdout).unwrap();
    let host = version
        .lines()
        .find_map(|line| line.strip_prefix("host: "))
        .unwrap();
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--locked",
            "--filter-platform",
            host,
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let data: Value = serde_json::from_slice(&output.stdout).unwrap();
    let used: Vec<&str> = data["resolve"]["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| n["id"].as_str().unwrap())
        .collect();
    let all = data["packages"].as_array().unwrap().iter();
    all.filter(|p| used.contains(&p["id"].as_str().unwrap()))
        .cloned()
        .collect()
}

/// Texts in quotes of the list under a key of `deny.toml`.
fn allowed() -> Vec<String> {
    let text = include_str!("../../deny.toml");
    let list = text
        .split("allow = [")
        .nth(1)
        .unwrap()
        .split(']')
        .next()
        .unwrap();
    list.split('"')
        .skip(1)
        .step_by(2)
        .map(String::from)
        .collect()
}

/// Whether an expression of licences can be met with those that are allowed.
fn is_met(expression: &str, allowed: &[String]) -> bool {
    let text = expression.replace('/', " OR ");
    any(
        &mut text
            .replace('(', " ( ")
            .replace(')', " ) ")
            .split_whitespace()
            .peekable(),
        allowed,
    )
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn any(words: &mut Words<'_>, allowed: &[String]) -> bool {
    let mut met = all(words, allowed);
    while words.next_if_eq(&"OR").is_some() {
        met |= all(words, allowed);
    }
    met
}

fn all(words: &mut Words<'_>, allowed: &[String]) -> bool {
    let mut met = one(words, allowed);
    while words.next_if_eq(&"AND").is_some() {
        met &= one(words, allowed);
    }
    met
}

fn one(words: &mut Words<'_>, allowed: &[String]) -> bool {
    match words.next() {
        Some("(") => {
            let met = any(words, allowed);
            assert_eq!(words.next(), Some(")"));
            met
        }
        Some(name) => match words.next_if_eq(&"WITH").and_then(|_| words.next()) {
            Some(exception) => allowed.contains(&format!("{name} WITH {exception}")),
            None => allowed.iter().any(|a| a == name),
        },
        None => false,
    }
}

#[test]
fn dependencies_have_known_licences_and_come_from_one_place() {
    let allowed = allowed();
    let mut versions: BTreeMap<String, usize> = BTreeMap::new();
    let mut faults = Vec::new();
    let list = packages();
    assert!(list.len() > 50);
    for package in &list {
        let name = package["name"].as_str().unwrap();
        *versions.entry(name.to_string()).or_default() += 1;
        match package["source"].as_str() {
            // Our own.
            None => continue,
            Some(CRATES_IO) => {}
            Some(other) => faults.push(format!("{name} comes from {other}")),
        }
        match package["license"].as_str() {
            Some(license) if is_met(license, &allowed) => {}
            other => faults.push(format!("{name} has the licence {other:?}")),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let twice: Vec<_> = versions.iter().filter(|(_, count)| **count > 1).collect();
    assert!(
        twice.len() <= MOST_DUPLICATES,
        "{} crates in several versions: {twice:?}",
        twice.len()
    );
}

#[test]
fn expressions_of_licences_are_read() {
    let allowed = [
        "MIT",
        "Apache-2.0",
        "Unicode-3.0",
        "Apache-2.0 WITH LLVM-exception",
    ]
    .map(String::from);
    for (text, wanted) in [
        ("MIT", true),
        ("MIT/GPL-3.0", true),
        ("GPL-3.0", false),
        ("GPL-3.0 OR MIT AND Unicode-3.0", true),
        ("(GPL-3.0 OR MIT) AND Unicode-3.0", true),
        ("MIT AND GPL-3.0", false),
        ("Apache-2.0 WITH LLVM-exception", true),
        ("MIT WITH LLVM-exception", false),
    ] {
        assert_eq!(is_met(text, &allowed), wanted, "{text}");
    }
}
