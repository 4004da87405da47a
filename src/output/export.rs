//! Results for other programs: MATLAB, numpy, xarray, and readers of columns. One file per analysis, units inside.

mod mat;
mod netcdf;
mod npz;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::{results::Results, table_file, write_file};
use crate::error::Error;
use crate::report::{Column, Report, Table};

/// Formats of [`export`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// MATLAB level 5, `NAME.mat`: one struct per table, and `units` with the same fields.
    Mat,
    /// Apache Parquet, a file per table: `NAME.parquet`, `NAME.TABLE.parquet`; units in the metadata.
    Parquet,
    /// numpy, `NAME.npz`: `column` of the main table, `table/column` of the others, `units` as JSON.
    Npz,
    /// netCDF classic with 64-bit offsets, `NAME.nc`: units and names in words as attributes.
    Netcdf,
}

impl ExportFormat {
    /// All formats, by the word of the command line.
    pub const ALL: [(&str, ExportFormat); 4] = [
        ("mat", ExportFormat::Mat),
        ("parquet", ExportFormat::Parquet),
        ("npz", ExportFormat::Npz),
        ("netcdf", ExportFormat::Netcdf),
    ];
}

/// Style of column names.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Names {
    /// As in the tables: `rms.mesh_1`.
    #[default]
    Written,
    /// Letters, digits and underscores: `rms_mesh_1`.
    Safe,
}

/// A table with the names that its columns get.
struct Named<'a> {
    /// `main` for the main table.
    name: &'a str,
    columns: Vec<(String, &'a Column)>,
}

/// Writes the tables of a folder into `out`. Returns the files.
///
/// # Errors
/// `Error::File`: a file that cannot be written, or a format that this build lacks.
pub fn export(
    results: &Results,
    folder: &Path,
    out: &Path,
    format: ExportFormat,
    names: Names,
) -> Result<Vec<PathBuf>, Error> {
    super::create_folder(out)?;
    let mut files = Vec::new();
    for report in &results.reports {
        if format == ExportFormat::Parquet {
            files.extend(parquet_files(report, folder, out, names)?);
            continue;
        }
        let (ending, names) = match format {
            ExportFormat::Mat => ("mat", Names::Safe),
            ExportFormat::Npz => ("npz", names),
            ExportFormat::Netcdf | ExportFormat::Parquet => ("nc", names),
        };
        let path = out.join(format!("{}.{ending}", report.name));
        let tables: Vec<Named<'_>> = report.tables.iter().map(|t| named(t, names)).collect();
        write_file(&path, |file| match format {
            ExportFormat::Mat => mat::write(report, &tables, file),
            ExportFormat::Npz => npz::write(&tables, file),
            ExportFormat::Netcdf | ExportFormat::Parquet => netcdf::write(report, &tables, file),
        })?;
        files.push(path);
    }
    Ok(files)
}

fn named(table: &Table, names: Names) -> Named<'_> {
    let mut taken = HashSet::new();
    let name = |column: &Column| match names {
        Names::Written => column.name.clone(),
        Names::Safe => safe(&column.name, &mut taken),
    };
    let mut name = name;
    Named {
        name: if table.name.is_empty() {
            "main"
        } else {
            &table.name
        },
        columns: table.columns.iter().map(|c| (name(c), c)).collect(),
    }
}

/// A name that programs take as a variable: letters, digits, underscores, at most 63, a letter first, each once.
fn safe(name: &str, taken: &mut HashSet<String>) -> String {
    /// Longest name in MATLAB.
    const LONGEST: usize = 63;
    let mut text: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
        .collect();
    if !text.starts_with(|c: char| c.is_ascii_alphabetic()) {
        text.insert(0, 'x');
    }
    text.truncate(LONGEST);
    let mut own = text.clone();
    for number in 2.. {
        if taken.insert(own.clone()) {
            break;
        }
        let ending = format!("_{number}");
        own = text[..text.len().min(LONGEST - ending.len())].to_owned() + &ending;
    }
    own
}

#[cfg(feature = "parquet")]
fn parquet_files(
    report: &Report,
    folder: &Path,
    out: &Path,
    names: Names,
) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for table in &report.tables {
        let source = folder.join(table_file(report, table));
        let path = out
            .join(table_file(report, table))
            .with_extension("parquet");
        let columns = named(table, names)
            .columns
            .into_iter()
            .map(|(name, column)| {
                let values = crate::report::Values::of_kind(column.values.kind());
                Column {
                    name,
                    unit: column.unit.clone(),
                    values: values.unwrap_or(column.values.clone()),
                }
            });
        super::parquet::write(&source, &path, &columns.collect::<Vec<_>>())?;
        files.push(path);
    }
    Ok(files)
}

/// Refuses: this build cannot write the format.
#[cfg(not(feature = "parquet"))]
fn parquet_files(report: &Report, _: &Path, out: &Path, _: Names) -> Result<Vec<PathBuf>, Error> {
    let name = report
        .tables
        .first()
        .map_or(String::new(), |table| table_file(report, table));
    let path = out.join(name).with_extension("parquet");
    let reason = "gearlash was built without the feature `parquet`; build it with `--features parquet`, or export npz or netcdf";
    let source = std::io::Error::new(std::io::ErrorKind::Unsupported, reason);
    Err(super::file_error("write", &path, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn safe_names_are_variables_and_each_is_its_own() {
        let mut taken = HashSet::new();
        let mut name = |text: &str| safe(text, &mut taken);
        assert_eq!(name("rms.mesh_1"), "rms_mesh_1");
        assert_eq!(name("rms.mesh.1"), "rms_mesh_1_2");
        assert_eq!(name("1st"), "x1st");
        assert_eq!(name(&"n".repeat(100)).len(), 63);
        assert_eq!(name(&"n".repeat(101)).len(), 63);
    }
}
