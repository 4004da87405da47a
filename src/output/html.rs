//! page
use super::RunOptions;
use crate::{error::Error, report::Report};
/// x
/// # Errors
/// x
pub fn render(_reports: &[Report], _options: &RunOptions) -> Result<String, Error> {
    Ok(String::new())
}
