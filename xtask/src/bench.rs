//! `cargo xtask bench`: the criterion benchmarks of `isograd-benches`.

use crate::process::{self, Outcome};

/// Runs all benchmarks, or those whose names begin with the stage named first; other arguments go to criterion.
pub fn run(arguments: &[String]) -> Outcome {
    let mut command =
        process::cargo(["bench", "--package", "isograd-benches", "--bench", "stages"]);
    command.arg("--");
    match arguments.split_first() {
        Some((stage, rest)) if !stage.starts_with('-') => {
            command.arg(format!("^{stage}")).args(rest);
        }
        _ => {
            command.args(arguments);
        }
    }
    process::run(&mut command)
}
