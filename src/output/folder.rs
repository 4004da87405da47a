//! The folder of the results before anything is computed: whether it can be written, what dead processes left in it, and what
//! earlier runs wrote.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{FigureFormat, create_folder, file_error, new_file};
use crate::error::Error;
use crate::machine;

/// Front and end of the names of temporary files; the number of the process follows the front.
pub(super) const FRONT: &str = ".gearlash-";
pub(super) const END: &str = ".part";
/// Bytes that must be free on the disk.
const LEAST_ROOM: u64 = 1 << 20;
/// Bytes written to see whether the folder takes them.
const PROBE: usize = 1 << 12;
/// Bytes of the longest `NAME.json` that is looked into.
const LONGEST: u64 = 64 << 20;
/// Bytes of the longest file name on usual file systems.
const LONGEST_NAME: usize = 255;
/// The longest ending of a result's name; temporary files and journals have shorter ones.
const LONGEST_ENDING: &str = ".multiplier_estimates.csv";
/// Names that some systems keep for devices, whatever the ending.
const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];
const NUMBERED_DEVICES: [&str; 2] = ["com", "lpt"];

/// Creates the folder, removes what dead processes left there, and writes a little to see whether that is possible.
///
/// # Errors
/// `Error::File`: a folder that cannot be created or written, or a full disk.
pub fn prepare(folder: &Path) -> Result<(), Error> {
    create_folder(folder)?;
    remove_left_overs(folder);
    let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
    if machine::room(folder).is_some_and(|room| room < LEAST_ROOM) {
        return Err(file_error("write to", folder, full()));
    }
    let probe = || -> std::io::Result<()> {
        let mut file = new_file(folder)?;
        file.write_all(&[0; PROBE])
    };
    probe().map_err(|source| file_error("write to", folder, source))
}

/// Removes temporary files whose writers are gone: nobody holds their lock, and the process in their name does not live.
fn remove_left_overs(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let Some(middle) = name
            .to_str()
            .and_then(|name| name.strip_prefix(FRONT)?.strip_suffix(END))
        else {
            continue;
        };
        let writer = middle.split('-').next().and_then(|text| text.parse().ok());
        let is_left = !writer.is_some_and(machine::is_alive);
        if is_left && entry.file_type().is_ok_and(|kind| kind.is_file()) && is_free(&entry.path()) {
            // Somebody else may have been faster.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Whether no process has locked a file; processes of other machines are seen by nothing else.
fn is_free(path: &Path) -> bool {
    let file = std::fs::File::open(path);
    file.is_ok_and(|file| !matches!(file.try_lock(), Err(std::fs::TryLockError::WouldBlock)))
}

/// Results that a folder held before a run.
#[derive(Debug, Default)]
pub struct Earlier {
    /// Files by the name of their analysis.
    files: BTreeMap<String, BTreeSet<PathBuf>>,
}

impl Earlier {
    /// Existing analyses, from the `NAME.json` files.
    pub fn of(folder: &Path) -> Earlier {
        let mut found = Earlier::default();
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        for entry in entries {
            let path = entry.path();
            let name = entry.file_name();
            let Some(stem) = name.to_str().and_then(|name| name.strip_suffix(".json")) else {
                continue;
            };
            let is_short = entry
                .metadata()
                .is_ok_and(|m| m.is_file() && m.len() <= LONGEST);
            if is_short && let Some(tables) = tables(&path, stem) {
                let figures = FigureFormat::ALL
                    .iter()
                    .map(|f| format!("{stem}.{}", f.extension()));
                let files = tables
                    .into_iter()
                    .chain(figures)
                    .map(|file| folder.join(file));
                let files = files.chain([path.clone()]).filter(|file| file.exists());
                found.files.insert(stem.to_string(), files.collect());
            }
        }
        found
    }

    /// What a run has left as it was: files of analyses that are not `known`, and of those that have been `written`, if they are
    /// not among the `files`.
    pub fn stale(&self, known: &[&str], written: &[&str], files: &[PathBuf]) -> Vec<String> {
        let mut list = Vec::new();
        for (name, earlier) in &self.files {
            let name = name.as_str();
            let left: Vec<String> = (earlier.iter())
                .filter(|file| !files.contains(file))
                .filter_map(|file| Some(file.file_name()?.to_string_lossy().into_owned()))
                .collect();
            if left.is_empty() || (known.contains(&name) && !written.contains(&name)) {
                continue;
            }
            let files = left.join(", ");
            list.push(match known.contains(&name) {
                false => format!(
                    "results of an analysis `{name}`, which the model no longer has, are left from an earlier run: {files}"
                ),
                true => format!("{files} of `{name}` are left from an earlier run with other settings"),
            });
        }
        list
    }
}

/// Files of the tables in the `NAME.json` of an analysis; `None` when it is none.
fn tables(path: &Path, stem: &str) -> Option<Vec<String>> {
    let text = std::fs::read(path).ok()?;
    let value: Value = serde_json::from_slice(&text).ok()?;
    if value.get("name")?.as_str()? != stem || value.get("type")?.as_str()?.is_empty() {
        return None;
    }
    let list = value.get("tables")?.as_array()?.iter();
    // A name with a folder in it is none of ours.
    let files = list.filter_map(|table| table.get("file")?.as_str());
    let own = files.filter(|file| file.starts_with(stem) && !file.contains(['/', '\\']));
    Some(own.map(String::from).collect())
}

/// Reason why files cannot have the name of an analysis.
pub fn name_fault(name: &str) -> Option<String> {
    let lower = name.to_ascii_lowercase();
    if ["manifest", "report", "timings"].contains(&lower.as_str()) {
        return Some(format!(
            "an analysis called `{name}` would overwrite the files of that name; choose another name"
        ));
    }
    let most = LONGEST_NAME - LONGEST_ENDING.len();
    (name.len() > most).then(|| {
        format!(
            "the name has {} characters; the limit is {most}, because file names end at {LONGEST_NAME} bytes",
            name.len()
        )
    })
}

/// Names that make trouble where the results are taken to another system: devices, and those that differ by case only.
pub fn name_warnings(names: &[&str]) -> Vec<String> {
    let mut list = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let lower = name.to_ascii_lowercase();
        let numbered = NUMBERED_DEVICES.iter().any(|front| {
            let digit = lower.strip_prefix(front);
            digit.is_some_and(|d| d.len() == 1 && d.as_bytes()[0].is_ascii_digit())
        });
        if numbered || DEVICES.contains(&lower.as_str()) {
            list.push(format!(
                "an analysis called {name}: Windows reserves that name for a device and rejects the result files"
            ));
        }
        if let Some(other) = names[..k]
            .iter()
            .find(|other| other.eq_ignore_ascii_case(name))
        {
            list.push(format!(
                "analyses {other} and {name} differ only in case: on Windows and macOS the files of one overwrite \
                 those of the other"
            ));
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_systems() {
        let names = ["a1", "A1", "CON", "con_1", "com7", "com77", "LPT", "b"];
        let warnings = name_warnings(&names);
        assert_eq!(warnings.len(), 3, "{warnings:?}");
        assert!(warnings[0].contains("a1 and A1"));
        assert!(warnings[1].contains("CON") && warnings[2].contains("com7"));
        assert!(name_fault("Report").is_some() && name_fault("a").is_none());
        assert!(name_fault(&"n".repeat(230)).is_none());
        assert!(name_fault(&"n".repeat(231)).is_some());
    }

    #[test]
    fn left_overs_go_and_living_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for name in [
            ".gearlash-ZZGIee.part",
            ".gearlash-8388608-abc.part",
            "other.part",
        ] {
            std::fs::write(file(name), "x").unwrap();
        }
        let own = new_file(folder.path()).unwrap();
        let locked = std::fs::File::create(file(".gearlash-8388608-def.part")).unwrap();
        locked.lock().unwrap();
        remove_left_overs(folder.path());
        assert!(!file(".gearlash-ZZGIee.part").exists());
        assert!(!file(".gearlash-8388608-abc.part").exists());
        assert!(file("other.part").exists() && own.path().exists());
        assert!(file(".gearlash-8388608-def.part").exists());
    }
}
