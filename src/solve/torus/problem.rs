//! The invariant curve as a residual.

use super::ring;
use crate::error::SolveError;
use crate::solve::curve::Shots;
use crate::solve::residual::{Linearisation, Residual};
use crate::system::System;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Step of the central difference in the parameter, which is a share of its range.
const STEP: f64 = 2e-6;

/// An invariant curve.
#[derive(Debug, Clone)]
pub(crate) struct CurveOfTorus {
    /// States on the curve at equidistant angles, point by point.
    pub points: Vec<f64>,
    /// Rotation per response period, in turns.
    pub rotation: f64,
    /// Share of the parameter.
    pub lambda: f64,
    /// Phase of the response at which the map is taken.
    pub section: f64,
}

/// Collocation of an invariant curve.
pub(crate) struct TorusProblem<'a> {
    pub(super) shots: Shots<'a>,
    /// Points on the curve; odd.
    pub count: usize,
    /// Phase of the response at which the map is taken.
    pub section: f64,
    /// Size of the states: what unknowns are measured in.
    pub(super) size: f64,
    /// The curve to whose angle the angle is tied, and its derivative per turn, in sizes.
    reference: (Vec<f64>, Vec<f64>),
}

impl<'a> TorusProblem<'a> {
    /// Around a curve.
    pub fn new(shots: Shots<'a>, around: &CurveOfTorus) -> TorusProblem<'a> {
        let size = around
            .points
            .iter()
            .fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let mut this = TorusProblem {
            count: around.points.len() / shots.size(),
            section: around.section,
            shots,
            size,
            reference: (Vec::new(), Vec::new()),
        };
        this.refer_to(around);
        this
    }

    /// Ties the angle to that of a curve, which decides about points and section too.
    pub(crate) fn refer_to(&mut self, torus: &CurveOfTorus) {
        let n = self.shots.size();
        self.count = torus.points.len() / n;
        self.section = torus.section;
        let scaled: Vec<f64> = torus.points.iter().map(|x| x / self.size).collect();
        let slope = ring::derivative(&scaled, n);
        self.reference = (scaled, slope);
    }

    /// Ties the angle to that of a small curve around a point.
    pub(crate) fn refer_to_circle(&mut self, centre: &[f64], circle: &[f64]) {
        let n = self.shots.size();
        let whole: Vec<f64> = (circle.iter().enumerate())
            .map(|(k, x)| (centre[k % n] + x) / self.size)
            .collect();
        let slope = ring::derivative(&whole, n);
        let length = slope.iter().map(|x| x * x).sum::<f64>().sqrt();
        let scale = (self.count as f64).sqrt() / length;
        self.reference = (whole, slope.into_iter().map(|x| x * scale).collect());
    }

    /// The system at a share of the parameter.
    ///
    /// # Errors
    /// There is none.
    pub fn system(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.shots.system([lambda, 0.0])
    }

    /// The flow back.
    pub(crate) fn into_shots(self) -> Shots<'a> {
        self.shots
    }

    /// Unknowns of a curve.
    pub fn unknowns(&self, torus: &CurveOfTorus) -> DVector<f64> {
        let values = torus.points.iter().map(|x| x / self.size);
        DVector::from_vec(values.chain([torus.rotation]).collect())
    }

    /// The curve of unknowns.
    pub fn torus(&self, x: &DVector<f64>, lambda: f64) -> CurveOfTorus {
        let length = self.count * self.shots.size();
        CurveOfTorus {
            points: x.rows(0, length).iter().map(|x| x * self.size).collect(),
            rotation: x[length],
            lambda,
            section: self.section,
        }
    }

    /// The span of phases of the map.
    pub(super) fn span(&self) -> (f64, f64) {
        (self.section, self.section + TAU)
    }

    /// P of a state; NaN where there is none.
    pub(super) fn image(&mut self, state: &mut [f64], lambda: f64) -> Result<(), SolveError> {
        let span = self.span();
        if !self.shots.map([lambda, 0.0], span, (&mut *state, None))? {
            state.fill(f64::NAN);
        }
        Ok(())
    }
}

impl Residual for TorusProblem<'_> {
    fn dim(&self) -> usize {
        self.count * self.shots.size() + 1
    }

    fn linearise(
        &mut self,
        x: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let (n, count, dim) = (self.shots.size(), self.count, self.dim());
        let torus = self.torus(x, lambda);
        let (shift, slope) = ring::weights(count, torus.rotation);
        out.magnitude = 1.0;
        let mut jacobian = vec![0.0; dim * dim];
        let mut phi = DMatrix::identity(n, n);
        for j in 0..count {
            let mut state = torus.points[j * n..(j + 1) * n].to_vec();
            let into = (state.as_mut_slice(), Some(&mut phi));
            let is_whole = self.shots.map([lambda, 0.0], self.span(), into)?;
            // Weights of a point are those of the first one, turned.
            let turned = |list: &[f64]| -> Vec<f64> {
                (0..count).map(|k| list[(k + count - j) % count]).collect()
            };
            let (own, own_slope) = (turned(&shift), turned(&slope));
            let target = ring::value(&torus.points, n, &own);
            let rise = ring::value(&torus.points, n, &own_slope);
            for i in 0..n {
                let row = j * n + i;
                let gap = (state[i] - target[i]) / self.size;
                out.r[row] = if is_whole { gap } else { f64::NAN };
                for (k, weight) in own.iter().enumerate() {
                    jacobian[(k * n + i) * dim + row] -= weight;
                }
                for c in 0..n {
                    jacobian[(j * n + c) * dim + row] += phi[(i, c)];
                }
                jacobian[(dim - 1) * dim + row] = -rise[i] / self.size;
            }
            if out.has_parameter {
                let mut ends = [Vec::new(), Vec::new()];
                for (end, step) in ends.iter_mut().zip([-STEP, STEP]) {
                    *end = torus.points[j * n..(j + 1) * n].to_vec();
                    self.image(end, lambda + step)?;
                }
                let [low, high] = ends;
                for (i, (a, b)) in low.iter().zip(&high).enumerate() {
                    out.dr_dlambda[j * n + i] = (b - a) / (2.0 * STEP * self.size);
                }
            }
        }
        let (reference, slope) = &self.reference;
        let mut tied = 0.0;
        for (k, d) in slope.iter().enumerate() {
            tied += (x[k] - reference[k]) * d / count as f64;
            jacobian[k * dim + dim - 1] = d / count as f64;
        }
        out.r[dim - 1] = tied;
        if out.has_parameter {
            out.dr_dlambda[dim - 1] = 0.0;
        }
        let mut block = out.dr_du.block_mut(dim, (0, 0));
        for (c, column) in jacobian.chunks_exact(dim).enumerate() {
            block.column(c).copy_from_slice(column);
        }
        Ok(())
    }
}
