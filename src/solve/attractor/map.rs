//! Iterates of a map: what attractors are judged on.

use crate::solve::integrate::{IntegrationEnd, Integrator};
use crate::solve::jumps;
use crate::system::{Mount, System};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Constraints of the equation of motion on invariant curves, independent of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tori {
    /// They may exist.
    Possible,
    /// They cannot exist: one coordinate, damped everywhere. The Poincaré map is then a map of the plane. A closed curve that it maps
    /// onto itself bounds a disk that it maps onto itself, which a map that shrinks every area cannot do.
    Excluded,
    /// Nothing is damped: curves come in families and attract nothing.
    Conservative,
}

/// A map of states onto states, with its derivative.
pub trait Map {
    /// Values in a state.
    fn size(&self) -> usize;

    /// state <- P(state).
    fn advance(&mut self, state: &mut [f64]) -> IntegrationEnd;

    /// The same, and frame <- DP frame.
    fn advance_with_variation(
        &mut self,
        state: &mut [f64],
        frame: &mut DMatrix<f64>,
    ) -> IntegrationEnd;

    /// Time of one iterate.
    fn duration(&self) -> f64 {
        1.0
    }

    /// Order of magnitude of the relative error of one iterate and of its derivative.
    fn error(&self) -> f64 {
        1e-14
    }

    /// Whether the derivative is known.
    fn has_variation(&self) -> bool {
        true
    }

    /// What is known about invariant curves.
    fn tori(&self) -> Tori {
        Tori::Possible
    }
}

/// The Poincaré map of a system: one period of the excitation, from phase 0 to phase 0, [q; v; z].
///
/// Every period is integrated over the same phases, so that the phase does not lose digits with time.
pub struct Stroboscopic<'a> {
    /// The system.
    pub system: &'a System,
    /// Integrator.
    pub integrator: &'a mut dyn Integrator,
}

impl Stroboscopic<'_> {
    fn span(&self) -> (f64, f64) {
        (0.0, TAU / self.system.subharmonic() as f64)
    }
}

impl Map for Stroboscopic<'_> {
    fn size(&self) -> usize {
        self.system.state_size()
    }

    fn advance(&mut self, state: &mut [f64]) -> IntegrationEnd {
        let span = self.span();
        self.integrator.advance(self.system, span, state, &mut ())
    }

    fn advance_with_variation(
        &mut self,
        state: &mut [f64],
        frame: &mut DMatrix<f64>,
    ) -> IntegrationEnd {
        let span = self.span();
        (self.integrator).advance_with_variation(self.system, span, state, frame, &mut ())
    }

    fn duration(&self) -> f64 {
        TAU / self.system.excitation_frequency()
    }

    fn error(&self) -> f64 {
        self.integrator.error()
    }

    fn has_variation(&self) -> bool {
        jumps::refuse_hidden(self.system).is_ok()
    }

    fn tori(&self) -> Tori {
        tori(self.system)
    }
}

/// What the equation of motion says about invariant curves.
///
/// ```text
/// d(q', v')/d(q, v):  trace = -(Gam + sum_e kappa_e W_e df_e/dv)
/// ```
pub fn tori(system: &System) -> Tori {
    // Sliders and impacts take energy without damping, and memories are more dimensions.
    let is_plain =
        |mount: &Mount| mount.element.memory_count() == 0 && mount.element.least_impact().is_none();
    if !system.mounts().iter().all(is_plain) {
        return Tori::Possible;
    }
    let is_elastic = |mount: &Mount| !mount.element.depends_on_velocity();
    if system.damping().iter().all(|c| *c == 0.0) && system.mounts().iter().all(is_elastic) {
        return Tori::Conservative;
    }
    let takes_energy = |(e, mount): (usize, &Mount)| {
        let weight = system.stiffness()[(0, e)] * system.element_map()[(e, 0)];
        let is_steady = weight >= 0.0 && mount.stiffness_variation.is_none();
        is_elastic(mount) || (is_steady && mount.element.is_passive())
    };
    let shrinks = system.dof() == 1
        && system.damping()[(0, 0)] > 0.0
        && system.mounts().iter().enumerate().all(takes_energy);
    if shrinks {
        Tori::Excluded
    } else {
        Tori::Possible
    }
}
