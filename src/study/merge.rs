//! Joining the parts of a sharded study.

use super::ensemble::conclude;
use super::record::{Head, StudyRecord, journals};
use super::{Outcome, RunSettings, Shard, WrittenReport, plotting};
use crate::analysis::ParameterStudy;
use crate::error::{Diagnostic, Error};
use crate::output::manifest::size_and_hash;
use crate::output::results::Manifest;
use crate::output::stream::{Lines, RowFile};
use crate::output::{self, Input, RunOptions};
use crate::report::{Column, Report};
use indexmap::IndexMap;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// One part of one study.
struct StudyPart {
    folder: PathBuf,
    record: StudyRecord,
    json: Value,
}

/// Joins the parts in these folders into results as one run would have written them.
///
/// # Errors
/// Parts that do not belong together, are incomplete, missing, given twice or damaged: nothing is written then. A file that
/// cannot be written.
pub fn merge(folders: &[PathBuf], settings: &RunSettings) -> Result<Outcome, Error> {
    let mut faults = Vec::new();
    let mut studies: IndexMap<String, Vec<StudyPart>> = IndexMap::new();
    let mut manifests = Vec::new();
    for folder in folders {
        if same_folder(folder, &settings.out) {
            faults.push(fault(
                &settings.out,
                "is one of the parts",
                "give `--out` a separate folder",
            ));
        }
        match read(folder) {
            Ok((manifest, parts)) => {
                manifests.push(manifest);
                for (name, part) in parts {
                    studies.entry(name).or_default().push(part);
                }
            }
            Err(list) => faults.extend(list),
        }
    }
    for (name, parts) in &mut studies {
        let inputs = manifests
            .first()
            .map_or(&[][..], |manifest: &Manifest| &manifest.inputs);
        faults.extend(misfits(name, parts, inputs));
        parts.sort_by_key(|part| part.shard().index);
    }
    if !faults.is_empty() {
        return Err(Error::Input(faults));
    }
    let Some(manifest) = manifests.into_iter().next() else {
        let help = "such as `gearlash merge part-1 part-2 --out all`";
        return Err(Error::Input(vec![fault(
            Path::new(""),
            "no folders to join",
            help,
        )]));
    };
    let mut written = Vec::new();
    let mut model = String::new();
    for (name, parts) in &studies {
        let report = join(name, parts, settings)?;
        model.clone_from(&parts[0].record.model);
        written.push(WrittenReport::new(report, settings)?);
    }
    let options = RunOptions {
        model,
        figures: settings.figures.clone(),
        inputs: manifest.inputs,
        settings: manifest.options,
        description: manifest.model,
        comparison: None,
    };
    Outcome::summarised(written, settings, &options, false)
}

impl StudyPart {
    /// Which part it is: `read` takes nothing else.
    fn shard(&self) -> Shard {
        self.record.shard.unwrap_or(Shard::WHOLE)
    }

    fn table(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.csv"))
    }
}

fn fault(path: &Path, message: impl Into<String>, help: &str) -> Diagnostic {
    Diagnostic {
        location: None,
        path: path.display().to_string(),
        message: message.into(),
        help: (!help.is_empty()).then(|| help.into()),
    }
}

fn same_folder(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

/// A folder's manifest and its parts by the names of their studies.
type Contents = (Manifest, Vec<(String, StudyPart)>);

/// What a folder of a part holds.
fn read(folder: &Path) -> Result<Contents, Vec<Diagnostic>> {
    let one = |message: String, help: &str| vec![fault(folder, message, help)];
    let path = folder.join("manifest.json");
    let text = std::fs::read(&path).map_err(|error| {
        let message = format!("cannot read {}: {error}", path.display());
        one(
            message,
            "a part that was killed has none yet: repeat its command, it resumes",
        )
    })?;
    let manifest: Manifest = serde_json::from_slice(&text)
        .map_err(|error| one(format!("{} is not a manifest: {error}", path.display()), ""))?;
    let mut parts = Vec::new();
    let mut faults = Vec::new();
    for file in manifest.files.iter().filter(|f| f.name.ends_with(".json")) {
        let name = file.name.trim_end_matches(".json");
        let text = std::fs::read(folder.join(&file.name)).unwrap_or_default();
        let json: Value = serde_json::from_slice(&text).unwrap_or(Value::Null);
        let record = serde_json::from_value::<StudyRecord>(json["study"].clone());
        let Ok(record) = record else {
            continue;
        };
        if record.shard.is_none() {
            let message = format!("`{name}` is a whole study, not a part of one");
            faults.push(fault(
                folder,
                message,
                "parts come from `gearlash run --shard i/n`",
            ));
            continue;
        }
        let folder = folder.to_path_buf();
        faults.extend(damage(&folder, name, &record, &manifest));
        parts.push((
            name.to_string(),
            StudyPart {
                folder,
                record,
                json,
            },
        ));
    }
    if parts.is_empty() && faults.is_empty() {
        faults.push(fault(
            folder,
            "holds no part of a study",
            "parts come from `gearlash run --shard i/n`",
        ));
    }
    if faults.is_empty() {
        Ok((manifest, parts))
    } else {
        Err(faults)
    }
}

/// What is wrong with a part by itself: runs that are missing, a table that is not the one that was written.
fn damage(
    folder: &Path,
    name: &str,
    record: &StudyRecord,
    manifest: &Manifest,
) -> Option<Diagnostic> {
    let share = record.shard?.share(record.runs);
    if record.finished < share || !journals(folder, name).is_empty() {
        let message = format!(
            "`{name}` has {} of its {share} runs, or is running",
            record.finished
        );
        return Some(fault(
            folder,
            message,
            "repeat the command of this part, it resumes",
        ));
    }
    let table = format!("{name}.csv");
    let listed = manifest.files.iter().find(|f| f.name == table);
    match (listed, size_and_hash(&folder.join(&table))) {
        (_, Err(error)) => Some(fault(folder, error.to_string(), "")),
        (Some(file), Ok((size, hash))) if file.size == size && file.sha256 == hash => None,
        _ => {
            let message =
                format!("{table} is not what was written: its hash differs from the manifest's");
            Some(fault(folder, message, "repeat the command of this part"))
        }
    }
}

/// The command that makes a part, as it made the first one: into the folder that is called after its number, where that one is.
fn command(first: &StudyPart, inputs: &[Input], index: u64) -> String {
    let file = inputs.first().map_or("FILE", |input| input.name.as_str());
    let Shard { index: own, count } = first.shard();
    let folder = first.folder.display().to_string();
    let out = match folder.rfind(&own.to_string()) {
        Some(at) if folder.matches(&own.to_string()).count() == 1 => {
            let rest = &folder[at + own.to_string().len()..];
            format!(" --out {}{index}{rest}", &folder[..at])
        }
        _ => String::new(),
    };
    let overrides = inputs.iter().filter(|input| input.name == "--set").count();
    let set = " --set ..".repeat(overrides);
    format!("gearlash run {file}{set} --shard {index}/{count}{out}")
}

/// What keeps the parts of one study apart.
fn misfits(name: &str, parts: &[StudyPart], inputs: &[Input]) -> Vec<Diagnostic> {
    let first = &parts[0];
    let mut faults = Vec::new();
    for part in &parts[1..] {
        let (own, wanted) = (&part.record, &first.record);
        let pairs: [(&str, &str, String, String); 4] = [
            (
                "program version",
                "",
                own.version.clone(),
                wanted.version.clone(),
            ),
            (
                "number of parts",
                "",
                part.shard().count.to_string(),
                first.shard().count.to_string(),
            ),
            (
                "number of runs",
                "",
                own.runs.to_string(),
                wanted.runs.to_string(),
            ),
            (
                "input",
                " (SHA-256 of model and settings)",
                own.input.clone(),
                wanted.input.clone(),
            ),
        ];
        let odd = pairs.into_iter().find(|(_, _, own, wanted)| own != wanted);
        if let Some((what, more, own, wanted)) = odd {
            let message = format!(
                "`{name}` has another {what} than in {}: {own} instead of {wanted}{more}",
                first.folder.display()
            );
            faults.push(fault(
                &part.folder,
                message,
                "parts belong to one study with the same settings",
            ));
        }
    }
    if !faults.is_empty() {
        return faults;
    }
    let count = first.shard().count;
    let mut missing = Vec::new();
    for index in 1..=count {
        let mut holders = parts.iter().filter(|part| part.shard().index == index);
        match (holders.next(), holders.next()) {
            (None, _) => missing.push(index),
            (Some(one), Some(other)) => {
                let message = format!(
                    "part {index}/{count} of `{name}` is also in {}",
                    one.folder.display()
                );
                faults.push(fault(&other.folder, message, "give every part once"));
            }
            (Some(_), None) => {}
        }
    }
    if !missing.is_empty() {
        let list: Vec<String> = missing.iter().take(10).map(u64::to_string).collect();
        let dots = if missing.len() > list.len() {
            ", .."
        } else {
            ""
        };
        let message = format!(
            "{} of the {count} parts of `{name}` missing: {}{dots}",
            missing.len(),
            list.join(", ")
        );
        let commands: Vec<String> = (missing.iter().take(10))
            .map(|index| command(first, inputs, *index))
            .collect();
        let help = format!("make them: {}{dots}", commands.join("; "));
        faults.push(fault(Path::new(""), message, &help));
    }
    faults
}

/// One study: its table, run by run from the part that holds it, then its report.
fn join(name: &str, parts: &[StudyPart], settings: &RunSettings) -> Result<Report, Error> {
    let first = &parts[0];
    let refused = |what: &str| {
        let path = first.folder.join(format!("{name}.json"));
        Error::Input(vec![fault(&path, what, "")])
    };
    let columns: Option<Vec<Column>> = first.record.columns.iter().map(Head::column).collect();
    let columns = columns.ok_or_else(|| refused("columns of an unknown kind"))?;
    let study: ParameterStudy = serde_json::from_value(first.json["options"].clone())
        .map_err(|error| refused(&format!("its options are no study's: {error}")))?;
    output::create_folder(&settings.out)?;
    let table = settings.out.join(format!("{name}.csv"));
    let mut rows = RowFile::create(&table, &columns)?;
    let mut sources = parts
        .iter()
        .map(|part| Lines::new(part.table(name)))
        .collect::<Vec<_>>();
    for source in &mut sources {
        // The header row.
        source.next_line()?;
    }
    let count = sources.len() as u64;
    for run in 0..first.record.runs {
        let source = &mut sources[(run % count) as usize];
        let line = source.next_line()?;
        let is_next = line.is_some_and(|line| {
            line.split(|b| *b == b',').next() == Some(run.to_string().as_bytes())
        });
        match line.filter(|_| is_next) {
            Some(line) => rows.write(line)?,
            None => {
                let path = parts[(run % count) as usize].table(name);
                let message = format!("run {run} is out of place");
                return Err(Error::Input(vec![fault(
                    &path,
                    message,
                    "repeat the command of this part",
                )]));
            }
        }
    }
    rows.finish()?;
    let record = StudyRecord {
        shard: None,
        finished: first.record.runs,
        ..first.record.clone()
    };
    let mut report = conclude(&study, &table, &columns, record.runs, &record)?;
    report.warnings.splice(0..0, record.warnings);
    let parts = [record.caption, std::mem::take(&mut report.caption)];
    let parts = parts.into_iter().filter(|text| !text.is_empty());
    report.caption = parts.collect::<Vec<_>>().join(" ");
    name_report(&mut report, name, &first.json);
    Ok(report)
}

/// Name, texts and scales as the first part has them.
fn name_report(report: &mut Report, name: &str, json: &Value) {
    let text = |key: &str| json[key].as_str().unwrap_or_default().to_string();
    report.name = name.to_owned();
    report.kind = text("type");
    report.title = text("title");
    plotting::inherit(report, json);
    let assumed = json["assumed"].as_array().into_iter().flatten();
    report.assumed = assumed
        .filter_map(Value::as_str)
        .map(String::from)
        .collect();
    report
        .summary
        .insert("scales".into(), json["scales"].clone());
}
