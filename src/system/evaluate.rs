//! Evaluation of the equation of motion at one instant.

use super::System;
use crate::element::Response;
use nalgebra::DMatrix;

/// Buffers for one evaluation; created once per solver.
#[derive(Debug, Clone)]
pub struct Scratch {
    /// Deformations W q - e.
    pub deformation: Vec<f64>,
    /// Their rates, d/d(omega_c t).
    pub rate: Vec<f64>,
    /// Response of every law, stiffness variation included.
    pub response: Vec<Response>,
}

impl System {
    /// Buffers of the right size.
    pub fn scratch(&self) -> Scratch {
        let e = self.element_count();
        Scratch {
            deformation: vec![0.0; e],
            rate: vec![0.0; e],
            response: vec![Response::default(); e],
        }
    }

    /// Deformations, their rates and the responses of all connections at `state` = [q; v; z] into `scratch`; without z every law is on
    /// its first loading.
    pub fn respond(&self, tau: f64, state: &[f64], scratch: &mut Scratch) {
        self.respond_within(None, tau, state, scratch);
    }

    /// Evaluates with the laws of one region: outside its window (low, high), one per connection, a law goes on along its
    /// tangent, f(c) + df/dq(c) (x - c), c the nearer end. A law is then smooth wherever a trial step looks. Laws with memory are left out, with
    /// the force 0: their regions are not windows.
    pub fn respond_within(
        &self,
        windows: Option<&[(f64, f64)]>,
        tau: f64,
        state: &[f64],
        scratch: &mut Scratch,
    ) {
        let n = self.dof();
        let (q, rest) = state.split_at(n);
        let (v, mut memory) = rest.split_at(n);
        let at = self.moment(tau);
        let phase = at.phase;
        for (k, mount) in self.mounts.iter().enumerate() {
            let motion = if self.is_tree {
                [q[k], v[k]]
            } else {
                self.deform(k, q, v)
            };
            let [x, rate] = mount.deformation(motion, phase, at.frequency);
            let response = match windows {
                None if !memory.is_empty() => {
                    let (own, others) = memory.split_at(mount.element.memory_count());
                    memory = others;
                    mount.respond_with([x, rate], phase, own)
                }
                None => mount.respond(x, rate, phase),
                Some(_) if mount.element.memory_count() > 0 => Response::default(),
                Some(windows) => {
                    let inside = x.clamp(windows[k].0, windows[k].1);
                    let mut response = mount.element.eval(inside, rate, phase);
                    response.f += response.df_dq * (x - inside);
                    mount.vary(response, phase)
                }
            };
            (scratch.deformation[k], scratch.rate[k], scratch.response[k]) = (x, rate, response);
        }
    }

    /// W q and W v of one connection.
    fn deform(&self, k: usize, q: &[f64], v: &[f64]) -> [f64; 2] {
        let row = self.element_map_row(k).iter();
        row.fold([0.0; 2], |[x, rate], (j, w)| {
            [x + w * q[*j], rate + w * v[*j]]
        })
    }

    /// Acceleration d^2 q / d(omega_c t)^2 = Q - Gam v - kappa f.
    ///
    /// `state` = [q; v], 2n values; `out`: n values. The responses stay in `scratch`.
    pub fn acceleration(&self, tau: f64, state: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        self.respond(tau, state, scratch);
        self.accelerate(tau, state, scratch, out);
    }

    /// The same from responses at hand in `scratch`.
    pub fn accelerate(&self, tau: f64, state: &[f64], scratch: &Scratch, out: &mut [f64]) {
        out.fill(0.0);
        let at = self.moment(tau);
        for load in &self.loads {
            let value = self.load_value((&load.series, &load.kind), tau, &at);
            for (a, d) in out.iter_mut().zip(load.direction.iter()) {
                *a += d * value;
            }
        }
        let v = &state[self.dof()..2 * self.dof()];
        for (j, v) in v.iter().enumerate() {
            for (i, g) in self.damping_column(j) {
                out[*i] -= g * v;
            }
        }
        for (k, response) in scratch.response.iter().enumerate() {
            for (i, kappa) in self.stiffness_column(k) {
                out[*i] -= kappa * response.f;
            }
        }
    }

    /// Partial derivatives of the acceleration with respect to q and v, n x n each, at the last evaluation in `scratch`.
    ///
    /// ```text
    /// d/dq = -kappa diag(df/dq) W,    d/dv = -Gam - kappa diag(df/dv) W
    /// ```
    pub fn acceleration_partials(
        &self,
        scratch: &Scratch,
        dq: &mut DMatrix<f64>,
        dv: &mut DMatrix<f64>,
    ) {
        dq.fill(0.0);
        dv.copy_from(&self.damping);
        dv.neg_mut();
        for (k, response) in scratch.response.iter().enumerate() {
            for (j, w) in self.element_map_row(k) {
                for (i, kappa) in self.stiffness_column(k) {
                    dq[(*i, *j)] -= kappa * response.df_dq * w;
                    dv[(*i, *j)] -= kappa * response.df_dv * w;
                }
            }
        }
    }
}
