//! MATLAB files of level 5: structs of columns.

use std::io::{Result, Write};

use super::{Named, safe};
use crate::report::{Report, Values};

// Types of data elements, and classes of arrays.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const INT64: u32 = 12;
const MATRIX: u32 = 14;
const CELL_CLASS: u32 = 1;
const STRUCT_CLASS: u32 = 2;
const CHAR_CLASS: u32 = 4;
const DOUBLE_CLASS: u32 = 6;
const INT64_CLASS: u32 = 14;
/// Bytes of a field's name with its end.
const FIELD: usize = 64;

/// Writes one struct per table, and the units of their columns.
pub(super) fn write(report: &Report, tables: &[Named<'_>], out: &mut dyn Write) -> Result<()> {
    let mut head = format!(
        "MATLAB 5.0 MAT-file, gearlash {}, {}",
        env!("CARGO_PKG_VERSION"),
        report.name
    );
    head.retain(|c| c.is_ascii());
    head.truncate(116);
    let mut bytes = format!("{head:<124}").into_bytes();
    // Version 0x0100, and the mark of the byte order as a little-endian machine writes it.
    bytes.extend([0x00, 0x01, b'I', b'M']);
    out.write_all(&bytes)?;
    let mut taken = std::collections::HashSet::from(["units".to_owned()]);
    let mut units = Vec::new();
    for table in tables {
        let name = safe(table.name, &mut taken);
        let fields = table
            .columns
            .iter()
            .map(|(name, c)| (name.clone(), values("", &c.values)));
        checked(out, &structure(&name, &fields.collect::<Vec<_>>()))?;
        let fields = table
            .columns
            .iter()
            .map(|(name, c)| (name.clone(), text("", &c.unit)));
        units.push((name, structure("", &fields.collect::<Vec<_>>())));
    }
    checked(out, &structure("units", &units))
}

/// Sizes in a file have 31 bits.
fn checked(out: &mut dyn Write, bytes: &[u8]) -> Result<()> {
    if bytes.len() >= i32::MAX as usize {
        return Err(std::io::Error::other(
            "a table above 2 GB does not fit a .mat file; export netcdf",
        ));
    }
    out.write_all(bytes)
}

/// A data element: type, size, data, filled up to eight bytes.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn array(name: &str, class: u32, size: (usize, usize), parts: &[Vec<u8>]) -> Vec<u8> {
    let mut data = element(UINT32, &[class.to_le_bytes(), [0; 4]].concat());
    // Rows and columns: a table has fewer than 2^31 rows.
    let dimensions = [size.0 as i32, size.1 as i32]
        .map(i32::to_le_bytes)
        .concat();
    data.extend(element(INT32, &dimensions));
    data.extend(element(INT8, name.as_bytes()));
    data.extend(parts.concat());
    element(MATRIX, &data)
}

fn text(name: &str, text: &str) -> Vec<u8> {
    let units: Vec<u16> = text.encode_utf16().collect();
    let bytes: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
    let rows = usize::from(!units.is_empty());
    array(
        name,
        CHAR_CLASS,
        (rows, units.len()),
        &[element(UINT16, &bytes)],
    )
}

fn values(name: &str, values: &Values) -> Vec<u8> {
    let size = (values.len(), 1);
    match values {
        Values::Float(list) => {
            let bytes: Vec<u8> = list.iter().flat_map(|x| x.to_le_bytes()).collect();
            array(name, DOUBLE_CLASS, size, &[element(DOUBLE, &bytes)])
        }
        Values::Integer(list) => {
            let bytes: Vec<u8> = list.iter().flat_map(|x| x.to_le_bytes()).collect();
            array(name, INT64_CLASS, size, &[element(INT64, &bytes)])
        }
        Values::Text(list) => {
            let cells: Vec<Vec<u8>> = list.iter().map(|word| text("", word)).collect();
            array(name, CELL_CLASS, size, &cells)
        }
    }
}

fn structure(name: &str, fields: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut names = Vec::new();
    for (field, _) in fields {
        let mut own = field.as_bytes().to_vec();
        own.resize(FIELD, 0);
        names.extend(own);
    }
    // The length of the names is a small element: size and type in one word.
    let length = [
        (4_u32 << 16 | INT32).to_le_bytes(),
        (FIELD as u32).to_le_bytes(),
    ]
    .concat();
    let mut parts = vec![length, element(INT8, &names)];
    parts.extend(fields.iter().map(|(_, value)| value.clone()));
    array(name, STRUCT_CLASS, (1, 1), &parts)
}
