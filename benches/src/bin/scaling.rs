//! Time and memory against the size of the problem, as JSON:
//! `cargo run --release -p isograd-benches --bin scaling [FILE]` writes FILE, or docs/scaling.json.

use std::process::ExitCode;

use isograd_benches::output::run;
use isograd_benches::scaling;

fn main() -> ExitCode {
    run("scaling", scaling::run)
}
