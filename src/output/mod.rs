//! Results on disk: tables, figures, the page of a run and its manifest, all from [`Report`]s.
//!
//! Every file is written under a temporary name in its folder and renamed when it is complete, so that a file under
//! its own name is whole, also after an interruption or on a full disk.

pub mod csv;
pub mod export;
pub mod folder;
#[cfg(feature = "figures")]
pub mod html;
#[cfg(feature = "figures")]
pub mod image;
pub mod journal;
pub mod json;
pub mod manifest;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod stream;
#[cfg(feature = "figures")]
pub mod svg;

#[cfg(feature = "figures")]
pub mod arrange;
#[cfg(feature = "figures")]
mod axis;
#[cfg(feature = "figures")]
mod beside;
#[cfg(feature = "figures")]
mod draw;
#[cfg(feature = "figures")]
mod groups;
#[cfg(feature = "figures")]
mod legend;
#[cfg(feature = "figures")]
mod look;
#[cfg(feature = "figures")]
mod orbit_data;
#[cfg(feature = "figures")]
mod page_sections;
#[cfg(feature = "figures")]
mod panel;
#[cfg(feature = "figures")]
mod plot_data;
#[cfg(feature = "figures")]
mod raster;
pub mod results;
#[cfg(feature = "figures")]
mod room;
#[cfg(feature = "figures")]
pub mod schematic;
#[cfg(feature = "figures")]
mod series;
#[cfg(feature = "figures")]
mod sheet;
#[cfg(feature = "figures")]
mod shown;
#[cfg(feature = "figures")]
mod sparse;
#[cfg(feature = "figures")]
mod text;
#[cfg(feature = "figures")]
mod units;

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use crate::error::Error;
use crate::report::{Comparison, Description, Report, Table};

/// Format of the static figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureFormat {
    /// Scalable vector graphics, `NAME.svg`.
    Svg,
    /// Pixels, 300 dots per inch, `NAME.png`.
    Png,
    /// One page, `NAME.pdf`.
    Pdf,
}

impl FigureFormat {
    /// Every format that this build can write: none without the feature `figures`.
    pub const ALL: &[FigureFormat] = match cfg!(feature = "figures") {
        true => &[FigureFormat::Svg, FigureFormat::Png, FigureFormat::Pdf],
        false => &[],
    };

    /// Ending of the file name.
    pub fn extension(self) -> &'static str {
        match self {
            FigureFormat::Svg => "svg",
            FigureFormat::Png => "png",
            FigureFormat::Pdf => "pdf",
        }
    }
}

/// Data of a run for the outputs, besides its reports.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Name of the model: heading of the page.
    pub model: String,
    /// Formats of the static figures; empty: none.
    pub figures: Vec<FigureFormat>,
    /// Input files.
    pub inputs: Vec<Input>,
    /// Options, tolerances and seeds for the manifest.
    pub settings: Map<String, Value>,
    /// The model: names, numbers, connections, for the page and for comparisons.
    pub description: Description,
    /// Differences between two runs, for the page of their comparison.
    pub comparison: Option<Comparison>,
}

/// An input file as the manifest lists it.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Input {
    /// Name as the user wrote it.
    pub name: String,
    /// Bytes.
    pub size: u64,
    /// SHA-256, 64 hexadecimal digits.
    pub sha256: String,
}

impl Input {
    /// The entry of a text.
    pub fn of(name: impl Into<String>, bytes: &[u8]) -> Input {
        Input {
            name: name.into(),
            size: bytes.len() as u64,
            sha256: manifest::sha256(bytes),
        }
    }
}

/// Writes a whole run: the files of every report, `report.html` and `manifest.json`. Returns all paths.
///
/// # Errors
///
/// Those of [`write_report`] and [`write_summary`].
pub fn write_run(
    out_dir: &Path,
    reports: &[Report],
    options: &RunOptions,
) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for report in reports {
        files.extend(write_report(out_dir, report, &options.figures)?);
    }
    files.extend(write_summary(out_dir, reports, options, &files)?);
    Ok(files)
}

/// Writes the files of one report: its tables, `NAME.json` and its figure. Returns their paths. Creates the folder.
///
/// # Errors
///
/// `Error::File` when a file cannot be written (it names the file), or when the report's name is not a file name or would
/// overwrite the manifest; `Error::Input` when the figure wants a column that is not there.
pub fn write_report(
    out_dir: &Path,
    report: &Report,
    figures: &[FigureFormat],
) -> Result<Vec<PathBuf>, Error> {
    check_name(out_dir, &report.name)?;
    create_folder(out_dir)?;
    let mut files = Vec::new();
    for table in &report.tables {
        if !report.is_streamed(table) {
            let path = out_dir.join(table_file(report, table));
            write_file(&path, |out| csv::write(table, out))?;
        }
        let names = table_files(report, table);
        files.extend(names.iter().map(|name| out_dir.join(name)));
    }
    let path = out_dir.join(format!("{}.json", report.name));
    write_json(&path, &json::value(report))?;
    files.push(path);
    files.extend(write_figures(out_dir, report, figures)?);
    Ok(files)
}

/// Writes the figures of a report in every requested format: `NAME.svg`, `NAME.FIGURE.svg`. Returns their paths.
///
/// # Errors
/// As [`write_report`].
#[cfg(feature = "figures")]
pub fn write_figures(
    out_dir: &Path,
    report: &Report,
    formats: &[FigureFormat],
) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for (name, figure) in report.figures() {
        let svg = svg::render(figure, report)?;
        for format in formats {
            let path = out_dir.join(figure_file(report, name, *format));
            let bytes = match format {
                FigureFormat::Svg => Ok(svg.clone().into_bytes()),
                FigureFormat::Png => image::png(&svg),
                FigureFormat::Pdf => image::pdf(&svg),
            };
            let bytes = bytes
                .map_err(|message| file_error("draw", &path, std::io::Error::other(message)))?;
            write_file(&path, |out| out.write_all(&bytes))?;
            files.push(path);
        }
    }
    Ok(files)
}

/// Refuses every format: this build has no figures.
///
/// # Errors
/// Always, when there is a format.
#[cfg(not(feature = "figures"))]
pub fn write_figures(
    out_dir: &Path,
    report: &Report,
    formats: &[FigureFormat],
) -> Result<Vec<PathBuf>, Error> {
    let Some(format) = formats.first() else {
        return Ok(Vec::new());
    };
    let path = out_dir.join(format!("{}.{}", report.name, format.extension()));
    let reason = "gearlash was built without the feature `figures`";
    let source = std::io::Error::new(std::io::ErrorKind::Unsupported, reason);
    Err(file_error("draw", &path, source))
}

/// Writes `report.html` (with the feature `figures`), `timings.json` (`{NAME: {seconds}}`) and, last, `manifest.json`, which
/// lists `files` (those written before) and the page. Returns their paths. Times are in a file of their own that no manifest
/// lists, so that equal results have equal files.
///
/// # Errors
///
/// `Error::File` when a file cannot be written or one of `files` cannot be read back; `Error::Input` as in
/// [`write_report`].
pub fn write_summary(
    out_dir: &Path,
    reports: &[Report],
    options: &RunOptions,
    files: &[PathBuf],
) -> Result<Vec<PathBuf>, Error> {
    create_folder(out_dir)?;
    let mut written = write_page(out_dir, reports, options)?;
    let listed: Vec<PathBuf> = files.iter().chain(&written).cloned().collect();
    let timings = out_dir.join("timings.json");
    let times = reports.iter().filter_map(|report| {
        let times = report.summary.get(json::TIMINGS)?.clone();
        Some((report.name.clone(), times))
    });
    write_json(&timings, &Value::Object(times.collect()))?;
    let path = out_dir.join("manifest.json");
    let value = manifest::value(out_dir, options, &listed)?;
    write_json(&path, &value)?;
    written.extend([timings, path]);
    Ok(written)
}

#[cfg(feature = "figures")]
fn write_page(
    out_dir: &Path,
    reports: &[Report],
    options: &RunOptions,
) -> Result<Vec<PathBuf>, Error> {
    let page = out_dir.join("report.html");
    let content = html::render(reports, options)?;
    write_file(&page, |out| content.write(out))?;
    Ok(vec![page])
}

/// No page without figures.
#[cfg(not(feature = "figures"))]
fn write_page(_: &Path, _: &[Report], _: &RunOptions) -> Result<Vec<PathBuf>, Error> {
    Ok(Vec::new())
}

/// Draws a train into a file: SVG, PNG or PDF by the ending of its name.
///
/// # Errors
/// `Error::File`: another ending, a model without bodies, a file that cannot be written.
#[cfg(feature = "figures")]
pub fn write_schematic(path: &Path, model: &Description) -> Result<(), Error> {
    let failed = |message: String| file_error("draw", path, std::io::Error::other(message));
    let svg = schematic::render(model)
        .ok_or_else(|| failed("a reduced model has no bodies to draw".into()))?;
    let bytes = match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => Ok(svg.into_bytes()),
        Some("png") => image::png(&svg),
        Some("pdf") => image::pdf(&svg),
        _ => Err("wanted a name that ends with .svg, .png or .pdf".into()),
    };
    let bytes = bytes.map_err(failed)?;
    write_file(path, |out| out.write_all(&bytes))
}

/// Refuses: this build has no figures.
///
/// # Errors
/// Always.
#[cfg(not(feature = "figures"))]
pub fn write_schematic(path: &Path, _: &Description) -> Result<(), Error> {
    let reason = "gearlash was built without the feature `figures`";
    let source = std::io::Error::new(std::io::ErrorKind::Unsupported, reason);
    Err(file_error("draw", path, source))
}

/// File name of a figure: `NAME.svg`, or `NAME.FIGURE.svg` for all but the first one.
#[cfg(feature = "figures")]
fn figure_file(report: &Report, figure: &str, format: FigureFormat) -> String {
    let ending = format.extension();
    match figure {
        "" => format!("{}.{ending}", report.name),
        figure => format!("{}.{figure}.{ending}", report.name),
    }
}

/// File name of a table: `NAME.csv`, or `NAME.TABLE.csv` for all but the main one.
pub fn table_file(report: &Report, table: &Table) -> String {
    match table.name.as_str() {
        "" => format!("{}.csv", report.name),
        name => format!("{}.{name}.csv", report.name),
    }
}

/// Names of all files that hold a table.
fn table_files(report: &Report, table: &Table) -> Vec<String> {
    match &report.streamed {
        Some(streamed) if report.is_streamed(table) => streamed.files.clone(),
        _ => vec![table_file(report, table)],
    }
}

fn check_name(out_dir: &Path, name: &str) -> Result<(), Error> {
    let reason = if name == "manifest" {
        "an analysis of this name would overwrite manifest.json"
    } else if name.is_empty() || name.starts_with('.') || name.contains(['/', '\\', '\0']) {
        "the name of the analysis is no file name"
    } else {
        return Ok(());
    };
    let path = out_dir.join(format!("{name}.json"));
    let source = std::io::Error::new(std::io::ErrorKind::InvalidInput, reason);
    Err(file_error("write", &path, source))
}

/// Creates a folder and those above it.
///
/// # Errors
/// Errors of the operating system, with the name of the folder.
pub fn create_folder(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|source| file_error("create", folder, source))
}

fn write_json(path: &Path, value: &Value) -> Result<(), Error> {
    write_file(path, |out| {
        serde_json::to_writer_pretty(&mut *out, value)?;
        out.write_all(b"\n")
    })
}

/// Writes under a temporary name beside `path`, then renames.
fn write_file(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), Error> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let whole = || -> std::io::Result<()> {
        let mut temporary = new_file(folder)?;
        let mut buffer = std::io::BufWriter::new(temporary.as_file_mut());
        fill(&mut buffer)?;
        buffer.flush()?;
        drop(buffer);
        // A full disk may show only here.
        temporary.as_file().sync_all()?;
        temporary.persist(path)?;
        Ok(())
    };
    whole().map_err(|source| file_error("write", path, source))
}

/// A temporary file that others may read once it has its name, as the user's umask allows.
fn new_file(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let front = format!("{}{}-", folder::FRONT, std::process::id());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&front).suffix(folder::END);
    #[cfg(unix)]
    let permissions: std::fs::Permissions = std::os::unix::fs::PermissionsExt::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(permissions);
    let file = builder.tempfile_in(folder)?;
    // Tells processes of other machines that somebody writes; file systems without locks are used without.
    let _ = file.as_file().try_lock();
    Ok(file)
}

fn file_error(action: &'static str, path: &Path, source: std::io::Error) -> Error {
    Error::File {
        action,
        path: path.to_path_buf(),
        source,
    }
}
