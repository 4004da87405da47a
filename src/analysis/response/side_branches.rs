//! Branch switching: the other branches that begin where a branch is crossed.
//!
//! At a period doubling the branch of twice the period begins; its two arms are one orbit seen an excitation period apart, so one
//! is followed. At a branch point both arms of the other branch are followed, each a branch of its own. Where equal multipliers
//! pass together, several branches leave: each single part, and sums and differences of parts, are tried ([`Heading`]), and those
//! that lead to a branch already followed are left out.

use super::crossings::{Limits, MOST_HARMONICS};
use super::delivered::{Delivered, Origin};
use super::source::BranchSource;
use super::trace::Work;
use super::{BranchSettings, Method};
use crate::error::Error;
use crate::solve::continuation::{CrossingSide, Heading};
use crate::solve::events::EventKind;

impl BranchSettings {
    /// Whether a subharmonic index is within what a problem can hold.
    fn holds(&self, subharmonic: usize) -> bool {
        self.harmonics.most().saturating_mul(subharmonic) <= MOST_HARMONICS
    }
}

impl Work<'_> {
    /// Follows what begins on the branches delivered since `first`, in their order, and on those that come of it.
    pub(super) fn follow_crossings(&mut self, method: Method, first: usize) -> Result<(), Error> {
        let Some(limits) = self.settings.branches.limits() else {
            return Ok(());
        };
        let (mut branch, mut left_out) = (first, 0);
        while branch < self.delivered.len() {
            for event in 0..self.delivered[branch].events.len() {
                if !self.crossings.is_open(branch, event) {
                    continue;
                }
                if self.swept.setting.control.is_interrupted() {
                    return Ok(());
                }
                let origin = self.origin(branch, event);
                let is_within =
                    origin.depth <= limits.depth && self.delivered.len() - first < limits.limit;
                let revolutions = self.swept.setting.assembly.system.revolutions();
                if is_within
                    && self
                        .settings
                        .holds(self.subharmonic(origin).saturating_mul(revolutions))
                {
                    self.leave(method, origin)?;
                } else {
                    left_out += 1;
                }
            }
            branch += 1;
        }
        if left_out > 0 {
            let word = method.word();
            let Limits { depth, limit } = limits;
            self.warnings.push(format!(
                "{word}: the branches at {left_out} further bifurcations were not followed (depth {depth}, at most \
                 {limit} branches, at most {MOST_HARMONICS} harmonics of the response frequency)"
            ));
        }
        Ok(())
    }

    fn origin(&self, parent: usize, event: usize) -> Origin {
        let branch = &self.delivered[parent];
        Origin {
            parent,
            event,
            kind: branch.events[event].kind,
            depth: 1 + branch.origin.map_or(0, |o| o.depth),
        }
    }

    fn subharmonic(&self, origin: Origin) -> usize {
        let nu = self.delivered[origin.parent].subharmonic;
        match origin.kind {
            EventKind::PeriodDoubling => 2 * nu,
            _ => nu,
        }
    }

    /// Follows what begins at an event: one branch or two arms in every direction.
    fn leave(&mut self, method: Method, origin: Origin) -> Result<(), Error> {
        let sides: &[CrossingSide] = match origin.kind {
            EventKind::PeriodDoubling => &[CrossingSide::Forward],
            _ => &[CrossingSide::Forward, CrossingSide::Backward],
        };
        let event = &self.delivered[origin.parent].events[origin.event];
        let Some(point) = event.point.clone() else {
            return Ok(());
        };
        let headings = Heading::all(event.multiplicity);
        self.arms.clear();
        for heading in headings {
            for side in sides {
                let mut delivered = Delivered::new(method, self.subharmonic(origin));
                delivered.origin = Some(origin);
                let source = BranchSource::Crossing {
                    point: Box::new(point.clone()),
                    subharmonic: self.delivered[origin.parent].subharmonic,
                    side: *side,
                    heading,
                    is_doubled: origin.kind == EventKind::PeriodDoubling,
                };
                self.follow(source, &mut delivered)?;
                if !delivered.is_twin {
                    self.delivered.push(delivered);
                }
            }
        }
        Ok(())
    }
}
