//! Coefficient after coefficient: the equation of motion itself.

use super::acting::Acting;
use super::decay::DecayEnd;
use super::regions::Regions;
use super::series::{MotionSeries, Span, add};
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::system::System;

impl MotionSeries {
    /// Coefficients of q and of the deformations from a state [q; v].
    ///
    /// ```text
    /// (k + 2)(k + 1) q_{k+2} = h^2 Q_k - h Gam (k + 1) q_{k+1} - h^2 kappa (slope x_k + offset [k = 0] + forces_k)
    /// ```
    pub(crate) fn expand(
        &mut self,
        system: &System,
        (acting, regions): (&mut Acting, &Regions),
        span: Span,
        state: &[f64],
    ) {
        let at = self.instant(system, span);
        self.loads.expand(&at, &mut self.load);
        for (load, c) in self.load.iter_mut().zip(&self.constant) {
            load[0] += c;
        }
        if let Some(errors) = &self.errors {
            errors.expand(&at, &mut self.error);
            for s in &self.stiffness {
                let factor = s.value * self.slope[s.column];
                add(&mut self.load[s.row], factor, &self.error[s.column]);
            }
        }
        if let Some(holding) = &mut self.holding {
            let errors = self.errors.is_some().then_some(self.error.as_slice());
            holding.project_loads(&mut self.load, errors);
        }
        if acting.list.is_empty() {
            self.count = COUNT;
            self.recur(state);
        } else {
            self.count = self.terms;
            acting.expand(&at);
            self.recur_acting(system, (acting, regions), span, state);
        }
        if self.errors.is_some() {
            for (x, error) in self.deformation.iter_mut().zip(&self.error) {
                *x = error.map(|e| -e);
            }
            for w in &self.map {
                add(&mut self.deformation[w.row], w.value, &self.q[w.column]);
            }
        }
        if let Some(holding) = &mut self.holding {
            let forces = acting.list.iter().map(|p| acting.whole_force(*p));
            holding.close(&self.q, self.unit, forces);
        }
    }

    pub(super) fn recur(&mut self, state: &[f64]) {
        match state.len() / 2 {
            1 => self.recur_small::<1>(state),
            2 => self.recur_small::<2>(state),
            3 => self.recur_small::<3>(state),
            4 => self.recur_small::<4>(state),
            _ => self.recur_sparse(state),
        }
    }

    /// The recursion for N coordinates in arrays that the compiler can unroll.
    fn recur_small<const N: usize>(&mut self, state: &[f64]) {
        let damping: [[f64; N]; N] = self.damping.rows();
        let stiffness: [[f64; N]; N] = self.coupled.rows();
        let load: &[Polynomial; N] = self.load.first_chunk().expect("one per coordinate");
        let q: &mut [Polynomial; N] = self.q.first_chunk_mut().expect("one per coordinate");
        // q_k and (k + 1) q_{k+1}
        let (mut now, mut rate) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (now[i], rate[i]) = (state[i], state[N + i] * self.unit);
            (q[i][0], q[i][1]) = (now[i], rate[i]);
        }
        for k in 0..COUNT - 2 {
            let mut next = [0.0; N];
            for i in 0..N {
                // The damping last: the other terms do not wait for the step before.
                let mut sum = load[i][k];
                for j in 0..N {
                    sum -= stiffness[i][j] * now[j];
                }
                sum *= RECIPROCAL[k + 1];
                for j in 0..N {
                    sum -= damping[i][j] * RECIPROCAL[k + 1] * rate[j];
                }
                next[i] = sum;
                q[i][k + 2] = sum * RECIPROCAL[k + 2];
            }
            for i in 0..N {
                now[i] = q[i][k + 1];
            }
            rate = next;
        }
    }

    fn recur_sparse(&mut self, state: &[f64]) {
        let q = &mut self.q;
        let n = q.len();
        for (i, q) in q.iter_mut().enumerate() {
            (q[0], q[1]) = (state[i], state[n + i] * self.unit);
        }
        for k in 0..COUNT - 2 {
            let order = (k + 1) as f64;
            for (q, load) in q.iter_mut().zip(&self.load) {
                q[k + 2] = load[k];
            }
            for d in self.damping.entries() {
                q[d.row][k + 2] -= d.value * order * q[d.column][k + 1];
            }
            for c in self.coupled.entries() {
                q[c.row][k + 2] -= c.value * q[c.column][k];
            }
            for q in q.iter_mut() {
                q[k + 2] *= RECIPROCAL[k + 1] * RECIPROCAL[k + 2];
            }
        }
    }

    /// The recursion with forces that are made beside it; it ends where the terms no longer count in the time that remains.
    pub(super) fn recur_acting(
        &mut self,
        system: &System,
        (acting, regions): (&mut Acting, &Regions),
        span: Span,
        state: &[f64],
    ) {
        let n = self.q.len();
        for (i, q) in self.q.iter_mut().enumerate() {
            (q[0], q[1]) = (state[i], state[n + i] * self.unit);
        }
        for place in 0..acting.list.len() {
            let part = acting.list[place];
            if acting.evolves(part) {
                acting.remember(part, regions.parts()[part].z);
            }
        }
        let square = self.unit * self.unit;
        let mut ending = DecayEnd::new(span.remaining, self.control);
        for k in 0..self.terms - 2 {
            let order = (k + 1) as f64;
            let mut memory = 0.0_f64;
            for (q, load) in self.q.iter_mut().zip(&self.load) {
                q[k + 2] = load[k];
            }
            for d in self.damping.entries() {
                self.q[d.row][k + 2] -= d.value * order * self.q[d.column][k + 1];
            }
            for c in self.coupled.entries() {
                self.q[c.row][k + 2] -= c.value * self.q[c.column][k];
            }
            for place in 0..acting.list.len() {
                let part = acting.list[place];
                let e = acting.connection(part);
                let motion = self.motion(system, e, k);
                let force = square * acting.force(part, regions.piece(part), k, motion);
                let column = match &self.holding {
                    None => system.stiffness_column(e),
                    Some(holding) => holding.column(e),
                };
                for (i, kappa) in column {
                    self.q[*i][k + 2] -= kappa * force;
                }
                memory = memory.max(acting.next_memory(part, k).abs());
            }
            let mut largest = memory;
            for q in &mut self.q {
                q[k + 2] *= RECIPROCAL[k + 1] * RECIPROCAL[k + 2];
                largest = largest.max(q[k + 2].abs());
            }
            if ending.is_reached(k, &self.q, largest) && k + 3 >= span.least {
                self.count = k + 3;
                break;
            }
        }
        for q in &mut self.q {
            q[self.count..].fill(0.0);
        }
        acting.close_memories(self.count);
    }
}

/// 1 / k.
pub(super) const RECIPROCAL: Polynomial = {
    let mut list = [0.0; COUNT];
    let mut k = 1;
    while k < COUNT {
        list[k] = 1.0 / k as f64;
        k += 1;
    }
    list
};
