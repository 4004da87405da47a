//! Figures drawn again from the tables of a folder, without a run.

use super::Outcome;
use crate::error::Error;
use crate::output::results::{self, HeldRows, Results};
use crate::output::{self, FigureFormat, RunOptions};
use crate::report::{Plot, Report};
use crate::yaml::{self, Node, Value};
use std::path::{Path, PathBuf};

/// Keys whose value is a list; one word is a list of one.
const LISTS: [&str; 4] = ["y", "events", "connections", "methods"];

/// Draws the figures of the analyses `only` (all, when there is none) again, with `changes` (`key=value`) to their `plot`, and the
/// page of the folder.
///
/// # Errors
/// A folder without results, a name that it does not have, a change that cannot be drawn: nothing is written then. A file that
/// cannot be written.
pub fn redraw(
    folder: &Path,
    only: &[String],
    changes: &[String],
    formats: &[FigureFormat],
) -> Result<Outcome, Error> {
    let mut results = results::read(folder, HeldRows::Drawn)?;
    results.check_names(only)?;
    let is_chosen = |report: &Report| only.is_empty() || only.contains(&report.name);
    for report in results.reports.iter_mut().filter(|r| is_chosen(r)) {
        report.plot = changed(&report.plot, changes)?;
        check(report, only.is_empty())?;
    }
    let mut files = Vec::new();
    for report in results.reports.iter().filter(|r| is_chosen(r)) {
        files.extend(output::write_figures(folder, report, formats)?);
    }
    conclude(folder, results, files, formats)
}

/// A figure's settings with changes.
fn changed(plot: &Plot, changes: &[String]) -> Result<Plot, Error> {
    let mut node = Node::from_json(&serde_json::to_value(plot).unwrap_or_default());
    for change in changes {
        yaml::apply_override(&mut node, change).map_err(|fault| Error::Input(vec![fault]))?;
    }
    if let Value::Map(map) = &mut node.value {
        for key in LISTS {
            if let Some(entry) = map.get_mut(key)
                && let Value::Scalar { text, .. } = &entry.node.value
            {
                let words = text
                    .split(',')
                    .map(str::trim)
                    .filter(|word| !word.is_empty());
                entry.node = Node::list(words.map(Node::quoted).collect::<Vec<_>>());
            }
        }
    }
    node.read::<Plot>("plot")
        .map_err(|fault| Error::Input(vec![fault]))
}

#[cfg(feature = "figures")]
fn check(report: &Report, is_every: bool) -> Result<(), Error> {
    for (_, figure) in report.figures() {
        output::svg::render(figure, report).map_err(|error| match error {
            Error::Input(list) if is_every => Error::Input(
                (list.into_iter())
                    .map(|fault| fault.with_help("`--only NAME` draws one analysis"))
                    .collect(),
            ),
            other => other,
        })?;
    }
    Ok(())
}

#[cfg(not(feature = "figures"))]
fn check(_: &Report, _: bool) -> Result<(), Error> {
    Ok(())
}

/// The page and the manifest of a folder whose figures are new.
fn conclude(
    folder: &Path,
    results: Results,
    figures: Vec<PathBuf>,
    formats: &[FigureFormat],
) -> Result<Outcome, Error> {
    let options = RunOptions {
        model: results.description.name.clone(),
        figures: formats.to_vec(),
        inputs: results.inputs,
        settings: results.settings,
        description: results.description,
        comparison: None,
    };
    let page = folder.join("report.html");
    let kept = results
        .files
        .into_iter()
        .filter(|file| *file != page && file.exists());
    let mut listed: Vec<PathBuf> = kept.collect();
    listed.extend(
        figures
            .iter()
            .filter(|f| !listed.contains(f))
            .cloned()
            .collect::<Vec<_>>(),
    );
    let summary = output::write_summary(folder, &results.reports, &options, &listed)?;
    Ok(Outcome {
        reports: results.reports,
        files: figures.into_iter().chain(summary).collect(),
        interrupted: false,
        left_out: Vec::new(),
        warnings: Vec::new(),
    })
}
