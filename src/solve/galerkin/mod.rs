//! The Galerkin method: multi-harmonic balance with alternating frequency/time sampling.
//!
//! ```text
//! R = (Om^2 D^2 (x) I + Om D (x) Gam) a + (I (x) kappa) c - d    (11b), times Om^2 of the paper's
//! ```
//!
//! Unknowns are coordinate-major: coefficient k of coordinate i is at i (2H + 1) + k, in the order mean, sin 1, cos 1, ...

pub mod accuracy;
pub mod adaptive;
mod aft;
mod aliasing;
pub mod conformance;
mod connection;
mod evolve;
mod exact;
mod hill;
pub mod jumps;
mod loads;
pub mod march;
mod parts;
mod refinement;
mod refusal;
mod switching;

use super::family::{Family, repetitions};
use super::floquet::Floquet;
use super::orbit::{FourierOrbit, Orbit};
use super::residual::{Extent, Linearisation, PeriodicResidual, Residual, Survey, slips};
use super::uninterrupted;
use crate::error::SolveError;
use crate::numeric::jacobian::JacobianStructure;
use crate::numeric::pattern::{Elimination, Pattern};
use crate::numeric::trigonometric;
use crate::system::{LoadKind, System};
use aft::Sampling;
use exact::ExactQuadrature;
use nalgebra::DVector;
pub use refusal::refuse;

/// Size of the Galerkin approximation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GalerkinOptions {
    /// Harmonics of the excitation frequency; nu times as many of the response frequency.
    pub harmonics: usize,
    /// Samples a response period.
    pub samples: usize,
}

impl GalerkinOptions {
    /// Fewest samples for a number of harmonics and a subharmonic index: a power of two, at least 16 a harmonic and 1024.
    pub fn default_samples(harmonics: usize, subharmonic: usize) -> usize {
        (16 * harmonics * subharmonic).next_power_of_two().max(1024)
    }
}

/// The Galerkin residual of a family of systems.
pub struct Galerkin<F: Family> {
    family: F,
    /// Parameter of the cached tables below.
    prepared: Option<f64>,
    coefficients: usize,
    structure: JacobianStructure,
    sampling: Sampling,
    /// Replaces sampling on request.
    exact: Option<ExactQuadrature>,
    /// Load coefficients of values and of rates (to be multiplied by nu Om), coordinate-major.
    load: Vec<f64>,
    load_rate: Vec<f64>,
    derivative: Vec<f64>,
    load_series: Vec<f64>,
    shifted: Linearisation,
    floquet: Floquet,
    /// Only harmonics whose order is a multiple of this are not held at 0.
    parts: usize,
}

impl<F: Family> Galerkin<F> {
    /// Buffers for the systems of a family.
    ///
    /// # Errors
    /// No harmonics, too few samples, or an excitation of a higher order than the harmonics kept.
    pub fn new(
        mut family: F,
        lambda: f64,
        options: GalerkinOptions,
    ) -> Result<Galerkin<F>, SolveError> {
        let system = family.at(lambda)?;
        let harmonics = options.harmonics * system.subharmonic() * system.revolutions();
        // The requested samples per revolution, rounded to a size suited to the transforms.
        let options = GalerkinOptions {
            samples: options.samples * system.revolutions().next_power_of_two(),
            ..options
        };
        check(system, options, harmonics)?;
        let coefficients = 2 * harmonics + 1;
        let dim = system.dof() * coefficients;
        let sampling = Sampling::new(system, harmonics, options.samples);
        let (load, load_rate) = (vec![0.0; dim], vec![0.0; dim]);
        let structure = structure(system, coefficients);
        let shifted = Linearisation::new(&match family.is_frequency() {
            true => JacobianStructure::Dense(0),
            false => structure.clone(),
        });
        let derivative = vec![0.0; coefficients];
        Ok(Galerkin {
            family,
            prepared: None,
            coefficients,
            structure,
            sampling,
            exact: None,
            load,
            load_rate,
            derivative,
            load_series: vec![0.0; coefficients],
            shifted,
            floquet: Floquet::default(),
            parts: 1,
        })
    }

    /// Integrates forces in closed form between switching instants instead of sampling them.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection that does not allow it.
    pub fn with_exact_quadrature(mut self, lambda: f64) -> Result<Galerkin<F>, SolveError> {
        let harmonics = self.coefficients / 2;
        self.exact = Some(ExactQuadrature::new(self.family.at(lambda)?, harmonics)?);
        Ok(self)
    }

    /// 2H + 1, Fourier coefficients per coordinate.
    pub fn coefficients(&self) -> usize {
        self.coefficients
    }

    /// The orbit of a solution as Fourier series; solutions of any number of harmonics are taken.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    pub fn fourier_orbit(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<FourierOrbit, SolveError> {
        let system = self.family.at(lambda)?;
        let coefficients = u
            .as_slice()
            .chunks_exact(u.len() / system.dof())
            .map(<[f64]>::to_vec)
            .collect();
        Ok(FourierOrbit {
            coefficients,
            omega: system.omega(),
            subharmonic: system.subharmonic(),
        })
    }

    /// Refreshes the tables that depend on the parameter.
    fn prepare(&mut self, lambda: f64) -> Result<(), SolveError> {
        if self.prepared == Some(lambda) || (self.prepared.is_some() && self.family.is_frequency())
        {
            return Ok(());
        }
        let system = self.family.at(lambda)?;
        match &mut self.exact {
            None => self.sampling.prepare(system),
            Some(exact) => exact.prepare(system)?,
        }
        if !self.structure.holds(system.coupled_pairs()) {
            self.structure = structure(system, self.coefficients);
        }
        loads::coefficients(
            system,
            self.coefficients,
            &mut self.load,
            &mut self.load_rate,
        );
        self.prepared = Some(lambda);
        Ok(())
    }

    /// R and dR/du, and dR/domega where the parameter is the frequency.
    fn evaluate(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        uninterrupted()?;
        self.prepare(lambda)?;
        let system = self.family.at(lambda)?;
        let c = self.coefficients;
        let (om, nu) = (system.omega(), system.subharmonic() as f64);
        out.dr_du.reshape(&self.structure);
        out.dr_du.fill(0.0);
        let rates = self.load.iter().zip(&self.load_rate);
        for ((r, dr), (value, rate)) in out.r.iter_mut().zip(out.dr_dlambda.iter_mut()).zip(rates) {
            *r = -value - nu * om * rate;
            *dr = -rate;
        }
        loads::add_growing(system, c, &mut self.load_series, out);
        out.magnitude = out.r.amax();
        linear_terms(system, c, u, &mut self.derivative, out);
        match &mut self.exact {
            None => self.sampling.add_forces(system, u, out),
            Some(exact) => exact.add_forces(system, u, out),
        }
        Ok(())
    }

    /// R and its derivatives, none of its harmonics held.
    fn of_all_harmonics(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        self.evaluate(u, lambda, out)?;
        if self.family.is_frequency() {
            let revolutions = self.family.at(lambda)?.revolutions();
            if revolutions > 1 {
                out.dr_dlambda /= revolutions as f64;
            }
            return Ok(());
        }
        if !out.has_parameter {
            return Ok(());
        }
        // A difference in any other parameter: dR/dlambda only steers the predictor and the last column of the border.
        let mut shifted = std::mem::replace(
            &mut self.shifted,
            Linearisation::new(&JacobianStructure::Dense(0)),
        );
        let outcome = self.difference(u, lambda, &mut shifted, out);
        self.shifted = shifted;
        outcome
    }

    /// dR/dlambda as a difference quotient.
    fn difference(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        shifted: &mut Linearisation,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let (low, high) = self.family.neighbours(lambda);
        self.evaluate(u, high, shifted)?;
        out.dr_dlambda.copy_from(&shifted.r);
        self.evaluate(u, low, shifted)?;
        out.dr_dlambda -= &shifted.r;
        out.dr_dlambda /= high - low;
        Ok(())
    }
}

impl<F: Family> Residual for Galerkin<F> {
    fn dim(&self) -> usize {
        self.load.len()
    }

    fn structure(&self) -> JacobianStructure {
        self.structure.clone()
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        self.of_all_harmonics(u, lambda, out)?;
        parts::hold(self.parts, self.coefficients, u, out);
        Ok(())
    }
}

impl<F: Family> PeriodicResidual for Galerkin<F> {
    fn system_at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.family.at(lambda)
    }

    fn orbit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Orbit, SolveError> {
        self.fourier_orbit(u, lambda).map(Orbit::Fourier)
    }

    fn aliasing(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        Galerkin::aliasing(self, u, lambda)
    }

    fn equal_parts(&mut self, u: &DVector<f64>, lambda: f64) -> Result<usize, SolveError> {
        let most = repetitions(&mut self.family, lambda)?;
        Ok(parts::of(u, self.family.at(lambda)?.dof(), most))
    }

    fn restrict(&mut self, parts: usize) -> usize {
        std::mem::replace(&mut self.parts, parts)
    }

    fn in_doubled_period(&self, half: &DVector<f64>) -> DVector<f64> {
        let (c, few) = (self.coefficients, self.coefficients.div_ceil(2));
        let mut u = DVector::zeros(self.dim());
        let blocks = u.as_mut_slice().chunks_exact_mut(c);
        for (block, half) in blocks.zip(half.as_slice().chunks_exact(few)) {
            block[0] = half[0];
            // Harmonic k becomes harmonic 2 k.
            for k in 1..=few / 2 {
                (block[4 * k - 1], block[4 * k]) = (half[2 * k - 1], half[2 * k]);
            }
        }
        u
    }

    fn survey(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        extent: Extent,
    ) -> Result<Survey, SolveError> {
        let orbit = self.fourier_orbit(u, lambda)?;
        let system = self.family.at(lambda)?;
        let extrema = orbit.extrema(system);
        let (multipliers, exponents, neutral) = match extent {
            Extent::Motion => (Vec::new(), None, 0),
            Extent::Stability if system.memory_count() > 0 => {
                let (list, neutral) = Floquet::with_memory(system, &orbit, &extrema, self.parts);
                (list, None, neutral)
            }
            Extent::Stability => {
                let along = (&orbit, extrema.as_slice());
                let known = self.floquet.of_part(system, along, self.parts);
                (known.0, known.1, 0)
            }
        };
        uninterrupted()?;
        let orbit = Orbit::Fourier(orbit);
        let slips = slips(system, &extrema);
        Ok(Survey {
            orbit,
            extrema,
            breakpoints: system.breakpoints(),
            multipliers,
            exponents,
            neutral,
            slips,
        })
    }
}

/// One block of coefficients for every pair of coordinates that share a body.
fn structure(system: &System, coefficients: usize) -> JacobianStructure {
    let pairs = system.coupled_pairs();
    JacobianStructure::chosen(Pattern::new(system.dof(), coefficients, pairs))
}

/// Blocks of the Jacobian that may differ from zero, and all of them, where it is eliminated by blocks; `None` where
/// elimination is dense. Either way coordinates that are linear at the moment are condensed first.
pub fn stored_blocks(system: &System) -> Option<[usize; 2]> {
    let pattern = Pattern::new(system.dof(), 1, system.coupled_pairs());
    Elimination::cost(&pattern).map(|_| [pattern.stored(), pattern.blocks().pow(2)])
}

/// Entries of the Jacobian, and multiplications of its elimination, in blocks of a coordinate's coefficients: what a linear
/// system takes is these numbers times the square and the cube of the number of coefficients.
pub fn effort(system: &System) -> (f64, f64) {
    let pattern = Pattern::new(system.dof(), 1, system.coupled_pairs());
    let blocks = pattern.blocks() as f64;
    match Elimination::cost(&pattern) {
        Some(operations) => (2.0 * pattern.stored() as f64, operations),
        None => (blocks * blocks, blocks.powi(3) / 3.0),
    }
}

fn check(system: &System, options: GalerkinOptions, harmonics: usize) -> Result<(), SolveError> {
    let error = |name, found: usize, wanted: String| {
        Err(SolveError::Option {
            name,
            found: found.to_string(),
            wanted,
        })
    };
    if options.harmonics == 0 {
        return error("harmonics", 0, "at least 1".into());
    }
    if options.samples < 4 * harmonics + 2 {
        return error(
            "samples",
            options.samples,
            format!("at least {} for {harmonics} harmonics", 4 * harmonics + 2),
        );
    }
    let highest = system
        .loads()
        .iter()
        // Measured motions fall off with the order: what is beyond the series is cut.
        .filter(|l| l.kind != LoadKind::Acceleration)
        .filter_map(|l| l.series.highest_order())
        .max()
        .unwrap_or(0);
    let highest = highest.div_ceil(system.revolutions());
    if highest > options.harmonics {
        let wanted = format!("at least {highest}, the highest order of the excitation");
        return error("harmonics", options.harmonics, wanted);
    }
    Ok(())
}

/// Inertia and damping: Om^2 D^2 a_i + Om sum_j Gam_ij D a_j.
fn linear_terms(
    system: &System,
    c: usize,
    u: &DVector<f64>,
    derivative: &mut [f64],
    out: &mut Linearisation,
) {
    let (n, om, nu) = (system.dof(), system.omega(), system.subharmonic() as f64);
    for j in 0..n {
        let a = &u.as_slice()[j * c..(j + 1) * c];
        for (k, a) in a.iter().enumerate().skip(1) {
            let (row, square) = (j * c + k, -(k.div_ceil(2) as f64).powi(2));
            out.r[row] += om * om * square * a;
            out.dr_dlambda[row] += 2.0 * om / nu * square * a;
        }
        let mut diagonal = out.dr_du.block_mut(c, (j, j));
        for k in 1..c {
            diagonal.column(k)[k] -= om * om * (k.div_ceil(2) as f64).powi(2);
        }
        trigonometric::differentiate(a, derivative);
        for (i, gamma) in system.damping_column(j) {
            for (k, d) in derivative.iter().enumerate().skip(1) {
                out.r[i * c + k] += om * gamma * d;
                out.dr_dlambda[i * c + k] += gamma / nu * d;
            }
            let mut block = out.dr_du.block_mut(c, (*i, j));
            for k in 1..=c / 2 {
                let entry = om * gamma * k as f64;
                block.column(2 * k)[2 * k - 1] -= entry;
                block.column(2 * k - 1)[2 * k] += entry;
            }
        }
    }
}
