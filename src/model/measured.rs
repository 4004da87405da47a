//! Columns of numbers in files beside the model file: measured torques and the like.

use super::fields::Mistakes;
use crate::error::{Diagnostic, did_you_mean};
use crate::yaml::{Node, Value};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Largest file in bytes.
const LARGEST: u64 = 64 << 20;
/// Most rows.
const MOST_ROWS: usize = 10_000_000;
/// Characters of a cell that a message shows.
const SHOWN: usize = 40;

/// The path of a file that a node names, relative to the model file that names it.
pub(super) fn beside(node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<PathBuf> {
    let written = mistakes.note(node.as_text(path))?;
    Some(folder(node).join(written))
}

/// The folder of the model file that contains a node.
fn folder(node: &Node) -> &Path {
    let file = node.location.as_ref().map(|l| Path::new(&l.source.name));
    file.and_then(Path::parent).unwrap_or(Path::new(""))
}

/// A document in which the paths of the files of loads and motions are absolute: they mean the same when the tree has lost its places.
pub(super) fn anchored(document: &Node) -> Node {
    let mut document = document.clone();
    if let Value::Map(map) = &mut document.value {
        for key in ["loads", "bodies"] {
            if let Some(entry) = map.get_mut(key) {
                make_absolute(&mut entry.node);
            }
        }
    }
    document
}

fn make_absolute(node: &mut Node) {
    match &mut node.value {
        Value::Map(map) => {
            for (key, entry) in map {
                let file = entry.node.as_text("").ok().filter(|_| key == "file");
                let whole = file.map(|file| std::path::absolute(folder(&entry.node).join(file)));
                match whole {
                    Some(Ok(path)) => entry.node = Node::quoted(path.to_string_lossy()),
                    _ => make_absolute(&mut entry.node),
                }
            }
        }
        Value::List(list) => list.iter_mut().for_each(make_absolute),
        Value::Scalar { .. } => {}
    }
}

/// Finite numbers of the named columns of a table with one header row, separated by commas, semicolons or tabs.
///
/// With semicolons and tabs a number may have a decimal comma.
pub(super) fn columns(
    file: &Path,
    (node, path): (&Node, &str),
    names: &[&str],
    mistakes: &mut Mistakes,
) -> Option<Arc<Vec<Vec<f64>>>> {
    if let Some(known) = mistakes.known_table(file, names) {
        return Some(known);
    }
    mistakes.note_file(file);
    let found = text(file).and_then(|text| parse(&text, names));
    let found = found
        .map_err(|message| Diagnostic::at(node, path, format!("{}: {message}", file.display())));
    let columns = mistakes.note(found)?;
    Some(mistakes.keep_table(file, names, columns))
}

/// The same of any file.
///
/// # Errors
/// What is wrong with it.
pub fn columns_of(file: &Path, names: &[&str]) -> Result<Vec<Vec<f64>>, String> {
    text(file).and_then(|text| parse(&text, names))
}

fn text(file: &Path) -> Result<String, String> {
    let about = std::fs::metadata(file).map_err(|e| e.to_string())?;
    if !about.is_file() {
        return Err("not a regular file".into());
    }
    if about.len() > LARGEST {
        let (found, most) = (about.len() >> 20, LARGEST >> 20);
        return Err(format!("{found} MiB, wanted at most {most} MiB"));
    }
    let bytes = std::fs::read(file).map_err(|e| e.to_string())?;
    String::from_utf8(bytes).map_err(|e| {
        let place = e.utf8_error().valid_up_to();
        format!("not UTF-8 text at byte {place}: wanted a table of numbers, such as CSV")
    })
}

fn parse(text: &str, names: &[&str]) -> Result<Vec<Vec<f64>>, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let header = text.lines().next().unwrap_or_default();
    let delimiter = [b';', b'\t']
        .into_iter()
        .find(|d| header.as_bytes().contains(d));
    let delimiter = delimiter.unwrap_or(b',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    let places = names.iter().map(|name| place(&header, name));
    let places = places.collect::<Result<Vec<usize>, String>>()?;
    let mut columns = vec![Vec::new(); names.len()];
    let mut marks = vec![None; names.len()];
    let mut record = csv::StringRecord::new();
    for count in 0.. {
        let found = reader.read_record(&mut record);
        let row = row(text, reader.position(), count);
        if !found.map_err(|e| unequal(&e, row))? {
            break;
        }
        if count >= MOST_ROWS {
            return Err(format!("more than {MOST_ROWS} rows"));
        }
        let cells = places.iter().zip(names).zip(&mut marks);
        for (column, ((place, name), mark)) in columns.iter_mut().zip(cells) {
            let cell = record.get(*place).unwrap_or_default();
            let shown = || cell.chars().take(SHOWN).collect::<String>();
            let number = number(cell, delimiter != b',').ok_or_else(|| {
                let shown = shown();
                format!("row {row}, column `{name}`: found `{shown}`, wanted a finite number")
            })?;
            let own = cell.chars().find(|c| ['.', ','].contains(c));
            if own.is_some() && mark.is_some() && own != *mark {
                let shown = shown();
                return Err(format!(
                    "row {row}, column `{name}`: found `{shown}`, but rows before have the other decimal sign: wanted points or commas throughout, \
                     and no separators of thousands"
                ));
            }
            *mark = mark.or(own);
            column.push(number);
        }
    }
    Ok(columns)
}

/// Line of the record that ends at a position. Blank lines are not records; where lines end otherwise than usual, records are counted
/// from the header, line 1.
fn row(text: &str, end: &csv::Position, count: usize) -> u64 {
    match text.as_bytes().get((end.byte() as usize).saturating_sub(1)) {
        Some(b'\n') => end.line() - 1,
        _ if text.contains('\n') => end.line(),
        _ => count as u64 + 2,
    }
}

/// What is wrong with the record on a line.
fn unequal(error: &csv::Error, row: u64) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!(
            "row {row}: found {len} cells, wanted {expected_len}, one per column of the first row"
        ),
        _ => format!("row {row}: {error}"),
    }
}

fn place(header: &csv::StringRecord, name: &str) -> Result<usize, String> {
    let mut places = header.iter().enumerate().filter(|(_, cell)| *cell == name);
    let all: Vec<&str> = header.iter().collect();
    match (places.next(), places.next()) {
        (Some((place, _)), None) => return Ok(place),
        (Some(_), Some(_)) => {
            return Err(format!("column `{name}` is there twice in its first row"));
        }
        (None, _) => {}
    }
    if all.iter().all(|cell| cell.is_empty()) {
        return Err(format!(
            "its first row is empty: wanted the names of the columns, `{name}` among them"
        ));
    }
    let help = match all.as_slice() {
        [one] if one.contains(name) => "columns are separated by commas, semicolons or tabs".into(),
        _ => did_you_mean(name, header.iter()),
    };
    Err(format!(
        "no column `{name}` in its first row, which names {} ({help})",
        all.join(", ")
    ))
}

fn number(cell: &str, may_have_comma: bool) -> Option<f64> {
    let value = match cell.parse::<f64>() {
        Ok(value) => value,
        Err(_) if may_have_comma && !cell.contains('.') => {
            cell.replacen(',', ".", 1).parse().ok()?
        }
        Err(_) => return None,
    };
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_several_programs_are_read() {
        let wanted = Ok(vec![vec![1.5, -2e3], vec![0.0, 1.0]]);
        for text in [
            "T,angle\n1.5,0\n-2e3,1\n",
            "\u{feff}angle;other;T\r\n0;x;1,5\r\n1;y;-2000,0\r\n",
            "angle\tT\n0\t1.5\n1\t-2000\n",
        ] {
            assert_eq!(parse(text, &["T", "angle"]), wanted, "{text}");
        }
    }

    #[test]
    fn mistakes_name_row_and_column() {
        for (text, wanted) in [
            ("T\n1\nx\n", "row 3, column `T`: found `x`"),
            ("T\nNaN\n", "row 2, column `T`: found `NaN`"),
            ("t,torque\n1,2\n", "no column `T`"),
            ("T,u\n1\n", "row 2"),
            ("T,u\n1,5,2\n", "row 2: found 3 cells, wanted 2"),
            ("T,u\n1,2\n\n3,4\n5\n", "row 5: found 1 cells"),
            ("T\n1\n\n\nx\n", "row 5, column `T`: found `x`"),
            ("T,T\n1,2\n", "is there twice"),
            ("", "its first row is empty"),
            ("T u\n1 2\n", "separated by commas"),
            ("T;u\n2,5;1\n1.234;2\n", "other decimal sign"),
        ] {
            let said = parse(text, &["T"]).expect_err("a mistake");
            assert!(said.contains(wanted), "{said}");
        }
    }
}
