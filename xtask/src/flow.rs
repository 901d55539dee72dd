//! `cargo xtask flow`: bodies in a flow solver, by scripts in Python with the package built for release.

use std::process::Command;

use crate::environment::{Environment, Obstacle};
use crate::pages;
use crate::process::{self, Outcome};
use crate::python;
use crate::workspace::Workspace;

/// Measures the named cases, or all of them with the film and the picture, and renders docs/flow.md.
pub fn run(cases: &[String]) -> Outcome {
    match measure(cases) {
        Ok(()) => pages::render(&["flow"]),
        Err(Obstacle::Absent(reason) | Obstacle::Failure(reason)) => Err(reason),
    }
}

fn measure(cases: &[String]) -> Result<(), Obstacle> {
    let folder = process::root().join("benches/flow");
    let target = Workspace::load()?.target;
    let requirements = folder.join("requirements.txt");
    let environment =
        Environment::with_requirements(target.join("xtask/flow/environment"), &requirements)?;
    process::run(&mut process::cargo([
        "build",
        "--release",
        "--package",
        "isograd-python",
    ]))?;
    let packages = target.join("xtask/flow/packages");
    python::assemble_package(&environment, &target.join("release"), &packages)?;
    let scripts: &[&str] = match cases {
        [] => &["measure.py", "pictures.py"],
        _ => &["measure.py"],
    };
    for script in scripts {
        let mut command = Command::new(&environment.python);
        command.arg(folder.join(script)).args(cases);
        command
            .env("PYTHONPATH", &packages)
            .env("MPLBACKEND", "Agg");
        process::run(command.current_dir(process::root()))?;
    }
    Ok(())
}
