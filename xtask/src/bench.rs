//! `cargo xtask bench`: the criterion benchmarks of `isograd-benches`.

use crate::process::{self, Outcome};

/// Runs all benchmarks, or those of the stage named first; other arguments go to criterion.
pub fn run(arguments: &[String]) -> Outcome {
    let mut command = process::cargo(["bench", "--package", "isograd-benches"]);
    let rest = match arguments.split_first() {
        Some((stage, rest)) if !stage.starts_with('-') => {
            command.args(["--bench", stage]);
            rest
        }
        _ => {
            command.arg("--benches");
            arguments
        }
    };
    process::run(command.arg("--").args(rest))
}
