//! `gearlash run`.

use super::progress::Terminal;
use super::{ENDED_EARLY, INTERRUPTED, RunArguments, print};
use crate::error::Error;
use crate::report::{Report, Values};
use crate::study::{RunSettings, Study};
use comfy_table::{Table, presets};
use std::path::PathBuf;
use std::process::ExitCode;

/// Loads, runs, writes, prints a short table.
pub fn run(arguments: &RunArguments) -> Result<ExitCode, Error> {
    let study = Study::load(&arguments.file, &arguments.set, &arguments.only)?;
    let jobs = arguments.jobs.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        usize::from,
    );
    let mut figures = arguments.figures.clone();
    figures.dedup();
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| default_folder(&arguments.file));
    let settings = RunSettings { out, figures, jobs };
    let control = Terminal::new(study.runs.len(), arguments.quiet);
    control.watch_for_interrupts();
    let outcome = study.run(&settings, &control)?;
    control.clear();
    for report in &outcome.reports {
        report
            .warnings
            .iter()
            .for_each(|w| eprintln!("warning: {}: {w}", report.name));
        if let Some(reason) = &report.ended_early {
            eprintln!("ended early: {}: {reason}", report.name);
        }
    }
    if !arguments.quiet {
        print(&summary(&outcome.reports))?;
        if study.runs.is_empty() {
            print("the file has no analyses\n")?;
        }
        print(&format!(
            "{} files in {}\n",
            outcome.files.len(),
            settings.out.display()
        ))?;
    }
    let ended_early = outcome.reports.iter().any(|r| r.ended_early.is_some());
    Ok(match () {
        _ if outcome.interrupted => ExitCode::from(INTERRUPTED),
        _ if ended_early => ExitCode::from(ENDED_EARLY),
        _ => ExitCode::SUCCESS,
    })
}

fn default_folder(file: &std::path::Path) -> PathBuf {
    let stem = file.file_stem().unwrap_or(file.as_os_str());
    PathBuf::from("results").join(stem)
}

/// One line an analysis: rows, events by kind, how it ended.
fn summary(reports: &[Report]) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(["analysis", "type", "rows", "events", "end"]);
    for report in reports {
        let rows = report.table("").map_or(0, crate::report::Table::rows);
        let end = match &report.ended_early {
            Some(_) => "ended early",
            None => "complete",
        };
        table.add_row([
            report.name.clone(),
            report.kind.clone(),
            rows.to_string(),
            events(report),
            end.to_string(),
        ]);
    }
    format!("{table}\n")
}

/// `2 fold, 4 period_doubling`.
fn events(report: &Report) -> String {
    let kinds = report.table("events").and_then(|t| t.column("kind"));
    let Some(Values::Text(kinds)) = kinds.map(|c| &c.values) else {
        return String::new();
    };
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for kind in kinds {
        match counts.iter_mut().find(|(word, _)| word == kind) {
            Some((_, count)) => *count += 1,
            None => counts.push((kind, 1)),
        }
    }
    counts
        .iter()
        .map(|(word, count)| format!("{count} {word}"))
        .collect::<Vec<_>>()
        .join(", ")
}
