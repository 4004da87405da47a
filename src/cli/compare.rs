//! `gearlash compare`.

use super::{CompareArguments, print, say};
use crate::error::Error;
use crate::report::{Comparison, Difference};
use crate::study;
use comfy_table::{Table, presets};
use std::process::ExitCode;

/// Lines of a table in the terminal; the page has all.
const MOST: usize = 40;

/// Compares, writes, prints what differs.
pub fn compare(arguments: &CompareArguments) -> Result<ExitCode, Error> {
    let folders = [arguments.first.as_path(), arguments.second.as_path()];
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| study::default_folder(folders));
    let figures = arguments.figures.formats();
    let (comparison, outcome) = study::compare(folders, &out, &figures)?;
    for text in &comparison.missing {
        say(&format!("note: {text}"));
    }
    print(&text(&comparison))?;
    print(&format!(
        "{} files in {}\n",
        outcome.files.len(),
        out.display()
    ))
}

fn text(comparison: &Comparison) -> String {
    let [a, b] = &comparison.names;
    let mut changes = table(["in the model", a, b, ""]);
    for change in comparison.changes.iter().take(MOST) {
        let [one, other] = &change.values;
        changes.add_row([change.path.as_str(), one, other, ""]);
    }
    let mut differences = table(["in the results", a, b, "change"]);
    for difference in comparison.differences.iter().take(MOST) {
        let [one, other] = difference.values.map(number);
        let quantity = format!("{}: {}", difference.analysis, difference.quantity);
        differences.add_row([quantity, one, other, change(difference)]);
    }
    match comparison.changes.is_empty() {
        true => format!("The models are equal.\n{differences}\n"),
        false => format!("{changes}\n{differences}\n"),
    }
}

fn table(head: [&str; 4]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(head);
    table
}

fn number(x: f64) -> String {
    match x.is_finite() {
        true => super::digits::number(x),
        false => "-".into(),
    }
}

fn change(difference: &Difference) -> String {
    let share = difference
        .share()
        .map(|share| format!("{:+.2} %", 100.0 * share));
    share.unwrap_or_default()
}
