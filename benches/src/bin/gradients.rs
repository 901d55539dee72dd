//! The pullback against differences and closed forms, as JSON:
//! `cargo run --release -p isograd-benches --bin gradients [FILE]` writes FILE, or docs/gradients.json.

use std::process::ExitCode;

use isograd_benches::gradients::Study;
use isograd_benches::output::run;

fn main() -> ExitCode {
    run("gradients", || Study::full().run()?.json())
}
