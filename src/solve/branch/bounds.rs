//! Branches that leave for infinity.

use super::Tracer;
use crate::error::SolveError;
use crate::solve::continuation::PathEnd;
use crate::solve::events::Probe;
use std::f64::consts::TAU;

/// Instants per excitation period at which deformations without breakpoints are looked at: a bound needs no peaks.
const INSTANTS: usize = 16;
/// Share of the bound up to which a vertical branch is followed: it may bend where it meets a breakpoint.
const VERTICAL: f64 = 0.01;

impl Tracer<'_> {
    /// Why the branch ends at a point whose deformations are too large to mean anything.
    pub(super) fn runaway(&mut self, at: &Probe) -> Result<Option<PathEnd>, SolveError> {
        if self.options.bounds.is_empty() {
            return Ok(None);
        }
        let share = self.share_of_bounds(at)?;
        Ok(match self.path.is_vertical() {
            [_, true] if share > VERTICAL => Some(PathEnd::Vertical),
            _ if share > 1.0 => Some(PathEnd::Unbounded),
            _ => None,
        })
    }

    /// Largest deformation in units of its bound.
    fn share_of_bounds(&mut self, at: &Probe) -> Result<f64, SolveError> {
        let survey = &at.look.survey;
        let system = self.problem.system_at(at.point.lambda)?;
        let bounds = &self.options.bounds;
        let mut share = 0.0_f64;
        for (extrema, bound) in survey.extrema.iter().zip(bounds) {
            let values = extrema.iter().map(|(_, x)| x.abs());
            share = values.fold(share, |s, x| s.max(x / bound));
        }
        let unseen = |e: &usize| survey.extrema[*e].is_empty();
        let smooth: Vec<usize> = (0..bounds.len()).filter(unseen).collect();
        let instants = INSTANTS * system.subharmonic();
        let mut state = vec![0.0; system.state_size()];
        for k in 0..if smooth.is_empty() { 0 } else { instants } {
            let tau = k as f64 * TAU / instants as f64;
            survey.orbit.state(tau, &mut state);
            for e in &smooth {
                let row = system.element_map_row(*e).iter();
                let x: f64 = row.map(|(j, w)| w * state[*j]).sum();
                share = share.max(x.abs() / bounds[*e]);
            }
        }
        Ok(share)
    }
}
