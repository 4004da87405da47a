//! Tables as comma-separated values.

use std::io::Write;

use super::file_error;
use crate::error::Error;
use crate::report::{Cell, Column, Table, Values};
use std::path::Path;

/// Writes a table: one header row, then one record a row, RFC 4180 (CR LF at the end of a record).
///
/// Floats take as many digits as are needed to read back the same number (at most 17 significant), integers are plain,
/// numbers that are not finite (NaN: unknown; infinite: overflown) are empty cells. Columns that are shorter than the first one are padded with empty cells.
///
/// # Errors
///
/// Errors of `out`: no space left, closed pipe.
pub fn write(table: &Table, out: impl Write) -> std::io::Result<()> {
    let mut writer = csv::WriterBuilder::new()
        .terminator(csv::Terminator::CRLF)
        .from_writer(out);
    writer.write_record(table.columns.iter().map(|c| c.name.as_bytes()))?;
    let rows = table.columns.iter().map(|c| c.values.len()).max();
    let mut cell = String::new();
    for row in 0..rows.unwrap_or(0) {
        for column in &table.columns {
            cell.clear();
            write_cell(column, row, &mut cell);
            writer.write_field(&cell)?;
        }
        writer.write_record(None::<&[u8]>)?;
    }
    writer.flush()
}

fn write_cell(column: &Column, row: usize, cell: &mut String) {
    match &column.values {
        Values::Float(v) => float(v.get(row).copied().unwrap_or(f64::NAN), cell),
        Values::Integer(v) => v
            .get(row)
            .into_iter()
            .for_each(|i| cell.push_str(&i.to_string())),
        Values::Text(v) => v.get(row).into_iter().for_each(|t| cell.push_str(t)),
    }
}

/// The shortest form that reads back the same, with an exponent where that is shorter; nothing for what is not finite.
fn float(x: f64, cell: &mut String) {
    use std::fmt::Write as _;
    if x.is_finite() {
        // Writing into a String cannot fail.
        let _ = write!(cell, "{x:?}");
    }
}

/// One record of a table, without the end of the line; it has none inside either: control characters become blanks.
///
/// # Errors
///
/// Never in memory: those of the writer.
pub fn record(cells: &[Cell]) -> std::io::Result<Vec<u8>> {
    /// Bytes of a usual record.
    const USUAL: usize = 256;
    let mut writer = csv::WriterBuilder::new()
        .buffer_capacity(USUAL)
        .from_writer(Vec::with_capacity(USUAL));
    let mut text = String::new();
    for cell in cells {
        text.clear();
        match cell {
            Cell::Float(x) => float(*x, &mut text),
            Cell::Integer(i) => text.push_str(&i.to_string()),
            Cell::Text(words) => {
                text.extend(words.chars().map(|c| if c.is_control() { ' ' } else { c }));
            }
        }
        writer.write_field(&text)?;
    }
    writer.write_record(None::<&[u8]>)?;
    let mut bytes = writer.into_inner().map_err(|error| error.into_error())?;
    bytes.truncate(bytes.trim_ascii_end().len());
    Ok(bytes)
}

/// Header row of a table, with the end of the line.
///
/// # Errors
///
/// Errors of `out`.
pub fn write_header(columns: &[Column], out: impl Write) -> std::io::Result<()> {
    let mut writer = csv::WriterBuilder::new()
        .terminator(csv::Terminator::CRLF)
        .from_writer(out);
    writer.write_record(columns.iter().map(|c| c.name.as_bytes()))?;
    writer.flush()
}

/// Reads a table row by row: `row` sees the fields as text.
///
/// # Errors
///
/// `Error::File` when the file cannot be read or is not a table, and what `row` says.
pub fn read(
    path: &Path,
    row: &mut dyn FnMut(&csv::StringRecord) -> Result<(), Error>,
) -> Result<(), Error> {
    let failed = |error: csv::Error| file_error("read", path, error.into());
    let mut reader = csv::Reader::from_path(path).map_err(failed)?;
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(failed)? {
        row(&record)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, values: Values) -> Column {
        Column {
            name: name.into(),
            unit: String::new(),
            values,
        }
    }

    fn text(table: &Table) -> String {
        let mut out = Vec::new();
        write(table, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn cells_are_quoted_where_needed_and_no_number_is_empty() {
        let table = Table {
            name: String::new(),
            columns: vec![
                column("point", Values::Integer(vec![0, -1])),
                column("rms.a", Values::Float(vec![f64::NAN, 0.5])),
                column("max.a", Values::Float(vec![f64::INFINITY, 1.0])),
                column(
                    "label",
                    Values::Text(vec!["a, \"b\"".into(), "line\nbreak".into()]),
                ),
            ],
        };
        assert_eq!(
            text(&table),
            "point,rms.a,max.a,label\r\n0,,,\"a, \"\"b\"\"\"\r\n-1,0.5,1.0,\"line\nbreak\"\r\n"
        );
    }

    #[test]
    fn one_empty_column_still_has_its_rows() {
        let table = Table {
            name: String::new(),
            columns: vec![column("x", Values::Float(vec![f64::NAN, 1.0]))],
        };
        assert_eq!(text(&table), "x\r\n\"\"\r\n1.0\r\n");
    }

    #[test]
    fn floats_read_back_the_same() {
        let numbers = vec![
            1.0 / 3.0,
            -0.0,
            5e-324,
            f64::MAX,
            1.234_567_890_123_456_7e-3,
            1e22,
        ];
        let table = Table {
            name: String::new(),
            columns: vec![column("x", Values::Float(numbers.clone()))],
        };
        let text = text(&table);
        let read: Vec<f64> = text.lines().skip(1).map(|l| l.parse().unwrap()).collect();
        assert_eq!(
            read.iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        );
    }
}
