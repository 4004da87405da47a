//! Mean motion in a model file: the reference shaft, drag, and the torque that balances all others.

use super::arms::Bodies;
use super::fields::{Fields, Mistakes, NumberMeasure, Range, entries, is_scalar};
use super::kinematics::{RigidRow, SpeedConflict, speeds};
use super::{Body, Drag, Load, LoadPart, Motion, Teeth};
use crate::error::Diagnostic;
use crate::numeric::fraction::{self, Fraction, whole};
use crate::numeric::growth::Growth;
use crate::numeric::periodic::Periodic;
use crate::quantity::UnitDimension;
use crate::yaml::Node;
use indexmap::IndexMap;
use num_traits::{One, Zero};

/// Speeds of all bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanMotion {
    /// The body whose revolutions orders count.
    pub reference: usize,
    /// Its speed [rad/s], not 0.
    pub speed: f64,
    /// Speeds of all bodies over that of the reference.
    pub ratios: Vec<Fraction>,
}

impl MeanMotion {
    /// Mean speed of a body [rad/s].
    pub fn speed_of(&self, body: usize) -> f64 {
        self.speed * fraction::to_f64(&self.ratios[body])
    }

    /// Tooth passing frequency of a mesh [rad/s].
    pub fn mesh_frequency(&self, teeth: &Teeth) -> f64 {
        fraction::to_f64(&self.order(teeth)) * self.speed.abs()
    }

    /// Tooth passing order of a mesh.
    pub fn order(&self, teeth: &Teeth) -> Fraction {
        teeth.order(&self.ratios)
    }
}

/// Rows of the connections with their names.
pub(super) struct ConnectionRows<'n> {
    pub names: Vec<&'n str>,
    pub rows: Vec<RigidRow>,
}

/// The `reference` of a train.
pub(super) fn reference(
    root: &Fields<'_>,
    bodies: &Bodies,
    rows: Option<&ConnectionRows<'_>>,
    mistakes: &mut Mistakes,
) -> Option<MeanMotion> {
    let node = root.get("reference")?;
    let fields = Fields::known(node, "reference", &["body", "speed", "also"], mistakes)?;
    let wanted =
        "the shaft to whose revolutions orders refer, such as {body: crank, speed: 800 rpm}";
    let body = fields.required("body", wanted, mistakes)?;
    let body = turning(body, &fields.path_of("body"), bodies, mistakes);
    let measure = NumberMeasure::Si(UnitDimension::FREQUENCY);
    fields.required("speed", "its mean speed, such as 800 rpm", mistakes);
    let speed = fields.number("speed", measure, Range::Any, mistakes);
    if let (Some(0.0), Some(node)) = (speed, fields.get("speed")) {
        let message = "found 0: orders are multiples of this speed";
        mistakes.add(Diagnostic::at(node, &fields.path_of("speed"), message));
    }
    let also = also(&fields, bodies, mistakes);
    let (reference, speed, rows) = (body?, speed.filter(|w| *w != 0.0)?, rows?);
    let mut given = vec![(reference, Fraction::one())];
    for (path, node, body, w) in also {
        if given.iter().any(|(other, _)| *other == body) {
            let message = "the speed of this body is already given";
            mistakes.add(Diagnostic::at(node, &path, message));
        }
        given.push((body, fraction::nearest(w / speed)));
    }
    match speeds(bodies.len(), &rows.rows, &given) {
        Ok(ratios) => Some(MeanMotion {
            reference,
            speed,
            ratios,
        }),
        Err(fault) => {
            mistakes.add(explain(root, fault, (node, "reference"), bodies, rows));
            None
        }
    }
}

/// Speeds of further bodies: path, node, body, rad/s.
fn also<'n>(
    fields: &Fields<'n>,
    bodies: &Bodies,
    mistakes: &mut Mistakes,
) -> Vec<(String, &'n Node, usize, f64)> {
    let mut list = Vec::new();
    let own = fields
        .get("also")
        .map(|node| (node, fields.path_of("also")));
    let Some(own) = own.and_then(|(node, path)| Fields::open(node, &path, mistakes)) else {
        return list;
    };
    for (name, entry) in own.entries() {
        let path = own.path_of(name);
        let found = bodies.get_index_of(name);
        if found.is_none() && !bodies.is_empty() {
            let at = Diagnostic::at_key(entry, &path, "");
            mistakes.add(super::arms::unknown_body(name, bodies, at));
        }
        let measure = NumberMeasure::Si(UnitDimension::FREQUENCY);
        let speed = mistakes.number(&entry.node, &path, measure, Range::Any);
        list.extend(
            found
                .zip(speed)
                .map(|(body, w)| (path, &entry.node, body, w)),
        );
    }
    list
}

/// The turning body that a scalar names.
fn turning(node: &Node, path: &str, bodies: &Bodies, mistakes: &mut Mistakes) -> Option<usize> {
    let name = mistakes.note(node.as_text(path))?;
    let found = bodies.get_full(name);
    match found {
        None if bodies.is_empty() => {}
        None => {
            let at = Diagnostic::at(node, path, "");
            mistakes.add(super::arms::unknown_body(name, bodies, at));
        }
        Some((_, _, Some(body))) if body.motion == Motion::Translation => {
            let message = format!("`{name}` is a translating mass: it does not rotate");
            mistakes.add(Diagnostic::at(node, path, message));
        }
        Some(_) => {}
    }
    found.map(|(k, ..)| k)
}

/// A train that cannot turn, or turns as it likes.
fn explain(
    root: &Fields<'_>,
    fault: SpeedConflict,
    (node, path): (&Node, &str),
    bodies: &Bodies,
    rows: &ConnectionRows<'_>,
) -> Diagnostic {
    let name = |body: usize| bodies.get_index(body).map_or("", |(name, _)| name.as_str());
    match fault {
        SpeedConflict::Undetermined { body } => {
            let message = format!(
                "the speed of `{}` does not follow: the train has another rigid-body mode",
                name(body)
            );
            let help = match path {
                "reference" => format!(
                    "give one more speed, such as `also: {{{}: 0 rpm}}`",
                    name(body)
                ),
                _ => "name one body per rigid-body mode".to_owned(),
            };
            Diagnostic::at(node, path, message).with_help(help)
        }
        SpeedConflict::Locked { row, closing } => {
            let path = format!("connections.{}", rows.names[row]);
            let node = root.node.at(&path).unwrap_or(node);
            let message = "locks the train: it contradicts the ratios of the other connections";
            let help = closing.map(|(body, share)| {
                format!(
                    "with {share:.10} times its lever arm (number of teeth) on `{}` the loop would close",
                    name(body)
                )
            });
            let mut mistake = Diagnostic::at(node, &path, message);
            mistake.help = help;
            mistake
        }
    }
}

/// The drag of a body: a torque, or {constant: .., viscous: ..}.
pub(super) fn drag(
    node: &Node,
    path: &str,
    motion: Motion,
    mistakes: &mut Mistakes,
) -> Option<Drag> {
    let (torque, rate) = match motion {
        Motion::Rotation => (UnitDimension::MOMENT, UnitDimension::TORSIONAL_DAMPING),
        Motion::Translation => (UnitDimension::FORCE, UnitDimension::DAMPING),
    };
    if is_scalar(node) {
        let constant = mistakes.number(node, path, NumberMeasure::Si(torque), Range::NotNegative);
        return Some(Drag {
            constant: constant?,
            viscous: 0.0,
        });
    }
    let fields = Fields::known(node, path, &["constant", "viscous"], mistakes)?;
    let mut part = |key, dimension| {
        let value = fields.number(
            key,
            NumberMeasure::Si(dimension),
            Range::NotNegative,
            mistakes,
        );
        value.unwrap_or(0.0)
    };
    Some(Drag {
        constant: part("constant", torque),
        viscous: part("viscous", rate),
    })
}

/// Adds the drag of every body to its mean load; drag without a reference is an error.
pub(super) fn add_drag(
    root: &Fields<'_>,
    bodies: &IndexMap<String, Body>,
    motion: Option<&MeanMotion>,
    loads: &mut IndexMap<String, Load>,
    mistakes: &mut Mistakes,
) {
    for (k, (name, body)) in bodies.iter().enumerate() {
        if body.drag == Drag::default() {
            continue;
        }
        let Some(motion) = motion else {
            let path = format!("bodies.{name}.drag");
            let node = root.node.at(&path).unwrap_or(root.node);
            let message = "opposes the mean rotation, which is unknown";
            let help = "give the model `reference: {body: .., speed: ..}`";
            mistakes.add(Diagnostic::at(node, &path, message).with_help(help));
            continue;
        };
        let speed = motion.speed_of(k);
        let constant = Drag {
            viscous: 0.0,
            ..body.drag
        };
        add_mean(loads, name, constant.torque(speed));
        add_viscous(loads, name, -body.drag.viscous * speed, motion.speed.abs());
    }
}

fn load_of<'l>(loads: &'l mut IndexMap<String, Load>, body: &str) -> &'l mut Load {
    loads.entry(body.to_owned()).or_insert(Load {
        series: mean_alone(0.0),
        others: Vec::new(),
    })
}

fn mean_alone(mean: f64) -> Periodic {
    Periodic::Fourier {
        mean,
        harmonics: Vec::new(),
    }
}

fn add_mean(loads: &mut IndexMap<String, Load>, body: &str, torque: f64) {
    let load = load_of(loads, body);
    load.series = load.series.plus(torque);
}

/// A torque that grows with the speed of the reference \[rad/s\], at which it is as given.
fn add_viscous(loads: &mut IndexMap<String, Load>, body: &str, torque: f64, reference: f64) {
    if torque != 0.0 {
        let growth = Growth::Signed { reference };
        let part = LoadPart::Growing(mean_alone(torque), growth, None);
        load_of(loads, body).others.push(part);
    }
}

/// The mean torques of the bodies named by `balance`, added to their loads.
///
/// ```text
/// sum over bodies of T thdot = 0 in every rigid motion
/// ```
pub(super) fn balance(
    root: &Fields<'_>,
    bodies: &Bodies,
    (rows, motion): (Option<&ConnectionRows<'_>>, Option<&MeanMotion>),
    loads: &mut IndexMap<String, Load>,
    mistakes: &mut Mistakes,
) -> Vec<(usize, f64)> {
    let reference_speed = motion.map_or(1.0, |motion| motion.speed.abs());
    let Some(node) = root.get("balance") else {
        return Vec::new();
    };
    let named = match is_scalar(node) {
        true => vec![("balance".to_owned(), node)],
        false => entries(node, "balance", mistakes),
    };
    let before = mistakes.count();
    let mut list: Vec<usize> = Vec::new();
    for (path, node) in &named {
        let Some(body) = turning(node, path, bodies, mistakes) else {
            continue;
        };
        let name = bodies.get_index(body).map_or("", |(name, _)| name.as_str());
        if list.contains(&body) {
            mistakes.add(Diagnostic::at(
                node,
                path,
                format!("`{name}` is named twice"),
            ));
        }
        let mean = format!("loads.{name}.mean");
        if let Some(given) = root.node.at(&mean).filter(|node| !node.is_null()) {
            let message =
                format!("`balance` computes the mean torque of `{name}`: leave this one out");
            mistakes.add(Diagnostic::at(given, &mean, message));
        }
        list.push(body);
    }
    let Some(rows) = rows.filter(|_| mistakes.count() == before) else {
        return Vec::new();
    };
    let torques = |k: usize| {
        let load = bodies.get_index(k).and_then(|(name, _)| loads.get(name));
        load.map_or([0.0; 2], |load| {
            let viscous = viscous(load);
            [load.mean_torque() - viscous, viscous]
        })
    };
    let mut balanced = Vec::new();
    for body in &list {
        // The rigid motion in which this one of the bodies turns and the others rest.
        let turn = |other: &usize| (*other, whole(i64::from(other == body)));
        let given: Vec<(usize, Fraction)> = list.iter().map(turn).collect();
        match speeds(bodies.len(), &rows.rows, &given) {
            Ok(motion) => {
                let mut power = [0.0; 2];
                for (k, w) in motion.iter().enumerate().filter(|(_, w)| !w.is_zero()) {
                    let torque = torques(k);
                    (0..2).for_each(|i| power[i] += torque[i] * fraction::to_f64(w));
                }
                balanced.push((*body, power.map(|power| 0.0 - power)));
            }
            Err(fault) => {
                mistakes.add(explain(root, fault, (node, "balance"), bodies, rows));
                return Vec::new();
            }
        }
    }
    for (body, [constant, growing]) in &balanced {
        if let Some((name, _)) = bodies.get_index(*body) {
            add_mean(loads, name, *constant);
            add_viscous(loads, name, *growing, reference_speed);
        }
    }
    let whole = |(body, parts): (usize, [f64; 2])| (body, parts[0] + parts[1]);
    balanced.into_iter().map(whole).collect()
}

/// The part of a mean load that follows the speed.
fn viscous(load: &Load) -> f64 {
    let part = |part: &LoadPart| match part {
        LoadPart::Growing(series, ..) => series.mean(),
        _ => 0.0,
    };
    load.others.iter().map(part).sum()
}
