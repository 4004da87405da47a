//! Orbits on the page: 32-bit floats in base64, thinned where there are many.

use std::collections::HashMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::plot_data::rounded;
use super::series::floats;
use crate::error::Error;
use crate::report::{Report, Table, Values};

/// Room for all orbits of a page, in characters: with it, the plotting script and many figures the page stays below 5 MB.
const ROOM: usize = 1_800_000;
/// Columns before the series.
const KEYS: [&str; 3] = ["branch", "point", "tau"];

/// Every how many orbits one is put on the page.
pub(super) fn stride(reports: &[Report]) -> usize {
    let tables = reports.iter().filter_map(|r| r.table("orbits"));
    let numbers: usize = tables.map(|t| t.rows() * series(t).count()).sum();
    (numbers * size_of::<f32>() * 4 / 3).div_ceil(ROOM).max(1)
}

/// Orbits of a report as the script of the page reads them; null where none were kept.
///
/// # Errors
///
/// `Error::Input` when a column is missing.
pub(super) fn value(report: &Report, stride: usize) -> Result<Value, Error> {
    let Some(table) = report.table("orbits").filter(|t| t.rows() > 0) else {
        return Ok(Value::Null);
    };
    let (branch, point) = (
        floats(report, table, "branch")?,
        floats(report, table, "point")?,
    );
    let (omega, cells) = (frequencies(report)?, MapCells::of(report)?);
    let names: Vec<&str> = series(table).collect();
    let columns = names.iter().map(|name| floats(report, table, name));
    let columns = columns.collect::<Result<Vec<_>, Error>>()?;
    let same = |a: usize, b: usize| branch[a] == branch[b] && point[a] == point[b];
    let starts: Vec<usize> = (0..table.rows())
        .filter(|&row| row == 0 || !same(row, row - 1))
        .collect();
    let ends = starts.iter().skip(1).copied().chain([table.rows()]);
    let orbits = starts.iter().copied().zip(ends).step_by(stride);
    let orbits: Vec<Value> = orbits
        .map(|(start, end)| {
            // Counts: far below 2^53.
            let key = (branch[start] as i64, point[start] as i64);
            let values = columns.iter().map(|c| encoded(&c[start..end]));
            let mut orbit = json!({
                "branch": key.0, "point": key.1, "omega": omega.get(&key).map(|x| rounded(*x)),
                "values": values.collect::<Vec<String>>(),
            });
            if let Some(cells) = &cells {
                cells.describe(&mut orbit, key.1);
            }
            orbit
        })
        .collect();
    let units: Vec<&str> = series(table)
        .filter_map(|name| table.column(name).map(|c| c.unit.as_str()))
        .collect();
    Ok(json!({"names": names, "units": units, "kept": starts.len(), "orbits": orbits}))
}

/// Cells of a map, by the rows of its main table.
struct MapCells<'a> {
    x: Vec<f64>,
    y: Vec<f64>,
    labels: &'a [String],
}

impl<'a> MapCells<'a> {
    fn of(report: &'a Report) -> Result<Option<MapCells<'a>>, Error> {
        let Some(main) = report.table("").filter(|t| t.column("seed").is_some()) else {
            return Ok(None);
        };
        let Some(Values::Text(labels)) = main.column("label").map(|c| &c.values) else {
            return Ok(None);
        };
        Ok(Some(MapCells {
            x: floats(report, main, "x")?,
            y: floats(report, main, "y")?,
            labels,
        }))
    }

    /// Adds the place and the label of a cell to its orbit.
    fn describe(&self, orbit: &mut Value, row: i64) {
        let row = row as usize;
        if let (Some(x), Some(y), Some(label)) =
            (self.x.get(row), self.y.get(row), self.labels.get(row))
        {
            orbit["place"] = json!([rounded(*x), rounded(*y)]);
            orbit["label"] = json!(label);
        }
    }
}

fn series(table: &Table) -> impl Iterator<Item = &str> {
    let names = table.columns.iter().map(|c| c.name.as_str());
    names.filter(|name| !KEYS.contains(name))
}

/// omega/omega_c at every point of every branch.
fn frequencies(report: &Report) -> Result<HashMap<(i64, i64), f64>, Error> {
    let Some(main) = report.table("").filter(|t| t.column("omega").is_some()) else {
        return Ok(HashMap::new());
    };
    let (branch, point) = (
        floats(report, main, "branch")?,
        floats(report, main, "point")?,
    );
    let keys = branch.into_iter().zip(point);
    let keys = keys.map(|(branch, point)| (branch as i64, point as i64));
    Ok(keys.zip(floats(report, main, "omega")?).collect())
}

/// Little-endian 32-bit floats in base64.
fn encoded(values: &[f64]) -> String {
    let bytes: Vec<u8> = values
        .iter()
        .flat_map(|v| (*v as f32).to_le_bytes())
        .collect();
    STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{Column, Values};

    fn report(orbits: i64) -> Report {
        let rows = || (0..orbits * 256).map(|row| row as f64);
        let column = |name: &str, values| Column {
            name: name.into(),
            unit: String::new(),
            values,
        };
        let columns = vec![
            column("branch", Values::Integer(rows().map(|_| 0).collect())),
            column(
                "point",
                Values::Integer((0..orbits * 256).map(|r| r / 256).collect()),
            ),
            column("tau", Values::Float(rows().collect())),
            column("q.mesh", Values::Float(rows().collect())),
        ];
        Report {
            tables: vec![Table {
                name: "orbits".into(),
                columns,
            }],
            ..Report::default()
        }
    }

    #[test]
    fn orbits_are_floats_that_read_back() {
        let value = value(&report(3), 2).unwrap();
        assert_eq!(value["kept"], 3);
        assert_eq!(value["names"], json!(["q.mesh"]));
        let orbits = value["orbits"].as_array().unwrap();
        assert_eq!((orbits.len(), &orbits[1]["point"]), (2, &json!(2)));
        let bytes = STANDARD.decode(orbits[1]["values"][0].as_str().unwrap());
        let bytes = bytes.unwrap();
        assert_eq!(bytes.len(), 4 * 256);
        assert_eq!(f32::from_le_bytes(bytes[4..8].try_into().unwrap()), 513.0);
    }

    #[test]
    fn many_orbits_are_thinned_to_the_room_there_is() {
        assert_eq!(stride(&[report(100)]), 1);
        let reports = [report(2000), report(1000)];
        let stride = stride(&reports);
        assert!(stride > 1, "{stride}");
        let texts = reports
            .iter()
            .map(|r| value(r, stride).unwrap().to_string());
        assert!(texts.map(|t| t.len()).sum::<usize>() < ROOM + ROOM / 10);
    }
}
