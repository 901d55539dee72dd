//! `cargo xtask peers`: isograd beside other libraries, by a script of Python.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::process::{self, Outcome};
use crate::workspace::Workspace;

/// Makes a virtual environment with the pinned peers, builds the timing program, and runs both.
pub fn run(arguments: &[String]) -> Outcome {
    let target = Workspace::load()?.target;
    let folder = process::root().join("benches").join("peers");
    let python = environment(&target.join("peers"), &folder.join("requirements.txt"))?;
    optional(&python, &folder.join("optional.txt"));
    build()?;
    let program = format!("stage-times{}", std::env::consts::EXE_SUFFIX);
    process::run(
        Command::new(python)
            .arg(folder.join("compare.py"))
            .arg("--stage-times")
            .arg(target.join("release").join(program))
            .args(arguments)
            .current_dir(process::root()),
    )
}

fn build() -> Outcome {
    process::run(&mut process::cargo([
        "build",
        "--release",
        "--package",
        "isograd-benches",
        "--bin",
        "stage-times",
    ]))
}

/// Installs what can be done without; what fails is said and left out.
fn optional(python: &Path, requirements: &Path) {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--requirement"]);
    // Where Debian has Eigen.
    pip.arg(requirements)
        .env("CPLUS_INCLUDE_PATH", "/usr/include/eigen3");
    if let Err(failure) = process::run(&mut pip) {
        eprintln!("left out: {failure}");
    }
}

/// The Python of a virtual environment that holds what `requirements` lists.
fn environment(folder: &Path, requirements: &Path) -> Outcome<PathBuf> {
    let python = if cfg!(windows) {
        folder.join("Scripts").join("python.exe")
    } else {
        folder.join("bin").join("python")
    };
    if !python.exists() {
        let system = if cfg!(windows) { "python" } else { "python3" };
        process::run(Command::new(system).args(["-m", "venv"]).arg(folder))?;
    }
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--requirement"]);
    process::run(pip.arg(requirements))?;
    Ok(python)
}
