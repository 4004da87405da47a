//! Values that are allowed but look like slips of a unit, judged by the sizes around them.

use crate::element::Dimension;
use crate::model::{Connection, DeformationUnit, Train};

/// Inertias or stiffnesses of neighbours that differ by more look like a slip.
const FAR: f64 = 1e6;
/// Pairs named in one warning.
const SHOWN: usize = 3;

/// A warning for each value that looks like a slip.
pub(super) fn slips(train: &Train) -> Vec<String> {
    let mut list = Vec::new();
    for (name, connection) in &train.connections {
        list.extend(large_displacements(name, connection));
    }
    list.extend(far_inertias(train));
    list.extend(far_stiffnesses(train));
    list
}

/// Displacements in a law, and a transmission error, that are larger than the smallest lever arm.
fn large_displacements(name: &str, connection: &Connection) -> Vec<String> {
    let arms = connection.arms.iter().map(|(_, arm)| arm.abs());
    let least = arms.fold(f64::INFINITY, f64::min);
    let unit = match connection.unit {
        DeformationUnit::Metre => "m",
        DeformationUnit::Radian => "rad",
    };
    let mut list = Vec::new();
    let mut judge = |path: String, value: f64| {
        if value.abs() > least {
            list.push(format!(
                "connections.{name}.{path} = {value} {unit} is larger than the smallest lever arm of the connection, {least}: \
                 is the unit right? (a bare number is in {unit})"
            ));
        }
    };
    let mut law = connection.element.clone_box();
    law.visit_parameters(&mut |p| {
        if p.dimension == Dimension::DISPLACEMENT {
            let index = p.index.map_or(String::new(), |k| format!(".{k}"));
            judge(format!("element.{}{index}", p.name), *p.value);
        }
    });
    if let Some(error) = &connection.transmission_error {
        judge(
            "transmission_error".into(),
            error.mean().abs() + error.swing(),
        );
    }
    list
}

/// Bodies that one connection joins, their inertias compared as they act on its deformation.
fn far_inertias(train: &Train) -> Option<String> {
    let mut pairs: Vec<String> = Vec::new();
    for (name, connection) in &train.connections {
        let felt = |(body, arm): &(usize, f64)| train.bodies[*body].inertia / (arm * arm);
        let free = connection.arms.iter().filter(|a| !train.is_moved(a.0));
        let mut ends: Vec<(usize, f64)> = free.map(|a| (a.0, felt(a))).collect();
        ends.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (Some(first), Some(last)) = (ends.first(), ends.last()) else {
            continue;
        };
        if last.1 > FAR * first.1 {
            let body = |k: usize| {
                train
                    .bodies
                    .get_index(k)
                    .map_or("", |(name, _)| name.as_str())
            };
            pairs.push(format!(
                "{} and {} at {name} ({:.1e} times)",
                body(first.0),
                body(last.0),
                last.1 / first.1
            ));
        }
    }
    far("inertias", &pairs)
}

/// Connections that act on one body, their stiffnesses compared as it feels them.
fn far_stiffnesses(train: &Train) -> Option<String> {
    let mut felt: Vec<Vec<(&str, f64)>> = vec![Vec::new(); train.bodies.len()];
    for (name, connection) in &train.connections {
        let stiffness = connection.contact_stiffness();
        for (body, arm) in connection.arms.iter().filter(|_| stiffness > 0.0) {
            felt[*body].push((name, stiffness * arm * arm));
        }
    }
    let mut pairs: Vec<String> = Vec::new();
    for (list, body) in felt.iter_mut().zip(train.bodies.keys()) {
        list.sort_by(|a, b| a.1.total_cmp(&b.1));
        if let (Some(first), Some(last)) = (list.first(), list.last())
            && last.1 > FAR * first.1
        {
            pairs.push(format!(
                "{} and {} at {body} ({:.1e} times)",
                first.0,
                last.0,
                last.1 / first.1
            ));
        }
    }
    far("stiffnesses", &pairs)
}

fn far(what: &str, pairs: &[String]) -> Option<String> {
    let more = match pairs.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let shown = &pairs[..pairs.len().min(SHOWN)];
    (!pairs.is_empty()).then(|| {
        format!(
            "{what} of neighbours are more than {FAR:e} times apart: {}{more}; are the units right?",
            shown.join(", ")
        )
    })
}
