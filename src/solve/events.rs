//! Bifurcations inside one step of a path: detection, refinement, location.

use super::continuation::{Continuation, PathPoint};
use super::residual::PeriodicResidual;
use crate::error::SolveError;
use crate::numeric::roots;
use num_complex::Complex;

/// Kind of a bifurcation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// The branch turns in the parameter (multiplier +1).
    Fold,
    /// Another branch crosses (multiplier +1 without turning).
    BranchPoint,
    /// A real multiplier passes -1.
    PeriodDoubling,
    /// A complex pair passes the unit circle.
    NeimarkSacker,
}

impl EventKind {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            EventKind::Fold => "fold",
            EventKind::BranchPoint => "branch_point",
            EventKind::PeriodDoubling => "period_doubling",
            EventKind::NeimarkSacker => "neimark_sacker",
        }
    }
}

/// A bifurcation between two points of a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct BifurcationEvent {
    /// Kind.
    pub kind: EventKind,
    /// Parameter at the event.
    pub lambda: f64,
    /// Parameters that enclose it; for a fold the neighbouring points', which may not.
    pub bracket: (f64, f64),
    /// Whether the location converged.
    pub located: bool,
    /// Point of the branch before the event.
    pub after_point: usize,
    /// Fraction of the step at which it stands.
    pub fraction: f64,
    /// Values of the recorder at the event; empty when it could not be located.
    pub recorded: Vec<f64>,
}

/// What is known at one place of a step.
#[derive(Debug, Clone)]
pub struct Probe {
    /// Fraction of the step, 0 at its origin.
    pub fraction: f64,
    /// The point.
    pub point: PathPoint,
    /// Multipliers; empty when stability is not asked for.
    pub multipliers: Vec<Complex<f64>>,
}

/// Width of a located bracket, as a fraction of the step.
const LOCATION_WIDTH: f64 = 1e-9;
/// Halvings of a step in which more than one thing happens to the multipliers.
const MAX_HALVINGS: usize = 8;
/// Halvings of a step that turns in the parameter.
const FOLD_HALVINGS: usize = 3;
/// Halvings of a step at both ends of which a multiplier is near -1: it may pass it and come back.
const NEAR_HALVINGS: usize = 2;
/// Distance from -1 that counts as near.
const NEAR_MINUS_ONE: f64 = 0.3;
/// Imaginary part below which a multiplier counts as real, relative to its modulus.
const REAL: f64 = 1e-9;

/// Numbers of multipliers outside the unit circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Outside {
    below_minus_one: i32,
    above_one: i32,
    pairs: i32,
}

impl Outside {
    fn of(multipliers: &[Complex<f64>]) -> Outside {
        let is_real = |mu: &&Complex<f64>| mu.im.abs() <= REAL * mu.norm();
        let outside = || multipliers.iter().filter(|mu| mu.norm() > 1.0);
        Outside {
            below_minus_one: outside().filter(is_real).filter(|mu| mu.re < 0.0).count() as i32,
            above_one: outside().filter(is_real).filter(|mu| mu.re > 0.0).count() as i32,
            pairs: outside().filter(|mu| !is_real(mu) && mu.im > 0.0).count() as i32,
        }
    }

    fn total(self) -> i32 {
        self.below_minus_one + self.above_one + 2 * self.pairs
    }
}

/// Counts at two probes; equal where the multipliers of one are unknown.
fn outside(a: &Probe, b: &Probe) -> (Outside, Outside) {
    let known = if a.multipliers.len() == b.multipliers.len() {
        b
    } else {
        a
    };
    (Outside::of(&a.multipliers), Outside::of(&known.multipliers))
}

/// The step under examination.
pub struct Step<'a> {
    /// The path; its last step is examined.
    pub path: &'a mut Continuation,
    /// The problem.
    pub problem: &'a mut dyn PeriodicResidual,
    /// Whether multipliers are to be computed.
    pub stability: bool,
    /// Point of the branch before the step.
    pub after_point: usize,
}

impl Step<'_> {
    /// Everything that happens between two probes, in the order of the path.
    ///
    /// # Errors
    /// What the problem returns.
    pub fn events(&mut self, a: &Probe, b: &Probe) -> Result<Vec<BifurcationEvent>, SolveError> {
        let mut list = Vec::new();
        self.scan(a, b, 0, &mut list)?;
        Ok(list)
    }

    fn probe(&mut self, fraction: f64) -> Result<Option<Probe>, SolveError> {
        let Some(point) = self.path.at_fraction(self.problem, fraction)? else {
            return Ok(None);
        };
        let multipliers = if self.stability {
            self.problem.multipliers(&point.u, point.lambda)?
        } else {
            Vec::new()
        };
        Ok(Some(Probe {
            fraction,
            point,
            multipliers,
        }))
    }

    /// Halves the stretch until at most one thing happens to the multipliers in it.
    fn scan(
        &mut self,
        a: &Probe,
        b: &Probe,
        depth: usize,
        list: &mut Vec<BifurcationEvent>,
    ) -> Result<(), SolveError> {
        let (before, after) = outside(a, b);
        let doubled = after.below_minus_one - before.below_minus_one;
        let passed = after.above_one - before.above_one;
        let paired = after.pairs - before.pairs;
        let changes = doubled.abs() + passed.abs() + paired.abs();
        let turns = a.point.tangent_lambda * b.point.tangent_lambda < 0.0;
        // Around a fold the multipliers move fast: what passes the circle on one side may pass it back on the other.
        let crowded = changes > 1 && depth < MAX_HALVINGS;
        let is_fold = self.stability && turns && depth < FOLD_HALVINGS;
        let is_near = |p: &Probe| {
            p.multipliers
                .iter()
                .any(|mu| (mu + 1.0).norm() < NEAR_MINUS_ONE)
        };
        let may_double = changes == 0 && depth < NEAR_HALVINGS && is_near(a) && is_near(b);
        if (crowded || is_fold || may_double)
            && let Some(middle) = self.probe(0.5 * (a.fraction + b.fraction))?
        {
            self.scan(a, &middle, depth + 1, list)?;
            return self.scan(&middle, b, depth + 1, list);
        }
        if turns {
            let found = self.locate(EventKind::Fold, a, b, |p| p.point.tangent_lambda)?;
            list.push(found);
        } else if i32::from(a.point.orientation) * i32::from(b.point.orientation) < 0 {
            let found = self.locate(EventKind::BranchPoint, a, b, |p| {
                f64::from(p.point.orientation)
            })?;
            list.push(found);
        }
        if doubled % 2 != 0 {
            let found = self.locate(EventKind::PeriodDoubling, a, b, |p| {
                distance_from_minus_one(&p.multipliers)
            })?;
            list.push(found);
        }
        // Two real multipliers that leave the circle together or meet outside it are no passage of a pair.
        if paired != 0 && after.total() != before.total() && doubled % 2 == 0 {
            let rank = before.pairs.max(after.pairs) as usize;
            let found = self.locate(EventKind::NeimarkSacker, a, b, |p| {
                pair_modulus(&p.multipliers, rank) - 1.0
            })?;
            list.push(found);
        }
        list.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        Ok(())
    }

    /// Root of a test function between two probes.
    fn locate(
        &mut self,
        kind: EventKind,
        a: &Probe,
        b: &Probe,
        test: impl Fn(&Probe) -> f64,
    ) -> Result<BifurcationEvent, SolveError> {
        let mut seen = vec![(a.fraction, a.point.lambda), (b.fraction, b.point.lambda)];
        let (low, high) = ((a.fraction, test(a)), (b.fraction, test(b)));
        let sought = roots::bracketed(
            |x| {
                let probe = self.probe(x).map_err(Some)?.ok_or(None)?;
                seen.push((x, probe.point.lambda));
                Ok::<f64, Option<SolveError>>(test(&probe))
            },
            low,
            high,
            LOCATION_WIDTH,
        );
        let lambda_at = |x: f64| seen.iter().find(|s| s.0 == x).map_or(f64::NAN, |s| s.1);
        let outer = (
            a.point.lambda.min(b.point.lambda),
            a.point.lambda.max(b.point.lambda),
        );
        let after_point = self.after_point;
        match sought {
            Ok(found) if low.1 * high.1 < 0.0 => {
                let ends = (lambda_at(found.low), lambda_at(found.high));
                let bracket = if kind == EventKind::Fold {
                    outer
                } else {
                    (ends.0.min(ends.1), ends.0.max(ends.1))
                };
                let lambda = lambda_at(found.root);
                Ok(BifurcationEvent {
                    kind,
                    lambda,
                    bracket,
                    located: true,
                    after_point,
                    fraction: found.root,
                    recorded: Vec::new(),
                })
            }
            Err(Some(error)) => Err(error),
            _ => Ok(BifurcationEvent {
                kind,
                lambda: 0.5 * (outer.0 + outer.1),
                bracket: outer,
                located: false,
                after_point,
                fraction: 0.5 * (a.fraction + b.fraction),
                recorded: Vec::new(),
            }),
        }
    }
}

/// det(Phi + I), without the growth of the large multipliers.
fn distance_from_minus_one(multipliers: &[Complex<f64>]) -> f64 {
    let product: Complex<f64> = multipliers
        .iter()
        .map(|mu| (mu + 1.0) / (1.0 + mu.norm()))
        .product();
    product.re
}

/// Modulus of the complex pair of that rank (1: the largest); a pair that has become real inside the circle counts as 0.
fn pair_modulus(multipliers: &[Complex<f64>], rank: usize) -> f64 {
    let mut moduli: Vec<f64> = multipliers
        .iter()
        .filter(|mu| mu.im > REAL * mu.norm())
        .map(|mu| mu.norm())
        .collect();
    moduli.sort_by(|a, b| b.total_cmp(a));
    moduli.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}
