//! A law in place: what it sees of the motion, and what it answers.

use crate::element::{Element, Response};
use crate::numeric::periodic::Periodic;

/// A law in place, with its time-varying stiffness and its transmission error.
#[derive(Debug, Clone)]
pub struct Mount {
    /// The law, nondimensional.
    pub element: Box<dyn Element>,
    /// s(phase), mean 1: multiplies the force.
    pub stiffness_variation: Option<Periodic>,
    /// e(phase): the law sees W q - e and its rate.
    pub transmission_error: Option<Periodic>,
}

impl Mount {
    /// A law with constant stiffness and no transmission error.
    pub fn new(element: Box<dyn Element>) -> Mount {
        Mount {
            element,
            stiffness_variation: None,
            transmission_error: None,
        }
    }

    /// Deformation W q - e and its rate, d/d(omega_c t), from W q and W v; `frequency`: omega/omega_c.
    #[inline]
    pub fn deformation(&self, [x, rate]: [f64; 2], phase: f64, frequency: f64) -> [f64; 2] {
        match &self.transmission_error {
            None => [x, rate],
            Some(e) => [x - e.value(phase), rate - frequency * e.derivative(phase)],
        }
    }

    /// Response at a deformation and its rate, stiffness variation included.
    #[inline]
    pub fn respond(&self, deformation: f64, rate: f64, phase: f64) -> Response {
        self.vary(self.element.eval(deformation, rate, phase), phase)
    }

    /// The same in motion, with what the law remembers.
    #[inline]
    pub fn respond_with(&self, motion: [f64; 2], phase: f64, memory: &[f64]) -> Response {
        let [deformation, rate] = motion;
        self.vary(
            self.element.respond(deformation, rate, phase, memory),
            phase,
        )
    }

    /// Response of the law times the stiffness variation.
    #[inline]
    pub fn vary(&self, response: Response, phase: f64) -> Response {
        let Some(variation) = &self.stiffness_variation else {
            return response;
        };
        let s = variation.value(phase);
        Response {
            f: s * response.f,
            df_dq: s * response.df_dq,
            df_dv: s * response.df_dv,
        }
    }
}
