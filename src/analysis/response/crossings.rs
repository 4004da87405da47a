//! Where branches are crossed by others: which crossings are known, and which of them are taken.

use super::delivered::{Delivered, Ending};
use crate::analysis::branch_table::MeasureRecorder;
use crate::error::Error;
use crate::solve::branch::{BranchPoint, Recorder};
use crate::solve::continuation::PathEnd;
use crate::solve::events::EventKind;
use crate::solve::orbit::Orbit;
use crate::solve::place::Place;
use crate::solve::residual::PeriodicResidual;
use crate::system::System;
use nalgebra::DVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which branches to follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "`primary`, `all` or {depth: .., limit: ..}")]
pub enum Branches {
    /// By a word.
    Word(Word),
    /// The primary branch and others, within limits.
    Limits(Limits),
}

/// Which branches to follow, by a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// The branch through the first solution.
    Primary,
    /// Also the branches that begin at events, within the default limits.
    All,
}

/// Limits of the search for branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Largest number of crossings between the primary branch and another branch.
    pub depth: usize,
    /// Largest number of branches per method, including the primary branch.
    pub limit: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            depth: 2,
            limit: 20,
        }
    }
}

impl Default for Branches {
    fn default() -> Self {
        Branches::Word(Word::Primary)
    }
}

impl Branches {
    /// The limits; `None` if only the primary branch is requested.
    pub(super) fn limits(self) -> Option<Limits> {
        match self {
            Branches::Word(Word::Primary) => None,
            Branches::Word(Word::All) => Some(Limits::default()),
            Branches::Limits(limits) => Some(limits),
        }
    }
}

/// Most harmonics of the response frequency.
pub(super) const MOST_HARMONICS: usize = 4096;

/// A place at which another branch begins.
pub(super) struct BranchCrossing {
    branch: usize,
    event: usize,
    place: Place,
    /// Whether both branches through it are known.
    is_taken: bool,
}

/// The crossings of the branches of one method.
#[derive(Default)]
pub(super) struct Crossings(Vec<BranchCrossing>);

impl Crossings {
    /// Their places.
    pub fn places(&self) -> Vec<Place> {
        self.0.iter().map(|c| c.place.clone()).collect()
    }

    /// Adds those of a branch, and takes the one onto which it returned; the number of the branch that it met there.
    pub fn add(
        &mut self,
        problem: &mut dyn PeriodicResidual,
        branch: usize,
        Delivered { points, events, .. }: &Delivered,
        end: PathEnd,
    ) -> Result<Option<usize>, Error> {
        // The branch ends with the point at which it met the other one.
        let joint = match (end, points.last()) {
            (PathEnd::Joined { .. }, Some(last)) => Some(last.lambda),
            _ => None,
        };
        let met = match end {
            PathEnd::Joined { known: Some(known) } => {
                self.0[known].is_taken = true;
                Some(self.0[known].branch)
            }
            _ => None,
        };
        for (event, found) in events.iter().enumerate() {
            let Some(point) = &found.point else { continue };
            if !leads_on(found.kind) || Some(found.method_lambda) == joint || !found.is_located() {
                continue;
            }
            let place = Place::of(problem, &point.u, point.lambda)?;
            // A place that is passed twice has two known branches.
            let twin = place.nearest(&self.places());
            let is_twin = |k: &usize| self.0[*k].place.subharmonic() == place.subharmonic();
            let twin = twin.filter(is_twin);
            if let Some(twin) = twin {
                self.0[twin].is_taken = true;
            }
            self.0.push(BranchCrossing {
                branch,
                event,
                place,
                is_taken: twin.is_some(),
            });
        }
        Ok(met)
    }

    pub fn is_open(&self, branch: usize, event: usize) -> bool {
        let here = |c: &&BranchCrossing| c.branch == branch && c.event == event;
        self.0.iter().find(here).is_some_and(|c| !c.is_taken)
    }
}

/// Whether another branch of periodic solutions begins there.
fn leads_on(kind: EventKind) -> bool {
    matches!(kind, EventKind::PeriodDoubling | EventKind::BranchPoint)
}

/// Cosine of the angle between two arms that are one.
const SAME_ARM: f64 = 0.99;

/// Records a branch that leaves a crossing, and stops it where another one has gone the same way.
pub(super) struct Apart<'r, 's> {
    inner: &'r mut MeasureRecorder<'s>,
    /// Directions of the arms followed before, of unit length.
    arms: &'r [DVector<f64>],
    first: Option<DVector<f64>>,
    /// Its own direction, once there is a second point.
    pub arm: Option<DVector<f64>>,
    /// Whether another one has gone the same way.
    pub is_twin: bool,
}

impl<'r, 's> Apart<'r, 's> {
    /// Keeps apart from these arms.
    pub fn new(inner: &'r mut MeasureRecorder<'s>, arms: &'r [DVector<f64>]) -> Apart<'r, 's> {
        Apart {
            inner,
            arms,
            first: None,
            arm: None,
            is_twin: false,
        }
    }
}

impl Recorder for Apart<'_, '_> {
    fn record(&mut self, lambda: f64, system: &System, orbit: &Orbit, values: &mut Vec<f64>) {
        self.inner.record(lambda, system, orbit, values);
    }

    fn accept(&mut self, point: &BranchPoint) -> bool {
        match &self.first {
            None => self.first = Some(point.unknowns.clone()),
            Some(first) if self.arm.is_none() && first.len() == point.unknowns.len() => {
                let arm = (&point.unknowns - first).normalize();
                let is_same =
                    |other: &DVector<f64>| other.len() == arm.len() && other.dot(&arm) > SAME_ARM;
                self.is_twin = self.arms.iter().any(is_same);
                self.arm = Some(arm);
            }
            Some(_) => {}
        }
        self.inner.accept(point) && !self.is_twin
    }
}

/// The end of a branch that began at a crossing: it may leave the range on either side, and one that is vertical has been told
/// in full.
pub(super) fn ending(end: PathEnd) -> Option<Ending> {
    match end {
        PathEnd::ReturnedToStart => Some(Ending {
            message: "the start of the range was reached".into(),
            ..Ending::complete()
        }),
        PathEnd::Vertical => Some(Ending {
            reason: end.reason(),
            message: end.message(),
            is_early: false,
        }),
        _ => None,
    }
}
