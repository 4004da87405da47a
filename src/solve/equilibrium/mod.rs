//! Static equilibrium under the mean load.
//!
//! Statics know no inertia: the balance is that of forces, W^T diag(k) f(W q - mean(e)) = F ([`crate::system::Balance`]). In a train without
//! loops it gives the force of every connection at once, and each deformation is read off its law. In a train with loops the
//! equilibrium is the minimum of the energy, which is found in finitely many steps where the laws are broken lines
//! (`energy`). Only what has no energy (reduced systems that are not symmetric, falling laws in loops) is left to Newton's
//! iteration (`general`).

mod balance;
mod energy;
mod face;
mod general;
mod graph;

use crate::system::System;
use balance::Demand;
use graph::{ForceSupport, Graph};
use nalgebra::DVector;

/// Static equilibrium of the train.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Relative coordinates, n values.
    pub q: DVector<f64>,
    /// Deformations W q - mean(e), e values.
    pub deformation: Vec<f64>,
    /// Forces, e values. Of a hard contact they are known to more digits than its deformation can show.
    pub force: Vec<f64>,
    /// Slopes of the laws there, e values: 0 where a connection is open; `None` where it sticks to a jump of its force.
    pub slope: Vec<Option<f64>>,
    /// Flank on which each connection rests: -1, 0 (open) or 1.
    pub flank: Vec<i8>,
    /// False when some motion meets no stiffness there: the point is then the middle of the gap.
    pub is_unique: bool,
}

impl Equilibrium {
    /// Slopes of the laws at rest, e values.
    ///
    /// # Errors
    /// A connection that sticks to a jump of its force: its slope there is no number. `names`: those of the connections.
    pub fn slopes(&self, names: &[String]) -> Result<Vec<f64>, String> {
        let stuck = self.slope.iter().position(Option::is_none);
        match stuck {
            Some(k) => Err(format!(
                "{} sticks to a jump of its force at rest, where it has no slope",
                names.get(k).map_or("a connection", String::as_str)
            )),
            None => Ok(self.slope.iter().copied().flatten().collect()),
        }
    }
}

/// Reason why no equilibrium is reported.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoEquilibrium {
    /// There is none: the forces of these connections cannot reach what the mean load asks of them.
    NotCarried {
        /// Connections that run apart.
        connections: Vec<usize>,
    },
    /// None was found, which proves nothing.
    NotFound,
}

impl NoEquilibrium {
    /// A sentence for people; `names`: those of the connections.
    pub fn describe(&self, names: &[String]) -> String {
        match self {
            NoEquilibrium::NotCarried { connections } => {
                let list = connections.iter().filter_map(|k| names.get(*k));
                let list: Vec<&str> = list.map(String::as_str).collect();
                let verb = if list.len() == 1 { "does" } else { "do" };
                format!(
                    "there is no static equilibrium under the mean load: {} {verb} not carry it, so the train runs \
                     apart there",
                    list.join(", ")
                )
            }
            NoEquilibrium::NotFound => {
                "no static equilibrium under the mean load was found; there may be one".into()
            }
        }
    }
}

/// Nonlinear static equilibrium under the mean load.
///
/// Stiffness variation counts with its mean, 1; laws that depend on the phase are read at phase 0. A force that jumps takes
/// every value in between at its breakpoint: a connection may rest there. Where no load decides (to rounding of the loads), a
/// connection rests in the middle of its gap. A law with memory is on its first loading from 0. A law that falls may allow several equilibria: the first one on the side to
/// which the load pushes is taken, and none where a law falls.
///
/// # Errors
/// There is none, or none was found.
pub fn equilibrium(system: &System) -> Result<Equilibrium, NoEquilibrium> {
    if let Some(still) = system.still() {
        let found = equilibrium(&still.system)?;
        let map = still.system.element_map() * &found.q;
        let q = still.connections.iter().map(|k| map[*k]);
        let q = DVector::from_iterator(still.connections.len(), q);
        return Ok(Equilibrium { q, ..found });
    }
    let mut laws = system.mounts().iter().map(|m| &m.element);
    if laws.any(|law| law.first_loading().is_some()) {
        return equilibrium(&system.at_first_loading());
    }
    let graphs: Vec<Graph> = (system.mounts().iter())
        .map(|m| Graph::of(m.element.as_ref()))
        .collect();
    let error: Vec<f64> = (system.mounts().iter())
        .map(|m| m.transmission_error.as_ref().map_or(0.0, |e| e.mean()))
        .collect();
    let Some(demand) = Demand::of(system) else {
        return general::solve(system, &graphs, &error);
    };
    if system.is_tree() {
        return read_off(&demand, &graphs, &error);
    }
    match energy::minimise(system, &demand, &graphs, &error) {
        Err(NoEquilibrium::NotFound) => general::solve(system, &graphs, &error),
        found => found,
    }
}

/// Without loops the balance gives every force, k_j f_j = F_j, and each law its deformation.
fn read_off(
    demand: &Demand,
    graphs: &[Graph],
    error: &[f64],
) -> Result<Equilibrium, NoEquilibrium> {
    let (mut places, mut missing) = (Vec::new(), Vec::new());
    for (j, graph) in graphs.iter().enumerate() {
        let force = demand.load[j] / demand.stiffness[j];
        let noise = demand.noise[j] / demand.stiffness[j];
        let wanted = if force.abs() <= noise { 0.0 } else { force };
        match graph.support(wanted) {
            Some(place) => places.push((wanted, place)),
            None => missing.push(j),
        }
    }
    if !missing.is_empty() {
        return Err(NoEquilibrium::NotCarried {
            connections: missing,
        });
    }
    let deformation: Vec<f64> = places.iter().map(|(_, place)| place.position()).collect();
    let q = deformation.iter().zip(error).map(|(x, e)| x + e);
    Ok(Equilibrium {
        q: DVector::from_iterator(graphs.len(), q),
        force: places.iter().map(|(f, _)| *f).collect(),
        slope: places.iter().map(|(_, place)| place.slope()).collect(),
        flank: (graphs.iter().zip(&places))
            .map(|(graph, (f, place))| graph.flank(place.position(), *f))
            .collect(),
        is_unique: !(places.iter()).any(|(_, place)| matches!(place, ForceSupport::Flat { .. })),
        deformation,
    })
}
