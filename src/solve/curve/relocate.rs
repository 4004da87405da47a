//! A point of a curve located again along a branch of orbits in the first parameter alone, by plain tests: determinants, moduli of
//! multipliers, extrema, turning points. Nothing of the defining system of the curve is used.

use super::conditions::shifted;
use super::defining::Spot;
use super::seek::Closing;
use super::shots::Shots;
use super::{CurveKind, Defining};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::floquet;
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::residual::{Linearisation, Residual};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use std::f64::consts::TAU;

/// Half widths in which an event is bracketed, in ranges of the first parameter: the next one is tried where there is no change of sign,
/// or that of another event beside this one, as near a corner of the curve.
const WIDTHS: [f64; 4] = [1e-4, 1e-5, 1e-6, 1e-3];
/// Distance within which it is this event.
const OWN: f64 = 1e-8;
/// Half widths of a fold in its coordinate, in sizes of the state.
const BENDS: [f64; 3] = [1e-3, 1e-4, 1e-2];
/// Width of a location, in half widths.
const WIDTH: f64 = 1e-9;
/// Corrector of the orbits.
const NEWTON: NewtonOptions = NewtonOptions {
    tolerance: 1e-12,
    step_tolerance: 1e-11,
    max_iterations: 20,
    min_damping: 1.0 / 64.0,
};
/// Distance from a touching, in sizes, of the states from which orbits beside it are sought.
const CLEAR: f64 = 1e-3;
/// Steps by which a touching is approached from its untouched side.
const SECANTS: usize = 12;
/// Share of such a step that is taken: behind a touching of a stop there may be no orbit.
const BEFORE: f64 = 0.999;
/// Distance of an extremum from its breakpoint, in sizes, at which the approach is over.
const TOUCHED: f64 = 1e-11;

/// The zero of a function on [-1, 1]: `None` where the ends show none, `Some(Ok(None))` where it is lost on the way.
///
/// The function fails with an error, or without one where it has no value. An end beyond the model is an end without a value; other errors,
/// interruptions among them, are handed on.
fn crossing(
    mut value: impl FnMut(f64) -> Result<f64, Option<SolveError>>,
) -> Option<Result<Option<f64>, SolveError>> {
    let mut ends = [0.0; 2];
    for (end, place) in ends.iter_mut().zip([-1.0, 1.0]) {
        *end = match value(place) {
            Ok(found) => found,
            Err(None | Some(SolveError::NoSystem { .. })) => return None,
            Err(Some(error)) => return Some(Err(error)),
        };
    }
    let [a, b] = ends;
    let is_bracketed = a * b < 0.0;
    is_bracketed.then(
        || match roots::bracketed(value, (-1.0, a), (1.0, b), WIDTH) {
            Ok(found) => Ok(Some(found.root)),
            Err(Some(error)) => Err(error),
            Err(None) => Ok(None),
        },
    )
}

impl Defining<'_> {
    /// The share of the first parameter at which a branch with the second one fixed meets the event of a spot; `None` where the
    /// branch shows none within reach.
    ///
    /// # Errors
    /// An interruption.
    pub(crate) fn relocated(&mut self, spot: &Spot) -> Result<Option<f64>, SolveError> {
        let found = match self.kind {
            CurveKind::Fold => self.turning(spot),
            CurveKind::Grazing { .. } => self.at_touching(spot),
            _ => self.passing(spot),
        };
        match found {
            // The model may end beside the spot.
            Err(SolveError::NoSystem { .. }) => Ok(None),
            found => found,
        }
    }

    /// Where a multiplier passes the circle.
    fn passing(&mut self, spot: &Spot) -> Result<Option<f64>, SolveError> {
        let mut other = None;
        for width in WIDTHS {
            let mut start = spot.u.clone();
            let mut value = |share: f64| {
                let p = [spot.p[0] + width * share, spot.p[1]];
                let orbit = closed(&mut self.shots, p, &start).map_err(Some)?;
                let (u, phi) = orbit.ok_or(None)?;
                start = u;
                Ok(test(self.kind, &phi, spot.extra))
            };
            let Some(found) = crossing(&mut value) else {
                continue;
            };
            match found? {
                Some(root) if (width * root).abs() < OWN => {
                    return Ok(Some(spot.p[0] + width * root));
                }
                found => other = other.or(found.map(|root| spot.p[0] + width * root)),
            }
        }
        Ok(other)
    }

    /// Where the branch turns: the first parameter against one coordinate.
    fn turning(&mut self, spot: &Spot) -> Result<Option<f64>, SolveError> {
        let Some((_, phi)) = imaged(&mut self.shots, spot.p, &spot.u)? else {
            return Ok(None);
        };
        let Some((_, along)) = self.vectors(&shifted(&phi, -1.0)) else {
            return Ok(None);
        };
        let pinned = along.icamax();
        let slope = self.slope(spot, 0)?;
        for bend in BENDS.map(|b| b * self.size) {
            let mut last = None;
            let mut value = |share: f64| {
                let level = spot.u[pinned] + bend * share;
                let mut problem = Pinned {
                    shots: &mut self.shots,
                    pinned,
                    level,
                    second: spot.p[1],
                    slope: &slope,
                    phi: phi.clone(),
                };
                let found = problem.solved(spot).map_err(Some)?;
                let (p, rise) = found.ok_or(None)?;
                last = Some(p);
                Ok(rise)
            };
            if let Some(found) = crossing(&mut value) {
                return Ok(found?.and(last));
            }
        }
        Ok(None)
    }

    /// Where an extremum comes to its breakpoint, from the side on which it does not touch.
    fn at_touching(&mut self, spot: &Spot) -> Result<Option<f64>, SolveError> {
        let CurveKind::Grazing {
            connection,
            breakpoint,
        } = self.kind
        else {
            return Ok(None);
        };
        let of = (connection, breakpoint, spot.extra);
        for width in [-WIDTHS[0], WIDTHS[0]] {
            let (mut a, mut b) = (width, 0.5 * width);
            let (Some(mut at_a), Some(mut at_b)) = (
                self.clearance((spot, a), of)?,
                self.clearance((spot, b), of)?,
            ) else {
                continue;
            };
            if at_a <= 0.0 || at_b <= 0.0 || at_b >= at_a {
                continue;
            }
            for _ in 0..SECANTS {
                let root = b - at_b * (b - a) / (at_b - at_a);
                if at_b.abs() < TOUCHED * self.size || root == b {
                    return Ok(Some(spot.p[0] + root));
                }
                let next = b + BEFORE * (root - b);
                let Some(at_next) = self.clearance((spot, next), of)? else {
                    return Ok(None);
                };
                (a, at_a, b, at_b) = (b, at_b, next, at_next);
            }
        }
        Ok(None)
    }

    /// Distance of the extremum nearest to a phase from its breakpoint, positive where it does not touch.
    fn clearance(
        &mut self,
        (spot, away): (&Spot, f64),
        (connection, breakpoint, tau): (usize, usize, f64),
    ) -> Result<Option<f64>, SolveError> {
        let p = [spot.p[0] + away, spot.p[1]];
        // From the touching orbit itself the corrector may come to what a stop throws back.
        let clear = self.untouched(spot, CLEAR)?;
        let Some((u, _)) = closed(&mut self.shots, p, &clear.u)? else {
            return Ok(None);
        };
        let list = super::seek::extrema(&mut self.shots, (p, &u))?;
        let Some((extrema, levels)) = list.map(|mut l| l.swap_remove(connection)) else {
            return Ok(None);
        };
        let gap = |t: f64| {
            let gap = (t - tau).rem_euclid(TAU);
            gap.min(TAU - gap)
        };
        let nearest = extrema
            .iter()
            .enumerate()
            .skip(1)
            .min_by(|a, b| gap(a.1.0).total_cmp(&gap(b.1.0)));
        let (Some((k, (_, x))), Some(level)) = (nearest, levels.get(breakpoint)) else {
            return Ok(None);
        };
        // A maximum has lower extrema beside it.
        let is_maximum = extrema[k - 1].1 < *x;
        Ok(Some(if is_maximum { level - x } else { x - level }))
    }
}

/// The test that changes its sign at an event.
fn test(kind: CurveKind, phi: &DMatrix<f64>, cosine: f64) -> f64 {
    match kind {
        CurveKind::PeriodDoubling => shifted(phi, 1.0).determinant(),
        CurveKind::NeimarkSacker => {
            let wanted = Complex::from_polar(1.0, cosine.clamp(-1.0, 1.0).acos());
            let list = floquet::multipliers(phi);
            let pairs = list.iter().filter(|mu| mu.im > 0.0);
            let nearest = pairs.min_by(|a, b| {
                let gap = |mu: &Complex<f64>| (*mu - wanted).norm();
                gap(a).total_cmp(&gap(b))
            });
            nearest.map_or(f64::NAN, |mu| mu.norm() - 1.0)
        }
        _ => shifted(phi, -1.0).determinant(),
    }
}

/// A state with its transition matrix.
type Imaged = Option<(Vec<f64>, DMatrix<f64>)>;

fn imaged(shots: &mut Shots<'_>, p: [f64; 2], u: &[f64]) -> Result<Imaged, SolveError> {
    let (mut state, mut phi) = (u.to_vec(), DMatrix::identity(u.len(), u.len()));
    let is_whole = shots.map(p, (0.0, TAU), (&mut state, Some(&mut phi)))?;
    Ok(is_whole.then_some((state, phi)))
}

/// The periodic orbit near a state, with its transition matrix.
fn closed(shots: &mut Shots<'_>, p: [f64; 2], u: &[f64]) -> Result<Imaged, SolveError> {
    let mut problem = Closing::new(shots, p);
    let mut newton = Newton::new(&problem.structure(), NEWTON);
    let mut x = DVector::from_column_slice(u);
    if !newton.solve(&mut problem, &mut x, 0.0)?.is_converged() {
        return Ok(None);
    }
    let found = imaged(shots, p, x.as_slice())?;
    Ok(found.map(|(_, phi)| (x.as_slice().to_vec(), phi)))
}

/// Periodic orbits with one coordinate given and the first parameter free.
struct Pinned<'s, 'a> {
    shots: &'s mut Shots<'a>,
    pinned: usize,
    level: f64,
    second: f64,
    /// dP/dp of the first parameter.
    slope: &'s DVector<f64>,
    phi: DMatrix<f64>,
}

impl Pinned<'_, '_> {
    /// The first parameter of the orbit, and how it rises with the coordinate.
    fn solved(&mut self, spot: &Spot) -> Result<Option<(f64, f64)>, SolveError> {
        let mut newton = Newton::new(&self.structure(), NEWTON);
        let mut x = DVector::from_column_slice(&spot.u);
        x[self.pinned] = spot.p[0];
        if !newton.solve(self, &mut x, 0.0)?.is_converged() {
            return Ok(None);
        }
        let mut work = Linearisation::of(self);
        self.linearise(&x, 0.0, &mut work)?;
        let n = x.len();
        let mut column: DVector<f64> = -self.phi.column(self.pinned);
        column[self.pinned] += 1.0;
        let matrix = DMatrix::from_fn(n, n, |i, j| work.dr_du[(i, j)]);
        let rises = matrix.lu().solve(&column);
        Ok(rises.map(|rises| (x[self.pinned], rises[self.pinned])))
    }
}

impl Residual for Pinned<'_, '_> {
    fn dim(&self) -> usize {
        self.shots.size()
    }

    fn linearise(
        &mut self,
        x: &DVector<f64>,
        _: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let (n, pinned) = (x.len(), self.pinned);
        let mut u = x.as_slice().to_vec();
        u[pinned] = self.level;
        let mut state = u.clone();
        let into = (state.as_mut_slice(), Some(&mut self.phi));
        let is_whole = self.shots.map([x[pinned], self.second], (0.0, TAU), into)?;
        let valid = if is_whole { 1.0 } else { f64::NAN };
        out.magnitude = x.amax().max(f64::MIN_POSITIVE);
        for k in 0..n {
            out.r[k] = valid * (state[k] - u[k]);
        }
        let mut jacobian = out.dr_du.block_mut(n, (0, 0));
        for c in 0..n {
            let column = jacobian.column(c);
            if c == pinned {
                column.copy_from_slice(self.slope.as_slice());
            } else {
                column.copy_from_slice(self.phi.column(c).as_slice());
                column[c] -= 1.0;
            }
        }
        out.dr_dlambda.fill(0.0);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interruption_at_an_end_of_a_bracket_is_handed_on() {
        for place in [-1.0, 1.0] {
            let stopped = |x: f64| match x == place {
                true => Err(Some(SolveError::Interrupted)),
                false => Ok(x),
            };
            let found = crossing(stopped);
            assert!(
                matches!(found, Some(Err(SolveError::Interrupted))),
                "{found:?}"
            );
        }
        let beyond = |x: f64| match x < 0.0 {
            true => Err(Some(SolveError::NoSystem {
                reason: "beyond".into(),
            })),
            false => Ok(x),
        };
        assert!(crossing(beyond).is_none());
        assert!(crossing(|_| Err(None)).is_none());
        let found = crossing(|x| Ok(x - 0.25)).unwrap().unwrap();
        assert!((found.unwrap() - 0.25).abs() < 1e-8);
    }
}
