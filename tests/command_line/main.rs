//! The real binary on real files.

#[path = "../support/program.rs"]
mod program;
#[path = "../support/synthetic.rs"]
mod synthetic;

mod bad_input;
mod cli;
mod closed_pipes;
mod compared;
mod confirm;
mod costs;
mod curve_units;
mod drawn_again;
mod ends_of_runs;
mod error_estimates;
mod folders;
mod gallery;
mod hostile_input;
mod laws_in_models;
mod long_trains;
mod memory;
mod messages;
mod output_files;
mod page;
#[cfg(unix)]
mod signals;
mod statics;
mod tutorial;
mod verify;
