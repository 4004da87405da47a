//! Connections in a model file: geometry, units, stiffness, law.

use super::arms::{Bodies, Geometry};
use super::drawing::on_line_of_action;
use super::fields::{Fields, Mistakes, NumberMeasure, Range, is_scalar};
use super::geometry::geometry;
use super::law::{LawUnits, law};
use super::orders::Orders;
use super::series::{stiffness_variation, transmission_error, unit};
use super::{Connection, DeformationUnit};
use crate::numeric::fraction::Fraction;
use crate::numeric::periodic::Periodic;
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;
use std::f64::consts::TAU;

const KEYS: [&str; 16] = [
    "gear",
    "internal_gear",
    "planet_gear",
    "planet_ring",
    "shaft",
    "ground",
    "acts_on",
    "stiffness",
    "damping",
    "element",
    "length",
    "transmission_error",
    "stiffness_variation",
    "order_unit",
    "base_order",
    "lag",
];

/// A connection whose geometry is known, where it is right.
pub(super) struct Placed<'n> {
    fields: Fields<'n>,
    /// Bodies and lever arms.
    pub geometry: Option<Geometry>,
}

/// The keys of a connection, with its geometry: what speeds and orders follow from.
pub(super) fn place<'n>(
    node: &'n Node,
    path: &str,
    bodies: &Bodies,
    held: &mut [bool],
    mistakes: &mut Mistakes,
) -> Option<Placed<'n>> {
    let fields = Fields::known(node, path, &KEYS, mistakes)?;
    let unit = unit_of_stiffness(&fields);
    let geometry = geometry(&fields, bodies, held, unit, mistakes);
    Some(Placed { fields, geometry })
}

/// A connection with everything that it does; `mesh`: its tooth passing order.
pub(super) fn connection(
    Placed { fields, geometry }: &Placed<'_>,
    mesh: Option<&Fraction>,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<Connection> {
    // What can be checked without the geometry is checked all the same, as if in metres.
    let written = geometry.as_ref().map(|g| g.unit);
    let si = |d: fn(DeformationUnit) -> UnitDimension| match written {
        Some(unit) => NumberMeasure::Si(d(unit)),
        None => NumberMeasure::Si(d(guessed_unit(fields))),
    };
    let stiffness = si(DeformationUnit::stiffness);
    let stiffness = fields.number("stiffness", stiffness, Range::Positive, mistakes);
    let damping = si(DeformationUnit::damping);
    let damping = fields.number("damping", damping, Range::NotNegative, mistakes);
    let displacement = si(DeformationUnit::dimension);
    let length = fields.number("length", displacement, Range::Positive, mistakes);
    let units = LawUnits::Si(written.unwrap_or_else(|| guessed_unit(fields)));
    let element_path = fields.path_of("element");
    let teeth = geometry.as_ref().and_then(|g| g.teeth.as_ref());
    let element = match fields.get("element") {
        Some(node) => on_line_of_action(node, &element_path, teeth, mistakes)
            .and_then(|node| law(Some(&node), &element_path, units, &[], mistakes)),
        None => law(None, &element_path, units, &[], mistakes),
    };
    // Of a law that cannot be read it is not known whether it needs a stiffness.
    let is_spring = element.as_ref().is_some_and(|law| law.is_spring());
    if is_spring {
        fields.required("stiffness", "the reference stiffness, > 0", mistakes);
    }
    // Of a law without displacement the stiffness cancels: any will do.
    let stiffness = match fields.get("stiffness") {
        None if !is_spring => Some(1.0),
        _ => stiffness,
    };
    let base = unit(fields, mesh, orders, mistakes);
    let stiffness_variation = fields.get("stiffness_variation").and_then(|node| {
        let path = fields.path_of("stiffness_variation");
        stiffness_variation(node, &path, (&base, orders), mistakes)
    });
    let transmission_error = fields.get("transmission_error").and_then(|node| {
        let path = fields.path_of("transmission_error");
        transmission_error(node, &path, displacement, (&base, orders), mistakes)
    });
    let lag = fields.number(
        "lag",
        NumberMeasure::Si(UnitDimension::NUMBER),
        Range::Any,
        mistakes,
    );
    let delay = lag.map(|lag| {
        let tooth = mesh.unwrap_or(&base.order);
        let order = orders.multiple(Some(tooth), fields.node, &fields.path, mistakes);
        TAU * lag / order as f64
    });
    let delayed = |series: Option<Periodic>| match delay {
        Some(delay) if delay != 0.0 => series.map(|series| series.delayed(delay)),
        _ => series,
    };
    let Geometry { arms, unit, teeth } = geometry.clone()?;
    Some(Connection {
        arms,
        unit,
        teeth,
        stiffness: stiffness?,
        damping: damping.unwrap_or(0.0),
        element: element?,
        stiffness_variation: delayed(stiffness_variation),
        transmission_error: delayed(transmission_error),
        length,
    })
}

/// Unit of a deformation whose geometry has an error: what the key suggests.
fn guessed_unit(fields: &Fields<'_>) -> DeformationUnit {
    if fields.get("shaft").is_some() || fields.get("ground").is_some() {
        DeformationUnit::Radian
    } else {
        unit_of_stiffness(fields)
    }
}

/// rad when the stiffness is written in N m/rad (or N m), else m.
fn unit_of_stiffness(fields: &Fields<'_>) -> DeformationUnit {
    let written = fields.get("stiffness").filter(|node| is_scalar(node));
    let quantity = written.and_then(|node| Quantity::from_node(node, "").ok());
    match quantity.and_then(|q| q.dimension) {
        Some(d) if d.fits(UnitDimension::TORSIONAL_STIFFNESS) => DeformationUnit::Radian,
        _ => DeformationUnit::Metre,
    }
}
