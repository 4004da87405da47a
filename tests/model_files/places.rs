//! Mistakes as tests compare them.

use gearlash::error::Diagnostic;

/// Line, column, path and message with help.
pub fn shown(d: &Diagnostic) -> (usize, usize, String, String) {
    let at = d.location.as_ref().expect("a place");
    let help = d.help.as_deref().unwrap_or("");
    (
        at.line,
        at.column,
        d.path.clone(),
        format!("{}; {help}", d.message),
    )
}
