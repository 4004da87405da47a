//! Whether the harmonics reach the frequencies at which contacts ring.

use super::delivered::Delivered;
use super::verify::recorded;
use super::{Method, Swept};
use crate::solve::branch::{BranchPoint, Stability};

/// Harmonics over the least that reach a contact's own frequency: coefficients begin to fall there.
const BEYOND: f64 = 2.0;

/// A contact that is made and lost at a frequency of its own above all harmonics.
struct Short {
    connection: usize,
    /// Frequency of the contact over that of the highest harmonic.
    ratio: f64,
    point: usize,
}

/// What is said where the stability of points stays unknown: their multipliers are those of a series that errs by more than their distance
/// from the unit circle.
pub(super) fn unknown_stability(swept: &Swept<'_>, delivered: &Delivered) -> Option<String> {
    let is_unknown =
        |p: &&BranchPoint| !p.multipliers.is_empty() && p.stability == Stability::Unknown;
    // At its first point a side branch meets the one that it leaves.
    let rest = delivered.points.iter().skip(1);
    let lambdas: Vec<f64> = rest.filter(is_unknown).map(|p| p.lambda).collect();
    if delivered.method != Method::Galerkin || lambdas.is_empty() {
        return None;
    }
    Some(format!(
        "galerkin: `stable` is empty at {} of {} points, {}: the multipliers of the series may err there by more than their \
         distance from the unit circle, so that changes of their number mean nothing; use more `harmonics`, or the method `shooting`",
        lambdas.len(),
        delivered.points.len(),
        swept.between(lambdas.iter().copied()),
    ))
}

/// What is said where the harmonics of a Galerkin branch end below the frequency of a contact that is made and lost.
///
/// A connection rings at sqrt((W kappa)_cc): its stiffness against the inertia that it moves, all other connections open.
pub(super) fn complaint(swept: &Swept<'_>, delivered: &Delivered) -> Option<String> {
    if delivered.method != Method::Galerkin {
        return None;
    }
    let system = &swept.setting.assembly.system;
    let own: Vec<f64> = (0..system.element_count())
        .map(|c| {
            let row = system.element_map_row(c).iter();
            let sum: f64 = row.map(|(i, w)| w * system.stiffness()[(*i, c)]).sum();
            sum.max(0.0).sqrt()
        })
        .collect();
    let harmonics =
        |p: &BranchPoint| swept.harmonics(p.unknowns.len(), delivered.subharmonic) as f64;
    let mut worst: Option<Short> = None;
    let mut count = 0;
    for (point, at) in delivered.points.iter().enumerate() {
        let impacts = recorded(swept, at, "impacts");
        let ringing = impacts.iter().enumerate().filter(|(_, n)| **n > 0.0);
        let Some((connection, frequency)) = ringing
            .map(|(c, _)| (c, own[c]))
            .max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            continue;
        };
        let ratio = frequency / (harmonics(at) * at.frequency);
        if ratio > 1.0 {
            count += 1;
            if worst.as_ref().is_none_or(|w| ratio > w.ratio) {
                worst = Some(Short {
                    connection,
                    ratio,
                    point,
                });
            }
        }
    }
    let Short {
        connection,
        ratio,
        point,
    } = worst?;
    let at = &delivered.points[point];
    let (own, reached) = (own[connection], harmonics(at) * at.frequency);
    let wanted = (BEYOND * ratio * harmonics(at)).ceil();
    let (unit, scale) = match swept.setting.is_si() {
        true => (
            " Hz",
            swept.setting.assembly.scales.frequency / std::f64::consts::TAU,
        ),
        false => (" omega_c", 1.0),
    };
    Some(format!(
        "galerkin: too few harmonics for contacts that open and close: at {} {} harmonics reach {:.4}{unit}, but {} \
         rings at {:.4}{unit} ({count} of {} points affected); use about {wanted} harmonics, or the method `shooting`",
        swept.place(at.lambda),
        harmonics(at),
        reached * scale,
        swept.setting.assembly.connections[connection],
        own * scale,
        delivered.points.len(),
    ))
}
