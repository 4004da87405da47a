//! Floquet multipliers from the variational equation along a periodic orbit.

use super::jumps;
use super::orbit::FourierOrbit;
use crate::numeric::exponential::exponential;
use crate::numeric::periodic::Periodic;
use crate::system::{Mount, Scratch, System};
use nalgebra::{DMatrix, Schur};
use num_complex::Complex;
use std::f64::consts::TAU;

/// Panels a period and harmonic where A(tau) varies smoothly: the fourth-order rule then errs by about 1e-7.
const PANELS_PER_HARMONIC: usize = 8;

/// State-transition matrix over one response period, in (q, v), 2n x 2n; the system stands at the orbit's frequency.
///
///     dPhi/dT = A Phi,    A = [[0, I], [-kappa diag(df/dq) W, -Gam - kappa diag(df/dv) W]]
///
/// The period is cut at every passage of a breakpoint and every kink of the stiffness variation. Between two cuts A is
/// constant for piecewise-affine laws and one matrix exponential is exact; elsewhere Magnus' fourth-order rule on panels
/// keeps det Phi = exp(integral of trace A) to rounding. A force that jumps at a breakpoint adds its saltation matrix
/// ([`jumps`]), a continuous one needs none. NaN where a law has hidden jumps: nobody knows.
///
/// Rook & Singh (1995), eqs. (17), (18), in d/dT instead of d/dtau.
pub fn monodromy(system: &System, orbit: &FourierOrbit) -> DMatrix<f64> {
    monodromy_between(system, orbit, &orbit.extrema(system))
}

/// The same with the extrema of the deformations already known, one list a connection.
pub fn monodromy_between(
    system: &System,
    orbit: &FourierOrbit,
    extrema: &[Vec<(f64, f64)>],
) -> DMatrix<f64> {
    let size = 2 * system.dof();
    if jumps::refuse_hidden(system).is_err() {
        return DMatrix::from_element(size, size, f64::NAN);
    }
    let (cuts, mut passages) = cuts(system, orbit, extrema);
    let is_constant = system.mounts().iter().all(is_piecewise_constant);
    let panel = TAU / (PANELS_PER_HARMONIC * orbit.harmonics().max(8)) as f64;
    let mut variation = Variation::new(system, orbit);
    let mut phi = DMatrix::identity(size, size);
    for cut in cuts.windows(2) {
        let (begin, end) = (cut[0], cut[1]);
        if end <= begin {
            continue;
        }
        let panels = if is_constant {
            1
        } else {
            ((end - begin) / panel).ceil() as usize
        };
        let width = (end - begin) / panels as f64;
        for k in 0..panels {
            let from = begin + k as f64 * width;
            let exponent = if is_constant {
                variation.midpoint(from, width)
            } else {
                variation.magnus(from, width)
            };
            phi = exponential(&exponent) * phi;
        }
        for passage in passages.extract_if(.., |p| p.tau <= end) {
            let Passage {
                connection,
                jump,
                rate,
                ..
            } = passage;
            jumps::saltate(system, connection, jump, rate, phi.as_mut_slice());
        }
    }
    phi
}

/// QR sweeps allowed for the eigenvalues of a transition matrix.
const MAX_SWEEPS: usize = 10_000;

/// Eigenvalues of a state-transition matrix by falling modulus, the member of a pair with positive imaginary part first; none
/// when the matrix has overflown or its eigenvalues do not converge.
pub fn multipliers(phi: &DMatrix<f64>) -> Vec<Complex<f64>> {
    if phi.iter().any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let Some(schur) = Schur::try_new(phi.clone(), f64::EPSILON, MAX_SWEEPS) else {
        return Vec::new();
    };
    let list = schur.complex_eigenvalues();
    by_falling_modulus(list.iter().map(|mu| Complex::new(mu.re, mu.im)).collect())
}

/// Multipliers by falling modulus, the member of a pair with positive imaginary part first.
pub fn by_falling_modulus(mut list: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    let key = |mu: &Complex<f64>| (mu.norm(), mu.re, mu.im);
    list.sort_by(|a, b| {
        key(b)
            .partial_cmp(&key(a))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    // Rounding may order the members of a pair either way.
    for k in 1..list.len() {
        if list[k].im > 0.0 && (list[k] - list[k - 1].conj()).norm() <= 1e-12 * list[k].norm() {
            list.swap(k - 1, k);
        }
    }
    list
}

/// A connection passes a jump of its force.
struct Passage {
    tau: f64,
    connection: usize,
    jump: f64,
    rate: f64,
}

/// 0, every instant where A(tau) is not smooth, 2 pi; and the jumps among them.
fn cuts(
    system: &System,
    orbit: &FourierOrbit,
    extrema: &[Vec<(f64, f64)>],
) -> (Vec<f64>, Vec<Passage>) {
    let (mut list, mut passages) = (vec![0.0, TAU], Vec::new());
    for (k, mount) in system.mounts().iter().enumerate() {
        if !extrema[k].is_empty() {
            let deformation = orbit.deformation(system, k);
            for level in mount.element.breakpoints() {
                for tau in deformation.crossings(level, &extrema[k]) {
                    list.push(tau);
                    if !mount.element.is_discontinuous() {
                        continue;
                    }
                    let rate = orbit.omega * deformation.at(tau)[1];
                    let phase = orbit.subharmonic as f64 * tau;
                    // The period's begin is its end.
                    let tau = if tau > 0.0 { tau } else { TAU };
                    passages.push(Passage {
                        tau,
                        connection: k,
                        jump: jumps::size(mount, level, rate, phase),
                        rate,
                    });
                }
            }
        }
        for series in [&mount.stiffness_variation, &mount.transmission_error]
            .into_iter()
            .flatten()
        {
            let nu = orbit.subharmonic;
            let copies = (0..nu).flat_map(|m| {
                series
                    .kinks()
                    .into_iter()
                    .map(move |x| (x + TAU * m as f64) / nu as f64)
            });
            list.extend(copies);
        }
    }
    list.sort_by(f64::total_cmp);
    passages.retain(|p| p.jump != 0.0);
    (list, passages)
}

/// Whether df/dq, df/dv and the stiffness variation are constant between two cuts.
pub fn is_piecewise_constant(mount: &Mount) -> bool {
    let constant = match &mount.stiffness_variation {
        None | Some(Periodic::Rectangular { .. }) => true,
        Some(series) => series.is_constant(),
    };
    constant && mount.element.is_piecewise_affine()
}

/// A(tau) along an orbit, with its buffers.
struct Variation<'a> {
    system: &'a System,
    orbit: &'a FourierOrbit,
    state: Vec<f64>,
    scratch: Scratch,
    dq: DMatrix<f64>,
    dv: DMatrix<f64>,
}

impl<'a> Variation<'a> {
    fn new(system: &'a System, orbit: &'a FourierOrbit) -> Self {
        let n = system.dof();
        let scratch = system.scratch();
        let (dq, dv) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        Variation {
            system,
            orbit,
            state: vec![0.0; 2 * n],
            scratch,
            dq,
            dv,
        }
    }

    fn matrix(&mut self, tau: f64) -> DMatrix<f64> {
        let n = self.system.dof();
        self.orbit.state(tau, &mut self.state);
        self.system.respond(tau, &self.state, &mut self.scratch);
        self.system
            .acceleration_partials(&self.scratch, &mut self.dq, &mut self.dv);
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        a.view_mut((0, n), (n, n)).fill_with_identity();
        a.view_mut((n, 0), (n, n)).copy_from(&self.dq);
        a.view_mut((n, n), (n, n)).copy_from(&self.dv);
        a
    }

    fn midpoint(&mut self, from: f64, width: f64) -> DMatrix<f64> {
        self.matrix(from + 0.5 * width) * (width / self.system.omega())
    }

    /// h/2 (A1 + A2) + sqrt(3)/12 h^2 [A2, A1] at the two Gauss points.
    fn magnus(&mut self, from: f64, width: f64) -> DMatrix<f64> {
        let offset = 3.0_f64.sqrt() / 6.0;
        let a1 = self.matrix(from + (0.5 - offset) * width);
        let a2 = self.matrix(from + (0.5 + offset) * width);
        let h = width / self.system.omega();
        let commutator = &a2 * &a1 - &a1 * &a2;
        (a1 + a2) * (0.5 * h) + commutator * (0.5 * offset * h * h)
    }
}
