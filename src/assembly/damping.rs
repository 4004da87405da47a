//! Viscous damping of a train: modal, proportional to the stiffness, and dashpots parallel to the laws.

use super::mass::Mass;
use super::moved::Held;
use super::{Coupling, ElasticModes, mistake};
use crate::error::Diagnostic;
use crate::model::{Damping, MatrixPart, ModalDamping, Train};
use nalgebra::{DMatrix, DVector};

/// Damping of rigid-body motion relative to all damping that counts as rounding.
const UNDAMPED: f64 = 1e-9;

/// Modal ratios of the n elastic modes, ascending frequency; `None` without modal damping.
///
/// # Errors
/// A number of ratios other than n.
pub(super) fn ratios(damping: &Damping, n: usize) -> Result<Option<Vec<f64>>, Vec<Diagnostic>> {
    match &damping.modal {
        None => Ok(None),
        Some(ModalDamping::Uniform(ratio)) => Ok(Some(vec![*ratio; n])),
        Some(ModalDamping::PerMode(list)) if list.len() == n => Ok(Some(list.clone())),
        Some(ModalDamping::PerMode(list)) => {
            let message = format!(
                "found {} ratios, wanted {n}: one for each elastic mode, ascending frequency",
                list.len()
            );
            Err(vec![mistake("damping.modal_ratios", message, None)])
        }
    }
}

/// C of the absolute coordinates, n_b x n_b.
///
/// ```text
/// C = M U 2 zeta Lam^(1/2) U^T M + B^T (diag(c) + c_K K) B,    U^T C U = 2 zeta Lam^(1/2) (modal part)
/// ```
///
/// Every elastic mode has its ratio zeta, rigid-body motion none. N s/m per lever arm squared: N m s/rad for turning bodies.
/// `ratios`: zeta of the elastic modes, ascending. Rook & Singh (1995), sentence after eq. (3).
pub fn body_damping(
    train: &Train,
    coupling: &Coupling,
    modes: &ElasticModes,
    ratios: Option<&[f64]>,
) -> DMatrix<f64> {
    let b = &coupling.incidence;
    let mut cb = b.clone();
    for (mut row, dashpot) in cb.row_iter_mut().zip(local(train)) {
        row *= dashpot;
    }
    let mut c = b.tr_mul(&cb);
    for (part, rates) in damped(train) {
        let own = b.select_rows(&part.connections);
        c += own.tr_mul(&(rates * &own));
    }
    if let Some(ratios) = ratios {
        let mu = momenta(train, coupling, modes);
        let mut scaled = mu.clone();
        for (k, mut column) in scaled.column_iter_mut().enumerate() {
            column *= 2.0 * ratios[k] * modes.eigenvalues[k].sqrt();
        }
        c += scaled * mu.transpose();
    }
    c
}

/// C P^+, n_b x n: damping forces on the bodies per rate of the relative coordinates.
///
/// P^+ itself is not needed: with K z = B^T K W r for any z with P z = r,
///
/// ```text
/// C P^+ = M U 2 zeta Lam^(-1/2) (B U)^T K W + B^T (diag(c) + c_K K) W
/// ```
///
/// Without modal damping the pattern of the train stays: what must vanish is exactly 0.
pub(super) fn rate_map(
    train: &Train,
    coupling: &Coupling,
    modal: Option<(&ElasticModes, &[f64])>,
) -> DMatrix<f64> {
    let mut cw = coupling.element_map.clone();
    for (mut row, dashpot) in cw.row_iter_mut().zip(local(train)) {
        row *= dashpot;
    }
    let mut map = coupling.incidence.tr_mul(&cw);
    for (part, rates) in damped(train) {
        let own = coupling.incidence.select_rows(&part.connections);
        map += own.tr_mul(&(rates * coupling.element_map.select_rows(&part.connections)));
    }
    if let Some((modes, ratios)) = modal {
        let mut kw = coupling.element_map.clone();
        for (mut row, connection) in kw.row_iter_mut().zip(train.connections.values()) {
            row *= connection.contact_stiffness();
        }
        let mut share = (&coupling.incidence * &modes.shapes).tr_mul(&kw);
        for (k, mut row) in share.row_iter_mut().enumerate() {
            let frequency = modes.eigenvalues[k].sqrt();
            let is_elastic = frequency > 0.0;
            row *= if is_elastic {
                2.0 * ratios[k] / frequency
            } else {
                0.0
            };
        }
        map += momenta(train, coupling, modes) * share;
    }
    map
}

/// Parts given by matrices with damping of their own.
fn damped(train: &Train) -> impl Iterator<Item = (&MatrixPart, &DMatrix<f64>)> {
    let parts = train.parts.iter();
    parts.filter_map(|part| Some((part, part.damping.as_ref()?)))
}

/// Coefficients that act on the deformation rate of each connection: own dashpot and share of the stiffness.
fn local(train: &Train) -> impl Iterator<Item = f64> {
    let share = train.damping.stiffness_proportional;
    (train.connections.values()).map(move |c| c.damping + share * c.contact_stiffness())
}

/// M U, n_b x n: with the reactions of bodies whose motion is prescribed, so that N^T M U = 0.
fn momenta(train: &Train, coupling: &Coupling, modes: &ElasticModes) -> DMatrix<f64> {
    let mut mu = Mass::of(train).times(&modes.shapes);
    if !train.motions.is_empty() {
        let held = Held::new(train, coupling);
        for mut column in mu.column_iter_mut() {
            let mut torque = column.clone_owned();
            held.react(&mut torque);
            column.copy_from(&torque);
        }
    }
    mu
}

/// Checks that no damping acts on rigid-body motion: C N = 0. Otherwise relative coordinates alone do not describe the motion.
///
/// `c`: C, n_b x n_b; `rigid_body`: N, n_b x (n_b - n); judged in coordinates with unit inertia.
///
/// # Errors
/// The bodies on which the damping of a rigid-body motion acts.
pub fn refuse_damped_rigid_body(
    c: &DMatrix<f64>,
    inertia: &DVector<f64>,
    rigid_body: &DMatrix<f64>,
    bodies: &[String],
) -> Result<(), Vec<Diagnostic>> {
    let root = inertia.map(|m| m.sqrt());
    let mut scaled = c.clone();
    for (i, j) in (0..c.nrows()).flat_map(|i| (0..c.ncols()).map(move |j| (i, j))) {
        scaled[(i, j)] /= root[i] * root[j];
    }
    let size = scaled.norm();
    let mut names: Vec<&str> = Vec::new();
    for motion in rigid_body.column_iter() {
        let motion = motion.component_mul(&root).normalize();
        let force = &scaled * motion;
        let acts = |k: &usize| force[*k].abs() > UNDAMPED * size;
        names.extend((0..bodies.len()).filter(acts).map(|k| bodies[k].as_str()));
    }
    names.dedup();
    if names.is_empty() {
        return Ok(());
    }
    let message = format!(
        "damps rigid-body motion of {}: relative coordinates do not describe it",
        names.join(", ")
    );
    let help = "replace a viscous path to ground without stiffness by a mean drag torque";
    Err(vec![mistake("damping", message, Some(help.into()))])
}
