//! Multipliers of largest modulus by Arnoldi's method: products of the transition matrix with vectors, never the matrix.

use super::variation::{OrbitVariation, Stretches, gauss_offset};
use super::{Floquet, multipliers};
use crate::interrupt;
use crate::solve::jumps;
use crate::solve::orbit::FourierOrbit;
use crate::system::System;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;

/// Multipliers wanted at least; more where they are outside the unit circle.
const WANTED: usize = 10;
/// Vectors added to the subspace between two looks at its eigenvalues.
const GROWTH: usize = 10;
/// Residual of an eigenvalue, relative to the largest modulus or to 1, whichever is larger.
const TOLERANCE: f64 = 1e-9;

impl Floquet {
    /// The multipliers of largest modulus up to a phase: at least [`WANTED`], and all outside the unit circle.
    pub(super) fn leading(
        system: &System,
        (orbit, extrema): (&FourierOrbit, &[Vec<(f64, f64)>]),
        to: f64,
    ) -> Vec<Complex<f64>> {
        if jumps::refuse_hidden(system).is_err() {
            return Vec::new();
        }
        let stretches = Stretches::new(system, orbit, extrema, to);
        let mut flow = LeadingFlow::new(system, orbit, &stretches);
        let mut subspace = Subspace::new(2 * system.dof());
        loop {
            let is_whole = subspace.grow(&mut flow, GROWTH);
            if !subspace.is_finite() {
                return Vec::new();
            }
            if let Some(list) = subspace.converged(is_whole) {
                return list;
            }
            if is_whole {
                return Vec::new();
            }
        }
    }
}

/// exp(A h) with A of fixed slopes.
struct SlopePanel {
    /// h, in T.
    width: f64,
    df_dq: Vec<f64>,
    df_dv: Vec<f64>,
    /// Stretch whose end this panel is.
    ends: Option<usize>,
}

/// The linearised flow over one period as a sequence of exponentials.
struct LeadingFlow<'a> {
    system: &'a System,
    stretches: &'a Stretches,
    panels: Vec<SlopePanel>,
    term: Vec<f64>,
    next: Vec<f64>,
    force: Vec<f64>,
}

impl<'a> LeadingFlow<'a> {
    /// Constant slopes are one exponential a stretch; smooth ones two a panel, of fourth order without commutators:
    ///
    /// ```text
    /// exp(h (a2 A1 + a1 A2)) exp(h (a1 A1 + a2 A2)),    a1, a2 = 1/4 +- sqrt(3)/6
    /// ```
    ///
    /// A1, A2 at the two Gauss points.
    fn new(system: &'a System, orbit: &'a FourierOrbit, stretches: &'a Stretches) -> Self {
        let mut variation = OrbitVariation::new(system, orbit);
        let mut slopes = |tau: f64| -> [Vec<f64>; 2] {
            let responses = &variation.respond(tau).response;
            let partials =
                |f: fn(&crate::element::Response) -> f64| responses.iter().map(f).collect();
            [partials(|r| r.df_dq), partials(|r| r.df_dv)]
        };
        let mut panels = Vec::new();
        for (number, stretch) in stretches.list.iter().enumerate() {
            let width = stretch.panel_width();
            let h = width / orbit.omega;
            for k in 0..stretch.panels {
                let middle = stretch.begin + (k as f64 + 0.5) * width;
                let ends = (k + 1 == stretch.panels).then_some(number);
                if stretches.is_constant {
                    let [df_dq, df_dv] = slopes(middle);
                    let width = h;
                    panels.push(SlopePanel {
                        width,
                        df_dq,
                        df_dv,
                        ends,
                    });
                    continue;
                }
                let offset = gauss_offset();
                let (one, two) = (
                    slopes(middle - offset * width),
                    slopes(middle + offset * width),
                );
                let mix = |share: f64, x: &[f64], y: &[f64]| -> Vec<f64> {
                    let pairs = x.iter().zip(y);
                    pairs.map(|(x, y)| share * x + (1.0 - share) * y).collect()
                };
                for (share, ends) in [(0.5 + 2.0 * offset, None), (0.5 - 2.0 * offset, ends)] {
                    panels.push(SlopePanel {
                        width: 0.5 * h,
                        df_dq: mix(share, &one[0], &two[0]),
                        df_dv: mix(share, &one[1], &two[1]),
                        ends,
                    });
                }
            }
        }
        let buffer = || vec![0.0; 2 * system.dof()];
        LeadingFlow {
            system,
            stretches,
            panels,
            term: buffer(),
            next: buffer(),
            force: vec![0.0; system.element_count()],
        }
    }

    /// x <- Phi x.
    fn apply(&mut self, x: &mut [f64]) {
        for k in 0..self.panels.len() {
            if interrupt::is_requested() {
                return x.fill(f64::NAN);
            }
            self.exponential(k, x);
            if let Some(stretch) = self.panels[k].ends {
                for passage in &self.stretches.list[stretch].passages {
                    passage.saltate(self.system, x);
                }
            }
        }
    }

    /// x <- exp(A h) x by Taylor's series on steps short enough to lose no digit.
    fn exponential(&mut self, k: usize, x: &mut [f64]) {
        let size = self.size(k);
        let steps = (size / LONGEST).ceil().max(1.0);
        let h = self.panels[k].width / steps;
        for _ in 0..steps as usize {
            self.term.copy_from_slice(x);
            for order in 1..=MAX_TERMS {
                self.derive(k);
                let factor = h / order as f64;
                let (mut largest, mut sum) = (0.0_f64, 0.0_f64);
                for ((x, term), next) in x.iter_mut().zip(&mut self.term).zip(&self.next) {
                    *term = factor * next;
                    *x += *term;
                    largest = largest.max(term.abs());
                    sum = sum.max(x.abs());
                }
                if largest <= 0.1 * f64::EPSILON * sum || !sum.is_finite() {
                    break;
                }
            }
        }
    }

    /// Bound of |A h|: the largest column sum of its parts.
    fn size(&self, k: usize) -> f64 {
        let (system, panel) = (self.system, &self.panels[k]);
        let n = system.dof();
        let total = |list: &[(usize, f64)]| list.iter().map(|(_, x)| x.abs()).sum::<f64>();
        let (mut by_q, mut by_v) = (vec![0.0; n], vec![1.0; n]);
        for e in 0..system.element_count() {
            let kappa = total(system.stiffness_column(e));
            for (j, w) in system.element_map_row(e) {
                by_q[*j] += kappa * (panel.df_dq[e] * w).abs();
                by_v[*j] += kappa * (panel.df_dv[e] * w).abs();
            }
        }
        for (j, sum) in by_v.iter_mut().enumerate() {
            *sum += total(system.damping_column(j));
        }
        // The units of q and v are balanced by the root of the stiffness.
        let largest = |list: &[f64]| list.iter().fold(0.0_f64, |m, x| m.max(*x));
        panel.width * largest(&by_q).max(largest(&by_v))
    }

    /// next = A term.
    fn derive(&mut self, k: usize) {
        let (system, panel) = (self.system, &self.panels[k]);
        let n = system.dof();
        let (q, v) = self.term.split_at(n);
        for (e, force) in self.force.iter_mut().enumerate() {
            *force = 0.0;
            for (j, w) in system.element_map_row(e) {
                *force += w * (panel.df_dq[e] * q[*j] + panel.df_dv[e] * v[*j]);
            }
        }
        let (rate, acceleration) = self.next.split_at_mut(n);
        rate.copy_from_slice(v);
        acceleration.fill(0.0);
        for (e, force) in self.force.iter().enumerate() {
            for (i, kappa) in system.stiffness_column(e) {
                acceleration[*i] -= kappa * force;
            }
        }
        for (j, v) in v.iter().enumerate() {
            for (i, gamma) in system.damping_column(j) {
                acceleration[*i] -= gamma * v;
            }
        }
    }
}

/// |A h| of one Taylor step: terms then stay below e^2 times the sum.
const LONGEST: f64 = 2.0;
/// Terms of a Taylor step at most; 2^40 / 40! is far below rounding.
const MAX_TERMS: usize = 40;

/// An orthonormal basis of the Krylov space with Phi projected on it.
struct Subspace {
    basis: Vec<DVector<f64>>,
    /// Columns of the Hessenberg matrix, each with the entry below the diagonal last.
    columns: Vec<Vec<f64>>,
}

impl Subspace {
    /// Starts from a vector with every component, the same in every run.
    fn new(size: usize) -> Subspace {
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let first = DVector::from_fn(size, |k, _| 0.25 + (golden * (k + 1) as f64).fract());
        Subspace {
            basis: vec![first.normalize()],
            columns: Vec::new(),
        }
    }

    fn is_finite(&self) -> bool {
        self.columns.iter().flatten().all(|x| x.is_finite())
    }

    /// Adds vectors; true when the subspace is invariant or fills the space.
    fn grow(&mut self, flow: &mut LeadingFlow<'_>, count: usize) -> bool {
        for _ in 0..count {
            let mut x = self.basis[self.columns.len()].clone();
            flow.apply(x.as_mut_slice());
            let size = x.norm();
            let mut column = vec![0.0; self.basis.len()];
            // Twice is enough: what one pass leaves of the basis is rounding, which the second removes.
            for _ in 0..2 {
                for (h, v) in column.iter_mut().zip(&self.basis) {
                    let part = v.dot(&x);
                    x.axpy(-part, v, 1.0);
                    *h += part;
                }
            }
            let rest = x.norm();
            column.push(rest);
            self.columns.push(column);
            if self.columns.len() == x.len() || rest <= f64::EPSILON * size || !rest.is_finite() {
                return true;
            }
            self.basis.push(x / rest);
        }
        false
    }

    /// The leading eigenvalues, when enough of them have converged.
    fn converged(&self, is_whole: bool) -> Option<Vec<Complex<f64>>> {
        let m = self.columns.len();
        let at = |i: usize, j: usize| self.columns[j].get(i).copied().unwrap_or(0.0);
        let hessenberg = DMatrix::from_fn(m, m, |i, j| if i <= j + 1 { at(i, j) } else { 0.0 });
        let list = multipliers(&hessenberg);
        if is_whole {
            return Some(list);
        }
        let below = self.columns[m - 1][m];
        let unit = list.first()?.norm().max(1.0);
        let good = list
            .iter()
            .take_while(|mu| below * last_component(&hessenberg, **mu) <= TOLERANCE * unit)
            .count();
        let kept = wanted(&list);
        (good >= kept).then(|| list[..kept].to_vec())
    }
}

/// How many multipliers of a list by falling modulus are wanted.
pub(super) fn wanted(list: &[Complex<f64>]) -> usize {
    let outside = list.iter().filter(|mu| mu.norm() >= 1.0).count();
    let wanted = WANTED.max(outside + 2).min(list.len());
    // A pair stays together.
    let parts_pair = wanted < list.len() && list[wanted - 1].im > 0.0;
    wanted + usize::from(parts_pair)
}

/// Modulus of the last component of the eigenvector of an eigenvalue, by inverse iteration.
fn last_component(hessenberg: &DMatrix<f64>, mu: Complex<f64>) -> f64 {
    let m = hessenberg.nrows();
    let shift = mu * Complex::new(1.0 + 1e-12, 0.0) + 1e-300;
    let shifted = DMatrix::from_fn(m, m, |i, j| {
        let entry = Complex::new(hessenberg[(i, j)], 0.0);
        if i == j { entry - shift } else { entry }
    });
    let lu = shifted.lu();
    let mut x = DVector::from_element(m, Complex::new(1.0, 0.0));
    for _ in 0..2 {
        if !lu.solve_mut(&mut x) {
            return f64::INFINITY;
        }
        x /= Complex::new(x.norm(), 0.0);
    }
    x[m - 1].norm()
}
