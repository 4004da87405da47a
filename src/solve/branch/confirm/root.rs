//! An event sought on the flow's own branch.

use super::flow::{Care, ConfirmingFlow, ConfirmingPlane, FlowPoint};
use crate::error::SolveError;
use crate::numeric::{interpolation, roots};
use crate::solve::events::{BifurcationEvent, EventKind};
use crate::solve::family::Family;
use crate::solve::residual::Survey;
use nalgebra::DVector;
use num_complex::Complex;
use std::f64::consts::{PI, TAU};

/// Width to which an event is located, relative to the parameter.
const WIDTH: f64 = 1e-9;
/// The parameter counts as at least this large.
const LEAST: f64 = 1e-3;
/// Places on each side at which the test function is looked at where the search from the start leads nowhere.
const LOOKS: usize = 8;
/// Value of a test function at a root, relative to its largest: above it the function jumps there.
const VANISHES: f64 = 1e-3;
/// Places through which the guess of an orbit is interpolated.
const NODES: usize = 3;
/// Distance of a product of two multipliers from 1 that counts by its direction alone.
const FAR_FROM_ONE: f64 = 0.3;
/// Imaginary parts below this share of the modulus belong to real multipliers.
const REAL: f64 = 1e-12;

/// A function that vanishes at an event.
#[derive(Debug, Clone)]
pub(super) enum Test {
    /// A multiplier passes this value, 1 or -1.
    Real(f64),
    /// So many equal multipliers pass this value together.
    Equal(f64, usize),
    /// A complex pair passes the circle.
    Pair,
    /// So many equal complex pairs, near this value, pass it together.
    EqualPairs(Complex<f64>, usize),
    /// An extremum touches a breakpoint.
    Touch {
        connection: usize,
        breakpoint: usize,
        is_maximum: bool,
        /// Phase at which the extremum was seen last.
        tau: f64,
    },
}

impl Test {
    /// The test of an event, given what its own method sees there; `None` where that does not show the event.
    pub fn of(event: &BifurcationEvent, survey: &Survey) -> Option<Test> {
        let real = |passed: f64| match event.multiplicity {
            1 => Test::Real(passed),
            count => Test::Equal(passed, count),
        };
        match event.kind {
            EventKind::Fold | EventKind::BranchPoint => Some(real(1.0)),
            EventKind::PeriodDoubling => Some(real(-1.0)),
            EventKind::Unresolved | EventKind::SlipOnset { .. } => None,
            EventKind::NeimarkSacker => {
                let upper = survey.multipliers.iter().filter(|mu| is_upper(mu));
                let gap = |mu: &Complex<f64>| (mu.norm() - 1.0).abs();
                let nearest = upper.min_by(|a, b| gap(a).total_cmp(&gap(b)));
                nearest.map(|mu| match event.multiplicity {
                    1 => Test::Pair,
                    count => Test::EqualPairs(*mu, count),
                })
            }
            EventKind::Grazing {
                connection,
                breakpoint,
            } => {
                let level = *survey.breakpoints[connection].get(breakpoint)?;
                let extrema = survey.extrema[connection].windows(2);
                let gap = |w: &[(f64, f64)]| (w[0].1 - level).abs();
                let nearest = extrema.min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
                Some(Test::Touch {
                    connection,
                    breakpoint,
                    is_maximum: nearest[0].1 > nearest[1].1,
                    tau: nearest[0].0,
                })
            }
        }
    }

    /// Its value on the flow; not a number where the flow does not show what is watched.
    fn value<F: Family>(
        &mut self,
        flow: &mut ConfirmingFlow<'_, F>,
        point: &FlowPoint,
    ) -> Result<f64, SolveError> {
        Ok(match self {
            Test::Real(passed) => {
                let factor = |mu: &Complex<f64>| (mu - *passed) / (1.0 + mu.norm());
                let product: Complex<f64> = point.multipliers.iter().map(factor).product();
                product.re
            }
            Test::Equal(passed, count) => {
                let near = nearest(point.multipliers.iter(), Complex::new(*passed, 0.0), *count);
                near.iter().map(|mu| mu.re - *passed).sum::<f64>() * passed.signum()
            }
            Test::Pair => products_beyond_one(&point.multipliers),
            Test::EqualPairs(seen, count) => {
                let upper = point.multipliers.iter().filter(|mu| is_upper(mu));
                let near = nearest(upper, *seen, *count);
                match near.len() == *count {
                    true => near.iter().map(|mu| mu.norm() - 1.0).sum(),
                    false => f64::NAN,
                }
            }
            Test::Touch {
                connection,
                breakpoint,
                is_maximum,
                tau,
            } => {
                let extrema = flow.extrema(point, *connection)?;
                let levels = flow.system_at(point.lambda())?.breakpoints();
                let Some(level) = levels[*connection].get(*breakpoint) else {
                    return Ok(f64::NAN);
                };
                let alike = extrema
                    .windows(2)
                    .filter(|w| (w[0].1 > w[1].1) == *is_maximum);
                let gap = |w: &[(f64, f64)]| turn(w[0].0 - *tau).abs();
                match alike.min_by(|a, b| gap(a).total_cmp(&gap(b))) {
                    Some(extremum) => {
                        *tau = extremum[0].0;
                        extremum[0].1 - level
                    }
                    None => f64::NAN,
                }
            }
        })
    }
}

/// The product of mu_j mu_k - 1 over all pairs, factors far from 0 by their direction alone. It depends on the set and on nothing that was
/// seen before, and changes its sign where the modulus of a complex pair passes 1; also where two real multipliers are reciprocal, which
/// the counts on both sides tell apart.
fn products_beyond_one(list: &[Complex<f64>]) -> f64 {
    let mut product = Complex::new(1.0, 0.0);
    for (k, mu) in list.iter().enumerate() {
        for other in &list[k + 1..] {
            let factor = mu * other - 1.0;
            product *= factor / factor.norm().max(FAR_FROM_ONE);
        }
    }
    product.re
}

/// The multipliers nearest to a value.
fn nearest<'m>(
    list: impl Iterator<Item = &'m Complex<f64>>,
    to: Complex<f64>,
    count: usize,
) -> Vec<Complex<f64>> {
    let mut list: Vec<Complex<f64>> = list.copied().collect();
    list.sort_by(|a, b| (a - to).norm().total_cmp(&(b - to).norm()));
    list.truncate(count);
    list
}

fn is_upper(mu: &Complex<f64>) -> bool {
    mu.im > REAL * mu.norm()
}

/// A difference of phases, the short way round.
fn turn(difference: f64) -> f64 {
    (difference + PI).rem_euclid(TAU) - PI
}

/// An event on the flow's own branch.
#[derive(Debug, Clone)]
pub(super) struct ConfirmedRoot {
    /// Plane of the event.
    pub s: f64,
    /// The orbit there.
    pub point: FlowPoint,
    /// Parameters that enclose it.
    pub bracket: (f64, f64),
    /// Other orbits that the search has solved: planes and orbits.
    pub seen: Vec<(f64, FlowPoint)>,
}

impl ConfirmedRoot {
    /// The orbit farthest before (`side` -1) or behind (1) the root among those seen within a distance from it.
    pub fn beside(&self, side: f64, within: f64) -> Option<&FlowPoint> {
        let ahead = |s: f64| side * (s - self.s);
        let near = |x: &&(f64, FlowPoint)| (0.0..within).contains(&ahead(x.0)) && x.0 != self.s;
        let farthest = self.seen.iter().filter(near);
        let farthest = farthest.max_by(|a, b| ahead(a.0).total_cmp(&ahead(b.0)));
        farthest.map(|x| &x.1)
    }
}

/// One search.
struct RootSearch<'a, 'f, F: Family> {
    flow: &'a mut ConfirmingFlow<'f, F>,
    plane: &'a ConfirmingPlane,
    test: Test,
    /// Places seen: s, value, orbit.
    seen: Vec<(f64, f64, FlowPoint)>,
}

/// The event nearest to s = 0 within the reach on either side; `stride`: a distance in which the branch is about straight.
/// `None` where the flow's branch has none there.
///
/// # Errors
/// Errors of the flow.
pub(super) fn locate<F: Family>(
    flow: &mut ConfirmingFlow<'_, F>,
    plane: &ConfirmingPlane,
    test: Test,
    (stride, reach): (f64, f64),
) -> Result<Option<ConfirmedRoot>, SolveError> {
    let mut search = RootSearch {
        flow,
        plane,
        test,
        seen: Vec::new(),
    };
    let lambda = plane.base[plane.base.len() - 1].abs().max(LEAST);
    let width = WIDTH * lambda;
    let found = match search.beside_start(stride, reach, width)? {
        Some(found) => Some(found),
        None => search.by_looks(reach, width)?,
    };
    let Some(found) = found else { return Ok(None) };
    let seen = search.seen;
    let lambda_at = |s: f64| seen.iter().find(|x| x.0 == s).map(|x| x.2.lambda());
    let ends = (lambda_at(found.low), lambda_at(found.high));
    let largest = seen.iter().fold(0.0_f64, |m, x| m.max(x.1.abs()));
    let root = seen.iter().find(|x| x.0 == found.root);
    let Some((s, _, point)) = root.filter(|x| x.1.abs() <= VANISHES * largest).cloned() else {
        return Ok(None);
    };
    let at = point.lambda();
    let (a, b) = (ends.0.unwrap_or(at), ends.1.unwrap_or(at));
    Ok(Some(ConfirmedRoot {
        s,
        point,
        bracket: (a.min(b), a.max(b)),
        seen: seen.into_iter().map(|x| (x.0, x.2)).collect(),
    }))
}

impl<F: Family> RootSearch<'_, '_, F> {
    /// Value in a plane. The inner `Err`: no orbit there, or nothing to watch.
    fn value(&mut self, s: f64) -> Result<f64, Option<SolveError>> {
        if let Some(known) = self.seen.iter().find(|x| x.0 == s) {
            return Ok(known.1);
        }
        let guess = self.guess(s);
        let point = self
            .flow
            .at(self.plane, s, guess, Care::Rough)
            .map_err(Some)?;
        let point = point.ok_or(None)?;
        let value = self.test.value(self.flow, &point).map_err(Some)?;
        if value.is_nan() {
            return Err(None);
        }
        self.seen.push((s, value, point));
        Ok(value)
    }

    /// On the parabola through the three nearest places seen, or the line through two.
    fn guess(&self, s: f64) -> DVector<f64> {
        let mut near: Vec<&(f64, f64, FlowPoint)> = self.seen.iter().collect();
        near.sort_by(|a, b| (a.0 - s).abs().total_cmp(&(b.0 - s).abs()));
        near.truncate(NODES);
        if near.is_empty() {
            return &self.plane.base + &self.plane.tangent * s;
        }
        if let [one] = near[..] {
            return &one.2.x + &self.plane.tangent * (s - one.0);
        }
        let mut guess = DVector::zeros(self.plane.base.len());
        let nodes: Vec<f64> = near.iter().map(|node| node.0).collect();
        let mut shares = [0.0; NODES];
        interpolation::weights(&nodes, s, &mut shares[..nodes.len()]);
        for (share, node) in shares.iter().zip(&near) {
            guess.axpy(*share, &node.2.x, 1.0);
        }
        guess
    }

    fn beside_start(
        &mut self,
        stride: f64,
        reach: f64,
        width: f64,
    ) -> Result<Option<roots::Bracketed>, SolveError> {
        let sought = self.value(0.0).and_then(|at| {
            let beside = self.value(stride)?;
            let slope = (beside - at) / stride;
            let guess = -at / slope;
            let guess = if guess.abs() < reach { guess } else { 0.0 };
            let limits = (-reach, reach);
            roots::near_guess(|s| self.value(s), guess, slope, limits, width)
        });
        match sought {
            Ok(found) => Ok(found),
            Err(None) => Ok(None),
            Err(Some(error)) => Err(error),
        }
    }

    /// Outwards from the start, until the test function changes its sign.
    fn by_looks(&mut self, reach: f64, width: f64) -> Result<Option<roots::Bracketed>, SolveError> {
        for side in [1.0, -1.0] {
            // Where the branches of the two methods lie apart, the nearest planes may have no orbit.
            let mut has_begun = false;
            for k in 1..=LOOKS {
                match self.value(side * reach * k as f64 / LOOKS as f64) {
                    Ok(_) => has_begun = true,
                    Err(None) if has_begun => break,
                    Err(None) => {}
                    Err(Some(error)) => return Err(error),
                }
            }
        }
        let mut line: Vec<(f64, f64)> = self.seen.iter().map(|x| (x.0, x.1)).collect();
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        let changes = line.windows(2).filter(|w| w[0].1 * w[1].1 <= 0.0);
        let far = |w: &[(f64, f64)]| w[0].0.abs().min(w[1].0.abs());
        let Some(nearest) = changes.min_by(|a, b| far(a).total_cmp(&far(b))) else {
            return Ok(None);
        };
        let (low, high) = (nearest[0], nearest[1]);
        match roots::bracketed(|s| self.value(s), low, high, width) {
            Ok(found) => Ok(Some(found)),
            Err(None) => Ok(None),
            Err(Some(error)) => Err(error),
        }
    }
}
