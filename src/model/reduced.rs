//! Reduced, nondimensional systems in a model file.

use super::arms::Bodies;
use super::fields::{Fields, Mistakes, NumberMeasure, Range, check_name, entries};
use super::law::{LawUnits, law};
use super::orders::{Orders, on_common_base};
use super::series::{
    OrderUnit, UNIT_KEYS, harmonic_order, stiffness_variation, transmission_error, unit,
};
use super::train::MOST_CONNECTIONS;
use super::{Reduced, ReducedDamping, ReducedElement};
use crate::error::Diagnostic;
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::yaml::Node;
use indexmap::IndexMap;
use nalgebra::DMatrix;

const PATH: &str = "reduced";
const ASIDE: [&str; 4] = [
    "stiffness_variation",
    "transmission_error",
    UNIT_KEYS[0],
    UNIT_KEYS[1],
];

/// The reduced system of a node.
pub(super) fn reduced(node: &Node, mistakes: &mut Mistakes) -> Option<Reduced> {
    let keys = ["stiffness", "damping", "elements", "element_map", "loads"];
    let fields = Fields::known(node, PATH, &keys, mistakes)?;
    let stiffness = fields.required("stiffness", "kappa as a list of rows, n x e", mistakes);
    let stiffness = stiffness.and_then(|node| matrix(node, "reduced.stiffness", mistakes));
    let shape = stiffness.as_ref().map(|kappa| kappa.shape());
    let n = shape.map(|(n, _)| n);
    let nobody = Bodies::new();
    let read = |orders: &mut Orders<'_>, mistakes: &mut Mistakes| {
        let elements = elements(&fields, orders, mistakes);
        (elements, loads(&fields, n, orders, mistakes))
    };
    let ((elements, loads), revolutions) = on_common_base((&nobody, None), node, mistakes, read);
    if let (Some(kappa), Some(elements)) = (&stiffness, &elements)
        && kappa.ncols() != elements.len()
    {
        let message = format!(
            "kappa is {} x {}, but there are {} elements: wanted one column per element",
            kappa.nrows(),
            kappa.ncols(),
            elements.len()
        );
        mistakes.add(at(&fields, "stiffness", message));
    }
    let element_map = element_map(&fields, shape, mistakes);
    let damping = match fields.get("damping") {
        Some(node) => damping(node, n, mistakes),
        None => Some(ReducedDamping::StiffnessProportional(0.0)),
    };
    Some(Reduced {
        stiffness: stiffness?,
        element_map: element_map?,
        damping: damping?,
        elements: elements?,
        loads,
        revolutions,
    })
}

fn at(fields: &Fields<'_>, key: &str, message: String) -> Diagnostic {
    let node = fields.get(key).unwrap_or(fields.node);
    Diagnostic::at(node, &fields.path_of(key), message)
}

/// A matrix as a list of rows of equal length.
fn matrix(node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<DMatrix<f64>> {
    let before = mistakes.count();
    let rows: Vec<Vec<f64>> = entries(node, path, mistakes)
        .iter()
        .map(|(path, row)| vector(row, path, mistakes))
        .collect();
    if mistakes.count() > before {
        return None;
    }
    let width = rows.first().map_or(0, Vec::len);
    if width == 0 {
        let message = "empty: wanted a list of rows, such as [[2, 1], [1, 2]]";
        mistakes.add(Diagnostic::at(node, path, message));
        return None;
    }
    if let Some(k) = rows.iter().position(|row| row.len() != width) {
        let message = format!(
            "row {} has {} values and row 0 has {width}: wanted rows of equal length",
            k,
            rows[k].len()
        );
        mistakes.add(Diagnostic::at(node, path, message));
        return None;
    }
    Some(DMatrix::from_fn(rows.len(), width, |i, j| rows[i][j]))
}

fn vector(node: &Node, path: &str, mistakes: &mut Mistakes) -> Vec<f64> {
    let list = entries(node, path, mistakes);
    list.iter()
        .filter_map(|(path, node)| mistakes.number(node, path, NumberMeasure::Bare, Range::Any))
        .collect()
}

fn element_map(
    fields: &Fields<'_>,
    shape: Option<(usize, usize)>,
    mistakes: &mut Mistakes,
) -> Option<DMatrix<f64>> {
    let path = fields.path_of("element_map");
    let given = fields.get("element_map");
    let map = match given {
        Some(node) => Some(matrix(node, &path, mistakes)?),
        None => None,
    };
    let (n, e) = shape?;
    match map {
        None if n == e => Some(DMatrix::identity(n, n)),
        None => {
            let message = format!(
                "element_map (W) is missing: stiffness (kappa) is {n} x {e}, so W must be given, {e} x {n}"
            );
            mistakes.add(at(fields, "stiffness", message));
            None
        }
        Some(map) if map.shape() == (e, n) => Some(map),
        Some(map) => {
            let message = format!(
                "W is {} x {}, wanted {e} x {n}: one row per element, one column per coordinate",
                map.nrows(),
                map.ncols()
            );
            mistakes.add(at(fields, "element_map", message));
            None
        }
    }
}

fn damping(node: &Node, n: Option<usize>, mistakes: &mut Mistakes) -> Option<ReducedDamping> {
    const KEYS: [&str; 3] = ["modal_ratio", "matrix", "stiffness_proportional"];
    let path = "reduced.damping";
    let fields = Fields::known(node, path, &KEYS, mistakes)?;
    let (kind, node) = fields.exactly_one(&KEYS, "damping", mistakes)?;
    let own = fields.path_of(kind);
    if kind == "matrix" {
        let gamma = matrix(node, &own, mistakes)?;
        let n = n?;
        if gamma.shape() != (n, n) {
            let message = format!(
                "Gam is {} x {}, wanted {n} x {n}",
                gamma.nrows(),
                gamma.ncols()
            );
            mistakes.add(Diagnostic::at(node, &own, message));
            return None;
        }
        return Some(ReducedDamping::Matrix(gamma));
    }
    let value = mistakes.number(node, &own, NumberMeasure::Bare, Range::NotNegative)?;
    Some(match kind {
        "modal_ratio" => ReducedDamping::ModalRatio(value),
        _ => ReducedDamping::StiffnessProportional(value),
    })
}

fn elements(
    fields: &Fields<'_>,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<IndexMap<String, ReducedElement>> {
    let wanted = "one law per element, such as mesh_1: {type: backlash, half_gap: 1}";
    let node = fields.required("elements", wanted, mistakes)?;
    let list = Fields::open(node, &fields.path_of("elements"), mistakes)?;
    if list.len() == 0 || list.len() > MOST_CONNECTIONS {
        let message = format!(
            "found {} elements, wanted 1 to {MOST_CONNECTIONS}",
            list.len()
        );
        mistakes.add(Diagnostic::at(node, &list.path, message));
        return None;
    }
    let mut read = Vec::new();
    for (name, entry) in list.entries() {
        let path = list.path_of(name);
        mistakes.note(check_name(entry, name, &path));
        let one = element(&entry.node, &path, orders, mistakes);
        read.push(one.map(|element| (name.to_owned(), element)));
    }
    // The number of columns of kappa is judged against all elements: a wrong one has been reported already.
    read.into_iter().collect()
}

fn element(
    node: &Node,
    path: &str,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<ReducedElement> {
    let units = LawUnits::Bare;
    let element = law(Some(node), path, units, &ASIDE, mistakes);
    let Ok(_) = node.as_map(path) else {
        return None;
    };
    let fields = Fields::open(node, path, mistakes)?;
    let base = unit(&fields, None, orders, mistakes);
    let stiffness_variation = fields.get(ASIDE[0]).and_then(|node| {
        let path = fields.path_of(ASIDE[0]);
        stiffness_variation(node, &path, (&base, orders), mistakes)
    });
    let transmission_error = fields.get(ASIDE[1]).and_then(|node| {
        let path = fields.path_of(ASIDE[1]);
        transmission_error(node, &path, units.displacement(), (&base, orders), mistakes)
    });
    Some(ReducedElement {
        element: element?,
        stiffness_variation,
        transmission_error,
    })
}

/// One series a coordinate: mean + sum of cos cos(order phase) + sin sin(order phase).
fn loads(
    fields: &Fields<'_>,
    n: Option<usize>,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Vec<Periodic> {
    let count = n.unwrap_or(0);
    let mut mean = vec![0.0; count];
    let mut harmonics: Vec<Vec<Harmonic>> = vec![Vec::new(); count];
    let own = fields.get("loads").and_then(|node| {
        let path = fields.path_of("loads");
        Fields::known(node, &path, &["mean", "harmonics"], mistakes)
    });
    if let Some(own) = own {
        mean = part(&own, "mean", n, mistakes).unwrap_or(mean);
        let list = own.get("harmonics").map(|node| {
            let path = own.path_of("harmonics");
            entries(node, &path, mistakes)
        });
        for (path, node) in list.unwrap_or_default() {
            let Some(one) = Fields::known(node, &path, &["order", "cos", "sin"], mistakes) else {
                continue;
            };
            let written = one.required("order", "1 for the excitation frequency", mistakes);
            let unit = OrderUnit::reference();
            let order = harmonic_order(written, &one.path_of("order"), (&unit, orders), mistakes);
            let cos = part(&one, "cos", n, mistakes);
            let sin = part(&one, "sin", n, mistakes);
            let entry = |part: &Option<Vec<f64>>, i: usize| {
                part.as_ref()
                    .and_then(|list| list.get(i))
                    .map_or(0.0, |x| *x)
            };
            for (i, list) in harmonics.iter_mut().enumerate() {
                let (cos, sin) = (entry(&cos, i), entry(&sin, i));
                if cos != 0.0 || sin != 0.0 {
                    list.push(Harmonic { order, cos, sin });
                }
            }
        }
    }
    let pairs = mean.into_iter().zip(harmonics);
    pairs
        .map(|(mean, harmonics)| Periodic::Fourier { mean, harmonics })
        .collect()
}

/// A vector of n values; `None` when it is absent or wrong.
fn part(
    fields: &Fields<'_>,
    key: &str,
    n: Option<usize>,
    mistakes: &mut Mistakes,
) -> Option<Vec<f64>> {
    let node = fields.get(key)?;
    let path = fields.path_of(key);
    let before = mistakes.count();
    let list = vector(node, &path, mistakes);
    if mistakes.count() > before {
        return None;
    }
    match n {
        Some(n) if list.len() != n => {
            let message = format!(
                "found {} values, wanted {n}: one per coordinate",
                list.len()
            );
            mistakes.add(Diagnostic::at(node, &path, message));
            None
        }
        _ => Some(list),
    }
}
