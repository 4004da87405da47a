//! `gearlash run`.

use super::progress::{RunLimits, Terminal};
use super::{ENDED_EARLY, RunArguments, print, say};
use crate::error::{Diagnostic, Error};
use crate::report::{Report, Values};
use crate::study::{Outcome, RunSettings, Shard, Study};
use comfy_table::{Table, presets};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Loads, runs, writes, prints a short table.
pub fn run(arguments: &RunArguments) -> Result<ExitCode, Error> {
    let study = Study::load(&arguments.file, &arguments.set, &arguments.only)?;
    if study.runs.is_empty() {
        return Err(nothing_to_run());
    }
    let jobs = arguments.jobs.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        usize::from,
    );
    let figures = arguments.figures.formats();
    let out = match (&arguments.out, arguments.shard) {
        (Some(out), _) => out.clone(),
        (None, None) => default_folder(&arguments.file),
        (None, Some(Shard { index, count })) => {
            default_folder(&arguments.file).join(format!("shard-{index}-of-{count}"))
        }
    };
    let settings = RunSettings { out, figures, jobs };
    let limits = RunLimits {
        time: arguments.time_limit,
        memory: arguments.memory_limit,
    };
    let control = Terminal::new(study.runs.len(), arguments.quiet, limits);
    control.watch_for_signals();
    for warning in study.forewarnings(&control)? {
        say(&format!("warning: {warning}"));
    }
    control.watch_limits();
    let outcome = match arguments.shard {
        None => study.run(&settings, &control)?,
        Some(shard) => study.run_shard(&settings, shard, &control)?,
    };
    control.clear();
    for name in &outcome.left_out {
        say(&format!(
            "note: {name} is not a parameter_study and runs only without --shard"
        ));
    }
    let status = tell(&outcome, &settings.out, arguments.quiet)?;
    Ok(control
        .cause()
        .map_or(status, |cause| ExitCode::from(cause.status())))
}

fn nothing_to_run() -> Error {
    Error::Input(vec![Diagnostic {
        location: None,
        path: "analyses".into(),
        message: "the file has no analyses: nothing to run".into(),
        help: Some(
            "add one, such as `analyses: {lines: {type: modes}}`; `gearlash check` needs none"
                .into(),
        ),
    }])
}

/// Prints warnings, early ends and a short table; the exit status.
pub fn tell(outcome: &Outcome, out: &Path, quiet: bool) -> Result<ExitCode, Error> {
    for report in &outcome.reports {
        for warning in &report.warnings {
            say(&format!("warning: {}: {warning}", report.name));
        }
        if let Some(reason) = &report.ended_early {
            say(&format!("ended early: {}: {reason}", report.name));
        }
    }
    for warning in &outcome.warnings {
        say(&format!("warning: {warning}"));
    }
    if !quiet {
        print(&summary(&outcome.reports))?;
        print(&format!(
            "{} files in {}\n",
            outcome.files.len(),
            out.display()
        ))?;
    }
    let ended_early = outcome.reports.iter().any(|r| r.ended_early.is_some());
    Ok(match ended_early {
        true => ExitCode::from(ENDED_EARLY),
        false => ExitCode::SUCCESS,
    })
}

fn default_folder(file: &Path) -> PathBuf {
    let stem = file.file_stem().unwrap_or(file.as_os_str());
    PathBuf::from("results").join(stem)
}

/// One line per analysis: rows, events by kind, end; then the summaries of the flow and of the error estimates.
fn summary(reports: &[Report]) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(["analysis", "type", "rows", "events", "end"]);
    for report in reports {
        let rows = report.table("").map_or(0, |table| report.rows(table));
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
    let messages = reports.iter().flat_map(|report| {
        let said = |key: &str| report.summary.get(key)?.get("message")?.as_str();
        let messages = ["verify", "accuracy"].into_iter().filter_map(said);
        messages.map(|message| format!("{}: {message}\n", report.name))
    });
    format!("{table}\n{}", messages.collect::<String>())
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
