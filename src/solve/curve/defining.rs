//! The defining system of a curve as a residual for the path follower.
//!
//! Unknowns x = (u / size, p1, extra); the parameter of the path is p2. Both parameters are shares of their ranges.

use super::CurveKind;
use super::conditions::{Borders, paired, shifted};
use super::shots::Shots;
use crate::error::SolveError;
use crate::solve::residual::{Linearisation, Residual};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Step of the central differences, in sizes of the state and in ranges of the parameters: rounding of the exact flow and curvature are about
/// equal there.
const STEP: f64 = 4e-6;

/// A place on or near a curve.
#[derive(Debug, Clone)]
pub(crate) struct Spot {
    /// State at phase 0.
    pub u: Vec<f64>,
    /// Shares of the parameters.
    pub p: [f64; 2],
    /// cos theta of a Neimark-Sacker event, tau of a grazing, the unfolding of a branch point.
    pub extra: f64,
}

/// What is done about transition matrices.
pub(super) enum Passes<'p> {
    /// They are computed, with the derivatives of the conditions to u and tau.
    Varied(&'p mut DMatrix<f64>),
    /// Those of the last time are kept: so near to it, over so small a distance as that from the touching, they are the same.
    Kept,
}

/// The defining system.
pub(crate) struct Defining<'a> {
    pub(super) shots: Shots<'a>,
    /// Condition along the curve.
    pub kind: CurveKind,
    pub(super) borders: Option<Borders>,
    /// Size of the state: what unknowns are measured in.
    pub(super) size: f64,
    /// Why there was no system at the last place that has none.
    pub(super) missing: Option<String>,
    pub(super) state: Vec<f64>,
    pub(super) phi: DMatrix<f64>,
    /// Transition to the touching of a grazing.
    pub(super) before: DMatrix<f64>,
}

impl<'a> Defining<'a> {
    /// A system around a spot.
    ///
    /// # Errors
    /// There is no system at the spot.
    pub fn new(shots: Shots<'a>, kind: CurveKind, spot: &Spot) -> Result<Defining<'a>, SolveError> {
        let n = shots.size();
        let largest = spot.u.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut this = Defining {
            shots,
            kind,
            borders: None,
            missing: None,
            size: if largest > 0.0 { largest } else { 1.0 },
            state: vec![0.0; n],
            phi: DMatrix::identity(n, n),
            before: DMatrix::identity(n, n),
        };
        if matches!(kind, CurveKind::Grazing { .. }) {
            let repeats = this.shots.repeats(spot.p, &spot.u)?;
            this.shots.set_repeats(repeats);
        }
        this.follow_borders(spot)?;
        Ok(this)
    }

    /// The flow, for another system.
    pub(crate) fn into_shots(mut self) -> Shots<'a> {
        self.shots.set_repeats(1);
        self.shots
    }

    /// Unknowns of a spot.
    pub fn unknowns(&self, spot: &Spot) -> DVector<f64> {
        let mut x: Vec<f64> = spot.u.iter().map(|u| u / self.size).collect();
        x.push(spot.p[0]);
        if self.kind.extras() > 0 {
            x.push(spot.extra / self.kind.extra_unit());
        }
        DVector::from_vec(x)
    }

    /// The spot of unknowns.
    pub(crate) fn spot(&self, x: &DVector<f64>, p2: f64) -> Spot {
        let n = self.shots.size();
        Spot {
            u: x.rows(0, n).iter().map(|u| u * self.size).collect(),
            p: [x[n], p2],
            extra: x.get(n + 1).map_or(0.0, |x| x * self.kind.extra_unit()),
        }
    }

    /// Place of the first parameter among the unknowns.
    pub(crate) fn first_parameter(&self) -> usize {
        self.shots.size()
    }

    /// Moves the borders to a spot.
    ///
    /// # Errors
    /// There is no system there.
    pub(crate) fn follow_borders(&mut self, spot: &Spot) -> Result<(), SolveError> {
        if matches!(self.kind, CurveKind::Grazing { .. }) {
            return Ok(());
        }
        if !self.shoot(&spot.u, spot.p)? {
            return Ok(());
        }
        let found = match self.kind {
            CurveKind::NeimarkSacker => Borders::of_pair(&self.phi, spot.extra),
            kind => Borders::of(&singular(&self.phi, kind), 1, self.borders.as_ref()),
        };
        self.borders = found.or(self.borders.take());
        Ok(())
    }

    /// P(u) and Phi; false where there is no image.
    fn shoot(&mut self, u: &[f64], p: [f64; 2]) -> Result<bool, SolveError> {
        self.state.copy_from_slice(u);
        let span = (0.0, self.shots.period());
        let into = (self.state.as_mut_slice(), Some(&mut self.phi));
        self.shots.map(p, span, into)
    }

    /// P(u) - u (+ extra b for a branch point) and the conditions; NaN where there is no image.
    fn residual(&mut self, spot: &Spot, out: &mut [f64]) -> Result<(), SolveError> {
        if matches!(self.kind, CurveKind::Grazing { .. }) {
            return self.touching(spot, Passes::Kept, out);
        }
        out.fill(f64::NAN);
        if !self.shoot(&spot.u, spot.p)? {
            return Ok(());
        }
        for (r, (image, u)) in out.iter_mut().zip(self.state.iter().zip(&spot.u)) {
            *r = (image - u) / self.size;
        }
        self.events(spot, out)
    }

    /// The conditions on the transition matrix at hand.
    fn events(&mut self, spot: &Spot, out: &mut [f64]) -> Result<(), SolveError> {
        let n = spot.u.len();
        let Some(borders) = &self.borders else {
            return Ok(());
        };
        let found = match self.kind {
            CurveKind::NeimarkSacker => borders.conditions(&paired(&self.phi, spot.extra)),
            kind => borders.conditions(&singular(&self.phi, kind)),
        };
        if let Some(found) = found {
            out[n..n + found.len()].copy_from_slice(&found);
        }
        if self.kind == CurveKind::BranchPoint {
            let (left, _) = borders.vectors();
            // With the vector of the borders, which belongs to the point before, its error would grow from point to point.
            let own = borders.left_of(&singular(&self.phi, self.kind));
            for (r, b) in out.iter_mut().zip(left.iter()) {
                *r += spot.extra * b;
            }
            if let Some(own) = own {
                out[n + 1] = own.dot(&self.slope(spot, 0)?) / self.size;
            }
        }
        Ok(())
    }

    /// dP/dp of one parameter.
    pub(super) fn slope(&mut self, spot: &Spot, which: usize) -> Result<DVector<f64>, SolveError> {
        let mut ends = [spot.p, spot.p];
        ends[0][which] -= STEP;
        ends[1][which] += STEP;
        let mut images = [Vec::new(), Vec::new()];
        for (image, p) in images.iter_mut().zip(ends) {
            *image = spot.u.clone();
            if !self
                .shots
                .map(p, (0.0, TAU), (image.as_mut_slice(), None))?
            {
                image.fill(f64::NAN);
            }
        }
        let [a, b] = images.map(DVector::from_vec);
        Ok((b - a) / (2.0 * STEP))
    }

    /// Residuals on both sides of an unknown, or of p2 behind the last one, over twice the step.
    fn difference(
        &mut self,
        spot: &Spot,
        which: usize,
        out: &mut [Vec<f64>; 2],
    ) -> Result<(), SolveError> {
        let n = spot.u.len();
        for (values, step) in out.iter_mut().zip([-STEP, STEP]) {
            let mut moved = spot.clone();
            match which {
                k if k < n => moved.u[k] += step * self.size,
                k if k == n => moved.p[0] += step,
                k if k == n + self.kind.extras() => moved.extra += step,
                _ => moved.p[1] += step,
            }
            match self.residual(&moved, values) {
                // Beyond the border of the model the difference is one-sided.
                Err(SolveError::NoSystem { .. }) => self.residual(spot, values)?,
                done => done?,
            }
        }
        Ok(())
    }

    /// Width of the difference of an unknown: half of it where one side has no system.
    fn width(&mut self, spot: &Spot, which: usize) -> f64 {
        let n = spot.u.len();
        let k = match which {
            k if k < n => return 2.0 * STEP,
            k if k == n => 0,
            k if k == n + self.kind.extras() => return 2.0 * STEP,
            _ => 1,
        };
        let exists = |step: f64, this: &mut Self| {
            let mut p = spot.p;
            p[k] += step;
            !matches!(this.shots.system(p), Err(SolveError::NoSystem { .. }))
        };
        let sides = [-STEP, STEP].map(|step| exists(step, self));
        STEP * sides.iter().filter(|is_there| **is_there).count() as f64
    }
}

/// The matrix that is singular along a curve.
fn singular(phi: &DMatrix<f64>, kind: CurveKind) -> DMatrix<f64> {
    match kind {
        CurveKind::PeriodDoubling => shifted(phi, 1.0),
        _ => shifted(phi, -1.0),
    }
}

impl Residual for Defining<'_> {
    fn dim(&self) -> usize {
        self.shots.size() + 1 + self.kind.extras()
    }

    fn linearise(
        &mut self,
        x: &DVector<f64>,
        p2: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        match self.fill(x, p2, out) {
            // A trial step beyond the model is a step that fails.
            Err(SolveError::NoSystem { reason }) => {
                out.r.fill(f64::NAN);
                self.missing = Some(reason);
                Ok(())
            }
            done => done,
        }
    }
}

impl Defining<'_> {
    /// The residual with its derivatives.
    fn fill(
        &mut self,
        x: &DVector<f64>,
        p2: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let (n, dim) = (self.shots.size(), self.dim());
        let spot = self.spot(x, p2);
        let mut values = vec![f64::NAN; dim];
        let is_grazing = matches!(self.kind, CurveKind::Grazing { .. });
        let mut partials = DMatrix::zeros(2, n + 1);
        match is_grazing {
            true => self.touching(&spot, Passes::Varied(&mut partials), &mut values)?,
            false => self.residual(&spot, &mut values)?,
        }
        out.r.copy_from_slice(&values);
        out.magnitude = 1.0;
        let phi = self.phi.clone();
        let mut sides = [vec![0.0; dim], vec![0.0; dim]];
        let columns = dim + usize::from(out.has_parameter);
        for k in 0..columns {
            let is_known = is_grazing && (k < n || k == n + 1);
            let mut column = vec![0.0; dim];
            if !is_known {
                self.difference(&spot, k, &mut sides)?;
                let width = self.width(&spot, k);
                for (c, (a, b)) in column.iter_mut().zip(sides[0].iter().zip(&sides[1])) {
                    *c = (b - a) / width;
                }
            }
            if k < n {
                for i in 0..n {
                    column[i] = phi[(i, k)] - f64::from(i == k);
                }
            }
            if is_known {
                let place = if k < n { k } else { n };
                column[n] = partials[(0, place)];
                column[n + 1] = partials[(1, place)];
            }
            if k == n + 1 && k < dim {
                let unit = self.kind.extra_unit();
                column.iter_mut().for_each(|slope| *slope *= unit);
            }
            match k < dim {
                true => out
                    .dr_du
                    .block_mut(dim, (0, 0))
                    .column(k)
                    .copy_from_slice(&column),
                false => out.dr_dlambda.copy_from_slice(&column),
            }
        }
        Ok(())
    }
}
