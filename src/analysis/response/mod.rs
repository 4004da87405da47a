//! Responses against a parameter: what `frequency_response` and `parameter_response` share.
//!
//! `keys` and `settings`: how branches are computed; `swept`: what the continued parameter means, and `model_family` the systems
//! along a number of the model; `trace`: method by method from a first solution along the parameter, from a `source`; `crossings`: the branches that
//! begin where one is crossed; `starts` and `hunt`: those that random states lead to; `restart` and `poles`: what goes on behind a break or a pole; `integration`: the method that follows
//! attractors; `confirm` and `verify`: events and points by the flow; `accuracy`: what is known of their errors, and `harmonics` how many that
//! takes; `bandwidth`: whether they reach the contacts; `expense`: what they cost; `outcome`: how branches ended; `tables`: which ones are written; `report`: tables and figure.

mod accuracy;
mod bandwidth;
mod confirm;
mod crossings;
mod delivered;
mod event_states;
mod expense;
mod flow_start;
mod guarded;
mod harmonics;
mod hunt;
mod integration;
mod keys;
mod model_family;
mod orbits;
mod outcome;
mod poles;
mod random_starts;
mod report;
mod restart;
mod saved_start;
mod settings;
mod side_branches;
mod source;
mod starts;
mod swept;
mod tables;
mod trace;
mod verify;

pub use confirm::{Confirm, Verify};
pub use crossings::Branches;
pub use event_states::EventState;
pub(super) use event_states::event_states;
pub use harmonics::Harmonics;
pub use keys::{BranchSettings, Method, Orbits, Quadrature};
pub(super) use keys::{branch_settings, defaults, response_keys};
pub(super) use orbits::OrbitTable;
pub use saved_start::Beginning;
pub use starts::Starts;
pub(super) use swept::Swept;
pub use tables::{ResponseTable, TableChoice};
pub(super) use trace::{run, tables};
