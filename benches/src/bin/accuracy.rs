//! Errors against bodies whose distance is known, as JSON: `cargo run --release -p isograd-benches --bin accuracy [FILE]`
//! writes FILE, or docs/accuracy.json.

use std::process::ExitCode;

use isograd_benches::accuracy::Study;
use isograd_benches::output::run;

fn main() -> ExitCode {
    run("accuracy", || {
        let study = Study::full();
        study.run()?.json(&study)
    })
}
