//! `docs/gallery.md`: a figure for every type of analysis, commands that exist, figures that the commands make.
//!
//! `GEARLASH_WRITE_GALLERY=1` runs all commands and writes the figures; without it the quick ones are run and compared.

use gearlash::analysis::TYPES;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Largest figure in bytes: the page is read on the web.
const LARGEST: u64 = 130_000;
/// Analyses of a moment.
const QUICK: &[&str] = &["models/planetary_set.yaml", "fig_02", "fig_03b"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// The words of a command; quotes group.
fn words(line: &str) -> Vec<String> {
    let mut list = vec![String::new()];
    let mut is_quoted = false;
    for c in line.trim().chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            ' ' if !is_quoted => list.push(String::new()),
            c => list.last_mut().unwrap().push(c),
        }
    }
    list
}

fn commands(page: &str) -> Vec<Vec<String>> {
    let lines = page
        .lines()
        .filter(|line| line.starts_with("    gearlash "));
    lines.map(words).collect()
}

/// Names of the figures on the page, without folder.
fn figures(page: &str) -> Vec<&str> {
    let parts = page.split("](gallery/").skip(1);
    parts.map(|part| part.split(')').next().unwrap()).collect()
}

fn after<'w>(words: &'w [String], key: &str) -> Option<&'w str> {
    let at = words.iter().position(|word| word == key)?;
    words.get(at + 1).map(String::as_str)
}

/// Runs a command where `models` is at hand; its figures, under the names that the gallery gives them.
fn made(words: &[String], folder: &Path) -> HashMap<String, String> {
    let mut command = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin("gearlash"));
    std::fs::create_dir_all(folder.join("results/train")).unwrap();
    let output = command
        .current_dir(folder)
        .args(&words[1..])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() < Some(2), "{words:?}: {said}");
    if let Some(path) = words.iter().find_map(|word| word.strip_prefix("--figure=")) {
        let path = folder.join(path);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        return HashMap::from([(name, std::fs::read_to_string(path).unwrap())]);
    }
    let out = after(words, "--out").unwrap_or(&words[2]).to_owned();
    let front = out.rsplit('/').next().unwrap();
    let entries = std::fs::read_dir(folder.join(&out)).unwrap();
    let figures = entries.map(|entry| entry.unwrap().path());
    let figures = figures.filter(|path| path.extension().is_some_and(|e| e == "svg"));
    let named = |path: PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (
            format!("{front}.{name}"),
            std::fs::read_to_string(path).unwrap(),
        )
    };
    figures.map(named).collect()
}

#[test]
fn the_gallery_shows_every_analysis_and_its_commands_exist() {
    let page = std::fs::read_to_string(root().join("docs/gallery.md")).unwrap();
    for (kind, _, _) in TYPES {
        assert!(page.contains(&format!("\n## {kind}\n")), "{kind}");
    }
    for words in commands(&page) {
        let Some(model) = words.iter().find(|word| word.ends_with(".yaml")) else {
            continue;
        };
        let text = std::fs::read_to_string(root().join(model)).unwrap();
        if let Some(name) = after(&words, "--only") {
            assert!(
                text.contains(&format!("\n  {name}:")),
                "{model} has no {name}"
            );
        }
    }
}

#[test]
fn the_figures_are_those_of_the_commands() {
    let page = std::fs::read_to_string(root().join("docs/gallery.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let models = root().join("models");
    #[cfg(unix)]
    std::os::unix::fs::symlink(&models, folder.path().join("models")).unwrap();
    #[cfg(not(unix))]
    return;
    let writes = std::env::var("GEARLASH_WRITE_GALLERY").is_ok();
    let is_quick = |words: &[String]| words.iter().any(|word| QUICK.contains(&word.as_str()));
    let mut found = HashMap::new();
    for words in commands(&page) {
        if writes || is_quick(&words) {
            found.extend(made(&words, folder.path()));
        }
    }
    let mut compared = 0;
    for name in figures(&page) {
        let path = root().join("docs/gallery").join(name);
        if writes {
            let figure = found
                .get(name)
                .unwrap_or_else(|| panic!("no command makes {name}"));
            std::fs::write(&path, figure).unwrap();
        }
        let size = std::fs::metadata(&path)
            .unwrap_or_else(|e| panic!("{name}: {e}"))
            .len();
        assert!(size < LARGEST, "{name}: {size} bytes");
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("<svg viewBox="), "{name}");
        if let Some(figure) = found.get(name) {
            assert!(*figure == text, "{name} is not what its command makes");
            compared += 1;
        }
    }
    assert!(compared >= QUICK.len());
}
