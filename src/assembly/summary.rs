//! Plain data for `gearlash check --json`.

use super::Assembly;
use crate::model::{DeformationUnit, Model, Structure, Train};
use nalgebra::DMatrix;
use serde_json::{Value, json};

/// What `check` says about a model: lists in the order of the file, matrices as lists of rows.
///
/// `static_displacement` is null; who knows the static equilibrium fills it in. `natural_frequencies_rad_s`,
/// `inertias` and `units` are null for reduced systems, which have no bodies. Frequencies: elastic modes, ascending.
pub fn summary(model: &Model, assembly: &Assembly) -> Value {
    let system = &assembly.system;
    let frequencies: Vec<f64> = assembly.natural_frequencies.iter().copied().collect();
    let train = match &model.structure {
        Structure::Train(train) => Some(train),
        Structure::Reduced(_) => None,
    };
    let seconds = |_| -> Vec<f64> {
        let w_c = assembly.scales.frequency;
        frequencies.iter().map(|w| w * w_c).collect()
    };
    let bodies: Vec<&String> = train.map_or(Vec::new(), |t| t.bodies.keys().collect());
    let rigid_body_modes = assembly.coupling.as_ref().map_or_else(
        || system.dof() - frequencies.len().min(system.dof()),
        |c| c.rigid_body.ncols(),
    );
    let mut summary = json!({
        "name": model.name,
        "bodies": bodies,
        "inertias": train.map(inertias),
        "connections": assembly.connections,
        "units": train.map(|t| t.connections.values().map(|c| unit(c.unit)).collect::<Vec<_>>()),
        "connection_stiffness": assembly.scales.stiffness,
        "relative_coordinates": assembly.coordinates,
        "rigid_body_modes": rigid_body_modes,
        "natural_frequencies_rad_s": train.map(seconds),
        "natural_frequencies": frequencies,
        "stiffness": rows(system.stiffness()),
        "damping": rows(system.damping()),
        "element_map": rows(system.element_map()),
        "omega_c": assembly.scales.frequency,
        "displacement_scales": assembly.scales.displacement,
        "static_displacement": null,
        "mean_load": system.mean_load().as_slice(),
        "warnings": assembly.warnings,
    });
    if let (Some(map), Some(train)) = (summary.as_object_mut(), train) {
        map.extend(super::kinematics::kinematics(train));
    }
    summary
}

/// Inertias of the bodies; `None` of those whose motion is prescribed.
fn inertias(train: &Train) -> Vec<Option<f64>> {
    let bodies = train.bodies.values().enumerate();
    let list = bodies.map(|(k, body)| (!train.is_moved(k)).then_some(body.inertia));
    list.collect()
}

fn unit(unit: DeformationUnit) -> &'static str {
    match unit {
        DeformationUnit::Metre => "m",
        DeformationUnit::Radian => "rad",
    }
}

fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let list = matrix.row_iter();
    list.map(|row| row.iter().copied().collect()).collect()
}
