//! `gearlash` with one law more: every command, every analysis, and `type: hertz` in model files.

use custom_element as _; // links the crate and the law that it registers
use std::process::ExitCode;

fn main() -> ExitCode {
    gearlash::cli::main()
}
