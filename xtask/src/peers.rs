//! `cargo xtask peers`: comparison with other libraries, by a script in Python.

use std::path::PathBuf;
use std::process::Command;

use crate::environment::{Environment, Obstacle};
use crate::pages;
use crate::process::{self, Outcome};
use crate::workspace::Workspace;

/// Folder of the scripts.
fn folder() -> PathBuf {
    process::root().join("benches").join("peers")
}

/// The virtual environment with the pinned libraries.
fn environment() -> Result<Environment, String> {
    let target = Workspace::load()?.target;
    let requirements = folder().join("requirements.txt");
    match Environment::with_requirements(target.join("peers"), &requirements) {
        Ok(environment) => Ok(environment),
        Err(Obstacle::Absent(reason) | Obstacle::Failure(reason)) => Err(reason),
    }
}

/// Path of a program of `package`, built for release.
fn release(package: &str, program: &str, features: &[&str]) -> Result<PathBuf, String> {
    let build = ["build", "--release", "--package", package, "--bin", program];
    process::run(process::cargo(build).args(features))?;
    let name = format!("{program}{}", std::env::consts::EXE_SUFFIX);
    Ok(Workspace::load()?.target.join("release").join(name))
}

/// Compares surfaces of real shapes with their meshes, and renders the page.
pub fn surfaces(arguments: &[String]) -> Outcome {
    with_program("surfaces.py", arguments)?;
    pages::render(&["surfaces"])
}

/// Reconstructs a large cloud beside PoissonRecon, and renders the page.
pub fn large(arguments: &[String]) -> Outcome {
    with_program("large.py", arguments)?;
    pages::render(&["large"])
}

/// Measures clouds per core-hour, and renders the page.
pub fn datasets(arguments: &[String]) -> Outcome {
    with_program("datasets.py", arguments)?;
    pages::render(&["datasets"])
}

/// Runs a script that starts the program `isograd`.
fn with_program(script: &str, arguments: &[String]) -> Outcome {
    let environment = environment()?;
    process::run(
        Command::new(&environment.python)
            .arg(folder().join(script))
            .arg("--program")
            .arg(release("isograd-cli", "isograd", &[])?)
            .args(arguments)
            .current_dir(process::root()),
    )
}

/// Creates a virtual environment with the pinned libraries, builds the timing program, runs both, and renders the page.
pub fn run(arguments: &[String]) -> Outcome {
    let (environment, folder) = (environment()?, folder());
    // pysdf, whose build needs the headers of Eigen (in Debian below this folder).
    let eigen = ("CPLUS_INCLUDE_PATH", "/usr/include/eigen3".to_owned());
    let optional = folder.join("optional.txt");
    match environment.install(&[&"--requirement", &optional], &[eigen]) {
        Ok(()) => {}
        Err(Obstacle::Absent(reason) | Obstacle::Failure(reason)) => eprintln!("skipped: {reason}"),
    }
    let program = release(
        "isograd-benches",
        "stage-times",
        &["--features", "stage-times"],
    )?;
    process::run(
        Command::new(&environment.python)
            .arg(folder.join("compare.py"))
            .arg("--stage-times")
            .arg(program)
            .args(arguments)
            .current_dir(process::root()),
    )?;
    // Short runs are printed only.
    match arguments.iter().any(|a| a == "--quick" || a == "--only") {
        true => Ok(()),
        false => pages::render(&["peers"]),
    }
}
