//! The table of a study as Apache Parquet, for programs that read columns: pandas, Polars, DuckDB.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

use super::{csv, file_error};
use crate::error::Error;
use crate::report::{Column, Values};

/// Rows of a group, which are in memory at once.
const GROUP: usize = 65_536;

/// Writes a table that is on disk as CSV; empty cells of numbers are null, words are never null. The units are in the
/// metadata of the file, `unit.<column>`.
///
/// # Errors
/// `Error::File` when the table cannot be read or is of other kinds, or the file cannot be written.
pub fn write(table: &Path, path: &Path, columns: &[Column]) -> Result<(), Error> {
    let failed = |error: ParquetError| file_error("write", path, std::io::Error::other(error));
    let folder = path.parent().unwrap_or(Path::new("."));
    let temporary = super::new_file(folder).map_err(|e| file_error("write", path, e))?;
    let file = temporary.as_file().try_clone();
    let file = file.map_err(|e| file_error("write", path, e))?;
    let mut writer = begin(file, columns).map_err(failed)?;
    let mut group: Vec<Values> = columns.iter().map(|c| c.values.clone()).collect();
    let mut rows = 0;
    csv::read(table, &mut |record| {
        for (values, text) in group.iter_mut().zip(record.iter()) {
            let cell = values.read_cell(text).ok_or_else(|| {
                let what = format!("row {rows}: found `{text}`");
                file_error("read", table, std::io::Error::other(what))
            })?;
            values.push(cell);
        }
        rows += 1;
        if rows % GROUP == 0 {
            write_group(&mut writer, &mut group).map_err(failed)?;
        }
        Ok(())
    })?;
    write_group(&mut writer, &mut group).map_err(failed)?;
    writer.close().map_err(failed)?;
    let whole = || -> std::io::Result<()> {
        temporary.as_file().sync_all()?;
        temporary.persist(path)?;
        Ok(())
    };
    whole().map_err(|e| file_error("write", path, e))
}

fn begin(file: File, columns: &[Column]) -> Result<SerializedFileWriter<File>, ParquetError> {
    let fields = columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("table")
        .with_fields(fields)
        .build()?;
    let unit = |c: &Column| KeyValue::new(format!("unit.{}", c.name), c.unit.clone());
    let units = columns.iter().filter(|c| !c.unit.is_empty()).map(unit);
    let properties = WriterProperties::builder()
        .set_key_value_metadata(Some(units.collect()))
        .build();
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
}

fn field(column: &Column) -> Result<TypePtr, ParquetError> {
    let (physical, logical, repetition) = match column.values {
        Values::Float(_) => (Physical::DOUBLE, None, Repetition::OPTIONAL),
        Values::Integer(_) => (Physical::INT64, None, Repetition::REQUIRED),
        Values::Text(_) => (
            Physical::BYTE_ARRAY,
            Some(LogicalType::String),
            Repetition::REQUIRED,
        ),
    };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(field))
}

/// Writes the rows collected so far and forgets them.
fn write_group(
    writer: &mut SerializedFileWriter<File>,
    group: &mut [Values],
) -> Result<(), ParquetError> {
    if group.iter().all(Values::is_empty) {
        return Ok(());
    }
    let mut row_group: SerializedRowGroupWriter<'_, File> = writer.next_row_group()?;
    for values in group {
        let Some(mut column) = row_group.next_column()? else {
            break;
        };
        match values {
            Values::Float(list) => {
                let present: Vec<f64> = list.iter().copied().filter(|x| !x.is_nan()).collect();
                let levels: Vec<i16> = list.iter().map(|x| i16::from(!x.is_nan())).collect();
                let typed = column.typed::<DoubleType>();
                typed.write_batch(&present, Some(&levels), None)?;
                list.clear();
            }
            Values::Integer(list) => {
                column.typed::<Int64Type>().write_batch(list, None, None)?;
                list.clear();
            }
            Values::Text(list) => {
                let words: Vec<ByteArray> =
                    list.iter().map(|w| ByteArray::from(w.as_str())).collect();
                column
                    .typed::<ByteArrayType>()
                    .write_batch(&words, None, None)?;
                list.clear();
            }
        }
        column.close()?;
    }
    row_group.close()?;
    Ok(())
}
