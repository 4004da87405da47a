//! Exact quadrature: the forces of piecewise-affine laws as Fourier integrals in closed form between switching instants.
//!
//! On a trigonometric polynomial x(tau) such a law is f = g x + h, slope g and offset h constant between two switches. With jumps
//! dg_j at tau_j
//!
//! ```text
//! G_k = 1/(2 pi i k) sum_j dg_j e^(-i k tau_j),    c_k = H_k + sum_l G_k-l X_l
//! ```
//!
//! G and H the Fourier coefficients of g and h, X those of x. Nothing is sampled, so nothing aliases; F+ diag(g) F is the exact
//! Jacobian, for a continuous force does not notice that its switches move. A stiffness variation steps (more jumps) or
//! multiplies G and H.

mod memories;

use super::connection::{add_diagonal, add_force, add_jacobian, gather};
use super::hill::Hill;
use super::jumps::{self, Edge};
use super::march::March;
use super::switching::Switching;
use crate::element::automaton::Automaton;
use crate::error::SolveError;
use crate::numeric::corners::Piece;
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::solve::affine::AffineLaw;
use crate::solve::closed_form::ClosedForm;
use crate::solve::residual::Linearisation;
use crate::system::System;
use memories::automata;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use std::f64::consts::TAU;

/// How the stiffness of a connection varies.
enum StiffnessVariation {
    /// Not at all.
    None,
    /// By steps: instants in tau, ascending, with the factor behind each.
    Steps(Vec<(f64, f64)>),
    /// By harmonics of tau: mean, then order and coefficient of e^(i k tau).
    Harmonics(f64, Vec<(usize, Complex<f64>)>),
}

/// Tables and buffers of the exact quadrature.
pub(crate) struct ExactQuadrature {
    harmonics: usize,
    laws: Vec<AffineLaw>,
    variations: Vec<StiffnessVariation>,
    /// Fourier coefficients of the transmission errors, as long as the longest of them.
    errors: Vec<Option<Vec<f64>>>,
    switching: Switching,
    /// Coefficients of the deformation: mean, sin 1, cos 1, ...; the same as complex ones.
    a: Vec<f64>,
    x: Vec<Complex<f64>>,
    /// Complex coefficients of slope and offset, and of their products with the variation.
    slope: Vec<Complex<f64>>,
    offset: Vec<Complex<f64>>,
    product: Vec<Complex<f64>>,
    g: Vec<f64>,
    c: Vec<f64>,
    filler: Hill,
    hill: DMatrix<f64>,
    edges: Vec<Edge>,
    /// Laws with memory: their automata, and what these remember at rest. Whether the others are left to somebody else.
    automata: Vec<Vec<(Automaton, f64)>>,
    is_partial: bool,
    march: March,
    /// Memories that change with the motion: where they were set, and their factor of force over the stretches where it counts.
    memories: Vec<(f64, Vec<f64>)>,
}

impl ExactQuadrature {
    /// Buffers for a number of harmonics of tau.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection that does not allow it.
    pub fn new(system: &System, harmonics: usize) -> Result<ExactQuadrature, SolveError> {
        let mut this = ExactQuadrature::empty(harmonics);
        this.prepare(system)?;
        Ok(this)
    }

    fn empty(harmonics: usize) -> ExactQuadrature {
        let c = 2 * harmonics + 1;
        ExactQuadrature {
            harmonics,
            laws: Vec::new(),
            variations: Vec::new(),
            errors: Vec::new(),
            switching: Switching::new(harmonics),
            a: Vec::new(),
            x: Vec::new(),
            slope: Vec::new(),
            offset: Vec::new(),
            product: Vec::new(),
            g: vec![0.0; 4 * harmonics + 1],
            c: vec![0.0; c],
            filler: Hill::new(harmonics),
            hill: DMatrix::zeros(c, c),
            edges: Vec::new(),
            automata: Vec::new(),
            is_partial: false,
            march: March::default(),
            memories: Vec::new(),
        }
    }

    /// The same for the laws with memory alone, whatever the others are.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection with memory that does not allow it.
    pub(crate) fn of_memories(
        system: &System,
        harmonics: usize,
    ) -> Result<ExactQuadrature, SolveError> {
        let mut this = ExactQuadrature::empty(harmonics);
        this.is_partial = true;
        this.prepare(system)?;
        Ok(this)
    }

    /// Reads laws, stiffness variations and transmission errors of a system.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection that does not allow closed-form integrals.
    pub fn prepare(&mut self, system: &System) -> Result<(), SolveError> {
        let nu = system.subharmonic();
        for (connection, mount) in system.mounts().iter().enumerate() {
            let law = &mount.element;
            let is_ours = !self.is_partial || law.memory_count() > 0 && law.evolving().is_none();
            if let Some(reason) = ClosedForm::Quadrature.refusal(mount).filter(|_| is_ours) {
                return Err(SolveError::Unsupported { connection, reason });
            }
        }
        let mounts = system.mounts();
        let laws = mounts.iter().map(|m| AffineLaw::read(m.element.as_ref()));
        self.laws = laws.collect();
        self.automata = automata(system);
        let variations = mounts.iter().map(|m| m.stiffness_variation.as_ref());
        self.variations = variations.map(|s| StiffnessVariation::new(s, nu)).collect();
        let errors = mounts.iter().map(|m| m.transmission_error.as_ref());
        let highest = errors
            .clone()
            .flatten()
            .filter_map(Periodic::highest_order)
            .fold(self.harmonics, |l, order| l.max(nu * order));
        self.errors = errors
            .map(|e| e.map(|e| spectrum(e, nu, highest)))
            .collect();
        let varies = self
            .variations
            .iter()
            .map(StiffnessVariation::highest)
            .max();
        let length = self.harmonics + highest + 1 + varies.unwrap_or(0);
        self.switching.resize(highest);
        self.a.resize(2 * highest + 1, 0.0);
        self.x.resize(highest + 1, Complex::default());
        for spectrum in [&mut self.slope, &mut self.offset, &mut self.product] {
            spectrum.resize(length, Complex::default());
        }
        Ok(())
    }

    /// Adds (I (x) kappa) c to the residual and its Jacobian (12).
    pub(crate) fn add_forces(
        &mut self,
        system: &System,
        u: &DVector<f64>,
        out: &mut Linearisation,
    ) {
        for e in 0..system.element_count() {
            self.add_force_of(system, e, u, out);
        }
    }

    /// The same for one connection.
    pub(crate) fn add_force_of(
        &mut self,
        system: &System,
        e: usize,
        u: &DVector<f64>,
        out: &mut Linearisation,
    ) {
        self.deform(system, e, u);
        self.memories.clear();
        match self.automata[e].is_empty() {
            true => self.transform(system, e),
            false => self.follow(e),
        }
        self.vary(e);
        self.convolve();
        add_force(system, e, &self.c, out);
        let is_constant = self.slope[1..].iter().all(|z| *z == Complex::default());
        if self.edges.is_empty() && self.memories.is_empty() && is_constant {
            add_diagonal(system, e, self.slope[0].re, self.c.len(), out);
            return;
        }
        self.g[0] = self.slope[0].re;
        for (pair, z) in self.g[1..].chunks_exact_mut(2).zip(&self.slope[1..]) {
            (pair[0], pair[1]) = (-2.0 * z.im, 2.0 * z.re);
        }
        self.filler.fill(&self.g, &mut self.hill);
        jumps::add_slopes(&self.edges, &mut self.hill);
        self.add_memories();
        add_jacobian(system, e, &self.hill, out);
    }

    /// Coefficients of the deformation W q - e.
    fn deform(&mut self, system: &System, e: usize, u: &DVector<f64>) {
        gather(system, e, u, self.c.len(), &mut self.a);
        if let Some(error) = &self.errors[e] {
            self.a.iter_mut().zip(error).for_each(|(a, e)| *a -= e);
        }
        self.x[0] = self.a[0].into();
        for (x, pair) in self.x[1..].iter_mut().zip(self.a[1..].chunks_exact(2)) {
            *x = Complex::new(0.5 * pair[1], -0.5 * pair[0]);
        }
    }

    /// Coefficients of slope and offset from their jumps at the switches.
    fn transform(&mut self, system: &System, e: usize) {
        let (law, mount) = (&self.laws[e], &system.mounts()[e]);
        self.switching.find(&law.breakpoints, &self.a);
        self.slope.fill(Complex::default());
        self.offset.fill(Complex::default());
        self.edges.clear();
        let (steps, mut factor): (&[(f64, f64)], f64) = match &self.variations[e] {
            StiffnessVariation::Steps(steps) => (steps, steps.last().map_or(1.0, |s| s.1)),
            _ => (&[], 1.0),
        };
        let mut steps = steps.iter().peekable();
        let mut switches = self.switching.list().iter().peekable();
        let mut region = self.switching.first_region();
        let value = |region: usize, factor: f64| {
            (factor * law.slopes[region], factor * law.offsets[region])
        };
        let start = value(region, factor);
        let (mut last, mut now) = (0.0, start);
        loop {
            let step = steps.peek().map_or(TAU, |s| s.0);
            let switch = switches.peek().map_or(TAU, |s| s.tau);
            let tau = step.min(switch).min(TAU);
            let share = (tau - last) / TAU;
            self.slope[0] += share * now.0;
            self.offset[0] += share * now.1;
            let next = match () {
                _ if tau >= TAU => break,
                _ if switch <= step => {
                    let Some(s) = switches.next() else { break };
                    if mount.element.is_discontinuous() {
                        let impulse =
                            jump(law, s.level, s.slope) * factor * self.variations[e].at(tau);
                        self.edges.push(Edge::of_impulse(tau, impulse));
                    }
                    region = s.region;
                    value(region, factor)
                }
                _ => {
                    let Some(s) = steps.next() else { break };
                    factor = s.1;
                    value(region, factor)
                }
            };
            add_jump(&mut self.slope, tau, next.0 - now.0);
            add_jump(&mut self.offset, tau, next.1 - now.1);
            (last, now) = (tau, next);
        }
        // The end of the period is its begin.
        add_jump(&mut self.slope, 0.0, start.0 - now.0);
        add_jump(&mut self.offset, 0.0, start.1 - now.1);
        for spectrum in [&mut self.slope, &mut self.offset] {
            for (k, z) in spectrum.iter_mut().enumerate().skip(1) {
                *z *= Complex::new(0.0, -1.0 / (TAU * k as f64));
            }
        }
    }

    /// Products of slope and offset with a variation by harmonics.
    fn vary(&mut self, e: usize) {
        let StiffnessVariation::Harmonics(mean, list) = &self.variations[e] else {
            return;
        };
        for spectrum in [&mut self.slope, &mut self.offset] {
            let count = spectrum.len();
            for k in 0..count {
                let mut sum = at(spectrum, k as isize) * *mean;
                for (order, z) in list {
                    let (k, order) = (k as isize, *order as isize);
                    sum += at(spectrum, k - order) * z + at(spectrum, k + order) * z.conj();
                }
                self.product[k] = sum;
            }
            spectrum.copy_from_slice(&self.product);
        }
    }

    /// Real coefficients of the force.
    fn convolve(&mut self) {
        for k in 0..=self.harmonics {
            let mut sum = self.offset[k] + self.slope[k] * self.x[0];
            for (l, x) in self.x.iter().enumerate().skip(1) {
                let (k, l) = (k as isize, l as isize);
                sum += at(&self.slope, k - l) * x + at(&self.slope, k + l) * x.conj();
            }
            if k == 0 {
                self.c[0] = sum.re;
            } else {
                (self.c[2 * k - 1], self.c[2 * k]) = (-2.0 * sum.im, 2.0 * sum.re);
            }
        }
    }
}

impl StiffnessVariation {
    fn new(series: Option<&Periodic>, nu: usize) -> StiffnessVariation {
        let Some(series) = series.filter(|s| !s.is_constant() || s.mean() != 1.0) else {
            return StiffnessVariation::None;
        };
        match series {
            Periodic::Fourier { mean, harmonics } => {
                let one = |h: &Harmonic| (nu * h.order, Complex::new(0.5 * h.cos, -0.5 * h.sin));
                StiffnessVariation::Harmonics(*mean, harmonics.iter().map(one).collect())
            }
            _ => {
                let pieces = series.pieces();
                let copies = (0..nu).flat_map(|m| pieces.iter().map(move |p| (m, p)));
                let step =
                    |(m, p): (usize, &Piece)| ((p.begin + TAU * m as f64) / nu as f64, p.value);
                StiffnessVariation::Steps(copies.map(step).collect())
            }
        }
    }

    /// Highest order of tau.
    fn highest(&self) -> usize {
        match self {
            StiffnessVariation::Harmonics(_, list) => list.iter().map(|h| h.0).max().unwrap_or(0),
            _ => 0,
        }
    }

    /// Factor by harmonics at an instant; 1 for the others.
    fn at(&self, tau: f64) -> f64 {
        let StiffnessVariation::Harmonics(mean, list) = self else {
            return 1.0;
        };
        let wave =
            |(order, z): &(usize, Complex<f64>)| 2.0 * (z * Complex::cis(*order as f64 * tau)).re;
        mean + list.iter().map(wave).sum::<f64>()
    }
}

/// J / |x'| of a law at a breakpoint.
fn jump(law: &AffineLaw, level: usize, slope: f64) -> f64 {
    let side = |r: usize| law.slopes[r] * law.breakpoints[level] + law.offsets[r];
    (side(level + 1) - side(level)) / slope.abs()
}

/// Adds size e^(-i k tau) to every coefficient but the mean.
fn add_jump(spectrum: &mut [Complex<f64>], tau: f64, size: f64) {
    if size == 0.0 {
        return;
    }
    let turn = Complex::cis(-tau);
    let mut wave = Complex::new(size, 0.0);
    for z in &mut spectrum[1..] {
        wave *= turn;
        *z += wave;
    }
}

/// Coefficient of any order; those beyond the end are not known and not needed.
fn at(spectrum: &[Complex<f64>], k: isize) -> Complex<f64> {
    let z = spectrum.get(k.unsigned_abs()).copied().unwrap_or_default();
    if k < 0 { z.conj() } else { z }
}

/// Mean, sin 1, cos 1, ... in tau of a function of the phase nu tau.
fn spectrum(series: &Periodic, nu: usize, highest: usize) -> Vec<f64> {
    let mut list = vec![0.0; 2 * highest + 1];
    series.coefficients(nu, &mut list);
    list
}
