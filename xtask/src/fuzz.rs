//! `cargo xtask fuzz`: random input for the readers, the library and the command line.

use std::fs;
use std::process::Command;

use crate::process::{self, Outcome};
use crate::test::build_default_and;
use crate::workspace::Workspace;

/// Arguments of the run within `cargo xtask test --all`.
const SHORT: [&str; 4] = ["--minutes", "1", "--seed", "1"];

/// Builds the program as the tests are built, and runs it with these arguments.
pub fn run(arguments: &[String]) -> Outcome {
    build_default_and("isograd-fuzz")?;
    start(arguments)
}

/// Runs the program that the last build made for a minute, with a fixed seed.
pub fn short() -> Outcome<Vec<String>> {
    start(&SHORT.map(String::from))?;
    Ok(Vec::new())
}

fn start(arguments: &[String]) -> Outcome {
    let workspace = Workspace::load()?;
    let name = format!("isograd-fuzz{}", std::env::consts::EXE_SUFFIX);
    let mut program = Command::new(workspace.program().with_file_name(name));
    let result = process::run(program.args(arguments).current_dir(process::root()));
    // A program that is killed or aborts leaves the command that repeats its last input.
    let running = workspace.target.join("fuzz/running");
    match fs::read_to_string(&running) {
        Ok(command) if result.is_err() && fs::remove_file(&running).is_ok() => {
            result.map_err(|failure| format!("{failure}; repeat: {}", command.trim()))
        }
        _ => result,
    }
}
