//! The program `gearlash`; everything is in the library, so that other binaries can add laws.

use std::process::ExitCode;

fn main() -> ExitCode {
    gearlash::cli::main()
}
