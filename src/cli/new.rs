//! `gearlash new`.

use super::print;
use crate::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// The starter model.
const STARTER: &str = include_str!("starter.yaml");

/// Writes the starter model to a file that does not exist yet, or to standard output.
pub fn new(file: Option<&Path>) -> Result<ExitCode, Error> {
    let Some(path) = file else {
        return print(STARTER);
    };
    let failed = |source| Error::File {
        action: "create",
        path: path.to_owned(),
        source,
    };
    // `create_new` leaves no moment in which a file of that name could appear and be overwritten.
    let mut created = std::fs::File::create_new(path).map_err(failed)?;
    created.write_all(STARTER.as_bytes()).map_err(failed)?;
    let shown = path.display();
    print(&format!(
        "{shown} is a model that runs. Next steps:\n  \
         gearlash check {shown}\n  \
         gearlash run {shown}\n  \
         gearlash schema > gearlash.schema.json    # completion and validation in editors\n"
    ))
}
