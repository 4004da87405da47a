//! The real binary on real files.

#[path = "../support/program.rs"]
mod program;
#[path = "../support/synthetic.rs"]
mod synthetic;

mod bad_input;
mod cli;
mod ends_of_runs;
mod hostile_input;
mod laws_in_models;
mod messages;
mod output_files;
mod page;
mod statics;
mod verify;
