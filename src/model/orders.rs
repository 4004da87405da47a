//! Orders in a model file: multiples of the reference shaft's frequency, whole, broken or named after a mesh or a shaft.

use super::arms::{Bodies, unknown_body};
use super::fields::{Fields, Mistakes, is_scalar};
use crate::error::Diagnostic;
use crate::numeric::fraction::{self, Fraction};
use crate::yaml::Node;
use num_traits::{One, Signed, ToPrimitive};
use std::collections::BTreeSet;

/// Highest order, in multiples of the base order: enough for any gear, and far from where sampling is hopeless.
const HIGHEST_ORDER: usize = 100_000;

/// Most revolutions of the reference in one period.
const MOST_REVOLUTIONS: usize = 10_000;
/// Orders that a message names.
const NAMED: usize = 6;

/// What an order may look like.
const WANTED: &str = "an order above 0: a whole number, a decimal, a fraction such as 35/47, `mesh`, or {shaft: BODY, times: 2}";

/// What orders refer to, and the base that they have in common.
pub(super) struct Orders<'a> {
    /// Bodies by name.
    pub bodies: &'a Bodies,
    /// Speeds over the reference's, by body; `None` without a reference.
    pub ratios: Option<&'a [Fraction]>,
    /// Revolutions of the reference in one period: one over the base order.
    pub revolutions: usize,
    /// Broken orders read so far.
    broken: BTreeSet<Fraction>,
    /// Those of them that only loads have.
    loose: BTreeSet<Fraction>,
    /// Orders of loads that have no common period with the others: for motions over time alone.
    free: BTreeSet<Fraction>,
}

/// Reads with all orders as multiples of their common base; the value and the revolutions of the reference in one period.
///
/// What is read knows the base only once it has been read: where it is not 1, it is read again.
pub(super) fn on_common_base<T>(
    (bodies, ratios): (&Bodies, Option<&[Fraction]>),
    root: &Node,
    mistakes: &mut Mistakes,
    mut read: impl FnMut(&mut Orders<'_>, &mut Mistakes) -> T,
) -> (T, usize) {
    let mut orders = Orders {
        bodies,
        ratios,
        revolutions: 1,
        broken: BTreeSet::new(),
        loose: BTreeSet::new(),
        free: BTreeSet::new(),
    };
    let before = mistakes.count();
    let value = read(&mut orders, mistakes);
    if orders.broken.is_empty() || mistakes.count() > before {
        return (value, 1);
    }
    match orders.common() {
        Some(revolutions) => {
            orders.revolutions = revolutions;
            (read(&mut orders, mistakes), revolutions)
        }
        None => {
            mistakes.add(Diagnostic::at(root, "", orders.excess()));
            (value, 1)
        }
    }
}

impl Orders<'_> {
    /// Revolutions in one period of all orders, but for loads that are then free.
    fn common(&mut self) -> Option<usize> {
        let all = fraction::common_denominator(&self.broken, MOST_REVOLUTIONS);
        if all.is_some() || self.loose.is_empty() {
            return all;
        }
        let mut kept: Vec<&Fraction> = self.broken.difference(&self.loose).collect();
        let mut common = fraction::common_denominator(kept.iter().copied(), MOST_REVOLUTIONS)?;
        let mut loose: Vec<&Fraction> = self.loose.iter().collect();
        loose.sort_by(|a, b| a.denom().cmp(b.denom()));
        for order in loose {
            kept.push(order);
            match fraction::common_denominator(kept.iter().copied(), MOST_REVOLUTIONS) {
                Some(revolutions) => common = revolutions,
                None => {
                    kept.pop();
                    self.free.insert(order.clone());
                }
            }
        }
        Some(common)
    }

    /// The order of a harmonic of a load: as a multiple of the base order, or as itself where it has no common period with the others.
    pub(super) fn of_load(
        &mut self,
        node: &Node,
        path: &str,
        mistakes: &mut Mistakes,
    ) -> (usize, Option<f64>) {
        let order = self.read(node, path, None, mistakes);
        if let Some(order) = order.as_ref().filter(|order| !order.is_integer()) {
            if self.free.contains(order) {
                return (1, Some(fraction::to_f64(order)));
            }
            self.loose.insert(order.clone());
        }
        (self.multiple(order.as_ref(), node, path, mistakes), None)
    }

    /// What is said of orders whose base is too slow.
    fn excess(&self) -> String {
        let mut list: Vec<&Fraction> = self.broken.iter().collect();
        list.sort_by(|a, b| b.denom().cmp(a.denom()));
        let named: Vec<String> = list.iter().take(NAMED).map(ToString::to_string).collect();
        format!(
            "the orders {} of the reference have no common period of at most {MOST_REVOLUTIONS} revolutions: remove \
             one of them, or choose another reference",
            named.join(", ")
        )
    }

    /// An order as a multiple of the base order; 1 where it cannot be read, or where the base is not that of all orders yet.
    pub(super) fn multiple(
        &mut self,
        order: Option<&Fraction>,
        node: &Node,
        path: &str,
        mistakes: &mut Mistakes,
    ) -> usize {
        let Some(order) = order else {
            return 1;
        };
        if !order.is_integer() {
            self.broken.insert(order.clone());
        }
        let multiple = order * fraction::whole(self.revolutions as i64);
        if !multiple.is_integer() {
            return 1;
        }
        match multiple.to_integer().to_usize() {
            Some(multiple) if multiple <= HIGHEST_ORDER => multiple,
            _ => {
                let message = format!(
                    "order {order} is {multiple} times the base order, wanted at most {HIGHEST_ORDER}"
                );
                mistakes.add(Diagnostic::at(node, path, message));
                1
            }
        }
    }

    /// The order of a node. `mesh`: tooth passing order of the connection at hand.
    pub(super) fn read(
        &self,
        node: &Node,
        path: &str,
        mesh: Option<&Fraction>,
        mistakes: &mut Mistakes,
    ) -> Option<Fraction> {
        let order = if is_scalar(node) {
            self.scalar(node, path, mesh, mistakes)?
        } else {
            self.of_shaft(node, path, mistakes)?
        };
        if order.is_positive() {
            return Some(order);
        }
        let message = format!("found {}, wanted {WANTED}", node.describe());
        mistakes.add(Diagnostic::at(node, path, message));
        None
    }

    fn scalar(
        &self,
        node: &Node,
        path: &str,
        mesh: Option<&Fraction>,
        mistakes: &mut Mistakes,
    ) -> Option<Fraction> {
        let text = mistakes.note(node.as_text(path))?;
        if text == "mesh" {
            if mesh.is_none() {
                let message = "`mesh` is the tooth passing order of a connection with teeth in a train with a `reference`";
                let help =
                    "give the mesh its `teeth`, and the model `reference: {body: .., speed: ..}`";
                mistakes.add(Diagnostic::at(node, path, message).with_help(help));
            }
            return mesh.cloned();
        }
        let order = fraction::parse(text).or_else(|| {
            // 1e1 is a number too.
            let value = text.parse::<f64>().ok().filter(|x| x.is_finite())?;
            Some(fraction::nearest(value))
        });
        if order.is_none() {
            let message = format!("found {}, wanted {WANTED}", node.describe());
            mistakes.add(Diagnostic::at(node, path, message));
        }
        order
    }

    /// {shaft: BODY, times: 2}
    fn of_shaft(&self, node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<Fraction> {
        let fields = Fields::known(node, path, &["shaft", "times"], mistakes)?;
        let shaft = fields.required("shaft", "the name of a body", mistakes)?;
        let times = match fields.get("times") {
            Some(node) => self.read(node, &fields.path_of("times"), None, mistakes)?,
            None => Fraction::one(),
        };
        let shaft_path = fields.path_of("shaft");
        let name = mistakes.note(shaft.as_text(&shaft_path))?;
        let Some(body) = self.bodies.get_index_of(name) else {
            let at = Diagnostic::at(shaft, &shaft_path, "");
            mistakes.add(unknown_body(name, self.bodies, at));
            return None;
        };
        let Some(ratios) = self.ratios else {
            let message = "orders of a shaft need the model's `reference: {body: .., speed: ..}`";
            mistakes.add(Diagnostic::at(node, path, message));
            return None;
        };
        let ratio = ratios[body].abs();
        if !ratio.is_positive() {
            let message = format!("`{name}` does not rotate: it has no orders");
            mistakes.add(Diagnostic::at(shaft, &shaft_path, message));
            return None;
        }
        Some(times * ratio)
    }
}
