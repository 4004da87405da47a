//! Measures of one connection.

use super::contacts::Contacts;
use crate::element::Element;

/// Measures of one connection over one response period, nondimensional.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measures {
    /// Mean deformation.
    pub mean: f64,
    /// R.m.s. of the deformation without its mean, (15).
    pub rms: f64,
    /// Smallest deformation, a refined extremum.
    pub min: f64,
    /// Largest deformation, a refined extremum.
    pub max: f64,
    /// R.m.s. of the rate of deformation, d/d(omega_c t).
    pub rms_velocity: f64,
    /// k_a (8b), (16); `None` where nothing moves.
    pub effective_stiffness: Option<f64>,
    /// k_dc (8a); `None` where the mean deformation vanishes.
    pub effective_stiffness_dc: Option<f64>,
    /// Mean of df/dq, (21): the slope that replaces k_a where nothing moves.
    pub mean_slope: f64,
    /// Mean of df/dv, (21).
    pub mean_damping: f64,
    /// Contacts of either flank.
    pub contacts: Contacts,
    /// Mean force.
    pub force_mean: f64,
    /// Smallest force.
    pub force_min: f64,
    /// Largest force.
    pub force_max: f64,
    /// Standard deviation of the force.
    pub force_std: f64,
    /// Whether the contact pulls somewhere: f against the flank it rests on.
    pub pulls: bool,
    /// Work done on the connection per excitation period: what it loses.
    pub loss: f64,
}

impl Measures {
    /// Contacts alone: nothing else is known.
    pub(crate) fn of_contacts(contacts: Contacts) -> Measures {
        let unknown = f64::NAN;
        Measures {
            mean: unknown,
            rms: unknown,
            min: unknown,
            max: unknown,
            rms_velocity: unknown,
            effective_stiffness: None,
            effective_stiffness_dc: None,
            mean_slope: unknown,
            mean_damping: unknown,
            contacts,
            force_mean: unknown,
            force_min: unknown,
            force_max: unknown,
            force_std: unknown,
            pulls: false,
            loss: unknown,
        }
    }

    /// Multiplies the forces, as another reference stiffness does.
    pub(crate) fn scale_force(&mut self, factor: f64) {
        for force in [
            &mut self.force_mean,
            &mut self.force_min,
            &mut self.force_max,
            &mut self.force_std,
            &mut self.loss,
        ] {
            *force *= factor;
        }
    }
}

/// Whether the law has an open stretch.
pub(crate) fn is_clearance(element: &dyn Element) -> bool {
    element.breakpoints().iter().any(|b| {
        let side = 1e-9 * (1.0 + b.abs());
        element.flank(b - side) == 0 || element.flank(b + side) == 0
    })
}
