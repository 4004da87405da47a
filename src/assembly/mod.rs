//! From a model in SI units to the nondimensional system in relative coordinates, and back.
//!
//! With B (e x n_b) one row of lever arms per connection, M the inertias, K and c the stiffnesses and dashpots:
//!
//! 1. `coupling`: P (the first independent rows of B), W with B = W P, N with B N = 0;
//! 2. `modes`: elastic modes in full contact, M^(-1/2) B^T K B M^(-1/2);
//! 3. `damping`: C, and C P^+ without forming P^+;
//! 4. `scaling`: omega_c, l_j, and with them kappa, Gam, W*, Q;
//! 5. `anchor`: absolute accelerations after the fact, Rook & Singh (1995), eq. (6a).
//!
//! `reduced` reads nondimensional systems.

mod again;
mod anchor;
mod closure;
mod coupling;
mod damping;
mod held;
mod kinematics;
mod mass;
mod modes;
mod moved;
mod reduced;
mod scaling;
mod slips;
mod summary;
mod torque;

pub(crate) use again::{reassemble, renumber};
pub(crate) use anchor::{Action, Anchor};
pub use coupling::couple;
pub use damping::body_damping;
pub use damping::refuse_damped_rigid_body;
pub use modes::ElasticModes;
pub use modes::elastic_modes;
pub use summary::summary;
pub use torque::Torque;

use crate::error::{Diagnostic, SolveError};
use crate::model::{FrequencyScale, Model, Structure, Train};
use crate::system::{Still, System};
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;

/// Relations between bodies, connections and relative coordinates.
#[derive(Debug, Clone)]
pub struct Coupling {
    /// B, e x n_b. Lever arms.
    pub incidence: DMatrix<f64>,
    /// P, n x n_b. r = P z.
    pub transform: DMatrix<f64>,
    /// W, e x n, geometric (not scaled). Deformations = W r.
    pub element_map: DMatrix<f64>,
    /// N, n_b x (n_b - n). Motions that deform no connection.
    pub rigid_body: DMatrix<f64>,
    /// Connection that each relative coordinate measures.
    pub coordinates: Vec<usize>,
    /// Loops that nearly close, probably because of a typing error.
    pub warnings: Vec<String>,
}

/// Characteristic values; the only bridge between SI and nondimensional numbers.
#[derive(Debug, Clone)]
pub struct Scales {
    /// omega_c [rad/s]; 1 for reduced systems.
    pub frequency: f64,
    /// l of every connection [m or rad]; 1 for reduced systems.
    pub displacement: Vec<f64>,
    /// K of every connection [N/m or N m/rad]; 1 for reduced systems.
    pub stiffness: Vec<f64>,
}

/// The nondimensional system with names, units and scales of the model.
#[derive(Debug, Clone)]
pub struct Assembly {
    /// The system, at Om = 1, nu = 1.
    pub system: System,
    /// Names of the connections, e of them.
    pub connections: Vec<String>,
    /// Names of the relative coordinates, n of them.
    pub coordinates: Vec<String>,
    /// Scales.
    pub scales: Scales,
    /// The coupling; `None` for reduced systems.
    pub coupling: Option<Coupling>,
    /// Conversion to absolute accelerations; `None` for reduced systems.
    pub(crate) anchor: Option<Anchor>,
    /// Natural frequencies in full contact over omega_c, ascending, elastic modes only: eigenvalues of (kappa W)^(1/2).
    pub natural_frequencies: DVector<f64>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// Coordinates from which modal damping, which fills Gam, is worth a warning: solvers then take the dense path.
const LONG_CHAIN: usize = 32;

/// The nondimensional system of a model.
///
/// # Errors
/// Errors of the model as a whole: a loop that nearly closes, damped rigid-body
/// motion, a wrong number of modal ratios, a characteristic frequency that is not a positive number. Paths are those of the model file.
pub fn assemble(model: &Model) -> Result<Assembly, Vec<Diagnostic>> {
    let mut assembly = match &model.structure {
        Structure::Train(train) => assemble_train(train)?,
        Structure::Reduced(system) => reduced::assemble(system)?,
    };
    assembly.warnings.splice(0..0, model.warnings.clone());
    Ok(assembly)
}

fn assemble_train(train: &Train) -> Result<Assembly, Vec<Diagnostic>> {
    refuse_impossible(train)?;
    let settled = held::settled(train)?;
    let still = settled.at_rest().as_ref().map(assemble_train).transpose()?;
    let mut train = Cow::Borrowed(settled.train.as_ref());
    if let Some(still) = &still {
        // Coordinates that motions bind have no frequency of their own.
        train.to_mut().scaling.frequency = FrequencyScale::Value(still.scales.frequency);
    }
    let train = train.as_ref();
    let coupling = couple(train)?;
    moved::refuse_motions(train, &coupling, settled.timed_count())?;
    let modes = elastic_modes(train, &coupling)?;
    let ratios = damping::ratios(&train.damping, modes.eigenvalues.len())?;
    let bodies: Vec<String> = train.bodies.keys().cloned().collect();
    let inertia = inertias(train);
    let c = body_damping(train, &coupling, &modes, ratios.as_deref());
    refuse_damped_rigid_body(&c, &inertia, &coupling.rigid_body, &bodies)?;
    let modal = ratios.as_deref().map(|ratios| (&modes, ratios));
    let rates = damping::rate_map(train, &coupling, modal);
    let scales = scaling::scales(train, &modes)?;
    let mut system = scaling::system(train, &coupling, &rates, &scales).map_err(refused)?;
    system.set_revolutions(train.revolutions);
    let mut natural_frequencies = modes.eigenvalues.map(|x| x.sqrt() / scales.frequency);
    if let Some(still) = still {
        natural_frequencies = still.natural_frequencies;
        let rates = settled.rates(&coupling);
        let rate = |k: &usize| rates[*k] / scales.displacement[*k] / scales.frequency;
        system = system.with_still(Still {
            system: Box::new(still.system),
            rates: coupling.coordinates.iter().map(rate).collect(),
            connections: coupling.coordinates.clone(),
        });
    }
    let connections: Vec<String> = train.connections.keys().cloned().collect();
    let coordinates = (coupling.coordinates.iter())
        .map(|k| connections[*k].clone())
        .collect();
    Ok(Assembly {
        warnings: warnings(train, &coupling, system.dof()),
        anchor: Some(Anchor::new(train, &coupling, &rates, scales.frequency)),
        system,
        connections,
        coordinates,
        scales,
        coupling: Some(coupling),
        natural_frequencies,
    })
}

/// What no later step could survive: programs that build models by hand meet it, readers of files have refused it before.
fn refuse_impossible(train: &Train) -> Result<(), Vec<Diagnostic>> {
    let mut list = Vec::new();
    if train.connections.is_empty() {
        list.push(mistake("connections", "none: nothing can deform", None));
    }
    for (name, body) in &train.bodies {
        if !(body.inertia > 0.0 && body.inertia.is_finite()) {
            let message = format!("found {}, must be > 0 and finite", body.inertia);
            list.push(mistake(format!("bodies.{name}.inertia"), message, None));
        }
    }
    for (name, c) in &train.connections {
        let path = format!("connections.{name}");
        if !(c.stiffness > 0.0 && c.stiffness.is_finite()) {
            let message = format!("found {}, must be > 0 and finite", c.stiffness);
            list.push(mistake(format!("{path}.stiffness"), message, None));
        }
        let mut distinct: Vec<usize> = c.arms.iter().map(|(body, _)| *body).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let sound = |(body, arm): &(usize, f64)| {
            *body < train.bodies.len() && arm.is_finite() && *arm != 0.0
        };
        if c.arms.is_empty() || !c.arms.iter().all(sound) || distinct.len() != c.arms.len() {
            let message = "lever arms must be finite, not zero, and act on distinct known bodies";
            list.push(mistake(path, message, None));
        }
    }
    if list.is_empty() { Ok(()) } else { Err(list) }
}

fn inertias(train: &Train) -> DVector<f64> {
    DVector::from_iterator(train.bodies.len(), train.bodies.values().map(|b| b.inertia))
}

fn warnings(train: &Train, coupling: &Coupling, n: usize) -> Vec<String> {
    let mut list = coupling.warnings.clone();
    list.extend(slips::slips(train));
    list.extend(anchor::unbalanced_mean_load(train, coupling));
    if train.damping.modal.is_some() {
        list.extend(full_damping(n));
    }
    list
}

/// A warning for long trains with modal damping.
fn full_damping(n: usize) -> Option<String> {
    (n >= LONG_CHAIN).then(|| {
        format!(
            "modal damping couples all {n} relative coordinates: Gam is a full matrix and the solvers use dense \
             matrices; damping: {{stiffness_proportional: ..}} keeps the pattern of the train"
        )
    })
}

fn mistake(
    path: impl Into<String>,
    message: impl Into<String>,
    help: Option<String>,
) -> Diagnostic {
    Diagnostic {
        location: None,
        path: path.into(),
        message: message.into(),
        help,
    }
}

fn refused(error: SolveError) -> Vec<Diagnostic> {
    let help = "look for quantities whose ratio leaves the range of a 64-bit number";
    vec![mistake("", error.to_string(), Some(help.into()))]
}
