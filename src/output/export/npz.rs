//! numpy archives: arrays in the format NPY 1.0 inside a ZIP without compression.

use std::io::{Result, Write};

use serde_json::{Map, Value, json};

use super::Named;
use crate::report::Values;

/// Sizes in a ZIP have 32 bits.
const LARGEST: usize = u32::MAX as usize;

struct ArchiveEntry {
    name: String,
    checksum: u32,
    size: u32,
    offset: u32,
}

/// Writes the tables as one archive.
pub(super) fn write(tables: &[Named<'_>], out: &mut dyn Write) -> Result<()> {
    let mut archive = Archive {
        out,
        offset: 0,
        entries: Vec::new(),
    };
    let mut units = Map::new();
    for table in tables {
        for (name, column) in &table.columns {
            let key = match table.name {
                "main" => name.clone(),
                table => format!("{table}/{name}"),
            };
            units.insert(key.clone(), json!(column.unit));
            archive.put(&key, &array(&column.values))?;
        }
    }
    let units = vec![Value::Object(units).to_string()];
    archive.put("units", &texts(&units, "()"))?;
    archive.finish()
}

fn array(values: &Values) -> Vec<u8> {
    let shape = format!("({},)", values.len());
    match values {
        Values::Float(list) => {
            let mut bytes = header("<f8", &shape);
            list.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes
        }
        Values::Integer(list) => {
            let mut bytes = header("<i8", &shape);
            list.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes
        }
        Values::Text(list) => texts(list, &shape),
    }
}

/// Words of equal length in UTF-32.
fn texts(list: &[String], shape: &str) -> Vec<u8> {
    let longest = list
        .iter()
        .map(|text| text.chars().count())
        .max()
        .unwrap_or(0)
        .max(1);
    let mut bytes = header(&format!("<U{longest}"), shape);
    for text in list {
        let characters = text.chars().map(|c| c as u32);
        let padded = characters.chain(std::iter::repeat(0)).take(longest);
        padded.for_each(|c| bytes.extend(c.to_le_bytes()));
    }
    bytes
}

fn header(kind: &str, shape: &str) -> Vec<u8> {
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version and length take ten bytes; the data begin at a multiple of 64.
    while (text.len() + 11) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    // At most some hundred bytes.
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

struct Archive<'a> {
    out: &'a mut dyn Write,
    offset: usize,
    entries: Vec<ArchiveEntry>,
}

impl Archive<'_> {
    fn put(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let name = format!("{name}.npy");
        if self.offset + bytes.len() + name.len() + 64 > LARGEST {
            return Err(std::io::Error::other(
                "more than 4 GB do not fit an .npz; export netcdf",
            ));
        }
        let entry = ArchiveEntry {
            checksum: crc32fast::hash(bytes),
            size: bytes.len() as u32,
            offset: self.offset as u32,
            name,
        };
        let mut head = b"PK\x03\x04".to_vec();
        head.extend(fields(&entry));
        head.extend(entry.name.as_bytes());
        self.out.write_all(&head)?;
        self.out.write_all(bytes)?;
        self.offset += head.len() + bytes.len();
        self.entries.push(entry);
        Ok(())
    }

    fn finish(self) -> Result<()> {
        let mut directory = Vec::new();
        for entry in &self.entries {
            directory.extend(b"PK\x01\x02\x14\x00");
            directory.extend(fields(entry));
            // No comment, disk 0, no attributes.
            directory.extend([0; 10]);
            directory.extend(entry.offset.to_le_bytes());
            directory.extend(entry.name.as_bytes());
        }
        let count = (self.entries.len().min(usize::from(u16::MAX)) as u16).to_le_bytes();
        let mut end = b"PK\x05\x06\x00\x00\x00\x00".to_vec();
        end.extend(count);
        end.extend(count);
        end.extend((directory.len() as u32).to_le_bytes());
        end.extend((self.offset as u32).to_le_bytes());
        end.extend([0, 0]);
        self.out.write_all(&directory)?;
        self.out.write_all(&end)
    }
}

/// What both heads of an entry have: version, UTF-8 names, no compression, 1 January 1980, checksum, sizes, lengths.
fn fields(entry: &ArchiveEntry) -> Vec<u8> {
    let mut bytes = vec![0x14, 0x00, 0x00, 0x08, 0x00, 0x00, 0x00, 0x00, 0x21, 0x00];
    bytes.extend(entry.checksum.to_le_bytes());
    bytes.extend(entry.size.to_le_bytes());
    bytes.extend(entry.size.to_le_bytes());
    bytes.extend((entry.name.len() as u16).to_le_bytes());
    bytes.extend([0, 0]);
    bytes
}
