//! Attracting periodic orbits: found by Newton's iteration on iterates of the map, and reached or not by a record.

use super::geometry::{Cloud, distance};
use super::lyapunov::{Exponents, FORGOTTEN};
use super::map::Map;
use crate::error::SolveError;
use crate::solve::floquet;
use crate::solve::integrate::IntegrationEnd;
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::residual::{Linearisation, Residual};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;

/// An attracting periodic orbit.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// Minimal period in iterates.
    pub period: usize,
    /// Its points in the order of time.
    pub points: Vec<f64>,
    /// Multipliers over the minimal period, by falling modulus: all inside the unit circle.
    pub multipliers: Vec<Complex<f64>>,
    /// Derivative of the map over the minimal period, from the first point.
    pub(super) phi: DMatrix<f64>,
}

impl Cycle {
    /// The same orbit from its smallest point on, whichever it was found at.
    pub(super) fn beginning_smallest(&self, map: &mut dyn Map) -> Cycle {
        let size = self.phi.nrows();
        let point = |k: &usize| &self.points[k * size..(k + 1) * size];
        let before = |a: &usize, b: &usize| {
            let parts = point(a).iter().zip(point(b)).map(|(x, y)| x.total_cmp(y));
            parts.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        };
        let first = (0..self.period).min_by(before).unwrap_or(0);
        if first == 0 {
            return self.clone();
        }
        let mut cycle = self.clone();
        cycle.points.rotate_left(first * size);
        let mut state = cycle.points[..size].to_vec();
        cycle.phi.fill_with_identity();
        for _ in 0..cycle.period {
            if map.advance_with_variation(&mut state, &mut cycle.phi) != IntegrationEnd::Reached {
                return self.clone();
            }
        }
        cycle
    }

    /// Whether it goes through the first point of another one of the same period.
    pub(super) fn is_near(&self, other: &Cycle, cloud: &Cloud<'_>) -> bool {
        let first = &other.points[..cloud.size];
        let mut points = self.points.chunks_exact(cloud.size);
        self.period == other.period
            && points.any(|point| distance(point, first, &cloud.scale) <= LEAST_SAME)
    }

    /// Lyapunov exponents: those of the multipliers.
    pub(super) fn exponents(&self, duration: f64) -> Exponents {
        let span = self.period as f64 * duration;
        // ln 0 is minus infinity: a deviation that is forgotten.
        let rate = |mu: &Complex<f64>| match mu.norm() {
            size if size < FORGOTTEN => f64::NEG_INFINITY,
            size => size.ln() / span,
        };
        let values: Vec<f64> = self.multipliers.iter().map(rate).collect();
        Exponents {
            error: 0.0,
            span,
            thirds: [values[0]; 3],
            values,
        }
    }
}

/// Distance from the unit circle below which a multiplier does not count as inside, in errors of the map and at least.
const INSIDE: (f64, f64) = (1e3, 1e-9);
/// Rounding of a solution, in errors of the map, over the distance of the multipliers from the circle.
const SAME: f64 = 1e3;
/// Two points are one below this, relative to the scale.
const LEAST_SAME: f64 = 1e-9;
/// Newton iterations per attempt: attempts start near an orbit or are given up.
const ITERATIONS: usize = 6;
/// Least fraction of Newton's step that is tried.
const DAMPING: f64 = 0.25;
/// Distance from an orbit, relative to the scale, within which a guess leads there.
const SEEN: f64 = 1e-2;
/// Largest multiplier of a saddle that is followed to its partner.
const SADDLE: f64 = 8.0;
/// Distance from a saddle at which its unstable manifold is entered, relative to the scale.
const OFFSET: f64 = 3e-3;
/// Laps along the unstable manifold.
const DESCENT: usize = 20;
/// Powers of a derivative that bring out its leading direction.
const POWERS: usize = 24;

/// u -> P^laps(u) - u.
struct Return<'a> {
    map: &'a mut dyn Map,
    laps: usize,
    phi: DMatrix<f64>,
    state: Vec<f64>,
    /// Iterates computed.
    cost: usize,
    /// Largest modulus of the record: what a residual is small against where the orbit is at rest.
    size: f64,
}

impl Return<'_> {
    fn advance(&mut self, u: &[f64]) -> bool {
        self.state.copy_from_slice(u);
        self.phi.fill_with_identity();
        for _ in 0..self.laps {
            self.cost += 1;
            let end = (self.map).advance_with_variation(&mut self.state, &mut self.phi);
            let is_finite = self.state.iter().all(|x| x.is_finite());
            if end != IntegrationEnd::Reached || !is_finite {
                return false;
            }
        }
        true
    }
}

impl Residual for Return<'_> {
    fn dim(&self) -> usize {
        self.state.len()
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        _lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let valid = if self.advance(u.as_slice()) {
            1.0
        } else {
            f64::NAN
        };
        out.dr_dlambda.fill(0.0);
        out.magnitude = u.amax().max(self.size);
        for (k, x) in self.state.iter().enumerate() {
            out.r[k] = valid * (x - u[k]);
            out.magnitude = out.magnitude.max(x.abs());
        }
        let mut jacobian = out.dr_du.block_mut(u.len(), (0, 0));
        for c in 0..u.len() {
            let column = jacobian.column(c);
            column.copy_from_slice(self.phi.column(c).as_slice());
            column[c] -= 1.0;
        }
        // What is remembered and never changed is data.
        for row in floquet::kept(&self.phi, 0) {
            for c in 0..u.len() {
                jacobian.column(c)[row] = if c == row { 1.0 } else { 0.0 };
            }
            out.r[row] = 0.0;
        }
        Ok(())
    }
}

/// A fixed point of an iterate of the map.
struct Solution {
    u: DVector<f64>,
    multipliers: Vec<Complex<f64>>,
    phi: DMatrix<f64>,
}

/// Looks for attracting orbits with a bounded number of iterates.
pub(super) struct OrbitSearch<'a> {
    map: &'a mut dyn Map,
    scale: Vec<f64>,
    /// Iterates left.
    budget: usize,
    /// Least fraction of Newton's step.
    damping: f64,
    /// Points of the orbits that were found and do not attract.
    seen: Vec<f64>,
}

impl<'a> OrbitSearch<'a> {
    pub fn new(map: &'a mut dyn Map, cloud: &Cloud<'_>, budget: usize) -> OrbitSearch<'a> {
        OrbitSearch {
            map,
            scale: cloud.scale.clone(),
            budget,
            damping: DAMPING,
            seen: Vec::new(),
        }
    }

    /// The attracting orbit of that period, or of a divisor of it, to which Newton's iteration leads from a state.
    pub fn attracting(&mut self, guess: &[f64], period: usize) -> Option<Cycle> {
        let found = self.solve(guess, period)?;
        let cycle = self.cycle(&found, period)?;
        let gap = 1.0 - cycle.multipliers[0].norm();
        let same = (SAME * self.map.error() / gap).max(LEAST_SAME);
        let size = guess.len();
        let repeats = |d: &usize| {
            let point = &cycle.points[d * size..(d + 1) * size];
            distance(point, found.u.as_slice(), &self.scale) <= same
        };
        let mut divisors = (1..period).filter(|d| period.is_multiple_of(*d));
        match divisors.find(repeats) {
            Some(shorter) => {
                let found = self.solve(found.u.as_slice(), shorter)?;
                self.cycle(&found, shorter)
            }
            None => Some(cycle),
        }
    }

    /// The same; where the iteration leads to a saddle, the orbit to which its unstable manifold goes on either side. An attracting
    /// orbit and a saddle are born together: from outside, Newton's iteration meets the saddle first.
    pub(crate) fn attracting_beyond_saddle(
        &mut self,
        guess: &[f64],
        period: usize,
    ) -> Option<Cycle> {
        if self.is_seen(guess) {
            return None;
        }
        // A guess that needs more is not worth it.
        self.damping = 1.0;
        let found = self.solve(guess, period);
        self.damping = DAMPING;
        let found = found?;
        let leading = found.multipliers.first()?;
        if leading.norm() < 1.0 {
            return self.attracting(found.u.as_slice(), period);
        }
        let points = self.orbit(found.u.as_slice(), period)?;
        self.seen.extend(points);
        let is_other_inside = found.multipliers.get(1).is_none_or(|mu| mu.norm() < 1.0);
        if leading.im != 0.0 || !(1.0..SADDLE).contains(&leading.re) || !is_other_inside {
            return None;
        }
        let direction = self.unstable_direction(&found.phi);
        [-OFFSET, OFFSET].into_iter().find_map(|share| {
            let mut state: Vec<f64> = (found.u.iter().zip(&direction))
                .map(|(u, d)| u + share * d)
                .collect();
            let cost = DESCENT * period;
            self.budget = self.budget.checked_sub(cost)?;
            for _ in 0..cost {
                if self.map.advance(&mut state) != IntegrationEnd::Reached {
                    return None;
                }
            }
            self.attracting(&state, period)
        })
    }

    /// The points of any orbit to which Newton's iteration leads from a state.
    pub(super) fn any(&mut self, guess: &[f64], period: usize) -> Option<Vec<f64>> {
        let found = self.solve(guess, period)?;
        self.orbit(found.u.as_slice(), period)
    }

    /// The attracting orbit of twice that period beside one whose leading multiplier has passed -1.
    pub(super) fn attracting_doubled(&mut self, guess: &[f64], period: usize) -> Option<Cycle> {
        let found = self.solve(guess, period)?;
        let leading = found.multipliers.first()?;
        let is_other_inside = found.multipliers.get(1).is_none_or(|mu| mu.norm() < 1.0);
        if leading.im != 0.0 || !(-SADDLE..-1.0).contains(&leading.re) || !is_other_inside {
            return None;
        }
        let direction = self.unstable_direction(&found.phi);
        let parts = found.u.iter().zip(&direction);
        let mut state: Vec<f64> = parts.map(|(u, d)| u + OFFSET * d).collect();
        let cost = 2 * DESCENT * period;
        self.budget = self.budget.checked_sub(cost)?;
        for _ in 0..cost {
            if self.map.advance(&mut state) != IntegrationEnd::Reached {
                return None;
            }
        }
        self.attracting(&state, 2 * period)
    }

    /// Whether a guess leads to an orbit that does not attract.
    fn is_seen(&self, guess: &[f64]) -> bool {
        let mut seen = self.seen.chunks_exact(guess.len());
        seen.any(|point| distance(point, guess, &self.scale) <= SEEN)
    }

    /// The leading eigenvector of a derivative, of length 1 in the scale.
    fn unstable_direction(&self, phi: &DMatrix<f64>) -> Vec<f64> {
        let mut direction = DVector::from_column_slice(&self.scale);
        for _ in 0..POWERS {
            direction = phi * direction;
            let parts = direction
                .iter()
                .zip(&self.scale)
                .map(|(d, s)| (d / s).abs());
            direction /= parts.fold(f64::MIN_POSITIVE, f64::max);
        }
        direction.as_slice().to_vec()
    }

    /// Derivative of an iterate at a state.
    pub fn lap(&mut self, state: &[f64], laps: usize) -> Option<DMatrix<f64>> {
        let mut state = state.to_vec();
        let mut phi = DMatrix::identity(state.len(), state.len());
        let mut reaches =
            || self.map.advance_with_variation(&mut state, &mut phi) == IntegrationEnd::Reached;
        (0..laps).all(|_| reaches()).then_some(phi)
    }

    /// A fixed point of an iterate.
    fn solve(&mut self, guess: &[f64], laps: usize) -> Option<Solution> {
        if laps > self.budget {
            return None;
        }
        let (size, error) = (guess.len(), self.map.error());
        let mut problem = Return {
            map: self.map,
            laps,
            phi: DMatrix::identity(size, size),
            state: vec![0.0; size],
            cost: 0,
            size: self.scale.iter().fold(0.0, |m, s| m.max(*s)),
        };
        let options = NewtonOptions {
            tolerance: 10.0 * error,
            step_tolerance: 1e-10_f64.max(1e2 * error),
            max_iterations: ITERATIONS.min(self.budget / laps),
            min_damping: self.damping,
        };
        let mut newton = Newton::new(&problem.structure(), options);
        let mut u = DVector::from_column_slice(guess);
        let outcome = newton.solve(&mut problem, &mut u, 0.0);
        let is_solved = outcome.is_ok_and(|o| o.is_converged());
        let (cost, phi) = (problem.cost, problem.phi);
        self.budget = self.budget.saturating_sub(cost);
        is_solved.then(|| Solution {
            u,
            multipliers: floquet::multipliers_and_neutral(&phi, 0).0,
            phi,
        })
    }

    /// The orbit of a fixed point with all its multipliers inside the circle.
    fn cycle(&mut self, found: &Solution, period: usize) -> Option<Cycle> {
        let inside = (INSIDE.0 * self.map.error()).max(INSIDE.1);
        if found.multipliers.first()?.norm() >= 1.0 - inside {
            return None;
        }
        Some(Cycle {
            period,
            points: self.orbit(found.u.as_slice(), period)?,
            multipliers: found.multipliers.clone(),
            phi: found.phi.clone(),
        })
    }

    fn orbit(&mut self, u: &[f64], laps: usize) -> Option<Vec<f64>> {
        let (mut points, mut state) = (u.to_vec(), u.to_vec());
        for _ in 1..laps {
            if self.map.advance(&mut state) != IntegrationEnd::Reached {
                return None;
            }
            points.extend_from_slice(&state);
        }
        Some(points)
    }
}
