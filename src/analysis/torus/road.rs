//! The systems along one number of the model, as shares of its range.

use crate::analysis::bifurcation_curve::CurveAxis;
use crate::analysis::parameter::{Systems, VariedParameter, joined};
use crate::analysis::{Fault, Setting};
use crate::error::SolveError;
use crate::solve::curve::Plane;
use crate::system::System;

/// The systems of a range; the second parameter of the plane is idle.
pub(in crate::analysis) struct TorusRoad<'a> {
    systems: Systems<'a>,
    axis: CurveAxis,
    /// Excitation frequency over omega_c, where it is not the parameter.
    at: f64,
}

impl<'a> TorusRoad<'a> {
    /// Along this axis.
    pub fn new(
        setting: &'a Setting<'a>,
        axis: CurveAxis,
        at: f64,
        subharmonic: usize,
    ) -> TorusRoad<'a> {
        let parameters = std::slice::from_ref(&axis.parameter);
        TorusRoad {
            systems: Systems::new(setting, parameters, at, subharmonic),
            axis,
            at,
        }
    }

    /// Errors in the range.
    pub fn check(&mut self) -> Option<Fault> {
        let mut one = |share: f64| self.system([share, 0.0]);
        match (one(0.0), one(0.381_966_011), one(1.0)) {
            (Err(error), ..) => Some(Fault::new("from", error.to_string())),
            (_, _, Err(error)) => Some(Fault::new("to", error.to_string())),
            (Ok(a), Ok(b), _) if !self.axis.parameter.is_frequency() && a.is_alike(&b) => {
                let message = format!(
                    "{} changes nothing: the scaled equation is the same at every value",
                    self.axis.written
                );
                Some(Fault::new("parameter", message))
            }
            _ => None,
        }
    }
}

impl Plane for TorusRoad<'_> {
    fn system(&mut self, p: [f64; 2]) -> Result<System, SolveError> {
        let frequency = self.reference_frequency(p);
        if frequency <= 0.0 || frequency.is_nan() {
            let reason = format!("the frequency would be {frequency}");
            return Err(SolveError::NoSystem { reason });
        }
        let found = self.systems.at(&[self.axis.value(p[0])]);
        found.cloned().map_err(|list| SolveError::NoSystem {
            reason: joined(&list),
        })
    }

    fn frequency(&self) -> Option<usize> {
        self.systems.lone_frequency()
    }

    fn reference_frequency(&self, p: [f64; 2]) -> f64 {
        match self.axis.parameter {
            VariedParameter::Frequency(_) => self.axis.value(p[0]),
            VariedParameter::Number(_) => self.at,
        }
    }
}
