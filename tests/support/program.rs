//! The real binary on real files in a folder of its own.

#![allow(dead_code)] // every test binary uses a part of it

use std::path::{Path, PathBuf};
use std::process::Output;
use tempfile::TempDir;

/// A small nondimensional model, two analyses of milliseconds.
pub const REDUCED: &str = "\
schema: 1
name: one mesh
reduced:
  stiffness: [[1]]
  damping: {modal_ratio: 0.05}
  elements: {mesh: {type: backlash, half_gap: 1.0}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.25]}]}
analyses:
  lines: {type: modes, points: 3}
  response: {type: frequency_response, from: 2.0, to: 1.6, harmonics: 5, marks: [1.9]}
";

/// A small train with results in SI units.
pub const TRAIN: &str = "\
schema: 1
name: pair
bodies:
  A: {inertia: 1.0e-3}
  B: {inertia: 1.0e-3 kg m^2}
connections:
  mesh:
    gear: {A: 50 mm, B: 50 mm}
    stiffness: 2.4e8
    element: {type: backlash, half_gap: 50 um}
damping: {modal_ratio: 0.05}
loads:
  A: {mean: 100 N m, harmonics: [{order: 1, amplitude: 20}]}
  B: {mean: 100}
report: {units: si}
analyses:
  response: {type: frequency_response, from: 9 kHz, to: 8000 Hz, harmonics: 5, marks: [8.5 kHz]}
";

/// A folder with files; the program runs in it.
pub struct Place {
    pub folder: TempDir,
}

impl Place {
    /// A folder with one file, `m.yaml`.
    pub fn with(text: &str) -> Place {
        let place = Place {
            folder: tempfile::tempdir().unwrap(),
        };
        place.write("m.yaml", text);
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Runs the program with these arguments.
    pub fn run(&self, arguments: &[&str]) -> Ended {
        run_in(self.folder.path(), arguments)
    }

    /// Runs the program with these arguments in a shell that has set a limit, such as `ulimit -t 10`.
    #[cfg(unix)]
    pub fn run_after(&self, limit: &str, arguments: &[&str]) -> Ended {
        let mut shell = assert_cmd::Command::new("sh");
        shell.args(["-c", &format!("{limit}; exec \"$0\" \"$@\"")]);
        shell.arg(assert_cmd::cargo::cargo_bin("gearlash"));
        ended(shell.current_dir(self.folder.path()).args(arguments))
    }

    /// Names in a folder, sorted.
    pub fn names(&self, folder: &str) -> Vec<String> {
        let mut list: Vec<String> = std::fs::read_dir(self.path(folder))
            .unwrap_or_else(|e| panic!("{folder}: {e}"))
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        list.sort();
        list
    }

    /// The records of a CSV file, header first.
    pub fn table(&self, name: &str) -> Vec<Vec<String>> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .from_path(self.path(name))
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let record = |r: Result<csv::StringRecord, csv::Error>| {
            r.unwrap().iter().map(str::to_owned).collect()
        };
        reader.records().map(record).collect()
    }

    /// The numbers of a column; empty cells are NaN.
    pub fn column(&self, name: &str, column: &str) -> Vec<f64> {
        let table = self.table(name);
        let at = table[0].iter().position(|c| c == column);
        let at = at.unwrap_or_else(|| panic!("{name} has no column {column}"));
        let number = |cell: &String| match cell.as_str() {
            "" => f64::NAN,
            text => text.parse().unwrap(),
        };
        table[1..].iter().map(|row| number(&row[at])).collect()
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }
}

/// How the program ended.
pub struct Ended {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Ended {
    /// The exit status, with everything said if it is another one. Nothing may have panicked.
    #[track_caller]
    pub fn ends_with(self, code: i32) -> Ended {
        assert_eq!(self.code, code, "{}\n{}", self.out, self.err);
        assert!(!self.err.contains("panicked"), "{}", self.err);
        self
    }

    /// Whether standard error has all these parts.
    #[track_caller]
    pub fn says(self, parts: &[&str]) -> Ended {
        for part in parts {
            assert!(
                self.err.contains(part),
                "wanted {part:?} in:\n{}",
                &self.err[..self.err.len().min(4000)]
            );
        }
        self
    }
}

pub fn run_in(folder: &Path, arguments: &[&str]) -> Ended {
    let mut program = assert_cmd::Command::cargo_bin("gearlash").unwrap();
    ended(program.current_dir(folder).args(arguments))
}

/// Longer than anything takes: what hangs fails its test.
const FOREVER: std::time::Duration = std::time::Duration::from_secs(120);

fn ended(command: &mut assert_cmd::Command) -> Ended {
    let output: Output = command.timeout(FOREVER).output().unwrap();
    Ended {
        code: output.status.code().unwrap_or(-1),
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}
