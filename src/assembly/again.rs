//! Numbers of an assembled model again: geometry, relative coordinates and scales stay.

use super::torque::torques;
use super::{
    Anchor, Assembly, Coupling, Scales, assemble, damping, elastic_modes, held, reduced, refused,
    scaling,
};
use crate::error::Diagnostic;
use crate::model::{Affected, Model, Structure, Train};
use crate::system::{LoadSource, System};
use nalgebra::DMatrix;

/// The system of a model that differs from an assembled one in numbers of that reach; its scales are those of the assembled one.
///
/// # Errors
/// As [`assemble`].
pub(crate) fn renumber(
    model: &Model,
    known: &Assembly,
    reach: Affected,
) -> Result<System, Vec<Diagnostic>> {
    let system = &known.system;
    if system.still().is_some() {
        return Ok(assemble(model)?.system);
    }
    match (&model.structure, reach, &known.coupling) {
        (Structure::Train(train), Affected::Laws, _) => {
            let train = held::settled(train)?;
            Ok(system.with_mounts(scaling::mounts(&train.train, &known.scales)))
        }
        (Structure::Train(train), Affected::Loads, _) => {
            Ok(system.with_loads(loads(train, &known.scales, system)))
        }
        (Structure::Train(train), Affected::Matrices, Some(coupling)) => {
            let train = held::settled(train)?;
            let train = train.train.as_ref();
            Ok(numbers(train, coupling, &scales(train, &known.scales))?.0)
        }
        (Structure::Reduced(own), Affected::Laws, _) => {
            Ok(system.with_mounts(reduced::mounts(own)))
        }
        (Structure::Reduced(own), Affected::Loads, _) => {
            Ok(system.with_loads(reduced::loads(&own.loads)))
        }
        (Structure::Reduced(own), Affected::Matrices, _) => reduced::system(own),
        (Structure::Train(_), Affected::Matrices, None) => Ok(assemble(model)?.system),
    }
}

/// The assembly of such a model.
///
/// # Errors
/// As [`assemble`].
pub(crate) fn reassemble(model: &Model, known: &Assembly) -> Result<Assembly, Vec<Diagnostic>> {
    let (Structure::Train(train), Some(coupling)) = (&model.structure, &known.coupling) else {
        return assemble(model);
    };
    if known.system.still().is_some() {
        return assemble(model);
    }
    let settled = held::settled(train)?;
    let train = settled.train.as_ref();
    let scales = scales(train, &known.scales);
    let (system, rates) = numbers(train, coupling, &scales)?;
    Ok(Assembly {
        anchor: Some(Anchor::new(train, coupling, &rates, scales.frequency)),
        system,
        scales,
        ..known.clone()
    })
}

/// Stiffnesses are their own scales.
fn scales(train: &Train, known: &Scales) -> Scales {
    Scales {
        stiffness: train.connections.values().map(|c| c.stiffness).collect(),
        ..known.clone()
    }
}

/// The system and C P^+ (n_b x n).
pub(super) fn numbers(
    train: &Train,
    coupling: &Coupling,
    scales: &Scales,
) -> Result<(System, DMatrix<f64>), Vec<Diagnostic>> {
    // Modes are dear, and only modal damping knows them.
    let modes = match &train.damping.modal {
        None => None,
        Some(_) => {
            let modes = elastic_modes(train, coupling)?;
            let ratios = damping::ratios(&train.damping, modes.eigenvalues.len())?;
            ratios.map(|ratios| (modes, ratios))
        }
    };
    let modal = modes
        .as_ref()
        .map(|(modes, ratios)| (modes, ratios.as_slice()));
    let rates = damping::rate_map(train, coupling, modal);
    let mut system = scaling::system(train, coupling, &rates, scales).map_err(refused)?;
    system.set_revolutions(train.revolutions);
    Ok((system, rates))
}

/// The loads of a system with the series of a train.
fn loads(train: &Train, scales: &Scales, system: &System) -> Vec<LoadSource> {
    let own = (train.loads.iter()).filter(|(name, _)| train.bodies.contains_key(*name));
    let units = (scales.frequency, train.revolutions);
    let torques = own.flat_map(|(_, load)| torques(load, units));
    let mut list = system.loads().to_vec();
    for (source, torque) in list.iter_mut().zip(torques) {
        (source.series, source.kind) = (torque.series, torque.kind);
    }
    list
}
