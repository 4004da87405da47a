//! Measured curves over computed ones: the key `compare` of every analysis.

use crate::error::Diagnostic;
use crate::model;
use crate::quantity::Quantity;
use crate::report::{Column, Curve, Measured, Panel, Report, Table, Values};
use crate::yaml::{self, Node};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A table with measured values and what they are drawn over.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Keys {
    file: String,
    x: String,
    y: String,
    #[serde(default)]
    over: Option<String>,
    #[serde(default)]
    x_unit: Option<String>,
    #[serde(default)]
    y_unit: Option<String>,
    #[serde(default)]
    label: Option<String>,
}

/// Measured values as the file has them.
#[derive(Debug, Clone)]
pub(super) struct Points {
    keys: Keys,
    pub path: PathBuf,
    x: Vec<f64>,
    y: Vec<f64>,
}

/// Reads what the entry of an analysis is compared with; `path` is that of the analysis.
///
/// # Errors
/// Keys that are wrong, files that cannot be read, units that are none.
pub(super) fn read(node: &Node, path: &str) -> Result<Vec<Points>, Vec<Diagnostic>> {
    let path = yaml::join(path, "compare");
    let Some(own) = node.get("compare").filter(|own| !own.is_null()) else {
        return Ok(Vec::new());
    };
    let list: Vec<(String, &Node)> = match &own.value {
        yaml::Value::List(list) => {
            let numbered = list.iter().enumerate();
            numbered
                .map(|(k, node)| (yaml::join(&path, k), node))
                .collect()
        }
        _ => vec![(path, own)],
    };
    let folder = own
        .location
        .as_ref()
        .and_then(|place| Path::new(&place.source.name).parent());
    let (mut points, mut faults) = (Vec::new(), Vec::new());
    for (path, node) in list {
        let keys: Keys = match node.read(&path) {
            Ok(keys) => keys,
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        let refuse = |key: &str, message: String| {
            let at = node.get(key).unwrap_or(node);
            Diagnostic::at(at, &yaml::join(&path, key), message)
        };
        for (key, unit) in [("x_unit", &keys.x_unit), ("y_unit", &keys.y_unit)] {
            if let Some(Err(message)) = unit.as_deref().map(one) {
                faults.push(refuse(key, message));
            }
        }
        let file = folder.unwrap_or(Path::new("")).join(&keys.file);
        match model::columns_of(&file, &[&keys.x, &keys.y]) {
            Err(message) => faults.push(refuse("file", format!("{}: {message}", file.display()))),
            Ok(mut columns) => points.push(Points {
                keys,
                path: file,
                y: columns.pop().unwrap_or_default(),
                x: columns.pop().unwrap_or_default(),
            }),
        }
    }
    match faults.is_empty() {
        true => Ok(points),
        false => Err(faults),
    }
}

/// One of a unit.
fn one(unit: &str) -> Result<Quantity, String> {
    Quantity::parse(&format!("1 {unit}"))
}

/// What a column along an axis holds: its unit, and SI per number.
struct UnitScale {
    unit: String,
    size: f64,
    is_frequency: bool,
}

impl UnitScale {
    fn of(column: &Column) -> UnitScale {
        let size = one(&column.unit).map_or(1.0, |quantity| quantity.value);
        UnitScale {
            unit: column.unit.clone(),
            size,
            is_frequency: false,
        }
    }

    /// Numbers of the column over numbers of the file.
    fn factor(&self, written: Option<&str>) -> Result<f64, String> {
        let Some(unit) = written else {
            return Ok(1.0);
        };
        let given = one(unit)?;
        if self.is_frequency {
            return Ok(given.value / self.size);
        }
        let own = one(&self.unit).ok().and_then(|quantity| quantity.dimension);
        match own == given.dimension {
            true => Ok(given.value / self.size),
            false if self.unit.is_empty() => {
                Err(format!("`{unit}`: the computed values have no unit"))
            }
            false => Err(format!(
                "`{unit}`: the computed values are in {}",
                self.unit
            )),
        }
    }
}

/// Adds the measured curves to a report whose figures are settled: a table each, and what is drawn.
pub(super) fn add(report: &mut Report, list: &[Points]) {
    for (k, points) in list.iter().enumerate() {
        match place(report, &points.keys) {
            Ok((curve, axes)) => {
                let name = match k {
                    0 => "measured".to_owned(),
                    k => format!("measured_{}", k + 1),
                };
                let column = |name: &str, scale: &(UnitScale, f64), values: &[f64]| Column {
                    name: name.to_owned(),
                    unit: scale.0.unit.clone(),
                    values: Values::Float(values.iter().map(|x| x * scale.1).collect()),
                };
                report.tables.push(Table {
                    name: name.clone(),
                    columns: vec![
                        column(&curve.x, &axes[0], &points.x),
                        column(&curve.y, &axes[1], &points.y),
                    ],
                });
                let stem = points.path.file_stem().unwrap_or_default();
                let label = points.keys.label.clone();
                report.plot.measured.push(Measured {
                    table: name,
                    x: curve.x,
                    y: curve.y,
                    label: label.unwrap_or_else(|| stem.to_string_lossy().into_owned()),
                });
            }
            Err(message) => report
                .warnings
                .push(format!("`compare` is not drawn: {message}")),
        }
    }
}

/// The curve over which measured values are drawn, and what its axes hold.
fn place(report: &Report, keys: &Keys) -> Result<(Curve, [(UnitScale, f64); 2]), String> {
    let panels: Vec<&Panel> = report
        .figures()
        .flat_map(|(_, figure)| &figure.panels)
        .collect();
    let wanted = keys.over.as_ref().unwrap_or(&keys.y);
    let front = format!("{wanted}.");
    let is_wanted = |curve: &&Curve| curve.y == *wanted || curve.y.starts_with(&front);
    let all = || {
        panels
            .iter()
            .flat_map(|panel| panel.curves.iter().map(move |c| (*panel, c)))
    };
    let found = all().find(|(_, curve)| is_wanted(curve));
    let first = || all().next().filter(|_| keys.over.is_none());
    let Some((panel, curve)) = found.or_else(first) else {
        let mut known: Vec<&str> = all().map(|(_, curve)| curve.y.as_str()).collect();
        known.dedup();
        return Err(format!(
            "no figure shows `{wanted}`; drawn are {}",
            known.join(", ")
        ));
    };
    let table = report.table(&curve.table);
    let column = |name: &str| {
        table
            .and_then(|table| table.column(name))
            .map(UnitScale::of)
    };
    let (Some(mut x), Some(y)) = (column(&curve.x), column(&curve.y)) else {
        return Err(format!("the figure of `{}` has no numbers", curve.y));
    };
    let mut x_factor = 1.0;
    if let Some(axis) = panel.x_frequency {
        x.size = axis.size(axis.written);
        x.is_frequency = true;
        // A bare number is in the unit of the axis.
        x_factor = 1.0 / axis.factor();
    }
    if keys.x_unit.is_some() {
        x_factor = x.factor(keys.x_unit.as_deref())?;
    }
    let y_factor = y.factor(keys.y_unit.as_deref())?;
    Ok((curve.clone(), [(x, x_factor), (y, y_factor)]))
}
