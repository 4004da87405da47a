//! Shooting: fixed points of the Poincaré map over nu excitation periods.
//!
//! ```text
//! R(u_0) = P^nu(u_0) - u_0,    dR/du_0 = Phi - I,    u_0 = {q(0), v(0)}
//! ```
//!
//! Rook & Singh (1995), eq. (23); v = Om q' as everywhere.
//!
//! Restricted to orbits that repeat themselves in m equal parts of the period, R and Phi are those of one part.

use super::family::{Family, equal_parts, repetitions};
use super::floquet;
use super::integrate::{
    FlowObserver, IntegrationEnd, Integrator, IntegratorOptions, Strain, choose,
};
use super::jumps;
use super::orbit::Orbit;
use super::residual::{Extent, Linearisation, PeriodicResidual, Residual, Survey, slips};
use super::segment_orbit::SegmentOrbit;
use super::uninterrupted;
use crate::error::SolveError;
use crate::system::System;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use std::f64::consts::TAU;

/// The shooting residual of a family of systems.
pub struct Shooting<F: Family> {
    family: F,
    options: IntegratorOptions,
    integrator: Box<dyn Integrator + Send>,
    /// Parameter for which the integrator's tables were made.
    prepared: f64,
    state: Vec<f64>,
    /// Image of the state whose differences are taken.
    centre: Vec<f64>,
    /// Trial steps that the integrator may still take.
    allowance: usize,
    /// Width of the latest difference in the parameter, in widths of the family's.
    width: f64,
    /// The latest difference quotient.
    quotient: Option<Quotient>,
    phi: DMatrix<f64>,
    /// Coordinates and rates: 2n.
    motion: usize,
    /// Equal parts of the period, one of which is integrated.
    parts: usize,
}

/// A difference quotient of the map in the parameter, and where it holds.
struct Quotient {
    u: DVector<f64>,
    lambda: f64,
    value: DVector<f64>,
    /// Half the width of the difference: the map is straight within it.
    reach: f64,
}

/// Map of the flow over nu excitation periods.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    /// P^nu(u), or the end of the first of the equal parts.
    pub state: &'a [f64],
    /// The transition matrix up to there.
    pub phi: &'a DMatrix<f64>,
}

impl<F: Family> Shooting<F> {
    /// Buffers and tables at a parameter.
    ///
    /// # Errors
    /// The system cannot be made, the integrator cannot take it, or a law has hidden jumps.
    pub fn new(
        mut family: F,
        lambda: f64,
        options: impl Into<IntegratorOptions>,
    ) -> Result<Shooting<F>, SolveError> {
        let system = family.at(lambda)?;
        let size = system.state_size();
        jumps::refuse_hidden(system)?;
        let motion = 2 * system.dof();
        let options = options.into();
        let integrator = choose(system, options)?;
        let (state, phi) = (vec![0.0; size], DMatrix::identity(size, size));
        Ok(Shooting {
            family,
            options,
            integrator,
            prepared: lambda,
            centre: state.clone(),
            allowance: usize::MAX,
            width: 1.0,
            quotient: None,
            motion,
            parts: 1,
            state,
            phi,
        })
    }

    /// `exact`, `series` or `dopri5`.
    pub fn integrator(&self) -> &'static str {
        self.integrator.name()
    }

    /// The most laborious map so far, if any was.
    pub fn strain(&self) -> Option<Strain> {
        self.integrator.strain()
    }

    /// The integrator keeps tables of the laws: they are rebuilt when anything except the frequency changes.
    fn prepare(&mut self, lambda: f64) -> Result<(), SolveError> {
        if lambda != self.prepared && !self.family.is_frequency() {
            self.integrator = choose(self.family.at(lambda)?, self.options)?;
        }
        self.prepared = lambda;
        Ok(())
    }

    /// Phase at the end of the first of the equal parts.
    fn end_of_part(&self) -> f64 {
        TAU / self.parts as f64
    }

    /// The state at a phase into `self.state`, watched on its way from `u` at phase 0.
    fn map(
        &mut self,
        u: &[f64],
        lambda: f64,
        to: f64,
        observer: &mut dyn FlowObserver,
    ) -> Result<IntegrationEnd, SolveError> {
        self.prepare(lambda)?;
        let system = self.family.at(lambda)?;
        self.state.copy_from_slice(u);
        self.integrator.allow(self.allowance);
        let end = self
            .integrator
            .advance(system, (0.0, to), &mut self.state, observer);
        self.allowance = self.allowance.saturating_sub(self.integrator.effort());
        uninterrupted().map(|()| end)
    }

    /// Limits the trial steps of the maps to come, all together; beyond it there is no image. Returns what is left of the limit before.
    pub fn allow(&mut self, steps: usize) -> usize {
        std::mem::replace(&mut self.allowance, steps)
    }

    /// The end of the first of the equal parts, and the transition matrix in `self.phi`.
    fn map_with_variation(
        &mut self,
        u: &[f64],
        lambda: f64,
        observer: &mut dyn FlowObserver,
    ) -> Result<IntegrationEnd, SolveError> {
        self.prepare(lambda)?;
        self.state.copy_from_slice(u);
        self.phi.fill_with_identity();
        let span = (0.0, self.end_of_part());
        let system = self.family.at(lambda)?;
        let (state, phi) = (&mut self.state, &mut self.phi);
        self.integrator.allow(self.allowance);
        let end = self
            .integrator
            .advance_with_variation(system, span, state, phi, observer);
        self.allowance = self.allowance.saturating_sub(self.integrator.effort());
        uninterrupted().map(|()| end)
    }

    /// P^nu(u), or the end of the first of the equal parts, and the transition matrix up to there, watched; `None` where the flow does not
    /// get there.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    pub fn image(
        &mut self,
        u: &[f64],
        lambda: f64,
        observer: &mut dyn FlowObserver,
    ) -> Result<Option<Image<'_>>, SolveError> {
        let end = self.map_with_variation(u, lambda, observer)?;
        let is_whole = end == IntegrationEnd::Reached;
        Ok(is_whole.then_some(Image {
            state: &self.state,
            phi: &self.phi,
        }))
    }

    /// Floquet multipliers by decreasing modulus from the last image.
    pub(crate) fn multipliers_of_image(&self) -> Vec<Complex<f64>> {
        floquet::multipliers(&self.phi)
    }

    /// Equal parts in which the image is taken.
    pub fn parts(&self) -> usize {
        self.parts
    }

    /// Derivative of the image with respect to lambda into `slope`, a difference quotient.
    ///
    /// # Errors
    /// The system cannot be made beside this parameter.
    pub fn slope(
        &mut self,
        u: &[f64],
        lambda: f64,
        slope: &mut DVector<f64>,
    ) -> Result<(), SolveError> {
        self.map(u, lambda, self.end_of_part(), &mut ())?;
        self.centre.copy_from_slice(&self.state);
        self.difference(u, lambda, slope)
    }

    /// Multipliers of an orbit over one part, with the number of those that are 1 by construction; the orbit is filled with the whole period.
    fn stability(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        orbit: &mut SegmentOrbit,
    ) -> Result<(Vec<Complex<f64>>, usize), SolveError> {
        let end = match self.parts {
            1 => self.map_with_variation(u.as_slice(), lambda, orbit)?,
            _ => {
                self.map(u.as_slice(), lambda, TAU, orbit)?;
                self.map_with_variation(u.as_slice(), lambda, &mut ())?
            }
        };
        if end != IntegrationEnd::Reached {
            return Ok((Vec::new(), 0));
        }
        Ok(floquet::multipliers_and_neutral(&self.phi, self.motion))
    }

    /// An orbit to be filled by the integration.
    fn empty_orbit(&mut self, lambda: f64) -> Result<SegmentOrbit, SolveError> {
        let system = self.family.at(lambda)?;
        Ok(SegmentOrbit::new(
            system.omega(),
            system.subharmonic(),
            system.dof(),
        ))
    }
}

impl<F: Family> Residual for Shooting<F> {
    fn dim(&self) -> usize {
        self.state.len()
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        // A flow that does not reach the end of the period has no image: the caller sees a residual that is not finite.
        let end = self.map_with_variation(u.as_slice(), lambda, &mut ())?;
        let valid = if end == IntegrationEnd::Reached {
            1.0
        } else {
            f64::NAN
        };
        out.magnitude = u.amax();
        for (k, x) in self.state.iter().enumerate() {
            out.r[k] = valid * (x - u[k]);
            out.magnitude = out.magnitude.max(x.abs());
        }
        let mut jacobian = out.dr_du.block_mut(u.len(), (0, 0));
        for c in 0..u.len() {
            let column = jacobian.column(c);
            column.copy_from_slice(self.phi.column(c).as_slice());
            column[c] -= 1.0;
        }
        // What is remembered and never changed is data: u keeps it.
        for row in floquet::kept(&self.phi, self.motion) {
            for c in 0..u.len() {
                jacobian.column(c)[row] = if c == row { -1.0 } else { 0.0 };
            }
            out.r[row] = 0.0;
        }
        if !out.has_parameter {
            return Ok(());
        }
        if let Some(known) = self
            .quotient
            .as_ref()
            .filter(|q| q.holds(u, lambda, &self.phi))
        {
            out.dr_dlambda.copy_from(&known.value);
            return Ok(());
        }
        self.centre.copy_from_slice(&self.state);
        self.difference(u.as_slice(), lambda, &mut out.dr_dlambda)?;
        let (low, high) = self.family.neighbours(lambda);
        self.quotient = Some(Quotient {
            u: u.clone(),
            lambda,
            value: out.dr_dlambda.clone(),
            reach: 0.5 * self.width * (high - low),
        });
        Ok(())
    }
}

impl Quotient {
    /// Whether a place is so near that the map has hardly moved: by less than it does within the difference.
    fn holds(&self, u: &DVector<f64>, lambda: f64, phi: &DMatrix<f64>) -> bool {
        let moved = u
            .iter()
            .zip(&self.u)
            .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        let straight = NEAR * self.reach;
        (lambda - self.lambda).abs() <= straight
            && moved * phi.amax().max(1.0) <= straight * self.value.amax()
    }
}

/// Share of a difference by which the map may move and keep its derivative.
const NEAR: f64 = 1e-2;

/// Share of the change of an image that its second difference may have: beyond it the difference quotient is not a derivative.
const BENT: f64 = 1e-2;
/// Share below which the next difference may be wider.
const PLAIN: f64 = 1e-4;
/// What a difference that is too wide shrinks by.
const NARROWING: f64 = 0.125;
/// Narrowest difference, in widths of the family's: rounding is a share of 1e-5 of it.
const NARROWEST: f64 = 1e-4;
/// Share of the state below which differences are rounding.
const ROUNDING: f64 = 1e-11;

impl<F: Family> Shooting<F> {
    /// dP/dlambda as a difference quotient, narrow enough for the map to be straight within it: after long periods it bends
    /// within 1e-7 of the parameter.
    fn difference(
        &mut self,
        u: &[f64],
        lambda: f64,
        out: &mut DVector<f64>,
    ) -> Result<(), SolveError> {
        let (low, high) = self.family.neighbours(lambda);
        loop {
            let width = self.width;
            let [low, high] = [low, high].map(|x| lambda + width * (x - lambda));
            self.map(u, high, self.end_of_part(), &mut ())?;
            out.copy_from_slice(&self.state);
            self.map(u, low, self.end_of_part(), &mut ())?;
            let (mut change, mut bend) = (0.0_f64, 0.0_f64);
            let (ahead, behind) = (high - lambda, lambda - low);
            let images = self.state.iter().zip(&self.centre);
            for (d, (x, centre)) in out.iter_mut().zip(images) {
                let rises = [(*d - centre) * behind, (centre - x) * ahead];
                change = change.max((rises[0] + rises[1]).abs());
                bend = bend.max((rises[0] - rises[1]).abs());
                *d = (*d - x) / (high - low);
            }
            // Rounding of the image counts as change.
            let size = self.centre.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let change = change.max(ROUNDING * size * ahead.max(behind));
            if bend > BENT * change && width > NARROWEST {
                self.width *= NARROWING;
                continue;
            }
            if bend < PLAIN * change {
                self.width = (2.0 * width).min(1.0);
            }
            return Ok(());
        }
    }
}

impl<F: Family> PeriodicResidual for Shooting<F> {
    fn system_at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.family.at(lambda)
    }

    fn orbit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Orbit, SolveError> {
        let mut orbit = self.empty_orbit(lambda)?;
        self.map(u.as_slice(), lambda, TAU, &mut orbit)?;
        Ok(Orbit::Segments(orbit))
    }

    fn equal_parts(&mut self, u: &DVector<f64>, lambda: f64) -> Result<usize, SolveError> {
        let most = repetitions(&mut self.family, lambda)?;
        equal_parts(most, u.as_slice(), |span, end| {
            let ended = self.map(u.as_slice(), lambda, span, &mut ())?;
            end.copy_from_slice(&self.state);
            Ok(ended == IntegrationEnd::Reached)
        })
    }

    fn restrict(&mut self, parts: usize) -> usize {
        (self.quotient, self.width) = (None, 1.0);
        std::mem::replace(&mut self.parts, parts)
    }

    fn in_doubled_period(&self, half: &DVector<f64>) -> DVector<f64> {
        half.clone()
    }

    fn survey(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        extent: Extent,
    ) -> Result<Survey, SolveError> {
        let mut orbit = self.empty_orbit(lambda)?;
        let (multipliers, neutral) = match extent {
            Extent::Motion => {
                self.map(u.as_slice(), lambda, TAU, &mut orbit)?;
                (Vec::new(), 0)
            }
            Extent::Stability => self.stability(u, lambda, &mut orbit)?,
        };
        let system = self.family.at(lambda)?;
        let extrema = orbit.extrema(system);
        let orbit = Orbit::Segments(orbit);
        let slips = slips(system, &extrema);
        Ok(Survey {
            orbit,
            extrema,
            breakpoints: system.breakpoints(),
            multipliers,
            exponents: None,
            neutral,
            slips,
        })
    }
}
