//! Curves of the same file that are drawn over a map.

use crate::analysis::bifurcation_curve::Axes;
use crate::analysis::columns::{float, integer, text};
use crate::analysis::parameter::VariedParameter;
use crate::analysis::read::parts;
use crate::analysis::{Analysis, Setting};
use crate::error::{Error, did_you_mean};
use crate::report::{Report, Table, Values};
use std::collections::HashMap;

/// The curve analysis of that name, and whether its parameters are those of the map in the other order.
pub(super) fn check(
    setting: &Setting<'_>,
    axes: &Axes,
    name: &str,
) -> Result<(Box<dyn Analysis>, bool), String> {
    let path = format!("analyses.{name}");
    let all = setting
        .model
        .document()
        .get("analyses")
        .and_then(|node| node.as_map("analyses").ok());
    let Some(entry) = all.and_then(|map| map.get(name)) else {
        let known: Vec<&str> =
            all.map_or(Vec::new(), |map| map.keys().map(String::as_str).collect());
        return Err(format!(
            "no analysis is called `{name}`; {}",
            did_you_mean(name, known)
        ));
    };
    let parts = parts(&entry.node, &path).map_err(|mistake| mistake.message)?;
    if parts.kind != "bifurcation_curve" {
        return Err(format!(
            "`{name}` is a {}, wanted a bifurcation_curve",
            parts.kind
        ));
    }
    let written = parts
        .own
        .get("parameters")
        .and_then(|node| node.as_list("parameters").ok());
    let written: Vec<VariedParameter> = (written.into_iter().flatten())
        .filter_map(|node| VariedParameter::find(setting, node.as_text("parameters").ok()?).ok())
        .collect();
    let own = [0, 1].map(|k| axes.list[k].parameter.name());
    let is_swapped = match written.as_slice() {
        [a, b] if [a.name(), b.name()] == own => false,
        [a, b] if [b.name(), a.name()] == own => true,
        _ => return Err(format!("`{name}` has other parameters than the map")),
    };
    let analysis = parts.own.read::<Box<dyn Analysis>>(&path);
    let analysis = analysis.map_err(|mistake| mistake.message)?;
    match analysis.check(setting).into_iter().next() {
        None => Ok((analysis, is_swapped)),
        Some(fault) => Err(format!("{path}.{}: {}", fault.key, fault.message)),
    }
}

/// What the curves of a report are called in its figure, by their numbers.
fn labels(report: &Report) -> HashMap<String, String> {
    let panels = report.figure.iter().flat_map(|figure| &figure.panels);
    let curves = panels.flat_map(|panel| &panel.curves);
    let own = curves.filter_map(|curve| Some((curve.only.clone()?.1, curve.label.clone())));
    own.collect()
}

/// Curves that are drawn over the map: their table, number and label of each, and what is missing.
pub(super) type Overlay = (Table, Vec<(String, String)>, Vec<String>);

/// Curves with their kinds, in the parameters of the map: `curve, kind, parameter_1, parameter_2`; reasons why some are not whole.
pub(super) fn tables(
    setting: &Setting<'_>,
    axes: &Axes,
    names: &[String],
) -> Result<Overlay, Error> {
    let (mut numbers, mut kinds, mut values) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    let (mut list, mut reasons) = (Vec::new(), Vec::new());
    for name in names {
        let Ok((analysis, is_swapped)) = check(setting, axes, name) else {
            continue;
        };
        let report = analysis.run(setting)?;
        reasons.extend(
            report
                .ended_early
                .iter()
                .map(|reason| format!("{name}: {reason}")),
        );
        let Some(table) = report.table("") else {
            continue;
        };
        let labels = labels(&report);
        let columns = ["curve", "kind", "parameter_1", "parameter_2"].map(|c| table.column(c));
        let [Some(curve), Some(kind), Some(first), Some(second)] =
            columns.map(|c| c.map(|c| &c.values))
        else {
            continue;
        };
        let (
            Values::Integer(curve),
            Values::Text(kind),
            Values::Float(first),
            Values::Float(second),
        ) = (curve, kind, first, second)
        else {
            continue;
        };
        let mut before = None;
        for row in 0..curve.len() {
            if before != Some(curve[row]) {
                let label = labels.get(&curve[row].to_string());
                let label = label.cloned().unwrap_or_else(|| kind[row].clone());
                list.push((list.len().to_string(), label));
            }
            before = Some(curve[row]);
            numbers.push(list.len() as i64 - 1);
            kinds.push(kind[row].clone());
            let pair = [first[row], second[row]];
            values[usize::from(is_swapped)].push(pair[0]);
            values[usize::from(!is_swapped)].push(pair[1]);
        }
    }
    let [first, second] = values;
    let columns = vec![
        integer("curve", numbers),
        text("kind", kinds),
        float("parameter_1", &axes.list[0].unit, first),
        float("parameter_2", &axes.list[1].unit, second),
    ];
    let table = Table {
        name: "curves".into(),
        columns,
    };
    Ok((table, list, reasons))
}
