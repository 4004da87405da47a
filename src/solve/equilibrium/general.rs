//! Equilibria without an energy, by Newton's iteration: kappa f(W q - mean(e)) = mean load.

use super::graph::{Graph, middle};
use super::{Equilibrium, NoEquilibrium};
use crate::error::SolveError;
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::residual::{Linearisation, Residual};
use crate::system::System;
use nalgebra::DVector;

/// Springs to the middle of every gap, relative to the reference stiffness, removed step by step.
const SOFTENING: [f64; 7] = [1.0, 1e-1, 1e-2, 1e-4, 1e-7, 1e-11, 0.0];

/// Misfit that a result may have, relative to the terms that cancel in it.
const BALANCED: f64 = 1e-8;

/// The statics of a system with auxiliary springs; the parameter is their stiffness.
struct Statics<'a> {
    system: &'a System,
    graphs: &'a [Graph<'a>],
    error: &'a [f64],
    middle: Vec<f64>,
    load: DVector<f64>,
}

impl Statics<'_> {
    fn deformation(&self, q: &DVector<f64>) -> Vec<f64> {
        let along = self.system.element_map() * q;
        along.iter().zip(self.error).map(|(x, e)| x - e).collect()
    }
}

impl Residual for Statics<'_> {
    fn dim(&self) -> usize {
        self.load.len()
    }

    fn linearise(
        &mut self,
        q: &DVector<f64>,
        auxiliary: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let n = self.dim();
        out.r.copy_from(&-&self.load);
        out.dr_dlambda.fill(0.0);
        out.magnitude = self.load.amax();
        (0..n * n).for_each(|k| out.dr_du[(k % n, k / n)] = 0.0);
        for (k, x) in self.deformation(q).into_iter().enumerate() {
            let (f, slope, _) = self.graphs[k].ramped(x);
            let pull = x - self.middle[k];
            for (i, kappa) in self.system.stiffness_column(k) {
                out.r[*i] += kappa * (f + auxiliary * pull);
                out.dr_dlambda[*i] += kappa * pull;
                out.magnitude = out.magnitude.max((kappa * f).abs());
                for (j, w) in self.system.element_map_row(k) {
                    out.dr_du[(*i, *j)] += kappa * (slope + auxiliary) * w;
                }
            }
        }
        Ok(())
    }
}

/// The equilibrium on which softer and softer auxiliary springs lead.
///
/// # Errors
/// [`NoEquilibrium::NotFound`] where the iteration does not converge.
pub(super) fn solve(
    system: &System,
    graphs: &[Graph<'_>],
    error: &[f64],
) -> Result<Equilibrium, NoEquilibrium> {
    let flat = |graph: &Graph<'_>| {
        let (low, high) = graph.flat_stretch(0.0);
        middle(low, high)
    };
    let mut problem = Statics {
        system,
        graphs,
        error,
        middle: graphs.iter().map(flat).collect(),
        load: system.mean_load(),
    };
    let options = NewtonOptions {
        max_iterations: 200,
        min_damping: 1e-9,
        ..NewtonOptions::default()
    };
    let mut newton = Newton::new(&problem.structure(), options);
    let mut q = DVector::zeros(system.dof());
    for auxiliary in SOFTENING {
        let mut next = q.clone();
        let outcome = newton.solve(&mut problem, &mut next, auxiliary);
        if outcome.is_ok_and(|o| o.is_converged()) {
            q = next;
        } else if auxiliary > 0.0 {
            return Err(NoEquilibrium::NotFound);
        }
    }
    let is_sound = newton.visit(&mut problem, &q, 0.0).is_ok();
    if !is_sound || newton.linearisation().norm() > BALANCED {
        return Err(NoEquilibrium::NotFound);
    }
    let is_unique = newton.solve_linear(&mut problem.load.clone()) != 0;
    let deformation = problem.deformation(&q);
    let places: Vec<(f64, f64, bool)> = (graphs.iter().zip(&deformation))
        .map(|(graph, x)| graph.ramped(*x))
        .collect();
    Ok(Equilibrium {
        q,
        force: places.iter().map(|p| p.0).collect(),
        slope: places.iter().map(|p| (!p.2).then_some(p.1)).collect(),
        flank: (graphs.iter().zip(&deformation).zip(&places))
            .map(|((graph, x), p)| graph.flank(*x, p.0))
            .collect(),
        deformation,
        is_unique,
    })
}
