//! Tables as comma-separated values.

use std::io::Write;

use crate::report::{Column, Table, Values};

/// Writes a table: one header row, then one record a row, RFC 4180 (CR LF at the end of a record).
///
/// Floats take as many digits as are needed to read back the same number (at most 17 significant), integers are plain,
/// numbers that are not finite (NaN: unknown; infinite: overflown) are empty cells. Columns that are shorter than the first one are padded with empty cells.
///
/// # Errors
///
/// What `out` says: no space left, closed pipe.
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
    use std::fmt::Write as _;
    // Writing into a String cannot fail.
    let _ = match &column.values {
        Values::Float(v) => match v.get(row) {
            // The debug form is the shortest that reads back the same, with an exponent where that is shorter.
            Some(x) if x.is_finite() => write!(cell, "{x:?}"),
            _ => Ok(()),
        },
        Values::Integer(v) => v.get(row).map_or(Ok(()), |i| write!(cell, "{i}")),
        Values::Text(v) => v.get(row).map_or(Ok(()), |t| write!(cell, "{t}")),
    };
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
