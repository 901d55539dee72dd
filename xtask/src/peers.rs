//! `cargo xtask peers`: comparison with other libraries, by a script in Python.

use std::process::Command;

use crate::environment::{Environment, Obstacle};
use crate::pages;
use crate::process::{self, Outcome};
use crate::workspace::Workspace;

/// Creates a virtual environment with the pinned libraries, builds the timing program, runs both, and renders the page.
pub fn run(arguments: &[String]) -> Outcome {
    let target = Workspace::load()?.target;
    let folder = process::root().join("benches").join("peers");
    let requirements = folder.join("requirements.txt");
    let environment = match Environment::with_requirements(target.join("peers"), &requirements) {
        Ok(environment) => environment,
        Err(Obstacle::Absent(reason) | Obstacle::Failure(reason)) => return Err(reason),
    };
    // pysdf, whose build needs the headers of Eigen (in Debian below this folder).
    let eigen = ("CPLUS_INCLUDE_PATH", "/usr/include/eigen3".to_owned());
    let optional = folder.join("optional.txt");
    match environment.install(&[&"--requirement", &optional], &[eigen]) {
        Ok(()) => {}
        Err(Obstacle::Absent(reason) | Obstacle::Failure(reason)) => eprintln!("skipped: {reason}"),
    }
    let build = [
        "build",
        "--release",
        "--package",
        "isograd-benches",
        "--bin",
    ];
    process::run(process::cargo(build).arg("stage-times"))?;
    let program = format!("stage-times{}", std::env::consts::EXE_SUFFIX);
    process::run(
        Command::new(&environment.python)
            .arg(folder.join("compare.py"))
            .arg("--stage-times")
            .arg(target.join("release").join(program))
            .args(arguments)
            .current_dir(process::root()),
    )?;
    // Short runs are printed only.
    match arguments.iter().any(|a| a == "--quick" || a == "--only") {
        true => Ok(()),
        false => pages::render(&["peers"]),
    }
}
