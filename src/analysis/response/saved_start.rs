//! Branches through points that other runs saved.

use super::delivered::{Delivered, Ending};
use super::hunt::Hunt;
use super::trace::{Work, sizes};
use super::{BranchSettings, Method, Swept};
use crate::analysis::saved::SavedPoint;
use crate::analysis::{Fault, Setting, columns};
use crate::error::Error;
use crate::solve::jumps::refuse_hidden;
use crate::solve::start::StartMode;
use nalgebra::DVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Beginning of the primary branch.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "`auto`, `full_contact`, `open`, `rest`, or a saved point {results, analysis, branch, point}"
)]
pub enum Beginning {
    /// First guess of the search for the first solution.
    Guess(StartMode),
    /// A point saved by another run.
    Saved(SavedPoint),
}

impl Default for Beginning {
    fn default() -> Self {
        Beginning::Guess(StartMode::Auto)
    }
}

impl Beginning {
    /// The first guess of a search.
    pub(super) fn guess(&self) -> StartMode {
        match self {
            Beginning::Guess(mode) => *mode,
            Beginning::Saved(_) => StartMode::Auto,
        }
    }

    /// The saved point.
    pub(super) fn saved(&self) -> Option<&SavedPoint> {
        match self {
            Beginning::Guess(_) => None,
            Beginning::Saved(point) => Some(point),
        }
    }
}

impl BranchSettings {
    /// What is wrong with a saved point, its place in the range left out.
    pub(super) fn check_saved(&self, setting: &Setting<'_>) -> Option<Fault> {
        let point = self.start.saved()?;
        let read = point.read().and_then(|row| row.state(setting));
        let hidden = refuse_hidden(&setting.assembly.system);
        let hidden = hidden.map_err(|error| setting.name_connection(&error));
        let message = read.map(drop).and(hidden).err()?;
        Some(Fault::new("start", message))
    }
}

impl Swept<'_> {
    /// A saved point outside the range.
    pub(in crate::analysis) fn check_start(&self, settings: &BranchSettings) -> Option<Fault> {
        let message = self.saved(settings.start.saved()?).err()?;
        Some(Fault::new("start", message))
    }
}

impl Work<'_> {
    /// Follows the branch through a saved point both ways.
    pub(super) fn follow_saved(&mut self, method: Method, point: &SavedPoint) -> Result<(), Error> {
        let (settings, swept) = (self.settings, self.swept);
        let refused = |message| columns::refused(swept.setting, Fault::new("start", message));
        let (lambda, state) = swept.saved(point).map_err(refused)?;
        let mut hunt = Hunt::new((settings, swept), lambda, 0)?;
        let system = hunt.system()?;
        let moved = |e: usize| {
            let row = system.element_map_row(e).iter();
            row.map(|(j, w)| w * state[*j]).sum::<f64>().abs()
        };
        let sizes = sizes(&system).into_iter().enumerate();
        self.bounds = sizes
            .map(|(e, size)| settings.bound * size.max(moved(e)).max(1.0))
            .collect();
        let found = hunt.near(DVector::from_vec(state))?;
        let u = match &found {
            Some(found) => hunt.unknowns(method, found)?,
            None => None,
        };
        let origin = format!("point {} of {}", point.point, point.analysis);
        let first = self.delivered.len();
        match u {
            Some(u) => self.follow_both_ways(method, &u, lambda, &origin)?,
            None => {
                let mut delivered = Delivered::new(method, settings.subharmonic);
                let message = format!(
                    "no periodic solution near the saved point at {}",
                    swept.place(lambda)
                );
                delivered.end = Ending::early("no_start", message);
                self.delivered.push(delivered);
            }
        }
        for delivered in &mut self.delivered[first..] {
            delivered.is_saved = true;
        }
        Ok(())
    }
}
