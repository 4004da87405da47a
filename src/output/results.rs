//! The results in a folder, read back: what a run has written, as reports.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Map, Value};

use super::{Input, csv, file_error, json};
use crate::error::{Diagnostic, Error, did_you_mean};
use crate::report::{
    Column, Description, Figure, NamedFigure, Plot, Report, Streamed, Table, Values,
};

/// Content of a results folder.
#[derive(Debug)]
pub struct Results {
    /// Reports in the order of the run.
    pub reports: Vec<Report>,
    /// Model description in the manifest.
    pub description: Description,
    /// Input files of the run.
    pub inputs: Vec<Input>,
    /// Options of the run.
    pub settings: Map<String, Value>,
    /// Files that the manifest lists.
    pub files: Vec<PathBuf>,
}

/// Run description in a manifest.
#[derive(Deserialize)]
pub(crate) struct Manifest {
    #[serde(default)]
    pub(crate) model: Description,
    pub(crate) inputs: Vec<Input>,
    pub(crate) options: Map<String, Value>,
    pub(crate) files: Vec<Input>,
}

#[derive(Deserialize)]
struct ResultHead {
    name: String,
    file: String,
    rows: u64,
    columns: Vec<ColumnHead>,
}

#[derive(Deserialize)]
struct ColumnHead {
    name: String,
    unit: String,
    #[serde(default)]
    kind: String,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct SavedDrawing {
    figure: Option<Figure>,
    further_figures: Vec<NamedFigure>,
    plot: Plot,
    connections: Vec<String>,
}

/// Rows of a study's table that are held; the others are in its file.
const MOST_ROWS: u64 = 20_000;

/// Rows of the tables of studies that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeldRows {
    /// As many as are drawn.
    Drawn,
    /// All.
    All,
}

impl Results {
    /// Names of the analyses.
    pub fn names(&self) -> Vec<&str> {
        self.reports
            .iter()
            .map(|report| report.name.as_str())
            .collect()
    }

    /// Refuses names that are not there.
    ///
    /// # Errors
    /// The first one, with the nearest that is.
    pub fn check_names(&self, only: &[String]) -> Result<(), Error> {
        let names = self.names();
        let Some(unknown) = only.iter().find(|name| !names.contains(&name.as_str())) else {
            return Ok(());
        };
        Err(Error::Input(vec![Diagnostic {
            location: None,
            path: "--only".into(),
            message: format!("the folder has no analysis `{unknown}`"),
            help: Some(did_you_mean(unknown, names)),
        }]))
    }
}

/// Reads a folder that `gearlash run` has written.
///
/// # Errors
/// `Error::File`: a file that is missing, damaged, or no result.
pub fn read(folder: &Path, rows: HeldRows) -> Result<Results, Error> {
    let path = folder.join("manifest.json");
    let manifest: Manifest = read_json(&path)?;
    let timings: Map<String, Value> = read_json(&folder.join("timings.json")).unwrap_or_default();
    let names = manifest.files.iter().filter_map(|file| {
        let stem = file.name.strip_suffix(".json")?;
        is_plain(stem).then(|| stem.to_string())
    });
    let mut reports = Vec::new();
    for name in names.collect::<Vec<String>>() {
        let mut report = report(folder, &name, rows)?;
        if let Some(times) = timings.get(&name) {
            report.summary.insert(json::TIMINGS.into(), times.clone());
        }
        reports.push(report);
    }
    let files = manifest.files.iter().filter(|file| is_plain(&file.name));
    Ok(Results {
        reports,
        description: manifest.model,
        files: files.map(|file| folder.join(&file.name)).collect(),
        inputs: manifest.inputs,
        settings: manifest.options,
    })
}

/// A name with a folder in it is none of ours.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && !name.contains(['/', '\\']) && !name.starts_with('.')
}

fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, Error> {
    let bytes = std::fs::read(path).map_err(|source| file_error("read", path, source))?;
    serde_json::from_slice(&bytes).map_err(|error| damaged(path, &error.to_string()))
}

fn damaged(path: &Path, what: &str) -> Error {
    let message = format!("{what}; run the model again");
    file_error("read", path, std::io::Error::other(message))
}

fn report(folder: &Path, name: &str, rows: HeldRows) -> Result<Report, Error> {
    let path = folder.join(format!("{name}.json"));
    let mut map: Map<String, Value> = read_json(&path)?;
    let mut take = |key: &str| map.shift_remove(key).unwrap_or_default();
    let text = |value: Value| value.as_str().unwrap_or_default().to_string();
    let list = |value: Value| serde_json::from_value(value).unwrap_or_default();
    let heads: Vec<ResultHead> = serde_json::from_value(take("tables"))
        .map_err(|error| damaged(&path, &error.to_string()))?;
    let drawing: SavedDrawing = match take(json::FIGURES) {
        Value::Null => SavedDrawing::default(),
        value => {
            serde_json::from_value(value).map_err(|error| damaged(&path, &error.to_string()))?
        }
    };
    let (kind, title, caption) = (
        text(take("type")),
        text(take("title")),
        text(take("caption")),
    );
    let (assumed, warnings) = (list(take("assumed")), list(take("warnings")));
    let ended_early = take("ended_early").as_str().map(String::from);
    for own in ["name", "columns"] {
        take(own);
    }
    let is_study = map.contains_key("study");
    let mut report = Report {
        name: name.to_string(),
        kind,
        title,
        caption,
        assumed,
        figure: drawing.figure,
        further_figures: drawing.further_figures,
        plot: drawing.plot,
        connections: drawing.connections,
        summary: map,
        warnings,
        ended_early,
        ..Report::default()
    };
    for head in heads {
        if is_study && head.name.is_empty() {
            report.streamed = Some(Streamed {
                rows: head.rows,
                files: vec![head.file.clone()],
            });
        }
        let most = match (rows, is_study) {
            (HeldRows::Drawn, true) => MOST_ROWS,
            _ => u64::MAX,
        };
        report.tables.push(table(folder, head, most)?);
    }
    Ok(report)
}

fn table(folder: &Path, head: ResultHead, most: u64) -> Result<Table, Error> {
    let path = folder.join(&head.file);
    if !is_plain(&head.file) {
        return Err(damaged(&path, "a table outside the folder"));
    }
    let columns = head.columns.into_iter().map(|column| {
        let values = Values::of_kind(&column.kind)
            .ok_or_else(|| damaged(&path, "its JSON file has no kinds of columns"))?;
        Ok(Column {
            name: column.name,
            unit: column.unit,
            values,
        })
    });
    let columns: Vec<Column> = columns.collect::<Result<_, Error>>()?;
    let mut table = Table {
        name: head.name,
        columns,
    };
    let stride = head.rows.div_ceil(most).max(1);
    let mut row = 0_u64;
    csv::read(&path, &mut |record| {
        if record.len() != table.columns.len() {
            return Err(damaged(
                &path,
                &format!("row {row} has {} cells", record.len()),
            ));
        }
        if row.is_multiple_of(stride) {
            for (column, text) in table.columns.iter_mut().zip(record.iter()) {
                let cell = column.values.read_cell(text).ok_or_else(|| {
                    damaged(
                        &path,
                        &format!("row {row}, column {}: found `{text}`", column.name),
                    )
                })?;
                column.values.push(cell);
            }
        }
        row += 1;
        Ok(())
    })?;
    Ok(table)
}
