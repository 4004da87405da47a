//! Poles: where a multiplier of a linear train is 1, its response is infinite. On both sides of the pole there is one response,
//! and the multipliers do not depend on it.

use super::delivered::{Delivered, Ending};
use super::source::BranchSource;
use super::trace::Work;
use super::{BranchSettings, Method};
use crate::error::{Error, SolveError};
use crate::numeric::roots::{self, Bracketed};
use crate::solve::continuation::CrossingSide;
use crate::solve::events::{BifurcationEvent, Count, EventKind, Sought, Verdict};
use crate::solve::family::Family;
use crate::solve::floquet;
use crate::solve::galerkin::Galerkin;
use crate::solve::residual::Residual;
use crate::solve::shooting::Shooting;
use crate::system::Mount;
use nalgebra::DVector;
use num_complex::Complex;

/// First distance from the last point at which the pole is sought, relative to the parameter, and the factor to the next one.
const NEXT: (f64, f64) = (1e-7, 2.0);
/// Width to which a pole is located, relative to the parameter.
const WIDTH: f64 = 1e-10;
/// Distance from 1 of a multiplier that passes there.
const AT_ONE: f64 = 1e-4;
/// The parameter counts as at least this share of the range.
const LEAST: f64 = 1e-3;
/// Distances behind the pole at which the branch may be taken up again, over that at which it was given up: the response is a
/// tenth there, or, where another pole is near, a little smaller.
const BEHIND: [f64; 3] = [10.0, 4.0, 1.5];
/// Poles along one range.
const MOST: usize = 100;

/// A pole between two parameters.
struct Pole {
    at: f64,
    bracket: (f64, f64),
    unstable: (usize, usize),
    /// Where the branch may be taken up again; `None`: nowhere before the end of the range.
    behind: Option<f64>,
}

/// Multipliers of a linear system, whose transition matrix is the same along every motion.
struct LinearTrain<F: Family> {
    shooting: Shooting<F>,
    state: Vec<f64>,
}

impl<F: Family> LinearTrain<F> {
    fn multipliers(&mut self, lambda: f64) -> Result<Vec<Complex<f64>>, SolveError> {
        let image = self.shooting.image(&self.state, lambda, &mut ())?;
        Ok(image.map_or(Vec::new(), |image| floquet::multipliers(image.phi)))
    }

    fn value(&mut self, sought: Sought, lambda: f64) -> Result<f64, SolveError> {
        Ok(sought.value(&self.multipliers(lambda)?))
    }

    /// The next pole from a parameter on, towards the end of the range; `scale`: size of the parameter.
    fn pole(&mut self, from: f64, to: f64, scale: f64) -> Result<Option<Pole>, SolveError> {
        let sign = (to - from).signum();
        let mut low = (from, Count::of(&self.multipliers(from)?));
        let mut stride = NEXT.0 * scale;
        while (to - low.0) * sign > 0.0 {
            let next = low.0 + sign * stride.min((to - low.0).abs());
            let high = (next, Count::of(&self.multipliers(next)?));
            let (Some(before), Some(behind)) = (low.1, high.1) else {
                return Ok(None);
            };
            if before != behind
                && let Some(found) = self.passage((low.0, next), before.sought(behind), scale)?
            {
                return Ok(Some(Pole {
                    at: found.root,
                    bracket: (found.low, found.high),
                    unstable: (before.outside, behind.outside),
                    behind: self.behind(found.root, (from, to), behind)?,
                }));
            }
            (low, stride) = (high, NEXT.1 * stride);
        }
        Ok(None)
    }

    /// A place behind a pole with the same count as just behind it.
    fn behind(
        &mut self,
        pole: f64,
        (from, to): (f64, f64),
        count: Count,
    ) -> Result<Option<f64>, SolveError> {
        for place in BEHIND.map(|share| pole + share * (pole - from)) {
            let is_inside = (to - place) * (to - from) > 0.0;
            if is_inside && Count::of(&self.multipliers(place)?) == Some(count) {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }

    /// Where a multiplier passes 1 between two parameters; `None` where something else passes.
    fn passage(
        &mut self,
        (low, high): (f64, f64),
        sought: Sought,
        scale: f64,
    ) -> Result<Option<Bracketed>, SolveError> {
        let ends = [low, high].map(|x| Ok::<_, SolveError>((x, self.value(sought, x)?)));
        let [low, high] = ends;
        let found = roots::bracketed(|x| self.value(sought, x), low?, high?, WIDTH * scale)?;
        let list = self.multipliers(found.root)?;
        let is_one = |mu: &Complex<f64>| (mu - 1.0).norm() < AT_ONE;
        Ok(list.iter().any(is_one).then_some(found))
    }
}

/// Whether a law is a straight line.
fn is_linear(mount: &Mount) -> bool {
    let law = &mount.element;
    law.is_piecewise_affine() && !law.depends_on_velocity() && law.breakpoints().is_empty()
}

impl Work<'_> {
    /// Lists the poles at which the branch of a linear train ends, and goes on behind them to the end of the range.
    pub(super) fn follow_behind_poles(&mut self, method: Method) -> Result<(), Error> {
        let mut mounts = self.swept.setting.assembly.system.mounts().iter();
        if !mounts.all(is_linear) {
            return Ok(());
        }
        for _ in 0..MOST {
            let number = self.delivered.len() - 1;
            let Some(pole) = self.pole_behind(number)? else {
                break;
            };
            let place = self.swept.place(pole.at);
            let delivered = &mut self.delivered[number];
            delivered.events.push(event(&pole, delivered.points.len()));
            let Some(behind) = pole.behind else {
                break;
            };
            let mut piece = Delivered::new(method, self.settings.subharmonic);
            piece.start = Some(format!("behind the pole at {place}"));
            piece.is_restart = true;
            let u = DVector::zeros(self.unknowns(method, behind)?);
            self.follow(
                BranchSource::Inside(u, behind, CrossingSide::Forward),
                &mut piece,
            )?;
            if piece.points.is_empty() {
                break;
            }
            self.delivered[number].end = Ending {
                reason: "unbounded",
                message: format!(
                    "the response grows without bound: a multiplier of the linear train is 1 at {place}; branch {} \
                     continues behind it",
                    number + 1
                ),
                is_early: false,
            };
            self.delivered.push(piece);
        }
        Ok(())
    }

    /// The pole at which a branch was given up.
    fn pole_behind(&self, number: usize) -> Result<Option<Pole>, Error> {
        let delivered = &self.delivered[number];
        let (settings, swept): (&BranchSettings, _) = (self.settings, self.swept);
        let last = delivered.points.last().map(|p| p.lambda);
        let Some(last) = last.filter(|_| delivered.end.reason == "unbounded") else {
            return Ok(None);
        };
        let family = swept.family_for(delivered.subharmonic)?;
        let shooting = Shooting::new(family, last, settings.flow())?;
        let state = vec![0.0; shooting.dim()];
        let (from, to) = swept.range;
        let scale = last.abs().max(LEAST * (to - from).abs());
        let mut linear = LinearTrain { shooting, state };
        match linear.pole(last, to, scale) {
            // The model ends before.
            Err(SolveError::NoSystem { .. }) => Ok(None),
            found => Ok(found?),
        }
    }

    /// Number of unknowns of a method.
    fn unknowns(&self, method: Method, lambda: f64) -> Result<usize, Error> {
        let (settings, swept) = (self.settings, self.swept);
        if method == Method::Shooting {
            return Ok(swept.setting.assembly.system.state_size());
        }
        let size = settings.size_with(settings.harmonics.first(), settings.subharmonic);
        Ok(Galerkin::new(swept.family_for(settings.subharmonic)?, lambda, size)?.dim())
    }
}

/// A pole behind the last point.
fn event(pole: &Pole, points: usize) -> BifurcationEvent {
    BifurcationEvent {
        kind: EventKind::BranchPoint,
        lambda: pole.at,
        method_lambda: f64::NAN,
        verdict: Verdict::Confirmed,
        bracket: pole.bracket,
        multiplicity: pole.unstable.0.abs_diff(pole.unstable.1).max(1),
        unstable: Some(pole.unstable),
        after_point: points.saturating_sub(1),
        fraction: 1.0,
        point: None,
        breakpoint: None,
        doubt: 0.0,
        recorded: Vec::new(),
    }
}
