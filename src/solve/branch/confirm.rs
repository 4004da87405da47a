//! Branches of the Galerkin method taken through the flow.
//!
//! Every event is located again on the flow's own branch and judged by the number of unstable multipliers on both sides of it,
//! counted by the flow. A spread of points is solved by the flow too: it tells the error of the series and of its multipliers.
//! Along the branch the counts must agree with the events; where they do not, the flow's branch is followed through the interval,
//! and what it shows is adopted.

mod align;
mod chain;
mod events;
mod flow;
mod restless;
mod retrace;
mod root;
mod stretch;

use super::{Branch, Recorder, Stability};
use crate::error::SolveError;
use crate::numeric::assignment::assign;
use crate::numeric::fraction::gcd;
use crate::solve::events::{Resolution, Verdict};
use crate::solve::family::Family;
use crate::solve::newton::NewtonOptions;
use crate::solve::residual::{PeriodicResidual, Residual};
use crate::solve::shooting::Shooting;
use flow::{Care, ConfirmingFlow, FlowPoint};
use nalgebra::DVector;
use num_complex::Complex;

/// Points of the spread, besides those beside events.
const SPREAD: usize = 12;
/// Difference of states, relative to their size, above which all points of a small system are taken through the flow.
const POOR: f64 = 1e-3;
/// The same for multipliers, relative to their size or 1.
const POOR_MULTIPLIERS: f64 = 0.2;
/// Coordinates up to which a system counts as small: its flow takes microseconds per period.
const SMALL: usize = 6;
/// Steps per response period up to which the flow's branch is followed wherever something is open.
const FEW_STEPS: f64 = 300.0;
/// Difference of states, relative to their size, up to which an orbit of the flow is the one of the series.
const SAME_ORBIT: f64 = 0.1;
/// Difference of states at the same parameter over the one to the nearest orbit: above it the orbit at the same parameter may lie
/// on the other arm of a fold.
const SAME_ARM: f64 = 5.0;
/// Share of the parameter in the arclength below which a branch is steep.
const STEEP: f64 = 0.3;
/// Distance of two orbits beside a point, in lengths of the steps around it, up to which they count as one.
const BESIDE: f64 = 1e-3;
/// Error of the multipliers at a point over the larger one at the two checked points around it.
const SAFETY: f64 = 3.0;

/// Points that the flow confirms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorSpread {
    /// Both ends, those beside events, some evenly between, and all where these show that the series is poor.
    Some,
    /// Every k-th, the first among them.
    Every(usize),
}

/// Settings of the confirmation of a branch.
pub struct ConfirmOptions<'a> {
    /// Points that are taken through the flow.
    pub spread: ErrorSpread,
    /// Whether the first point is a crossing with another branch, at which a multiplier of the flow is anywhere near the circle.
    pub begins_at_crossing: bool,
    /// Steps of the flow per response period, estimated.
    pub steps: f64,
    /// Weight of the states in the arclength.
    pub weight: f64,
    /// The range of the parameter.
    pub range: (f64, f64),
    /// Changes of stability at least this wide are found where the flow's branch is followed.
    pub resolution: Resolution,
    /// The corrector.
    pub newton: NewtonOptions,
    /// Steps of the flow, times the square of its states, after which nothing more is begun; and the same again for following the flow's
    /// branch.
    pub most_work: f64,
    /// False ends the work early.
    pub keep_going: &'a dyn Fn() -> bool,
}

/// What a branch has shown on its way through the flow.
#[derive(Debug)]
pub struct Confirmed {
    /// Points that were checked.
    pub checked: Vec<CheckedBranch>,
    /// Whether the work allowed has not sufficed for everything.
    pub is_spent: bool,
}

/// A point taken through the flow.
#[derive(Debug, Clone)]
pub struct CheckedBranch {
    /// Number of the point.
    pub point: usize,
    /// State at phase 0 of the flow's orbit at the same parameter, and iterations of the corrector; `None` where it failed.
    pub orbit: Option<(DVector<f64>, usize)>,
    /// Whether it is the orbit of the series, by the distance of the states.
    pub is_same: bool,
    /// Whether the flow's branch runs beside the point, at this parameter or another.
    pub has_branch: bool,
    /// Largest difference between the multipliers of the two methods, relative to their modulus or 1.
    pub multiplier_error: f64,
}

/// Takes a branch through the flow: verdicts and best values of its events, multipliers of its points.
///
/// # Errors
/// Errors of the problem or the flow.
pub fn confirm<F: Family>(
    series: &mut dyn PeriodicResidual,
    shooting: &mut Shooting<F>,
    branch: &mut Branch,
    recorder: &mut dyn Recorder,
    options: &ConfirmOptions<'_>,
) -> Result<Confirmed, SolveError> {
    let mut states = Vec::with_capacity(branch.points.len());
    for point in &branch.points {
        let mut x = DVector::zeros(shooting.dim() + 1);
        let orbit = series.orbit(&point.unknowns, point.lambda)?;
        let n = shooting.dim();
        orbit.state(0.0, &mut x.as_mut_slice()[..n]);
        x[n] = point.lambda;
        states.push(x);
    }
    let parts = parts(series, branch, options)?;
    let parts_outside = shooting.restrict(parts);
    let states_squared = (shooting.dim() as f64).powi(2);
    let work = Confirmer {
        steps_left: (options.most_work / states_squared) as usize,
        flow: ConfirmingFlow::new(shooting, options.weight, options.newton),
        stations: vec![None; states.len()],
        series,
        branch,
        recorder,
        options,
        states,
        located: Vec::new(),
        crossings: Vec::new(),
        followed: Vec::new(),
        explained: Vec::new(),
    };
    let confirmed = work.all();
    shooting.restrict(parts_outside);
    confirmed
}

/// Equal parts of the period of all orbits of a branch.
fn parts(
    series: &mut dyn PeriodicResidual,
    branch: &Branch,
    options: &ConfirmOptions<'_>,
) -> Result<usize, SolveError> {
    if options.begins_at_crossing {
        return Ok(1);
    }
    let mut common = 0;
    for point in &branch.points {
        common = gcd(common, series.equal_parts(&point.unknowns, point.lambda)?);
    }
    Ok(common.max(1))
}

/// One branch on its way through the flow.
struct Confirmer<'a, F: Family> {
    flow: ConfirmingFlow<'a, F>,
    series: &'a mut dyn PeriodicResidual,
    branch: &'a mut Branch,
    recorder: &'a mut dyn Recorder,
    options: &'a ConfirmOptions<'a>,
    /// States at phase 0 with the parameter, by point.
    states: Vec<DVector<f64>>,
    /// What the flow has there, as far as it was asked.
    stations: Vec<Option<Station>>,
    /// Confirmed events on the flow's own branch.
    located: Vec<chain::Located>,
    /// The bifurcations among them: where on the branch, and unstable multipliers of the flow before and after.
    crossings: Vec<chain::ChainItem>,
    /// The bifurcations of stretches through which the flow's branch was followed.
    followed: Vec<chain::ChainItem>,
    /// Steps of the flow that are left for following its branch.
    steps_left: usize,
    /// Steps through which the flow's branch was followed.
    explained: Vec<(usize, usize)>,
}

/// Result of the flow beside a point.
#[derive(Debug, Clone)]
struct Station {
    /// The orbit at the same parameter.
    level: Option<FlowPoint>,
    /// The orbit in the plane across the branch, where the one at the same parameter lies elsewhere: beside a fold.
    nearest: Option<FlowPoint>,
    /// Whether the orbit at the same parameter is the one of the series.
    is_same: bool,
    /// Whether the orbit in the plane represents the flow's branch beside the point.
    is_nearest_own: bool,
    /// Difference of the states, relative to their size.
    gap: f64,
    /// Largest difference of the multipliers, relative to their modulus or 1.
    multiplier_error: f64,
}

impl Station {
    /// The flow's own branch beside the point.
    fn orbit(&self) -> Option<&FlowPoint> {
        let known = match self.is_nearest_own {
            true => self.nearest.as_ref(),
            false => self.level.as_ref(),
        };
        known.filter(|_| self.gap <= SAME_ORBIT)
    }

    fn is_poor(&self) -> bool {
        self.orbit().is_none() || self.gap > POOR || self.multiplier_error > POOR_MULTIPLIERS
    }
}

impl<F: Family> Confirmer<'_, F> {
    fn all(mut self) -> Result<Confirmed, SolveError> {
        self.spread()?;
        self.confirm_events()?;
        self.complete()?;
        self.explain()?;
        self.hand_over();
        Ok(Confirmed {
            checked: self.checked(),
            is_spent: self.is_spent(),
        })
    }

    /// Whether more may be begun.
    fn goes_on(&self) -> bool {
        !self.is_spent() && (self.options.keep_going)()
    }

    fn is_spent(&self) -> bool {
        let states = self.flow.shooting.dim() as f64;
        let steps = self.options.steps * self.flow.periods + self.flow.passages;
        steps * states * states > self.options.most_work || self.steps_left == 0
    }

    /// Whether the flow's branch is cheap to follow.
    fn is_quick(&self) -> bool {
        self.options.steps <= FEW_STEPS
    }

    /// Whether the flow takes microseconds per period.
    fn is_small(&self) -> bool {
        self.is_quick() && self.flow.shooting.dim() <= 2 * SMALL
    }

    /// Solves the points of the spread.
    fn spread(&mut self) -> Result<(), SolveError> {
        let count = self.states.len();
        let mut chosen: Vec<usize> = match self.options.spread {
            ErrorSpread::Every(stride) => (0..count).step_by(stride.max(1)).collect(),
            ErrorSpread::Some => (0..SPREAD)
                .map(|k| k * count.saturating_sub(1) / (SPREAD - 1))
                .collect(),
        };
        chosen.dedup();
        for k in chosen.into_iter().filter(|k| *k < count) {
            self.station(k)?;
        }
        Ok(())
    }

    /// Solves more points where the spread shows that it has to be: all of a poor series, those whose stability it leaves open.
    fn complete(&mut self) -> Result<(), SolveError> {
        if self.options.spread == ErrorSpread::Some {
            let events = &self.branch.events;
            let is_refuted = events.iter().any(|e| e.verdict == Verdict::Refuted);
            if self.is_small()
                && (is_refuted || self.stations.iter().flatten().any(Station::is_poor))
            {
                for k in 0..self.states.len() {
                    self.station(k)?;
                }
            }
        }
        for k in 0..self.states.len() {
            if self.is_open(k) {
                self.station(k)?;
            }
        }
        Ok(())
    }

    /// Whether the error of the multipliers, as known from the checked points around, may be larger than their distance from the
    /// circle.
    fn is_open(&self, k: usize) -> bool {
        let error = |s: &Station| match s.orbit() {
            Some(_) => s.multiplier_error,
            None => f64::INFINITY,
        };
        let before = self.stations[..k].iter().rev().flatten().next();
        let behind = self.stations[k..].iter().flatten().next();
        let around = [before, behind].into_iter().flatten();
        let error = around.map(error).fold(0.0, f64::max);
        SAFETY * error >= distance(&self.branch.points[k].multipliers)
    }

    /// From the point before to the point behind.
    fn direction(&self, k: usize) -> DVector<f64> {
        let behind = (k + 1).min(self.states.len() - 1);
        &self.states[behind] - &self.states[k.saturating_sub(1)]
    }

    /// Whether the parameter hardly changes in a direction of the branch.
    fn is_steep(&self, direction: &DVector<f64>) -> bool {
        let along = direction[direction.len() - 1].abs();
        along < STEEP * self.flow.dot(direction, direction).sqrt()
    }

    /// Solves a point by the flow, once.
    fn station(&mut self, k: usize) -> Result<(), SolveError> {
        if self.stations[k].is_some() || !self.goes_on() {
            return Ok(());
        }
        let x = self.states[k].clone();
        let direction = self.direction(k);
        let is_steep = self.is_steep(&direction);
        // Points outside the request need only multipliers.
        let care = match self.options.spread {
            ErrorSpread::Some => Care::Rough,
            ErrorSpread::Every(_) => Care::Fine,
        };
        let flow = &mut self.flow;
        let size = flow.dot(&x, &x).sqrt();
        let plane = flow.level(x.clone());
        let level = flow.at(&plane, 0.0, x.clone(), care)?;
        let (before, behind) = (k.saturating_sub(1), (k + 1).min(self.states.len() - 1));
        let beside = [before, behind].into_iter().filter(|j| *j != k);
        let room = beside
            .map(|j| flow.distance(&self.states[j], &x))
            .fold(f64::INFINITY, f64::min);
        let gap = |flow: &ConfirmingFlow<'_, F>, p: &Option<FlowPoint>| match p {
            Some(p) => flow.distance(&p.x, &x),
            None => f64::INFINITY,
        };
        let aside = gap(flow, &level);
        let (mut nearest, mut apart) = (None, aside);
        if (is_steep || aside > 0.5 * room)
            && let Some(plane) = flow.across(x.clone(), direction.clone())?
        {
            nearest = flow.at(&plane, 0.0, x.clone(), care)?;
            apart = apart.min(gap(flow, &nearest));
        }
        // Beside a fold the orbit at the same parameter may lie on the other arm.
        let is_same = aside <= SAME_ORBIT * size && aside <= SAME_ARM * apart;
        let is_nearest_own = match (&level, &nearest) {
            (Some(level), Some(nearest)) => {
                !is_same || is_steep && !is_onward(flow, &(&level.x - &nearest.x), &direction, room)
            }
            (_, nearest) => nearest.is_some(),
        };
        let mut station = Station {
            is_same,
            is_nearest_own,
            gap: apart / size,
            multiplier_error: f64::NAN,
            level,
            nearest,
        };
        if let Some(orbit) = station.orbit() {
            let own = &self.branch.points[k].multipliers;
            station.multiplier_error = difference(own, &orbit.multipliers);
        }
        self.stations[k] = Some(station);
        Ok(())
    }

    /// The flow's branch beside a point where it is known, else the series'.
    fn place(&self, k: usize) -> &DVector<f64> {
        let station = self.stations[k].as_ref();
        let orbit = station.and_then(Station::orbit);
        orbit.map_or(&self.states[k], |p| &p.x)
    }

    /// Multipliers of the flow take the place of the series' where they are known.
    fn hand_over(&mut self) {
        for k in 0..self.states.len() {
            if self.branch.points[k].multipliers.is_empty() {
                continue;
            }
            let is_open = self.is_open(k);
            let point = &mut self.branch.points[k];
            match self.stations[k].as_ref().map(Station::orbit) {
                Some(Some(orbit)) => {
                    point.multipliers.clone_from(&orbit.multipliers);
                    point.stability = match orbit.unstable() {
                        0 => Stability::Stable,
                        _ => Stability::Unstable,
                    };
                }
                _ if is_open => point.stability = Stability::Unknown,
                _ => {}
            }
        }
        self.withdraw();
    }

    fn checked(&self) -> Vec<CheckedBranch> {
        let stations = self.stations.iter().enumerate();
        let known = stations.filter_map(|(point, s)| s.as_ref().map(|s| (point, s)));
        known
            .map(|(point, s)| CheckedBranch {
                point,
                orbit: s.level.as_ref().map(|p| (p.state(), p.iterations)),
                is_same: s.is_same,
                has_branch: s.orbit().is_some(),
                multiplier_error: s.multiplier_error,
            })
            .collect()
    }
}

/// Whether an orbit lies on the same arm of a fold as another one, given their difference, the direction of the branch and the length of
/// its steps: along an arm the parameter rises with the states.
fn is_onward<F: Family>(
    flow: &ConfirmingFlow<'_, F>,
    offset: &DVector<f64>,
    direction: &DVector<f64>,
    room: f64,
) -> bool {
    let last = offset.len() - 1;
    let share = flow.dot(offset, direction) / flow.dot(direction, direction);
    let expected = share * direction[last];
    let length = flow.dot(offset, offset).sqrt();
    length <= BESIDE * room || (offset[last] - expected).abs() <= 0.5 * expected.abs()
}

/// Distance of the multipliers from the unit circle, relative to their modulus or 1.
fn distance(multipliers: &[Complex<f64>]) -> f64 {
    let one = |mu: &Complex<f64>| (mu.norm() - 1.0).abs() / mu.norm().max(1.0);
    multipliers.iter().map(one).fold(f64::INFINITY, f64::min)
}

/// Largest difference between two sets of multipliers, relative to their modulus or 1; of as many as both have.
pub fn difference(a: &[Complex<f64>], b: &[Complex<f64>]) -> f64 {
    let (few, many) = if a.len() < b.len() { (a, b) } else { (b, a) };
    let gap = |i: usize, j: usize| (few[i] - many[j]).norm();
    let partners = assign(few.len(), many.len(), gap);
    let pairs = partners.iter().enumerate();
    let relative = pairs.map(|(i, j)| gap(i, *j) / many[*j].norm().max(1.0));
    relative.fold(0.0, f64::max)
}
