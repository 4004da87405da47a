//! Periodic orbits told apart by their Poincaré points.

use super::residual::PeriodicResidual;
use crate::error::SolveError;
use nalgebra::DVector;
use std::f64::consts::TAU;

/// A crossing found twice: once by a multiplier of the flow along a series, once by the determinant of the residual with twice
/// the harmonics, which differ by the truncation of the series. Parameters relative to their size.
const SAME_LAMBDA: f64 = 1e-3;
/// The same for states, which change like the parameter times a slope, or like its root near a fold.
const SAME_STATE: f64 = 1e-2;

/// A periodic orbit at a parameter, as its states at phase 0 of each of the nu excitation periods.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Parameter.
    pub lambda: f64,
    states: Vec<DVector<f64>>,
}

impl Place {
    /// The place of a solution.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn of(
        problem: &mut dyn PeriodicResidual,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<Place, SolveError> {
        let orbit = problem.orbit(u, lambda)?;
        let system = problem.system_at(lambda)?;
        let (size, nu) = (system.state_size(), system.subharmonic());
        let state = |k: usize| {
            let mut state = DVector::zeros(size);
            orbit.state(TAU * k as f64 / nu as f64, state.as_mut_slice());
            state
        };
        Ok(Place {
            lambda,
            states: (0..nu).map(state).collect(),
        })
    }

    /// nu: excitation periods per response period.
    pub fn subharmonic(&self) -> usize {
        self.states.len()
    }

    /// Largest difference of states, relative to their size, in the phase that suits best: an orbit that begins an excitation
    /// period later is the same orbit.
    pub fn gap(&self, other: &Place) -> f64 {
        let (few, many) = match self.states.len() < other.states.len() {
            true => (&self.states, &other.states),
            false => (&other.states, &self.states),
        };
        let shifted = |shift: usize| {
            let pairs = many.iter().enumerate();
            pairs.fold(0.0_f64, |gap, (k, state)| {
                gap.max((state - &few[(k + shift) % few.len()]).amax())
            })
        };
        let least = (0..few.len()).map(shifted).fold(f64::INFINITY, f64::min);
        least / (1.0 + self.size())
    }

    /// Excitation periods after which the orbit repeats itself, as far as states tell that differ by less than a tolerance,
    /// relative to their size.
    pub fn period(&self, tolerance: f64) -> usize {
        let nu = self.states.len();
        let repeats = |period: &usize| {
            let gap = (0..nu).fold(0.0_f64, |gap, k| {
                let later = &self.states[(k + period) % nu];
                gap.max((later - &self.states[k]).amax())
            });
            nu.is_multiple_of(*period) && gap < tolerance * (1.0 + self.size())
        };
        (1..nu).find(repeats).unwrap_or(nu)
    }

    /// Distance of the orbit from repeating after half its period, relative to its size; infinite for odd nu.
    pub(crate) fn gap_of_halves(&self) -> f64 {
        let nu = self.states.len();
        if !nu.is_multiple_of(2) {
            return f64::INFINITY;
        }
        let (first, second) = self.states.split_at(nu / 2);
        let pairs = first.iter().zip(second);
        let largest = pairs.fold(0.0_f64, |gap, (a, b)| gap.max((a - b).amax()));
        largest / (1.0 + self.size())
    }

    /// The share of the way to another orbit of the same branch at which the halves change places.
    pub(crate) fn exchange_of_halves(&self, other: &Place) -> Option<f64> {
        let nu = self.states.len();
        if !nu.is_multiple_of(2) {
            return None;
        }
        let difference = |place: &Place| &place.states[0] - &place.states[nu / 2];
        let (from, to) = (difference(self), difference(other));
        let along = from.dot(&to);
        (along < 0.0).then(|| from.norm_squared() / (from.norm_squared() - along))
    }

    /// The one among these that the place coincides with, the nearest if there are several.
    pub fn nearest(&self, known: &[Place]) -> Option<usize> {
        let gaps = known.iter().enumerate().filter_map(|(k, other)| {
            let apart = (self.lambda - other.lambda).abs() / (1.0 + self.lambda.abs());
            let gap = self.gap(other);
            (apart < SAME_LAMBDA && gap < SAME_STATE).then_some((k, gap))
        });
        gaps.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }

    fn size(&self) -> f64 {
        self.states.iter().fold(0.0, |size, s| s.amax().max(size))
    }
}
