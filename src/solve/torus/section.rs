//! The phase at which the map is taken.
//!
//! Where a connection switches at the phase of the section somewhere along the curve, the map has a kink there and interpolation
//! converges slowly; at a phase where no deformation passes a breakpoint along the curve it is as smooth as between switches.

use super::{CurveOfTorus, TorusProblem};
use crate::error::SolveError;
use crate::solve::segment_orbit::SegmentOrbit;
use std::f64::consts::TAU;

/// Phases that are looked at per response period.
const PHASES: usize = 48;

impl TorusProblem<'_> {
    /// The same curve at another phase.
    pub(super) fn transported(
        &mut self,
        torus: &CurveOfTorus,
        section: f64,
    ) -> Result<CurveOfTorus, SolveError> {
        let n = self.shots.size();
        let mut moved = torus.clone();
        moved.section = section;
        let length = (section - torus.section).rem_euclid(TAU);
        if length == 0.0 {
            return Ok(moved);
        }
        let span = (torus.section, torus.section + length);
        for state in moved.points.chunks_exact_mut(n) {
            if !self
                .shots
                .map([torus.lambda, 0.0], span, (&mut *state, None))?
            {
                state.fill(f64::NAN);
            }
        }
        Ok(moved)
    }

    /// The orbits of all points of a curve over one response period from phase 0.
    ///
    /// # Errors
    /// There is no system, or an interruption.
    pub fn orbits(&mut self, torus: &CurveOfTorus) -> Result<Vec<SegmentOrbit>, SolveError> {
        let n = self.shots.size();
        let whole = self.transported(torus, 0.0)?;
        let p = [torus.lambda, 0.0];
        let system = self.shots.system(p)?;
        let empty = SegmentOrbit::new(system.omega(), system.subharmonic(), system.dof());
        let mut list = Vec::with_capacity(self.count);
        for state in whole.points.chunks_exact(n) {
            let (mut orbit, mut state) = (empty.clone(), state.to_vec());
            if self
                .shots
                .observed(p, (0.0, TAU), (&mut state, None), &mut orbit)?
            {
                list.push(orbit);
            }
        }
        Ok(list)
    }

    /// A phase at which no deformation passes a breakpoint along the curve, as far from that as there is: the present one if it
    /// has none.
    pub(super) fn better_section(
        &mut self,
        torus: &CurveOfTorus,
    ) -> Result<Option<f64>, SolveError> {
        let orbits = self.orbits(torus)?;
        let system = self.shots.system([torus.lambda, 0.0])?;
        let (levels, mut scratch) = (system.breakpoints(), system.scratch());
        let mut state = vec![0.0; 2 * system.dof()];
        // Least distance from a breakpoint, negative where the curve lies on both sides.
        let mut clearance = |tau: f64| {
            let mut sides: Vec<(f64, f64)> = Vec::new();
            for orbit in &orbits {
                orbit.state(tau, &mut state);
                system.respond(tau, &state, &mut scratch);
                let gaps = levels.iter().zip(&scratch.deformation);
                let gaps = gaps.flat_map(|(own, x)| own.iter().map(move |level| x - level));
                for (k, gap) in gaps.enumerate() {
                    match sides.get_mut(k) {
                        Some(ends) => *ends = (ends.0.min(gap), ends.1.max(gap)),
                        None => sides.push((gap, gap)),
                    }
                }
            }
            let own = sides.iter().map(|(low, high)| low.max(-high));
            own.fold(f64::INFINITY, f64::min)
        };
        if clearance(torus.section) > 0.0 {
            return Ok(None);
        }
        let phases = (0..PHASES).map(|k| TAU * k as f64 / PHASES as f64);
        let judged = phases.map(|tau| (clearance(tau), tau));
        let best = judged.max_by(|a, b| a.0.total_cmp(&b.0));
        Ok(best.filter(|(gap, _)| *gap > 0.0).map(|(_, tau)| tau))
    }
}
