//! What a study says of itself beside its table: enough to go on with it, and to join its parts.

use super::Shard;
use crate::error::{Diagnostic, Error};
use crate::output::journal;
use crate::report::{Column, Values};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::Path;

/// The key `study` of `NAME.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct StudyRecord {
    /// Name of the model.
    pub model: String,
    /// Version of the program.
    pub version: String,
    /// SHA-256 of everything that the rows depend on but the program.
    pub input: String,
    /// Runs of the whole study.
    pub runs: u64,
    /// The part that this is; `None`: all of it.
    pub shard: Option<Shard>,
    /// Runs in the table.
    pub finished: u64,
    /// Columns of the table.
    pub columns: Vec<Head>,
    /// The author's words below the heading.
    pub caption: String,
    /// Warnings about the model as written.
    pub warnings: Vec<String>,
}

/// A column without values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Head {
    pub name: String,
    pub unit: String,
    pub kind: String,
}

impl Head {
    /// Of a column.
    pub fn of(column: &Column) -> Head {
        Head {
            name: column.name.clone(),
            unit: column.unit.clone(),
            kind: column.values.kind().into(),
        }
    }

    /// The column; `None` when the kind is unknown.
    pub fn column(&self) -> Option<Column> {
        Some(Column {
            name: self.name.clone(),
            unit: self.unit.clone(),
            values: Values::of_kind(&self.kind)?,
        })
    }
}

impl StudyRecord {
    /// First line of a journal: whose lines these are.
    pub fn header(&self, study: &str) -> String {
        let StudyRecord {
            version,
            input,
            runs,
            shard,
            ..
        } = self;
        json!({
            "gearlash journal": 1,
            "study": study,
            "version": version,
            "input": input,
            "runs": runs,
            "shard": shard,
        })
        .to_string()
    }

    /// The record in the `NAME.json` of a folder; `None` where there is none.
    pub fn read(folder: &Path, study: &str) -> Option<StudyRecord> {
        let text = std::fs::read(folder.join(format!("{study}.json"))).ok()?;
        let mut value: Value = serde_json::from_slice(&text).ok()?;
        serde_json::from_value(value.get_mut("study")?.take()).ok()
    }

    /// Refuses a folder that holds another part of the same study: two parts there would overwrite each other.
    ///
    /// # Errors
    /// When there is one.
    pub fn refuse_other_parts(&self, study: &str, folder: &Path) -> Result<(), Error> {
        let Some(own) = self.shard else {
            return Ok(());
        };
        let written = StudyRecord::read(folder, study).and_then(|record| record.shard);
        let begun = journals(folder, study).into_iter().filter_map(|name| {
            let header = journal::header(&folder.join(name))?;
            let value: Value = serde_json::from_str(&header).ok()?;
            let is_same = value["input"] == json!(self.input);
            serde_json::from_value(value["shard"].clone())
                .ok()
                .filter(|_| is_same)?
        });
        match written.into_iter().chain(begun).find(|other| *other != own) {
            None => Ok(()),
            Some(other) => Err(Error::Input(vec![Diagnostic {
                location: None,
                path: "--out".into(),
                message: format!(
                    "{} holds part {other} of `{study}`, which part {own} would overwrite",
                    folder.display()
                ),
                help: Some("give every part a separate folder".into()),
            }])),
        }
    }
}

/// Names of the journals of a study in a folder.
pub(super) fn journals(folder: &Path, study: &str) -> Vec<String> {
    let front = format!("{study}.");
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = names
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with(&front) && name.ends_with(".journal"))
        .filter(|name| journal::header(&folder.join(name)).is_some())
        .collect();
    names.sort();
    names
}
