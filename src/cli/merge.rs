//! `gearlash merge`.

use super::{MergeArguments, run};
use crate::error::Error;
use crate::study::{self, RunSettings};
use std::process::ExitCode;

/// Joins, writes, prints a short table.
pub fn merge(arguments: &MergeArguments) -> Result<ExitCode, Error> {
    let figures = arguments.figures.formats();
    let settings = RunSettings {
        out: arguments.out.clone(),
        figures,
        jobs: 1,
    };
    let outcome = study::merge(&arguments.parts, &settings)?;
    run::tell(&outcome, &settings.out, arguments.quiet)
}
