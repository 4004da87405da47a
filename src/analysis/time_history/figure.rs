//! Figure of a time history.

use crate::analysis::{Setting, columns};
use crate::measure::Heading;
use crate::postprocess::connection::is_clearance;
use crate::report::{Curve, CurveStyle, Figure, Panel, Table, Words, readable};

/// Panels that connections without a gap may fill.
const FEW_PANELS: usize = 4;
/// Panels drawn at most; the table has every connection.
const MAX_PANELS: usize = 48;

/// Deformations against time, and force against deformation where there is a memory.
pub(super) fn figure(setting: &Setting<'_>, main: &Table) -> Figure {
    let time = columns::time(setting);
    let names = &setting.assembly.connections;
    let panel = |(quantity, name): (Heading, &String)| Panel {
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
    let loops = (0..names.len()).filter(|e| {
        let mounts = setting.assembly.system.mounts();
        mounts[*e].element.memory_count() > 0
    });
    let is_there = |panel: &Panel| {
        let mut curves = panel.curves.iter();
        curves.all(|c| [&c.x, &c.y].iter().all(|name| main.column(name).is_some()))
    };
    let loops = loops.map(|e| force_loop(setting, e)).filter(is_there);
    Figure {
        title: String::new(),
        panels: (quantities.into_iter().zip(names))
            .enumerate()
            .filter(|(e, (quantity, _))| drawn.contains(e) && main.column(&quantity.name).is_some())
            .map(|(_, named)| panel(named))
            .chain(loops.take(MAX_PANELS))
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

/// Force against deformation of a connection.
fn force_loop(setting: &Setting<'_>, connection: usize) -> Panel {
    let count = setting.assembly.connections.len();
    let mut headings = columns::connections(setting);
    let force = headings.swap_remove(2 * count + connection);
    let deformation = headings.swap_remove(connection);
    Panel {
        x_label: deformation.axis(),
        y_label: force.axis(),
        curves: vec![Curve {
            table: String::new(),
            x: deformation.name,
            y: force.name,
            label: setting.assembly.connections[connection].clone(),
            style: CurveStyle::Line,
            only: None,
        }],
        ..Panel::default()
    }
}
