//! Parts of a train that are given by matrices, such as a reduced finite-element model, with coordinates named beside the bodies.
//!
//! ```text
//! M z'' + C z' + K z = forces,    K = sum over i of k_i a_i^T a_i,    C = A^T S A
//! ```
//!
//! Coordinates are bodies to everything else. K becomes linear connections with arms a_i, as many as its rank; C acts on their rates.

use super::arms::Bodies;
use super::fields::{Fields, Mistakes, NumberMeasure, Range, check_name, entries, word};
use super::kinematics::RigidRow;
use super::{Body, Connection, DeformationUnit, Drag, MatrixPart, Motion};
use crate::element::Linear;
use crate::error::Diagnostic;
use crate::numeric::fraction::{self, Fraction, whole};
use crate::quantity::Quantity;
use crate::yaml::{Node, Value};
use indexmap::IndexMap;
use nalgebra::{DMatrix, DVector};

/// Most coordinates of a part.
const MOST: usize = 256;
/// Entries across the diagonal that differ by more, relative to the diagonal, are a mistake.
const SYMMETRIC: f64 = 1e-6;
/// A motion whose stiffness is below this share of the largest is free; just above it a rounded free motion is more likely than a spring.
const FREE: f64 = 1e-11;
const LIKELY: f64 = 1e-7;
/// Entries of arms below this share of the largest are rounding.
const ROUNDING: f64 = 1e-13;
/// Denominators of ratios in rigid motion that rounding is taken off for.
const DENOMINATOR: f64 = 5040.0;

/// A part as it is written, its coordinates among the bodies.
pub(super) struct PlacedMatrices {
    name: String,
    unit: DeformationUnit,
    /// Numbers of its coordinates among the bodies.
    bodies: Vec<usize>,
    inertia: DMatrix<f64>,
    /// A with the stiffnesses k.
    arms: DMatrix<f64>,
    stiffness: Vec<f64>,
    damping: Option<DMatrix<f64>>,
    /// Names of the connections that it becomes.
    names: Vec<String>,
}

/// The parts of a model; their coordinates join the bodies.
pub(super) fn parts(
    root: &Fields<'_>,
    bodies: &mut Bodies,
    mistakes: &mut Mistakes,
) -> Option<Vec<PlacedMatrices>> {
    let Some(node) = root.get("matrices") else {
        return Some(Vec::new());
    };
    let fields = Fields::open(node, "matrices", mistakes)?;
    let mut list = Vec::new();
    for (name, entry) in fields.entries() {
        let path = fields.path_of(name);
        mistakes.note(check_name(entry, name, &path));
        list.push(part(name, &entry.node, &path, bodies, mistakes));
    }
    list.into_iter().collect()
}

fn part(
    name: &str,
    node: &Node,
    path: &str,
    bodies: &mut Bodies,
    mistakes: &mut Mistakes,
) -> Option<PlacedMatrices> {
    let keys = ["coordinates", "inertia", "damping", "stiffness"];
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let coordinates = coordinates(&fields, mistakes);
    let n = coordinates.as_ref().map(Vec::len);
    let mut read = |key: &str, wanted: &str| {
        let node = fields.required(key, wanted, mistakes)?;
        symmetric(node, &fields.path_of(key), n?, mistakes)
    };
    let inertia = read("inertia", "M as a list of rows, SI units");
    let stiffness = read("stiffness", "K as a list of rows, SI units");
    let damping = match fields.get("damping") {
        Some(node) => Some(symmetric(node, &fields.path_of("damping"), n?, mistakes)?),
        None => None,
    };
    let coordinates = coordinates?;
    let first = bodies.len();
    for (k, (own, motion)) in coordinates.iter().enumerate() {
        if bodies.contains_key(own) {
            let message = format!("`{own}` is the name of a body already");
            mistakes.add(Diagnostic::at(
                node,
                &fields.path_of("coordinates"),
                message,
            ));
            return None;
        }
        let body = inertia.as_ref().map(|m| Body {
            inertia: m[(k, k)],
            motion: *motion,
            drag: Drag::default(),
        });
        bodies.insert(own.clone(), body);
    }
    let (inertia, stiffness) = (inertia?, stiffness?);
    if inertia.clone().cholesky().is_none() {
        let message = "M is not positive definite: some motion would have no inertia";
        let at = fields.get("inertia").unwrap_or(node);
        mistakes.add(Diagnostic::at(at, &fields.path_of("inertia"), message));
        return None;
    }
    let at = fields.get("stiffness").unwrap_or(node);
    let factors = factors(&stiffness, (at, &fields.path_of("stiffness")), mistakes)?;
    let (arms, stiffness) = factors;
    let damping = match (&damping, fields.get("damping")) {
        (Some(c), Some(at)) => Some(rates(c, &arms, (at, &fields.path_of("damping")), mistakes)?),
        _ => None,
    };
    let is_turning = coordinates.iter().all(|(_, m)| *m == Motion::Rotation);
    Some(PlacedMatrices {
        name: name.to_owned(),
        unit: DeformationUnit::of(if is_turning {
            Motion::Rotation
        } else {
            Motion::Translation
        }),
        bodies: (first..first + coordinates.len()).collect(),
        inertia,
        names: (1..=stiffness.len())
            .map(|k| format!("{name}_{k}"))
            .collect(),
        arms,
        stiffness,
        damping,
    })
}

/// Names with their motions: a list of angles, or a map to `rotation` and `translation`.
fn coordinates(fields: &Fields<'_>, mistakes: &mut Mistakes) -> Option<Vec<(String, Motion)>> {
    let node = fields.required(
        "coordinates",
        "their names, such as [flange, rim]",
        mistakes,
    )?;
    let path = fields.path_of("coordinates");
    let before = mistakes.count();
    let mut list: IndexMap<String, Motion> = IndexMap::new();
    if let Value::Map(map) = &node.value {
        for (name, entry) in map {
            let own = format!("{path}.{name}");
            mistakes.note(check_name(entry, name, &own));
            let motion = word(&entry.node, &own, &["rotation", "translation"]);
            let motion = match mistakes.note(motion) {
                Some("translation") => Motion::Translation,
                _ => Motion::Rotation,
            };
            list.insert(name.clone(), motion);
        }
    } else {
        for (own, node) in entries(node, &path, mistakes) {
            let name = mistakes.note(node.as_text(&own))?;
            if !super::is_name(name) {
                let message = format!("names {}", super::NAMES);
                mistakes.add(Diagnostic::at(node, &own, message));
            }
            if list.insert(name.to_owned(), Motion::Rotation).is_some() {
                let message = format!("`{name}` is there twice");
                mistakes.add(Diagnostic::at(node, &own, message));
            }
        }
    }
    if mistakes.count() == before && !(1..=MOST).contains(&list.len()) {
        let message = format!("found {} coordinates, wanted 1 to {MOST}", list.len());
        mistakes.add(Diagnostic::at(node, &path, message));
    }
    (mistakes.count() == before).then(|| list.into_iter().collect())
}

/// A symmetric matrix of bare numbers, n x n.
fn symmetric(node: &Node, path: &str, n: usize, mistakes: &mut Mistakes) -> Option<DMatrix<f64>> {
    let before = mistakes.count();
    let rows = entries(node, path, mistakes);
    let mut matrix = DMatrix::zeros(n, n);
    let mut widths = Vec::new();
    for (i, (path, row)) in rows.iter().enumerate() {
        let row = entries(row, path, mistakes);
        widths.push(row.len());
        for (j, (path, node)) in row.iter().enumerate() {
            let value = match bare(node, path) {
                Ok(_) => mistakes.number(node, path, NumberMeasure::AnySi, Range::Any),
                Err(mistake) => mistakes.note(Err(mistake)),
            };
            let value = value.unwrap_or(0.0);
            if i < n && j < n {
                matrix[(i, j)] = value;
            }
        }
    }
    if mistakes.count() > before {
        return None;
    }
    if widths.len() != n || widths.iter().any(|w| *w != n) {
        let found = widths.iter().find(|w| **w != n).unwrap_or(&n);
        let message = format!(
            "found {} rows, one of them with {found} values; wanted {n} x {n}: a row and a column for each coordinate",
            widths.len()
        );
        mistakes.add(Diagnostic::at(node, path, message));
        return None;
    }
    let size = |k: usize| matrix[(k, k)].abs().sqrt();
    for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let (a, b) = (matrix[(i, j)], matrix[(j, i)]);
        if (a - b).abs() > SYMMETRIC * (size(i) * size(j)).max(SYMMETRIC * a.abs().max(b.abs())) {
            let message = format!("not symmetric: {path}.{i}.{j} = {a}, {path}.{j}.{i} = {b}");
            let help = "gyroscopic and circulatory terms are not taken";
            mistakes.add(Diagnostic::at(node, path, message).with_help(help));
            return None;
        }
    }
    Some((&matrix + matrix.transpose()) * 0.5)
}

/// The entry on the other side of the diagonal: `matrices.rim.stiffness.1.0` of `matrices.rim.stiffness.0.1`.
pub(super) fn mirrored(path: &str) -> Option<String> {
    let steps: Vec<&str> = path.split('.').collect();
    match steps.as_slice() {
        ["matrices", part, key, i, j] if i != j => Some(format!("matrices.{part}.{key}.{j}.{i}")),
        _ => None,
    }
}

/// A finite number without a unit: a matrix over angles and displacements has several.
fn bare(node: &Node, path: &str) -> Result<f64, Diagnostic> {
    let quantity = Quantity::from_node(node, path)?;
    match quantity.dimension {
        None if quantity.value.is_finite() => Ok(quantity.value),
        _ => {
            let message = format!(
                "found {}, wanted a finite number in SI units",
                node.describe()
            );
            Err(Diagnostic::at(node, path, message))
        }
    }
}

/// K = A^T diag(k) A with as many rows as its rank, by Cholesky's method with diagonal pivots on a unit diagonal.
fn factors(
    stiffness: &DMatrix<f64>,
    (node, path): (&Node, &str),
    mistakes: &mut Mistakes,
) -> Option<(DMatrix<f64>, Vec<f64>)> {
    let n = stiffness.nrows();
    let refuse = |mistakes: &mut Mistakes, reason: String| {
        let message = format!("K is not positive semidefinite: {reason}");
        mistakes.add(Diagnostic::at(node, path, message));
    };
    let size = DVector::from_fn(n, |k, _| stiffness[(k, k)].max(0.0).sqrt());
    let bare = |k: usize| size[k] == 0.0 && stiffness.row(k).iter().any(|x| *x != 0.0);
    if let Some(k) = (0..n).find(|k| stiffness[(*k, *k)] < 0.0 || bare(*k)) {
        refuse(mistakes, format!("{path}.{k}.{k} = {}", stiffness[(k, k)]));
        return None;
    }
    let unit = |k: usize| if size[k] > 0.0 { 1.0 / size[k] } else { 0.0 };
    let mut rest = DMatrix::from_fn(n, n, |i, j| stiffness[(i, j)] * unit(i) * unit(j));
    let (mut rows, mut list) = (Vec::new(), Vec::new());
    for _ in 0..n {
        // The first of equal pivots, whatever rounding did to the others.
        let largest = (0..n).map(|k| rest[(k, k)]).fold(0.0, f64::max);
        let Some(pivot) =
            (0..n).find(|k| rest[(*k, *k)] >= (1.0 - 1e-9) * largest && largest > FREE)
        else {
            break;
        };
        if largest < LIKELY {
            mistakes.warn(format!(
                "{path}: a motion of the part has {largest:.0e} of its largest stiffness: if it is free, write K with more digits"
            ));
        }
        let column = rest.column(pivot) / largest.sqrt();
        rest -= &column * column.transpose();
        rest.row_mut(pivot).fill(0.0);
        rest.column_mut(pivot).fill(0.0);
        let row = column.component_mul(&size);
        let scale = row.amax();
        rows.push(row.map(|x| {
            if x.abs() > ROUNDING * scale {
                x / scale
            } else {
                0.0
            }
        }));
        list.push(scale * scale);
    }
    if let Some(k) = (0..n).find(|k| rest[(*k, *k)] < -1e3 * FREE || rest.row(*k).amax() > 1e-6) {
        refuse(
            mistakes,
            format!("coordinate {k} has a motion with negative stiffness"),
        );
        return None;
    }
    let arms = DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j]);
    Some((arms, list))
}

/// S with C = A^T S A.
fn rates(
    damping: &DMatrix<f64>,
    arms: &DMatrix<f64>,
    (node, path): (&Node, &str),
    mistakes: &mut Mistakes,
) -> Option<DMatrix<f64>> {
    let inverse = (arms * arms.transpose()).cholesky().map(|c| c.inverse());
    let shares = inverse.unwrap_or_else(|| DMatrix::zeros(arms.nrows(), arms.nrows())) * arms;
    let rates = &shares * damping * shares.transpose();
    let missed = arms.transpose() * &rates * arms - damping;
    let largest = damping.amax();
    if missed.amax() > SYMMETRIC * largest {
        let message = "damps a motion that K leaves free: relative coordinates do not describe it";
        let help = "replace a viscous path to ground without stiffness by a mean drag torque";
        mistakes.add(Diagnostic::at(node, path, message).with_help(help));
        return None;
    }
    let eigen = rates.clone().symmetric_eigenvalues();
    if eigen.min() < -SYMMETRIC * eigen.amax() {
        let message = "C is not positive semidefinite: some motion would gain energy";
        mistakes.add(Diagnostic::at(node, path, message));
        return None;
    }
    Some(rates)
}

impl PlacedMatrices {
    /// Coordinates that its stiffness holds.
    pub(super) fn held(&self) -> impl Iterator<Item = usize> + '_ {
        let acts = |k: &usize| self.arms.column(*k).amax() > 0.0;
        (0..self.bodies.len()).filter(acts).map(|k| self.bodies[k])
    }

    /// Names of its connections with their rows in rigid motion.
    pub(super) fn rigid_rows(&self) -> impl Iterator<Item = (&str, RigidRow)> {
        let echelon = echelon(self.arms.clone());
        let row = move |k: usize| {
            let arms = (0..self.bodies.len()).filter(|j| echelon[(k, *j)] != 0.0);
            RigidRow {
                arms: arms
                    .map(|j| (self.bodies[j], ratio(echelon[(k, j)])))
                    .collect(),
            }
        };
        let names = self.names.iter().map(String::as_str);
        names.enumerate().map(move |(k, name)| (name, row(k)))
    }

    /// Adds its connections to those of the model.
    pub(super) fn join(
        &self,
        connections: &mut IndexMap<String, Connection>,
        (node, mistakes): (&Node, &mut Mistakes),
    ) -> Option<MatrixPart> {
        let first = connections.len();
        for (k, name) in self.names.iter().enumerate() {
            let arms = self.arms.row(k);
            let arms = arms
                .iter()
                .zip(&self.bodies)
                .filter(|(arm, _)| **arm != 0.0);
            let connection = Connection {
                arms: arms.map(|(arm, body)| (*body, *arm)).collect(),
                unit: self.unit,
                teeth: None,
                stiffness: self.stiffness[k],
                damping: 0.0,
                element: Box::new(Linear {}),
                stiffness_variation: None,
                transmission_error: None,
                length: None,
            };
            if connections.insert(name.clone(), connection).is_some() {
                let message = format!("its connection `{name}` has the name of another one");
                let path = format!("matrices.{}", self.name);
                mistakes.add(Diagnostic::at(node, &path, message));
                return None;
            }
        }
        Some(MatrixPart {
            bodies: self.bodies.clone(),
            inertia: self.inertia.clone(),
            connections: (first..connections.len()).collect(),
            damping: self.damping.clone(),
        })
    }
}

/// Reduced row echelon form of a matrix of full row rank, with complete pivots.
fn echelon(mut rows: DMatrix<f64>) -> DMatrix<f64> {
    let (r, n) = rows.shape();
    for k in 0..r {
        let places = (k..r).flat_map(|i| (0..n).map(move |j| (i, j)));
        let best = places.max_by(|a, b| rows[*a].abs().total_cmp(&rows[*b].abs()));
        let (i, j) = best.unwrap_or((k, k));
        rows.swap_rows(k, i);
        let pivot = rows.row(k) / rows[(k, j)];
        for other in (0..r).filter(|other| *other != k) {
            let factor = rows[(other, j)];
            let next = rows.row(other) - &pivot * factor;
            rows.set_row(other, &next);
            rows[(other, j)] = 0.0;
        }
        rows.set_row(k, &pivot);
    }
    rows.map(|x| if x.abs() < 1e-9 { 0.0 } else { x })
}

/// A ratio of speeds without the rounding of an elimination.
fn ratio(x: f64) -> Fraction {
    let parts = (x * DENOMINATOR).round();
    match (x - parts / DENOMINATOR).abs() < 1e-9 {
        true => whole(parts as i64) / whole(DENOMINATOR as i64),
        false => fraction::nearest(x),
    }
}
