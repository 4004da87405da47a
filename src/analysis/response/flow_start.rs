//! The first periodic solution where there is no Galerkin method: what the motion from rest comes to.

use super::Method;
use super::delivered::{Delivered, Ending};
use super::source::BranchSource;
use super::trace::{Work, sizes};
use crate::analysis::flow;
use crate::error::Error;
use crate::solve::integrate::{IntegrationEnd, choose};
use crate::solve::uninterrupted;
use nalgebra::DVector;
use std::f64::consts::TAU;

/// Periods of the response from rest before Newton's iteration.
const TRANSIENT: usize = 400;
/// Change of a state over a period, relative to its size, at which the motion has settled.
const SETTLED: f64 = 1e-9;

impl Work<'_> {
    /// Whether a branch begins where the motion from rest leads.
    pub(super) fn starts_by_flow(&self, method: Method) -> bool {
        let system = &self.swept.setting.assembly.system;
        let mut laws = system.mounts().iter().map(|m| &m.element);
        method == Method::Shooting && laws.any(|law| law.automata().is_some())
    }

    /// The branch from what the motion comes to.
    pub(super) fn settled(&mut self, method: Method) -> Result<Delivered, Error> {
        let mut delivered = Delivered::new(method, self.settings.subharmonic);
        match self.settle_from_rest()? {
            Ok(u) => self.follow(BranchSource::Guess(u), &mut delivered)?,
            Err(message) => delivered.end = Ending::early("no_start", message),
        }
        Ok(delivered)
    }

    /// A state near a periodic solution at the beginning of the range, or why there is none; sets the bounds of the branch.
    pub(super) fn settle_from_rest(&mut self) -> Result<Result<DVector<f64>, String>, Error> {
        let (settings, swept) = (self.settings, self.swept);
        let from = swept.range.0;
        let mut family = swept.family_for(settings.subharmonic)?;
        let system = family.at(from)?;
        let mut integrator = choose(system, settings.flow())?;
        let (mut state, _) = flow::rest(system);
        let mut largest = vec![0.0_f64; system.element_count()];
        let (mut nearest, mut least) = (state.clone(), f64::INFINITY);
        for period in 0..TRANSIENT {
            let before = state.clone();
            let end = integrator.advance(system, (0.0, TAU), &mut state, &mut ());
            uninterrupted()?;
            if end != IntegrationEnd::Reached {
                return Ok(Err(format!("integration from rest: {}", end.message())));
            }
            for (e, size) in largest.iter_mut().enumerate() {
                let row = system.element_map_row(e).iter();
                *size = size.max(row.map(|(j, w)| w * state[*j]).sum::<f64>().abs());
            }
            let size = state.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
            let changes = state.iter().zip(&before).map(|(x, y)| (x - y).abs());
            let change = changes.fold(0.0, f64::max) / size;
            // A motion that does not settle comes close to orbits that repel it.
            if change < least && 2 * period >= TRANSIENT || change <= SETTLED {
                (nearest, least) = (before, change);
            }
            if change <= SETTLED {
                break;
            }
        }
        let state = nearest;
        let bounds = sizes(system).into_iter().zip(largest);
        self.bounds = bounds
            .map(|(size, moved)| settings.bound * size.max(moved).max(1.0))
            .collect();
        Ok(Ok(DVector::from_vec(state)))
    }
}
