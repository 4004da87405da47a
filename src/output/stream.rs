//! A table written record by record, in bounded memory, and rows read back for what is drawn and summarised.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::{csv, file_error, new_file};
use crate::error::Error;
use crate::report::{Cell, Column, Table, Values};
use tempfile::NamedTempFile;

/// A table that grows under a temporary name and gets its own when it is complete.
#[derive(Debug)]
pub struct RowFile {
    path: PathBuf,
    out: BufWriter<NamedTempFile>,
}

impl RowFile {
    /// Begins a table with its header row.
    ///
    /// # Errors
    /// `Error::File` when the file cannot be written.
    pub fn create(path: &Path, columns: &[Column]) -> Result<RowFile, Error> {
        let folder = path.parent().unwrap_or(Path::new("."));
        let failed = |e| file_error("write", path, e);
        let mut out = BufWriter::new(new_file(folder).map_err(failed)?);
        csv::write_header(columns, &mut out).map_err(failed)?;
        Ok(RowFile {
            path: path.to_path_buf(),
            out,
        })
    }

    /// Adds a record that [`csv::record`] has written.
    ///
    /// # Errors
    /// `Error::File` when it cannot be written.
    pub fn write(&mut self, record: &[u8]) -> Result<(), Error> {
        let out = &mut self.out;
        let written = out.write_all(record).and_then(|()| out.write_all(b"\r\n"));
        written.map_err(|e| file_error("write", &self.path, e))
    }

    /// Gives the complete table its name.
    ///
    /// # Errors
    /// `Error::File`: a full disk may show only here.
    pub fn finish(self) -> Result<(), Error> {
        let RowFile { path, out } = self;
        let whole = || -> std::io::Result<()> {
            let file = out.into_inner().map_err(|e| e.into_error())?;
            file.as_file().sync_all()?;
            file.persist(&path)?;
            Ok(())
        };
        whole().map_err(|e| file_error("write", &path, e))
    }
}

/// Writes a table that is on disk in the other formats that this program has. Returns the names of all files that hold it.
///
/// # Errors
/// `Error::File` when the table cannot be read back, or another file cannot be written.
pub fn formats(table: &Path, columns: &[Column]) -> Result<Vec<String>, Error> {
    let name = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let mut names = vec![name(table)];
    for (extension, write) in FORMATS {
        let path = table.with_extension(extension);
        write(table, &path, columns)?;
        names.push(name(&path));
    }
    Ok(names)
}

/// Writes a table, in the second file, from the first one.
type Format = fn(&Path, &Path, &[Column]) -> Result<(), Error>;

/// Formats beside CSV, by the ending of their names.
#[cfg(feature = "parquet")]
const FORMATS: [(&str, Format); 1] = [("parquet", super::parquet::write)];
#[cfg(not(feature = "parquet"))]
const FORMATS: [(&str, Format); 0] = [];

/// Retained part of a table that is too long for memory.
#[derive(Debug, Clone, PartialEq)]
pub struct TableSurvey {
    /// Rows of the table.
    pub rows: u64,
    /// Every k-th row is kept, beginning with the first.
    pub stride: u64,
    /// The kept ones.
    pub kept: Table,
    /// Of each column that holds real numbers: how many there are, and what they are like.
    pub statistics: Vec<Option<Statistics>>,
    /// Rows with a value in each of the requested columns.
    pub filled: Vec<u64>,
}

/// Moments and extrema of the numbers in a column.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Statistics {
    /// Cells that are not empty.
    pub count: u64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Sum of the squares of the deviations from the mean.
    squares: f64,
}

impl Statistics {
    /// Standard deviation of the sample, with n - 1; NaN for less than two numbers.
    pub fn deviation(&self) -> f64 {
        if self.count < 2 {
            return f64::NAN;
        }
        (self.squares / (self.count - 1) as f64).sqrt()
    }

    /// Welford's update: one pass without cancellation.
    fn add(&mut self, x: f64) {
        self.count += 1;
        let before = x - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (x - self.mean);
        (self.min, self.max) = match self.count {
            1 => (x, x),
            _ => (self.min.min(x), self.max.max(x)),
        };
    }
}

/// Reads a table and keeps at most `most` rows of it, evenly spread. `rows`: how many it has; `filled`: columns whose cells
/// are counted where they are not empty.
///
/// # Errors
/// `Error::File` when it cannot be read or its cells are not of the columns' kinds.
pub fn survey(
    path: &Path,
    columns: &[Column],
    (rows, most): (u64, u64),
    filled: &[usize],
) -> Result<TableSurvey, Error> {
    let number = |column: &Column| matches!(column.values, Values::Float(_));
    let mut survey = TableSurvey {
        rows: 0,
        stride: rows.div_ceil(most.max(1)).max(1),
        kept: Table {
            name: String::new(),
            columns: columns.to_vec(),
        },
        statistics: (columns.iter())
            .map(|c| number(c).then(Statistics::default))
            .collect(),
        filled: vec![0; filled.len()],
    };
    csv::read(path, &mut |record| {
        let is_kept = survey.rows.is_multiple_of(survey.stride);
        for (k, text) in record.iter().enumerate() {
            let misfit = || {
                let what = format!("row {}, column {k}: found `{text}`", survey.rows);
                file_error("read", path, std::io::Error::other(what))
            };
            let column = survey.kept.columns.get_mut(k).ok_or_else(misfit)?;
            let cell = column.values.read_cell(text).ok_or_else(misfit)?;
            if let (Some(statistics), Cell::Float(x)) = (&mut survey.statistics[k], &cell)
                && x.is_finite()
            {
                statistics.add(*x);
            }
            if is_kept {
                column.values.push(cell);
            }
        }
        for (count, column) in survey.filled.iter_mut().zip(filled) {
            *count += u64::from(record.get(*column).is_some_and(|text| !text.is_empty()));
        }
        survey.rows += 1;
        Ok(())
    })?;
    Ok(survey)
}

/// Lines of a file one after another, without their ends. Between two looks at it the file is closed, so that a thousand of
/// them can be read side by side.
#[derive(Debug)]
pub struct Lines {
    path: PathBuf,
    /// Bytes of the file before `piece`.
    offset: u64,
    piece: Vec<u8>,
    /// Beginning of the next line in `piece`.
    next: usize,
}

/// Bytes read at once.
const PIECE: u64 = 1 << 16;

impl Lines {
    /// The lines of a file, from the first one.
    pub fn new(path: PathBuf) -> Lines {
        Lines {
            path,
            offset: 0,
            piece: Vec::new(),
            next: 0,
        }
    }

    /// The next line; `None` at the end of the file.
    ///
    /// # Errors
    /// `Error::File` when the file cannot be read.
    pub fn next_line(&mut self) -> Result<Option<&[u8]>, Error> {
        let mut searched = self.next;
        loop {
            let found = self.piece[searched..].iter().position(|b| *b == b'\n');
            if let Some(length) = found {
                let start = std::mem::replace(&mut self.next, searched + length + 1);
                let line = &self.piece[start..searched + length];
                return Ok(Some(line.strip_suffix(b"\r").unwrap_or(line)));
            }
            searched = self.piece.len() - self.next;
            if !self
                .refill()
                .map_err(|e| file_error("read", &self.path, e))?
            {
                return Ok(None);
            }
        }
    }

    /// Drops the lines that are done with and reads on; false at the end of the file.
    fn refill(&mut self) -> std::io::Result<bool> {
        self.piece.drain(..self.next);
        self.offset += self.next as u64;
        self.next = 0;
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(self.offset + self.piece.len() as u64))?;
        let count = file.take(PIECE).read_to_end(&mut self.piece)?;
        Ok(count > 0)
    }
}
