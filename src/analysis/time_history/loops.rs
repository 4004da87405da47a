//! Force against deformation of every connection of a train that is not linear: in motion, and slowly over the same range.

use crate::analysis::{Setting, columns};
use crate::report::{Column, Curve, CurveStyle, Panel, Table, Values};
use crate::system::Mount;

/// Steps of a slow passage through the range.
const STEPS: usize = 200;

/// The table `loops`: for every connection whose force at rest is a function of deformation and memory, one slow cycle through the range
/// of its motion, from the largest deformation down and up again; without memory that is the force curve, traced twice. `None` where all laws are linear.
pub(super) fn table(setting: &Setting<'_>, main: &Table) -> Option<Table> {
    let mounts = setting.assembly.system.mounts();
    if mounts.iter().all(is_linear) {
        return None;
    }
    let mut headings = columns::connections(setting);
    let forces = headings.split_off(2 * mounts.len());
    let mut list = Vec::new();
    for (e, mount) in mounts.iter().enumerate().filter(|(_, m)| is_slow(m)) {
        let (q, f) = (&headings[e], &forces[e]);
        let Some(Values::Float(motion)) = main.column(&q.name).map(|c| &c.values) else {
            continue;
        };
        let motion = motion.iter().copied().filter(|x| x.is_finite());
        let (low, high) = motion.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let (places, values) = match low <= high {
            true => cycle(mount, (low / q.factor, high / q.factor)),
            false => Default::default(),
        };
        list.extend([q.clone().column(places), f.clone().column(values)]);
    }
    Some(Table {
        name: "loops".into(),
        columns: list,
    })
}

/// Whether the force is a multiple of the deformation.
fn is_linear(mount: &Mount) -> bool {
    let law = &mount.element;
    law.memory_count() == 0
        && law.is_piecewise_affine()
        && law.breakpoints().is_empty()
        && mount.stiffness_variation.is_none()
}

/// Whether a force at rest follows from deformation and memory alone.
fn is_slow(mount: &Mount) -> bool {
    mount.element.evolving().is_none() && mount.element.least_impact().is_none()
}

/// Deformations and forces of a slow cycle.
fn cycle(mount: &Mount, (low, high): (f64, f64)) -> (Vec<f64>, Vec<f64>) {
    let mut memory = vec![0.0; mount.element.memory_count()];
    let place = |k: usize| {
        let share = (k % (2 * STEPS)).abs_diff(STEPS) as f64 / STEPS as f64;
        low + share * (high - low)
    };
    // The first cycle forgets how it began.
    let points = (0..=4 * STEPS).map(|k| {
        let x = place(k);
        mount.element.project(x, &mut memory);
        (x, mount.respond_with([x, 0.0], 0.0, &memory).f)
    });
    points.skip(2 * STEPS).unzip()
}

/// Panels: force against deformation of each connection, in motion and slowly.
pub(super) fn panels<'a>(
    setting: &'a Setting<'_>,
    (main, slow): (&'a Table, &'a Table),
) -> impl Iterator<Item = Panel> + 'a {
    let names = &setting.assembly.connections;
    let mut headings = columns::connections(setting);
    let forces = headings.split_off(2 * names.len());
    let there = move |table: &Table, x: &str, y: &str| {
        table.column(x).is_some_and(has_values) && table.column(y).is_some_and(has_values)
    };
    (headings.into_iter().zip(forces).zip(names)).filter_map(move |((q, f), name)| {
        let curve = |table: &Table, label: String| Curve {
            table: table.name.clone(),
            x: q.name.clone(),
            y: f.name.clone(),
            label,
            style: CurveStyle::Line,
            only: None,
        };
        let tables = [(main, name.clone()), (slow, format!("{name}, slowly"))];
        let curves: Vec<Curve> = (tables.into_iter())
            .filter(|(table, _)| there(table, &q.name, &f.name))
            .map(|(table, label)| curve(table, label))
            .collect();
        let is_drawn = curves.first().is_some_and(|c| c.table == main.name);
        is_drawn.then(|| Panel {
            x_label: q.axis(),
            y_label: f.axis(),
            curves,
            ..Panel::default()
        })
    })
}

fn has_values(column: &Column) -> bool {
    match &column.values {
        Values::Float(list) => list.iter().any(|x| x.is_finite()),
        _ => false,
    }
}
