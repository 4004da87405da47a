//! Bodies whose motion is prescribed: moving grounds with whatever torque it takes.

use super::torque::course;
use super::{Coupling, Scales, mistake};
use crate::error::Diagnostic;
use crate::model::{BodyMotion, Train};
use crate::system::LoadSource;
use nalgebra::{DMatrix, DVector};

/// Singular values of unit rows below this are rounding.
const ROUNDING: f64 = 1e-10;

/// Refuses prescribed motions of coordinates of parts given by matrices, and those that strain the train whatever the other bodies
/// do, but for the `bound` ones that are known to.
///
/// A body can be followed where its column of B lies in the span of those that are free.
///
/// # Errors
/// The coordinates of parts; the bodies that nothing can follow.
pub(super) fn refuse_motions(
    train: &Train,
    coupling: &Coupling,
    bound: usize,
) -> Result<(), Vec<Diagnostic>> {
    if train.motions.is_empty() {
        return Ok(());
    }
    let name = |motion: &BodyMotion| {
        let found = train.bodies.get_index(motion.body);
        found.map_or(String::new(), |(name, _)| name.clone())
    };
    let is_of_part = |motion: &&BodyMotion| {
        train
            .parts
            .iter()
            .any(|part| part.bodies.contains(&motion.body))
    };
    let of_parts: Vec<Diagnostic> = (train.motions.iter().filter(is_of_part))
        .map(|motion| {
            let message = "a coordinate of a part given by matrices cannot have a prescribed motion: its inertia is coupled to the others";
            let help = "prescribe the motion of a body and connect it to the coordinate by a shaft";
            mistake(format!("loads.{}.motion", name(motion)), message, Some(help.into()))
        })
        .collect();
    if !of_parts.is_empty() {
        return Err(of_parts);
    }
    let held = Held::new(train, coupling);
    if held.rank + bound == train.motions.len() {
        return Ok(());
    }
    let list = train.motions.iter().map(|motion| {
        let message = "the train cannot follow this motion: other connections hold it to the frame, or to another body with a \
                       prescribed motion";
        let help = "leave out a `ground` of the train, or one of the motions";
        mistake(format!("bodies.{}.motion", name(motion)), message, Some(help.into()))
    });
    Err(list.collect())
}

/// The bodies with prescribed motion within the rigid-body motions of a train.
pub(super) struct Held<'a> {
    motions: &'a DMatrix<f64>,
    bodies: Vec<usize>,
    /// Pseudo-inverse of N_s^T, N_s the rows of the held bodies: k x r.
    inverse: DMatrix<f64>,
    /// Independent rigid-body motions in which they move.
    rank: usize,
    /// A basis of those in which they rest, r x (r - rank).
    pub free: DMatrix<f64>,
}

impl<'a> Held<'a> {
    pub(super) fn new(train: &Train, coupling: &'a Coupling) -> Held<'a> {
        let motions = &coupling.rigid_body;
        let r = motions.ncols();
        let bodies: Vec<usize> = train.motions.iter().map(|motion| motion.body).collect();
        let rows = motions.select_rows(&bodies);
        if r == 0 {
            return Held {
                motions,
                inverse: rows,
                bodies,
                rank: 0,
                free: DMatrix::zeros(0, 0),
            };
        }
        // N_s^T N_s by its eigenvectors: few motions, entries of order 1.
        let eigen = rows.tr_mul(&rows).symmetric_eigen();
        let largest = eigen.eigenvalues.amax();
        let is_moved = |k: &usize| eigen.eigenvalues[*k] > ROUNDING * largest;
        let moved: Vec<usize> = (0..r).filter(is_moved).collect();
        let free: Vec<usize> = (0..r).filter(|k| !is_moved(k)).collect();
        let mut scaled = eigen.eigenvectors.select_columns(&moved);
        for (k, mut column) in moved.iter().zip(scaled.column_iter_mut()) {
            column /= eigen.eigenvalues[*k];
        }
        let inverse = &rows * scaled * eigen.eigenvectors.select_columns(&moved).transpose();
        Held {
            motions,
            bodies,
            inverse,
            rank: moved.len(),
            free: eigen.eigenvectors.select_columns(&free),
        }
    }

    /// Adds the torques by which these bodies keep their motion: what the torques do on rigid-body motion is taken up.
    pub(super) fn react(&self, torque: &mut DVector<f64>) {
        let reaction = &self.inverse * self.motions.tr_mul(torque);
        for (body, reaction) in self.bodies.iter().zip(reaction.iter()) {
            torque[*body] -= reaction;
        }
    }
}

/// What prescribed motions do to the relative coordinates.
///
/// ```text
/// r'' = P z'':  Q += omega_c^-2 D_r^-1 P_m thdot_m'
/// ```
pub(super) fn sources(train: &Train, coupling: &Coupling, scales: &Scales) -> Vec<LoadSource> {
    let w_c = scales.frequency;
    let source = |motion: &BodyMotion| {
        let column = coupling.transform.column(motion.body);
        let direction = DVector::from_fn(column.len(), |i, _| {
            column[i] / scales.displacement[coupling.coordinates[i]] / (w_c * w_c)
        });
        let torque = course(&motion.course, w_c)?;
        Some(LoadSource {
            direction,
            series: torque.series,
            kind: torque.kind,
        })
    };
    train.motions.iter().filter_map(source).collect()
}
