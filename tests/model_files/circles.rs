//! No circle of imports between files: a file can be read after those that it imports.
//!
//! A module and its own parts may name each other: a folder's `mod.rs` holds the types that its files share.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Sources by module path, without tests and comments.
fn modules() -> BTreeMap<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut folders, mut found) = (vec![root.clone()], BTreeMap::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let below = path.strip_prefix(&root).unwrap().with_extension("");
                let mut steps: Vec<&str> = below.iter().map(|p| p.to_str().unwrap()).collect();
                if steps.last() == Some(&"mod") {
                    steps.pop();
                }
                let text = std::fs::read_to_string(&path).unwrap();
                let text = text.split("#[cfg(test)]").next().unwrap_or_default();
                let code = text
                    .lines()
                    .filter(|line| !line.trim_start().starts_with("//"));
                found.insert(steps.join("::"), code.collect::<Vec<_>>().join("\n"));
            }
        }
    }
    found
}

/// The paths of a `use` tree, one by one.
fn leaves(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((front, rest)) = tree.split_once('{') else {
        return vec![
            tree.split(" as ")
                .next()
                .unwrap_or_default()
                .trim()
                .to_owned(),
        ];
    };
    let (mut depth, mut item, mut found) = (1, String::new(), Vec::new());
    for c in rest.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if depth == 0 || (depth == 1 && c == ',') {
            let own = std::mem::take(&mut item);
            if !own.trim().is_empty() {
                found.extend(
                    leaves(&own)
                        .into_iter()
                        .map(|leaf| front.trim().to_owned() + &leaf),
                );
            }
        } else {
            item.push(c);
        }
    }
    found
}

/// `use` trees of a source; re-exports name the parts of a module and are no imports.
fn uses(code: &str) -> Vec<String> {
    let statements = code.split(';').filter_map(|statement| {
        let at = statement.rfind("use ")?;
        let before = statement[..at].trim_end();
        let is_own = before.is_empty() || before.ends_with(['}', ']', '\n', ';', '{']);
        (is_own && !before.ends_with("pub")).then(|| statement[at + 4..].to_owned())
    });
    statements.flat_map(|tree| leaves(&tree)).collect()
}

/// The module in whose file a path ends, seen from `from`; re-exports are followed once.
fn target(path: &str, from: &str, all: &BTreeMap<String, String>) -> Option<String> {
    let mut steps: Vec<&str> = path.split("::").map(str::trim).collect();
    let mut base: Vec<&str> = from.split("::").filter(|step| !step.is_empty()).collect();
    match steps[0] {
        "crate" => {
            base.clear();
            steps.remove(0);
        }
        "super" => {
            while steps.first() == Some(&"super") {
                base.pop();
                steps.remove(0);
            }
        }
        _ => return None,
    }
    while let Some(step) = steps.first() {
        let deeper = [base.as_slice(), &[step]].concat().join("::");
        if !all.contains_key(&deeper) {
            break;
        }
        base.push(steps.remove(0));
    }
    let found = base.join("::");
    let item = steps.first()?;
    let source = all.get(&found)?;
    let exported = source.split(';').filter_map(|s| s.split_once("pub use "));
    let paths = exported.flat_map(|(_, tree)| leaves(tree));
    let part = paths.filter_map(|path| {
        let (front, name) = path.rsplit_once("::")?;
        let part = [found.as_str(), front].join("::");
        (name == *item && all.contains_key(&part)).then_some(part)
    });
    part.into_iter().next().or(Some(found))
}

/// Modules that lead back to themselves, in groups.
fn circles(edges: &BTreeMap<String, BTreeSet<String>>) -> Vec<BTreeSet<String>> {
    let reach = |from: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from.to_owned()]);
        while let Some(module) = open.pop() {
            for next in edges.get(&module).into_iter().flatten() {
                if seen.insert(next.clone()) {
                    open.push(next.clone());
                }
            }
        }
        seen
    };
    let all: BTreeMap<&String, BTreeSet<String>> = edges.keys().map(|m| (m, reach(m))).collect();
    let mut found: Vec<BTreeSet<String>> = Vec::new();
    for (module, reached) in &all {
        if reached.contains(*module) && found.iter().all(|circle| !circle.contains(*module)) {
            let both = |other: &&String| all[*other].contains(*module);
            let circle = reached.iter().filter(|m| all.contains_key(m)).filter(both);
            found.push(circle.cloned().collect());
        }
    }
    found
}

#[test]
fn files_do_not_import_each_other_in_circles() {
    let all = modules();
    let edges: BTreeMap<String, BTreeSet<String>> = (all.iter())
        .map(|(module, code)| {
            let paths = uses(code);
            let targets = paths.iter().filter_map(|path| target(path, module, &all));
            let is_part = |other: &String| {
                let inside = |outer: &str, inner: &str| {
                    outer.is_empty() || inner.starts_with(&format!("{outer}::"))
                };
                other == module || inside(module, other) || inside(other, module)
            };
            (module.clone(), targets.filter(|t| !is_part(t)).collect())
        })
        .collect();
    assert!(edges.values().map(BTreeSet::len).sum::<usize>() > 500);
    let found = circles(&edges);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn circles_are_found() {
    let edges = |pairs: &[(&str, &str)]| {
        let mut map: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (from, to) in pairs {
            map.entry((*from).into()).or_default().insert((*to).into());
        }
        map
    };
    assert!(circles(&edges(&[("a", "b"), ("b", "c")])).is_empty());
    let found = circles(&edges(&[("a", "b"), ("b", "c"), ("c", "a"), ("d", "a")]));
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].len(), 3);
    let text = "use crate::a::{B, c::{D as E, F}};\npub use x::Y;\nuse super::G;\n";
    assert_eq!(
        uses(text),
        [
            "crate::a::B",
            "crate::a::c::D",
            "crate::a::c::F",
            "super::G"
        ]
    );
}
