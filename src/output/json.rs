//! The machine-readable side of a report: `NAME.json`.

use serde_json::{Map, Value, json};

use super::table_file;
use crate::report::{Report, Table};

/// Key of the summary that goes to `timings.json` instead.
pub const TIMINGS: &str = "timings";
/// Key of what is drawn and how, for drawing again.
pub(super) const FIGURES: &str = "drawing";

/// The content of `NAME.json`.
///
/// `name, type, title, caption, assumed, columns` (of the main table), `tables` (all of them, with file names and row
/// counts), everything in `report.summary` in its order, `warnings` and `ended_early` (null when it did not). A key of
/// the summary that has one of these names gives way; timings are not among them. Numbers that are not finite are null.
pub fn value(report: &Report) -> Value {
    let mut map = Map::new();
    map.insert("name".into(), json!(report.name));
    map.insert("type".into(), json!(report.kind));
    map.insert("title".into(), json!(report.title));
    map.insert("caption".into(), json!(report.caption));
    map.insert("assumed".into(), json!(report.assumed));
    let main = report.table("").map_or_else(Vec::new, columns);
    map.insert("columns".into(), Value::Array(main));
    let tables = report.tables.iter().map(|t| table(report, t)).collect();
    map.insert("tables".into(), Value::Array(tables));
    for (key, value) in &report.summary {
        let is_own = ["warnings", "ended_early", TIMINGS, FIGURES].contains(&key.as_str());
        if !is_own && !map.contains_key(key) {
            map.insert(key.clone(), value.clone());
        }
    }
    if report.figure.is_some() {
        let figures = json!({
            "figure": report.figure,
            "further_figures": report.further_figures,
            "plot": report.plot,
            "connections": report.connections,
        });
        map.insert(FIGURES.into(), figures);
    }
    map.insert("warnings".into(), json!(report.warnings));
    map.insert("ended_early".into(), json!(report.ended_early));
    Value::Object(map)
}

fn columns(table: &Table) -> Vec<Value> {
    let column = |c: &crate::report::Column| json!({"name": c.name, "unit": c.unit});
    table.columns.iter().map(column).collect()
}

/// Columns with the kind of their values: what reads the file back needs it.
fn kinds(table: &Table) -> Vec<Value> {
    let column = |c: &crate::report::Column| json!({"name": c.name, "unit": c.unit, "kind": c.values.kind()});
    table.columns.iter().map(column).collect()
}

fn table(report: &Report, table: &Table) -> Value {
    json!({
        "name": table.name,
        "file": table_file(report, table),
        "rows": report.rows(table),
        "columns": kinds(table),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summary_is_kept_and_cannot_overwrite_the_frame() {
        let mut report = Report {
            name: "fig_11".into(),
            kind: "frequency_response".into(),
            warnings: vec!["pulls".into()],
            ..Report::default()
        };
        report
            .summary
            .insert("options".into(), json!({"tolerance": f64::NAN}));
        report.summary.insert("name".into(), json!("other"));
        report.summary.insert("warnings".into(), json!([]));
        let value = value(&report);
        assert_eq!(value["name"], "fig_11");
        assert_eq!(value["type"], "frequency_response");
        assert_eq!(value["options"]["tolerance"], Value::Null);
        assert_eq!(value["warnings"], json!(["pulls"]));
        assert_eq!(value["ended_early"], Value::Null);
        assert_eq!(value["columns"], json!([]));
    }
}
