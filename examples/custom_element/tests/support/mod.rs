//! What the tests of this crate share.

use std::collections::HashMap;
use std::path::Path;

/// Rows of a CSV file as maps from column to cell.
pub fn table(path: &Path) -> Vec<HashMap<String, String>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells = line.split(',').map(str::to_owned);
        names.iter().map(|n| n.to_string()).zip(cells).collect()
    };
    lines.map(row).collect()
}
