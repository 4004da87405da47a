//! The system as a function of one parameter.

use crate::error::SolveError;
use crate::numeric::fraction::gcd;
use crate::system::System;

/// The system at a value of the continuation parameter.
pub trait Family {
    /// The system at `lambda`.
    ///
    /// # Errors
    /// The system cannot be made at this value.
    fn at(&mut self, lambda: f64) -> Result<&System, SolveError>;

    /// True when the parameter is the excitation frequency omega / omega_c: derivatives are analytic then.
    fn is_frequency(&self) -> bool {
        false
    }

    /// Two values around `lambda` for a difference quotient in the parameter.
    fn neighbours(&self, lambda: f64) -> (f64, f64) {
        // The step at which truncation and rounding of a central difference are of one size.
        let h = f64::EPSILON.cbrt() * lambda.abs().max(1e-3);
        (lambda - h, lambda + h)
    }
}

/// Equal parts of the response period in each of which everything that excites is the same, at a parameter and beside it: a load may
/// vanish at one value only.
///
/// # Errors
/// The system cannot be made.
pub(crate) fn repetitions(family: &mut impl Family, lambda: f64) -> Result<usize, SolveError> {
    let mut parts = family.at(lambda)?.repetitions();
    if !family.is_frequency() {
        let (low, high) = family.neighbours(lambda);
        for beside in [low, high] {
            parts = gcd(parts, family.at(beside)?.repetitions());
        }
    }
    Ok(parts)
}

impl<F: Family + ?Sized> Family for Box<F> {
    fn at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        (**self).at(lambda)
    }

    fn is_frequency(&self) -> bool {
        (**self).is_frequency()
    }

    fn neighbours(&self, lambda: f64) -> (f64, f64) {
        (**self).neighbours(lambda)
    }
}

/// Parameter: the frequency of the reference shaft over omega_c.
#[derive(Debug, Clone)]
pub struct FrequencyFamily {
    system: System,
}

impl FrequencyFamily {
    /// A family over the frequency of this system.
    pub fn new(system: System) -> FrequencyFamily {
        FrequencyFamily { system }
    }
}

impl Family for FrequencyFamily {
    fn at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.system.set_reference_frequency(lambda);
        Ok(&self.system)
    }

    fn is_frequency(&self) -> bool {
        true
    }
}

/// Parameter: share of every alternating part, 0 (the static equilibrium) to 1 (the system itself).
#[derive(Debug, Clone)]
pub struct ExcitationFamily {
    full: System,
    system: System,
}

impl ExcitationFamily {
    /// A family from rest to this system.
    pub fn new(full: System) -> ExcitationFamily {
        ExcitationFamily {
            system: full.clone(),
            full,
        }
    }
}

impl Family for ExcitationFamily {
    fn at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.system = self.full.with_excitation_share(lambda);
        Ok(&self.system)
    }
}
