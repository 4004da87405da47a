//! `gearlash export`.

use super::{ExportArguments, print};
use crate::error::Error;
use crate::output::export::{ExportFormat, Names, export as write};
use crate::output::results::{self, HeldRows};
use std::process::ExitCode;

/// Writes and says what.
pub fn export(arguments: &ExportArguments) -> Result<ExitCode, Error> {
    let mut results = results::read(&arguments.folder, HeldRows::All)?;
    results.check_names(&arguments.only)?;
    if !arguments.only.is_empty() {
        results
            .reports
            .retain(|report| arguments.only.contains(&report.name));
    }
    let names = if arguments.safe_names {
        Names::Safe
    } else {
        Names::Written
    };
    let out = arguments.out.as_ref().unwrap_or(&arguments.folder);
    let files = write(&results, &arguments.folder, out, arguments.format, names)?;
    let names = files.iter().filter_map(|file| file.file_name());
    let names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
    print(&format!("{} in {}\n", names.join(", "), out.display()))
}

/// A word of `--format`.
pub fn format(word: &str) -> Result<ExportFormat, String> {
    let found = ExportFormat::ALL.iter().find(|(name, _)| *name == word);
    found.map(|(_, format)| *format).ok_or_else(|| {
        let list: Vec<&str> = ExportFormat::ALL.iter().map(|(name, _)| *name).collect();
        format!("wanted one of {}", list.join(", "))
    })
}
