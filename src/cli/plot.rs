//! `gearlash plot`.

use super::{PlotArguments, print};
use crate::error::Error;
use crate::study;
use std::process::ExitCode;

/// Draws again and says where.
pub fn plot(arguments: &PlotArguments) -> Result<ExitCode, Error> {
    let figures = arguments.figures.formats();
    let outcome = study::redraw(
        &arguments.folder,
        &arguments.only,
        &arguments.plot,
        &figures,
    )?;
    if arguments.quiet {
        return Ok(ExitCode::SUCCESS);
    }
    let names = outcome.files.iter().filter_map(|file| file.file_name());
    let names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
    print(&format!(
        "{} in {}\n",
        names.join(", "),
        arguments.folder.display()
    ))
}
