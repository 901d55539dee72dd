//! The command line of isograd.

use std::process::ExitCode;

fn main() -> ExitCode {
    isograd_cli::run(std::env::args_os()).into()
}
