//! The variational equation along an orbit, stretch by stretch.

use crate::numeric::periodic::Periodic;
use crate::solve::jumps;
use crate::solve::orbit::FourierOrbit;
use crate::system::{Mount, Scratch, System};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Panels a period and harmonic where A(tau) varies smoothly: the fourth-order rule then errs by about 1e-7.
const PANELS_PER_HARMONIC: usize = 8;

/// A connection passes a jump of its force.
#[derive(Debug, Clone, Copy)]
pub(super) struct JumpPassage {
    tau: f64,
    connection: usize,
    jump: f64,
    rate: f64,
}

impl JumpPassage {
    /// Phi <- S Phi.
    pub(crate) fn saltate(&self, system: &System, phi: &mut [f64]) {
        jumps::saltate(system, self.connection, self.jump, self.rate, phi);
    }
}

/// Stretch of the period on which A(tau) is smooth.
#[derive(Debug)]
pub(super) struct SmoothStretch {
    pub begin: f64,
    pub end: f64,
    /// Panels into which a rule of fixed order cuts it.
    pub panels: usize,
    /// Jumps at its end.
    pub passages: Vec<JumpPassage>,
}

impl SmoothStretch {
    pub(crate) fn panel_width(&self) -> f64 {
        (self.end - self.begin) / self.panels as f64
    }
}

/// All stretches of a period, or of its first part.
#[derive(Debug)]
pub(super) struct Stretches {
    pub list: Vec<SmoothStretch>,
    /// Whether A(tau) is constant on each.
    pub is_constant: bool,
}

impl Stretches {
    /// `to`: phase at the end.
    pub fn new(
        system: &System,
        orbit: &FourierOrbit,
        extrema: &[Vec<(f64, f64)>],
        to: f64,
    ) -> Stretches {
        let (cuts, mut passages) = cuts(system, orbit, extrema, to);
        let is_constant = system.mounts().iter().all(is_piecewise_constant);
        let panel = TAU / (PANELS_PER_HARMONIC * orbit.harmonics().max(8)) as f64;
        let mut list = Vec::with_capacity(cuts.len());
        for cut in cuts.windows(2).filter(|cut| cut[1] > cut[0]) {
            let (begin, end) = (cut[0], cut[1]);
            let panels = if is_constant {
                1
            } else {
                ((end - begin) / panel).ceil() as usize
            };
            list.push(SmoothStretch {
                begin,
                end,
                panels,
                passages: passages.extract_if(.., |p| p.tau <= end).collect(),
            });
        }
        Stretches { list, is_constant }
    }
}

/// 0, every instant where A(tau) is not smooth, the end; and the jumps of the period.
fn cuts(
    system: &System,
    orbit: &FourierOrbit,
    extrema: &[Vec<(f64, f64)>],
    to: f64,
) -> (Vec<f64>, Vec<JumpPassage>) {
    let (mut list, mut passages) = (vec![0.0, to], Vec::new());
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
                    passages.push(JumpPassage {
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
    list.retain(|tau| *tau <= to);
    list.sort_by(f64::total_cmp);
    passages.retain(|p| p.jump != 0.0);
    (list, passages)
}

/// Whether df/dq, df/dv and the stiffness variation are constant between two cuts.
pub(crate) fn is_piecewise_constant(mount: &Mount) -> bool {
    let constant = match &mount.stiffness_variation {
        None | Some(Periodic::Rectangular { .. }) => true,
        Some(series) => series.is_constant(),
    };
    constant && mount.element.is_piecewise_affine()
}

/// Offset of the two Gauss points from the middle of a panel, in its width.
pub(super) fn gauss_offset() -> f64 {
    3.0_f64.sqrt() / 6.0
}

/// A(tau) along an orbit, with its buffers.
pub(super) struct OrbitVariation<'a> {
    system: &'a System,
    orbit: &'a FourierOrbit,
    state: Vec<f64>,
    scratch: Scratch,
    dq: DMatrix<f64>,
    dv: DMatrix<f64>,
    exponent: DMatrix<f64>,
}

impl<'a> OrbitVariation<'a> {
    pub fn new(system: &'a System, orbit: &'a FourierOrbit) -> Self {
        let n = system.dof();
        let scratch = system.scratch();
        let (dq, dv) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        let mut exponent = DMatrix::zeros(2 * n, 2 * n);
        exponent.view_mut((0, n), (n, n)).fill_with_identity();
        OrbitVariation {
            system,
            orbit,
            state: vec![0.0; 2 * n],
            scratch,
            dq,
            dv,
            exponent,
        }
    }

    /// Partials of the laws at one instant.
    pub fn respond(&mut self, tau: f64) -> &Scratch {
        self.orbit.state(tau, &mut self.state);
        self.system.respond(tau, &self.state, &mut self.scratch);
        &self.scratch
    }

    /// A(tau) times `scale` into the buffer of the exponent.
    fn fill(&mut self, tau: f64, scale: f64) {
        let n = self.system.dof();
        self.respond(tau);
        self.system
            .acceleration_partials(&self.scratch, &mut self.dq, &mut self.dv);
        let exponent = &mut self.exponent;
        (0..n).for_each(|i| exponent[(i, n + i)] = scale);
        exponent.view_mut((0, 0), (n, n)).fill(0.0);
        (0..n).for_each(|j| {
            (0..n)
                .filter(|i| *i != j)
                .for_each(|i| exponent[(i, n + j)] = 0.0)
        });
        self.dq *= scale;
        self.dv *= scale;
        exponent.view_mut((n, 0), (n, n)).copy_from(&self.dq);
        exponent.view_mut((n, n), (n, n)).copy_from(&self.dv);
    }

    /// A(tau).
    pub fn coefficients(&mut self, tau: f64) -> &DMatrix<f64> {
        self.fill(tau, 1.0);
        &self.exponent
    }

    /// The exponent of a panel on which A is constant.
    pub(crate) fn midpoint(&mut self, from: f64, width: f64) -> &DMatrix<f64> {
        self.fill(from + 0.5 * width, width / self.system.omega());
        &self.exponent
    }

    /// h/2 (A1 + A2) + sqrt(3)/12 h^2 [A2, A1] at the two Gauss points.
    pub(crate) fn magnus(&mut self, from: f64, width: f64) -> &DMatrix<f64> {
        let offset = gauss_offset();
        let h = width / self.system.omega();
        self.fill(from + (0.5 - offset) * width, 1.0);
        let a1 = self.exponent.clone();
        self.fill(from + (0.5 + offset) * width, 1.0);
        let a2 = &self.exponent;
        let commutator = a2 * &a1 - &a1 * a2;
        self.exponent = (a1 + a2) * (0.5 * h) + commutator * (0.5 * offset * h * h);
        &self.exponent
    }
}
