//! Figure of a time history.

use super::loops;
use crate::analysis::{Setting, columns};
use crate::measure::ColumnHeading;
use crate::postprocess::connection::is_clearance;
use crate::report::{Curve, CurveStyle, Figure, NamedFigure, Panel, Table, Words, readable};

/// Panels that connections without a gap may fill.
const FEW_PANELS: usize = 4;
/// Panels drawn at most; the table has every connection.
const MAX_PANELS: usize = 48;

/// Force against deformation, in a figure of its own.
pub(super) fn of_loops(setting: &Setting<'_>, tables: (&Table, &Table)) -> NamedFigure {
    NamedFigure {
        name: "loops".into(),
        figure: Figure {
            title: String::new(),
            panels: loops::panels(setting, tables).take(MAX_PANELS).collect(),
        },
    }
}

/// Deformations against time, then force against deformation where `slow` is given.
pub(super) fn figure(setting: &Setting<'_>, main: &Table, slow: Option<&Table>) -> Figure {
    let time = columns::time(setting);
    let names = &setting.assembly.connections;
    let panel = |(quantity, name): (ColumnHeading, &String)| Panel {
        x_label: time.axis(),
        y_label: Words::of("q").axis(&quantity.unit),
        heading: readable(name),
        curves: vec![Curve {
            table: String::new(),
            x: time.name.clone(),
            y: quantity.name,
            label: name.clone(),
            style: CurveStyle::Line,
            only: None,
        }],
        ..Panel::default()
    };
    let quantities = columns::connections(setting);
    let drawn = drawn(setting);
    let loops = slow.map(|slow| loops::panels(setting, (main, slow)));
    Figure {
        title: String::new(),
        panels: (quantities.into_iter().zip(names))
            .enumerate()
            .filter(|(e, (quantity, _))| drawn.contains(e) && main.column(&quantity.name).is_some())
            .map(|(_, named)| panel(named))
            .chain(loops.into_iter().flatten().take(MAX_PANELS))
            .collect(),
    }
}

/// Connections that are drawn: all with a gap, and others while there are few panels.
fn drawn(setting: &Setting<'_>) -> Vec<usize> {
    let mounts = setting.assembly.system.mounts();
    let has_gap = |e: &usize| is_clearance(mounts[*e].element.as_ref());
    let (gaps, others): (Vec<usize>, Vec<usize>) = (0..mounts.len()).partition(has_gap);
    let room = FEW_PANELS.saturating_sub(gaps.len());
    let others = others.into_iter().take(room);
    gaps.into_iter().take(MAX_PANELS).chain(others).collect()
}
