//! The first point of a curve from a place near it.

use super::CurveKind;
use super::correction::corrected_at;
use super::defining::{Defining, Spot};
use super::shots::{Plane, Shots};
use crate::error::SolveError;
use crate::solve::attractor::scatter;
use crate::solve::floquet;
use crate::solve::integrate::IntegratorChoice;
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::residual::{Linearisation, Residual};
use crate::solve::segment_orbit::SegmentOrbit;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Target of the search: a kind, and for a grazing the connections that may touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guess {
    /// A kind that needs no more.
    Event(CurveKind),
    /// A touching, of this connection or of any.
    Touch(Option<usize>),
}

/// States at phase 0 from which periodic orbits are looked for.
#[derive(Debug, Clone)]
pub(crate) struct Guesses {
    /// Tried first.
    pub states: Vec<Vec<f64>>,
    /// Centre and half widths of random states.
    pub spread: (Vec<f64>, Vec<f64>),
    /// Random states.
    pub count: usize,
}

/// Reason why there is no first point.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum NoStart {
    /// No periodic orbit was found at the place.
    NoOrbit,
    /// None of the orbits is such an event near the place; the nearest event that was met, as shares.
    NoEvent {
        /// Orbits looked at.
        orbits: usize,
        /// The nearest one.
        nearest: Option<[f64; 2]>,
    },
}

/// Distance from the guess, in ranges, within which an event is the one that is meant.
const NEAR: f64 = 0.02;
/// Distance below which no better one is looked for.
const EXACT: f64 = 1e-8;
/// Guesses tried after the best event so far, in search of a nearer one.
const FURTHER: usize = 24;
/// Periods after which a random motion is a guess.
const PERIODS: [usize; 6] = [0, 1, 2, 4, 8, 60];
/// Orbits nearer than this, relative to their size, are one.
const SAME: f64 = 1e-4;
/// Residual, relative to the size, with which an orbit at a bifurcation is good enough for the corrector of the curve.
const ROUGH: f64 = 1e-3;
/// Seed of the random states.
const SEED: u64 = 2;
/// Extrema nearest to a breakpoint that are tried.
const EXTREMA: usize = 3;
/// Distance from a touching, in sizes, within which a curve does not begin, and how far aside it begins instead, in ranges.
const CORNER: f64 = 2e-5;
const ASIDE: [f64; 6] = [1e-4, -1e-4, 1e-3, -1e-3, 5e-3, -5e-3];

/// u -> P(u) - u at a place.
pub(super) struct Closing<'s, 'a> {
    shots: &'s mut Shots<'a>,
    p: [f64; 2],
    phi: DMatrix<f64>,
}

impl<'s, 'a> Closing<'s, 'a> {
    /// At a place.
    pub(super) fn new(shots: &'s mut Shots<'a>, p: [f64; 2]) -> Closing<'s, 'a> {
        let n = shots.size();
        Closing {
            shots,
            p,
            phi: DMatrix::identity(n, n),
        }
    }
}

impl Residual for Closing<'_, '_> {
    fn dim(&self) -> usize {
        self.shots.size()
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        _: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let n = u.len();
        let mut state = u.as_slice().to_vec();
        let into = (state.as_mut_slice(), Some(&mut self.phi));
        let is_whole = self.shots.map(self.p, (0.0, TAU), into)?;
        let valid = if is_whole { 1.0 } else { f64::NAN };
        out.magnitude = u.amax().max(f64::MIN_POSITIVE);
        for k in 0..n {
            out.r[k] = valid * (state[k] - u[k]);
        }
        let mut jacobian = out.dr_du.block_mut(n, (0, 0));
        for c in 0..n {
            let column = jacobian.column(c);
            column.copy_from_slice(self.phi.column(c).as_slice());
            column[c] -= 1.0;
        }
        out.dr_dlambda.fill(0.0);
        Ok(())
    }
}

/// Looks for the event of a kind nearest to a place.
///
/// # Errors
/// There is no system at the place, or an interruption.
pub(crate) fn seek<'a>(
    plane: Box<dyn Plane + 'a>,
    (guess, p): (Guess, [f64; 2]),
    guesses: &Guesses,
    choice: IntegratorChoice,
) -> Result<Result<(Defining<'a>, Spot), NoStart>, SolveError> {
    let mut shots = Shots::new(plane, p, choice)?;
    let mut orbits: Vec<Vec<f64>> = Vec::new();
    let (mut best, mut nearest): (Option<(CurveKind, Spot)>, Option<[f64; 2]>) = (None, None);
    let gap = |spot: &Spot| apart(spot.p, p);
    let mut tries = 0;
    for state in StateSpread::new(guesses) {
        tries += 1;
        if best.is_some() && tries > FURTHER {
            break;
        }
        let Some(u) = orbit(&mut shots, p, state)? else {
            continue;
        };
        let is_known = |other: &Vec<f64>| distance(other, &u) < SAME;
        if orbits.iter().any(is_known) {
            continue;
        }
        orbits.push(u.clone());
        let is_given = orbits.len() == 1 && !guesses.states.is_empty();
        for (kind, spot) in candidates(&mut shots, guess, (p, &u))? {
            let (back, found) = beside_corner(shots, kind, &spot, is_given)?;
            shots = back;
            let Some(found) = found else { continue };
            if nearest.is_none_or(|q: [f64; 2]| gap(&found) < apart(q, p)) {
                nearest = Some(found.p);
            }
            let is_better = best.as_ref().is_none_or(|(_, b)| gap(&found) < gap(b));
            if gap(&found) < NEAR && is_better {
                (best, tries) = (Some((kind, found)), 0);
            }
        }
        let is_exact = best.as_ref().is_some_and(|(_, spot)| gap(spot) < EXACT);
        if is_exact {
            break;
        }
    }
    Ok(match best {
        Some((kind, spot)) => Ok((Defining::new(shots, kind, &spot)?, spot)),
        None if orbits.is_empty() => Err(NoStart::NoOrbit),
        None => Err(NoStart::NoEvent {
            orbits: orbits.len(),
            nearest,
        }),
    })
}

/// Distance of two places, in ranges.
fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
}

/// The event to which the corrector leads from a spot. At the end of a curve, where it touches, differences of the flow reach across the
/// touching: the curve begins a little aside, at another value of the second parameter, or of the first.
fn beside_corner<'a>(
    mut shots: Shots<'a>,
    kind: CurveKind,
    spot: &Spot,
    is_given: bool,
) -> Result<(Shots<'a>, Option<Spot>), SolveError> {
    let (back, found) = corrected_at(shots, kind, spot, &[1, 0])?;
    shots = back;
    let is_grazing = matches!(kind, CurveKind::Grazing { .. });
    let nearest = match &found {
        _ if is_grazing => None,
        Some(found) => gaps(&mut shots, None, (found.p, &found.u))?
            .into_iter()
            .next(),
        None => None,
    };
    let size = spot.u.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let is_corner = nearest.is_some_and(|(gap, _, _)| gap < CORNER * size);
    if is_grazing || !(is_corner || found.is_none() && is_given) {
        return Ok((shots, found));
    }
    let places = [1, 0]
        .into_iter()
        .flat_map(|k| ASIDE.map(|aside| (k, aside)));
    for (parameter, aside) in places {
        let mut moved = found.clone().unwrap_or_else(|| spot.clone());
        moved.p[parameter] += aside;
        let (back, beside) = corrected_at(shots, kind, &moved, &[parameter])?;
        shots = back;
        let is_near = |other: &Spot| apart(other.p, spot.p) < NEAR;
        if let Some(beside) = beside.filter(is_near) {
            let clear = gaps(&mut shots, None, (beside.p, &beside.u))?
                .into_iter()
                .next();
            if clear.is_none_or(|(gap, _, _)| gap >= CORNER * size) {
                return Ok((shots, Some(beside)));
            }
        }
    }
    Ok((shots, found))
}

/// States to begin with: those given, then random ones, each with a number of periods to go.
struct StateSpread<'g> {
    guesses: &'g Guesses,
    next: usize,
}

impl<'g> StateSpread<'g> {
    fn new(guesses: &'g Guesses) -> StateSpread<'g> {
        StateSpread { guesses, next: 0 }
    }
}

impl Iterator for StateSpread<'_> {
    type Item = (Vec<f64>, usize);

    fn next(&mut self) -> Option<(Vec<f64>, usize)> {
        let k = self.next;
        self.next += 1;
        let given = &self.guesses.states;
        if k < given.len() {
            return Some((given[k].clone(), 0));
        }
        let k = k - given.len();
        if k >= self.guesses.count * PERIODS.len() {
            return None;
        }
        let (centre, widths) = &self.guesses.spread;
        let mut state = centre.clone();
        // The first one is the centre itself.
        if k >= PERIODS.len() {
            scatter(SEED, k / PERIODS.len() - 1, widths, &mut state);
        }
        Some((state, PERIODS[k % PERIODS.len()]))
    }
}

/// A periodic orbit, roughly, from a state that goes on for some periods first.
fn orbit(
    shots: &mut Shots<'_>,
    p: [f64; 2],
    (mut state, periods): (Vec<f64>, usize),
) -> Result<Option<Vec<f64>>, SolveError> {
    for _ in 0..periods {
        if !shots.map(p, (0.0, TAU), (&mut state, None))? {
            return Ok(None);
        }
    }
    let mut problem = Closing::new(shots, p);
    let options = NewtonOptions {
        tolerance: 1e-9,
        step_tolerance: 1e-8,
        max_iterations: 40,
        min_damping: 1.0 / 256.0,
    };
    let mut newton = Newton::new(&problem.structure(), options);
    let mut u = DVector::from_vec(state);
    let outcome = newton.solve(&mut problem, &mut u, 0.0)?;
    let is_near = outcome.is_converged() || outcome.residual_norm < ROUGH;
    Ok(is_near.then(|| u.as_slice().to_vec()))
}

/// Spots of an orbit from which the corrector may reach an event.
fn candidates(
    shots: &mut Shots<'_>,
    guess: Guess,
    (p, u): ([f64; 2], &[f64]),
) -> Result<Vec<(CurveKind, Spot)>, SolveError> {
    let spot = |extra: f64| Spot {
        u: u.to_vec(),
        p,
        extra,
    };
    let kind = match guess {
        Guess::Touch(connection) => return touches(shots, connection, (p, u)),
        Guess::Event(kind) => kind,
    };
    if kind != CurveKind::NeimarkSacker {
        return Ok(vec![(kind, spot(0.0))]);
    }
    let (mut state, mut phi) = (u.to_vec(), DMatrix::identity(u.len(), u.len()));
    if !shots.map(p, (0.0, TAU), (&mut state, Some(&mut phi)))? {
        return Ok(Vec::new());
    }
    let pairs = floquet::multipliers(&phi)
        .into_iter()
        .filter(|mu| mu.im > 0.0);
    let pair = |mu: num_complex::Complex<f64>| (kind, spot(mu.re / mu.norm()));
    Ok(pairs.map(pair).collect())
}

/// The extrema nearest to breakpoints.
fn touches(
    shots: &mut Shots<'_>,
    connection: Option<usize>,
    (p, u): ([f64; 2], &[f64]),
) -> Result<Vec<(CurveKind, Spot)>, SolveError> {
    let spot = |extra: f64| Spot {
        u: u.to_vec(),
        p,
        extra,
    };
    let nearest = gaps(shots, connection, (p, u))?.into_iter().take(EXTREMA);
    Ok(nearest.map(|(_, kind, tau)| (kind, spot(tau))).collect())
}

/// Extrema of a deformation, each with its phase, and the breakpoints of its law.
type Extrema = (Vec<(f64, f64)>, Vec<f64>);

/// Extrema of all deformations, connection by connection; `None` where there is no image.
pub(super) fn extrema(
    shots: &mut Shots<'_>,
    (p, u): ([f64; 2], &[f64]),
) -> Result<Option<Vec<Extrema>>, SolveError> {
    let system = shots.system(p)?.clone();
    let mut orbit = SegmentOrbit::new(system.omega(), system.subharmonic(), system.dof());
    let mut state = u.to_vec();
    if !shots.observed(p, (0.0, TAU), (&mut state, None), &mut orbit)? {
        return Ok(None);
    }
    let all = orbit.extrema(&system).into_iter();
    Ok(Some(all.zip(system.breakpoints()).collect()))
}

/// Distances of all extrema from breakpoints, the least first, each with its grazing and its phase.
pub(super) fn gaps(
    shots: &mut Shots<'_>,
    connection: Option<usize>,
    (p, u): ([f64; 2], &[f64]),
) -> Result<Vec<(f64, CurveKind, f64)>, SolveError> {
    let Some(all) = extrema(shots, (p, u))? else {
        return Ok(Vec::new());
    };
    let mut list: Vec<(f64, CurveKind, f64)> = Vec::new();
    for (own, (extrema, levels)) in all.iter().enumerate() {
        if connection.is_some_and(|wanted| wanted != own) {
            continue;
        }
        for (tau, x) in extrema.iter().skip(1) {
            for (breakpoint, level) in levels.iter().enumerate() {
                let kind = CurveKind::Grazing {
                    connection: own,
                    breakpoint,
                };
                list.push(((x - level).abs(), kind, *tau));
            }
        }
    }
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(list)
}

impl Defining<'_> {
    /// Least distance of an extremum from a breakpoint of its law, and the connection.
    pub(super) fn nearest_touch(
        &mut self,
        spot: &Spot,
    ) -> Result<Option<(f64, usize)>, SolveError> {
        let list = gaps(&mut self.shots, None, (spot.p, &spot.u))?;
        Ok(list.first().and_then(|(gap, kind, _)| match kind {
            CurveKind::Grazing { connection, .. } => Some((*gap, *connection)),
            _ => None,
        }))
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let gaps = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    gaps.fold(0.0, f64::max) / size
}
