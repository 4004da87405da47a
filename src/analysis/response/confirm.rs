//! The keys `confirm` and `verify`: what of Galerkin branches is taken through the flow.

use super::BranchSettings;
use super::trace::Work;
use super::verify::TakenBranch;
use crate::analysis::Setting;
use crate::analysis::branch_table::MeasureRecorder;
use crate::analysis::cost::Period;
use crate::error::Error;
use crate::solve::branch::Branch;
use crate::solve::branch::confirm::ErrorSpread;
use crate::solve::integrate::{Exact, IntegratorChoice, MAX_SWITCHES};
use crate::solve::residual::PeriodicResidual;
use crate::system::System;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::num::NonZeroUsize;

/// Coordinates up to which branches are confirmed unless asked otherwise: the transition matrix of a long train costs more than
/// its Galerkin solution.
const LARGEST: usize = 24;

/// Steps of the flow, times the square of its states, that the confirmation by default may take: half a minute in long trains.
const MOST_WORK: f64 = 3e8;

/// What the flow confirms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Confirm {
    /// Nothing.
    None,
    /// Events and a spread of points.
    Events,
    /// Events and every point.
    All,
    /// Events and every k-th point, the first one among them.
    Every(usize),
}

/// `true`: every point; k: every k-th.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verify {
    /// None.
    None,
    /// Every k-th point, the first one among them; `true` means every point.
    Every(usize),
}

impl From<Verify> for Confirm {
    fn from(verify: Verify) -> Confirm {
        match verify {
            Verify::None => Confirm::None,
            Verify::Every(1) => Confirm::All,
            Verify::Every(stride) => Confirm::Every(stride),
        }
    }
}

impl BranchSettings {
    /// The explicit request.
    pub(super) fn asked(&self) -> Option<Confirm> {
        self.verify.map(Confirm::from).or(self.confirm)
    }

    /// Whether points are listed in a table of their own.
    pub(super) fn lists_points(&self) -> bool {
        matches!(self.asked(), Some(Confirm::All | Confirm::Every(_)))
    }

    /// The points of Galerkin branches that are taken through the flow; `None`: no branch is.
    pub(super) fn spread(&self, setting: &Setting<'_>, system: &System) -> Option<ErrorSpread> {
        let is_judged = super::accuracy::is_asked_for(self);
        let chosen = match self.asked() {
            Some(chosen) => chosen,
            None if self.obstacle(setting, system).is_some() => Confirm::None,
            // An error is the difference from the flow.
            None if is_judged => Confirm::All,
            None => Confirm::Events,
        };
        match chosen {
            Confirm::None => None,
            Confirm::Events if is_judged => Some(ErrorSpread::Every(1)),
            Confirm::Events => Some(ErrorSpread::Some),
            Confirm::All => Some(ErrorSpread::Every(1)),
            Confirm::Every(stride) => Some(ErrorSpread::Every(stride)),
        }
    }

    /// Work that the confirmation of one branch may take.
    pub(super) fn most_work(&self) -> f64 {
        match self.asked() {
            Some(_) => f64::INFINITY,
            None => MOST_WORK,
        }
    }

    /// Reason why branches are not confirmed by default.
    fn obstacle(&self, setting: &Setting<'_>, system: &System) -> Option<String> {
        if self.integrator == IntegratorChoice::Dopri5 {
            return Some("the flow of `integrator: dopri5` is not exact".into());
        }
        if system.dof() > LARGEST {
            let dof = system.dof();
            return Some(format!("there are more than {LARGEST} coordinates ({dof})"));
        }
        let refused = Exact::new(system, MAX_SWITCHES).err()?;
        let refused = setting.name_connection(&refused);
        Some(format!("the flow is not exact ({refused})"))
    }

    /// Reason why events are not confirmed, if the user did not disable it; `None`: they are confirmed, or should not be.
    pub(super) fn unconfirmed(&self, setting: &Setting<'_>, system: &System) -> Option<String> {
        let reason = match self.asked() {
            Some(_) => return None,
            None => self.obstacle(setting, system)?,
        };
        Some(format!(
            "events and stability are the series' own, not confirmed by the flow: {reason}; set `confirm: events` to \
             confirm them."
        ))
    }

    /// Reason why a branch whose response period takes more steps than allowed is not confirmed by the flow.
    pub(super) fn beyond_cost(&self, steps: f64) -> Option<String> {
        (steps > self.max_steps as f64).then(|| {
            format!(
                "galerkin: events and stability are the series' own, not confirmed by the flow: a response period takes about \
                 {steps:.0} integration steps, more than {}; raise `max_steps` to confirm them",
                self.max_steps
            )
        })
    }
}

impl Work<'_> {
    /// Takes a Galerkin branch through the flow: verdicts of its events, multipliers of its points.
    pub(super) fn confirm(
        &mut self,
        problem: &mut dyn PeriodicResidual,
        (branch, begins_at_crossing): (&mut Branch, bool),
        recorder: &mut MeasureRecorder<'_>,
    ) -> Result<(), Error> {
        let (settings, swept) = (self.settings, self.swept);
        let system = problem.system_at(swept.range.0)?;
        let Some(spread) = settings.spread(swept.setting, system) else {
            let reason = settings.unconfirmed(swept.setting, system);
            self.verification.leave_out(reason);
            return Ok(());
        };
        let frequencies = branch.points.iter().map(|p| p.frequency.abs());
        let slowest = frequencies.fold(f64::INFINITY, f64::min);
        let steps = Period::of(swept.setting, slowest).steps * system.subharmonic() as f64;
        if let Some(note) = settings.beyond_cost(steps) {
            if !self.warnings.contains(&note) {
                self.warnings.push(note);
            }
            return Ok(());
        }
        let given = (settings, swept);
        let taken = TakenBranch {
            number: self.delivered.len(),
            spread,
            begins_at_crossing,
            steps,
        };
        let warnings = self
            .verification
            .add(given, problem, taken, branch, recorder)?;
        self.warnings.extend(warnings);
        Ok(())
    }
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ConfirmWord {
    None,
    Events,
    All,
}

impl JsonSchema for Confirm {
    fn schema_name() -> Cow<'static, str> {
        "Confirm".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "enum": ["events", "all", "none"] }, { "type": "integer", "minimum": 1 }] })
    }
}

impl Serialize for Confirm {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Confirm::None => ConfirmWord::None.serialize(serializer),
            Confirm::Events => ConfirmWord::Events.serialize(serializer),
            Confirm::All => ConfirmWord::All.serialize(serializer),
            Confirm::Every(stride) => serializer.serialize_u64(*stride as u64),
        }
    }
}

impl<'de> Deserialize<'de> for Confirm {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(
            untagged,
            expecting = "`events`, `all`, `none`, or k for every k-th point (at least 1)"
        )]
        enum WrittenConfirm {
            Word(ConfirmWord),
            Stride(NonZeroUsize),
        }
        Ok(match WrittenConfirm::deserialize(deserializer)? {
            WrittenConfirm::Word(ConfirmWord::None) => Confirm::None,
            WrittenConfirm::Word(ConfirmWord::Events) => Confirm::Events,
            WrittenConfirm::Word(ConfirmWord::All) => Confirm::All,
            WrittenConfirm::Stride(stride) => Confirm::Every(stride.get()),
        })
    }
}

impl JsonSchema for Verify {
    fn schema_name() -> Cow<'static, str> {
        "Verify".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "boolean" }, { "type": "integer", "minimum": 1 }] })
    }
}

impl Serialize for Verify {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Verify::None => serializer.serialize_bool(false),
            Verify::Every(1) => serializer.serialize_bool(true),
            Verify::Every(stride) => serializer.serialize_u64(*stride as u64),
        }
    }
}

impl<'de> Deserialize<'de> for Verify {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(
            untagged,
            expecting = "false, true, or k for every k-th point (at least 1)"
        )]
        enum WrittenVerify {
            Flag(bool),
            Stride(NonZeroUsize),
        }
        Ok(match WrittenVerify::deserialize(deserializer)? {
            WrittenVerify::Flag(false) => Verify::None,
            WrittenVerify::Flag(true) => Verify::Every(1),
            WrittenVerify::Stride(stride) => Verify::Every(stride.get()),
        })
    }
}
