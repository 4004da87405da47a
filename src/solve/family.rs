//! The system as a function of one parameter.

use crate::error::SolveError;
use crate::numeric::fraction::{divisors, gcd};
use crate::system::System;
use std::f64::consts::TAU;

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

/// Distance between the ends of a part, relative to the state, up to which an orbit repeats itself there: a solution of the whole period
/// has it as closely as its multipliers let it.
const EQUAL_PARTS: f64 = 1e-7;

/// Most equal parts of the response period, out of the divisors of `most`, in which the orbit of a state repeats itself. `image` writes the
/// state after a span of tau, and is false where there is none.
///
/// # Errors
/// Those of `image`.
pub(crate) fn equal_parts(
    most: usize,
    state: &[f64],
    mut image: impl FnMut(f64, &mut Vec<f64>) -> Result<bool, SolveError>,
) -> Result<usize, SolveError> {
    let size = state.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let mut end = state.to_vec();
    for parts in divisors(most).take_while(|parts| *parts > 1) {
        end.copy_from_slice(state);
        let is_whole = image(TAU / parts as f64, &mut end)?;
        let mut gaps = end.iter().zip(state).map(|(a, b)| (a - b).abs());
        if is_whole && gaps.all(|gap| gap <= EQUAL_PARTS * size) {
            return Ok(parts);
        }
    }
    Ok(1)
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
