//! netCDF classic with 64-bit offsets (CDF-2).

use std::io::{Result, Write};

use super::Named;
use crate::report::{Report, Values, Words};

// Tags of lists, and types of data.
const DIMENSION: u32 = 10;
const VARIABLE: u32 = 11;
const ATTRIBUTE: u32 = 12;
const CHAR: u32 = 2;
const INT: u32 = 4;
const DOUBLE: u32 = 6;

struct NetcdfVariable<'a> {
    name: String,
    dimensions: Vec<u32>,
    attributes: Vec<(&'static str, String)>,
    kind: u32,
    values: &'a Values,
    /// Bytes of a word.
    longest: usize,
}

/// Writes the tables: one dimension of rows per table, and one per length of words.
pub(super) fn write(report: &Report, tables: &[Named<'_>], out: &mut dyn Write) -> Result<()> {
    let mut dimensions: Vec<(String, usize)> = Vec::new();
    let mut variables = Vec::new();
    for table in tables {
        let rows = table
            .columns
            .iter()
            .map(|(_, c)| c.values.len())
            .max()
            .unwrap_or(0);
        // A dimension of length 0 would be the unlimited one.
        if rows == 0 {
            continue;
        }
        let row = dimensions.len() as u32;
        let (own, front) = match table.name {
            "main" => ("row".to_owned(), String::new()),
            name => (format!("{name}_row"), format!("{name}.")),
        };
        dimensions.push((own, rows));
        for (name, column) in &table.columns {
            variables.push(variable(
                format!("{front}{name}"),
                column,
                row,
                &mut dimensions,
            ));
        }
    }
    let globals = vec![
        ("title", report.title.clone()),
        ("analysis", report.kind.clone()),
        ("source", format!("gearlash {}", env!("CARGO_PKG_VERSION"))),
    ];
    // The offsets have a fixed size: the head is as long with zeros.
    let head = head(&dimensions, &globals, &variables, 0).len();
    out.write_all(&self::head(&dimensions, &globals, &variables, head as u64))?;
    variables
        .iter()
        .try_for_each(|variable| data(variable, out))
}

fn variable<'a>(
    name: String,
    column: &'a crate::report::Column,
    row: u32,
    dimensions: &mut Vec<(String, usize)>,
) -> NetcdfVariable<'a> {
    let mut attributes = vec![("long_name", Words::of(&column.name).axis(""))];
    if !column.unit.is_empty() {
        attributes.push(("units", column.unit.clone()));
    }
    let fits = |list: &[i64]| list.iter().all(|i| i32::try_from(*i).is_ok());
    let (kind, longest) = match &column.values {
        Values::Float(_) => (DOUBLE, 0),
        Values::Integer(list) => (if fits(list) { INT } else { DOUBLE }, 0),
        Values::Text(list) => (CHAR, list.iter().map(String::len).max().unwrap_or(0).max(1)),
    };
    let mut own = vec![row];
    if kind == CHAR {
        let length = format!("string{longest}");
        let known = dimensions.iter().position(|(name, _)| *name == length);
        own.push(known.unwrap_or_else(|| {
            dimensions.push((length, longest));
            dimensions.len() - 1
        }) as u32);
        attributes.push(("_Encoding", "utf-8".to_owned()));
    }
    NetcdfVariable {
        name,
        dimensions: own,
        attributes,
        kind,
        values: &column.values,
        longest,
    }
}

/// Bytes of the data of a variable, without what fills up to four.
fn size(variable: &NetcdfVariable<'_>) -> u64 {
    let each = match variable.kind {
        CHAR => variable.longest as u64,
        INT => 4,
        _ => 8,
    };
    each * variable.values.len() as u64
}

fn head(
    dimensions: &[(String, usize)],
    globals: &[(&'static str, String)],
    variables: &[NetcdfVariable<'_>],
    start: u64,
) -> Vec<u8> {
    let mut bytes = b"CDF\x02\x00\x00\x00\x00".to_vec();
    list(&mut bytes, DIMENSION, dimensions.len());
    for (name, length) in dimensions {
        text(&mut bytes, name);
        word(&mut bytes, *length as u32);
    }
    attributes(&mut bytes, globals);
    list(&mut bytes, VARIABLE, variables.len());
    let mut offset = start;
    for variable in variables {
        text(&mut bytes, &variable.name);
        word(&mut bytes, variable.dimensions.len() as u32);
        variable
            .dimensions
            .iter()
            .for_each(|d| word(&mut bytes, *d));
        attributes(&mut bytes, &variable.attributes);
        word(&mut bytes, variable.kind);
        let size = size(variable).next_multiple_of(4);
        // Larger ones are as long as their dimensions say.
        word(&mut bytes, u32::try_from(size).unwrap_or(u32::MAX));
        bytes.extend(offset.to_be_bytes());
        offset += size;
    }
    bytes
}

fn word(bytes: &mut Vec<u8>, value: u32) {
    bytes.extend(value.to_be_bytes());
}

fn list(bytes: &mut Vec<u8>, tag: u32, count: usize) {
    word(bytes, if count == 0 { 0 } else { tag });
    word(bytes, count as u32);
}

fn text(bytes: &mut Vec<u8>, text: &str) {
    word(bytes, text.len() as u32);
    bytes.extend(text.as_bytes());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
}

fn attributes(bytes: &mut Vec<u8>, entries: &[(&'static str, String)]) {
    list(bytes, ATTRIBUTE, entries.len());
    for (name, value) in entries {
        text(bytes, name);
        word(bytes, CHAR);
        text(bytes, value);
    }
}

fn data(variable: &NetcdfVariable<'_>, out: &mut dyn Write) -> Result<()> {
    match variable.values {
        Values::Float(list) => list
            .iter()
            .try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
        Values::Integer(list) if variable.kind == INT => {
            // Checked when the kind was chosen.
            list.iter()
                .try_for_each(|i| out.write_all(&(*i as i32).to_be_bytes()))?;
        }
        Values::Integer(list) => {
            list.iter()
                .try_for_each(|i| out.write_all(&(*i as f64).to_be_bytes()))?;
        }
        Values::Text(list) => {
            for word in list {
                let mut bytes = word.as_bytes().to_vec();
                bytes.resize(variable.longest, 0);
                out.write_all(&bytes)?;
            }
        }
    }
    let fill = size(variable).next_multiple_of(4) - size(variable);
    out.write_all(&[0; 4][..fill as usize])
}
