//! Period doublings too close to a grazing to be told from it.
//!
//! Beside a grazing with a stop of stiffness k, a multiplier varies like the root of the distance times the root of k: it passes -1 at a
//! distance of the order 1/k, which for stiff stops is below the rounding of the parameter.

use super::Tracer;
use crate::error::SolveError;
use crate::solve::events::{BifurcationEvent, Count, EventKind, Examined, Probe};

/// Distances from the grazing on both sides, as shares of the step, at which the multipliers are counted.
const BESIDE: [f64; 2] = [1e-7, 1e-6];

impl Tracer<'_> {
    /// Adds the doublings without a place of their own that happen at a grazing of the step.
    pub(super) fn double_at_grazings(
        &mut self,
        ends: (&Probe, &Probe),
        examined: &mut Examined,
    ) -> Result<(), SolveError> {
        let touches = |e: &BifurcationEvent| matches!(e.kind, EventKind::Grazing { .. });
        if !examined.events.iter().any(touches) && examined.events.iter().all(|e| e.point.is_some())
        {
            // Whoever asks next what is unexplained finds the same.
            return Ok(());
        }
        let is_doubling = |kind| kind == EventKind::PeriodDoubling;
        let mut gaps = self.unexplained(ends, examined)?;
        gaps.retain(|gap| is_doubling(gap.kind) && !self.has_equal_halves());
        for gap in gaps {
            let is_here = |e: &&BifurcationEvent| {
                touches(e)
                    && e.point.is_some()
                    && (gap.fractions.0..=gap.fractions.1).contains(&e.fraction)
            };
            let here: Vec<_> = examined.events.iter().filter(is_here).cloned().collect();
            for touch in here {
                let Some(bracket) = self.doubling_at(touch.fraction)? else {
                    continue;
                };
                examined.events.push(BifurcationEvent {
                    kind: EventKind::PeriodDoubling,
                    bracket,
                    multiplicity: 1,
                    unstable: gap.unstable,
                    breakpoint: None,
                    ..touch
                });
                break;
            }
        }
        Ok(())
    }

    /// Parameters just before and just behind a place of the step between which a real multiplier passes -1.
    fn doubling_at(&mut self, fraction: f64) -> Result<Option<(f64, f64)>, SolveError> {
        for distance in BESIDE {
            let mut sides = Vec::with_capacity(2);
            for x in [fraction - distance, fraction + distance] {
                if let Some(point) = self.path.at_fraction(self.problem, x)? {
                    sides.push(self.probe(point, x)?);
                }
            }
            let counts: Vec<Count> = sides.iter().filter_map(|p| p.look.count()).collect();
            if let ([low, high], [before, behind]) = (&sides[..], &counts[..])
                && before.passes_minus_one(*behind)
            {
                let (a, b) = (low.point.lambda, high.point.lambda);
                return Ok(Some((a.min(b), a.max(b))));
            }
        }
        Ok(None)
    }
}
