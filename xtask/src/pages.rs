//! The pages and pictures below `docs/` that commands make: a program measures and writes JSON, from which
//! `benches/pages/render.py` makes Markdown and charts.

use std::process::Command;

use crate::environment::{Environment, Obstacle};
use crate::pictures;
use crate::process::{self, Outcome};
use crate::workspace::Workspace;

/// Pages with a program of `isograd-benches` of the same name.
const MEASURED: [&str; 4] = ["accuracy", "gradients", "orientation", "scaling"];

/// Measures and renders all pages but the comparison with other libraries and the page that needs a GPU.
pub fn all() -> Outcome {
    for page in MEASURED {
        measure(page)?;
    }
    pictures::all()?;
    crate::fit::run()
}

/// Measures one page with its program, and renders it.
pub fn measure(page: &str) -> Outcome {
    process::run(&mut program(page))?;
    render(&[page])
}

/// Renders pages from their JSON; all of them if none is named.
pub fn render(pages: &[&str]) -> Outcome {
    match renderer() {
        Ok(mut command) => process::run(command.args(pages)),
        Err(Obstacle::Absent(reason) | Obstacle::Failure(reason)) => Err(reason),
    }
}

/// Fails if a page is not what the renderer makes of its JSON. Returns a `SKIPPED` line if Python or its packages are
/// missing.
pub fn check() -> Outcome<Vec<String>> {
    match renderer() {
        Ok(mut command) => process::run(command.arg("--check")).map(|()| Vec::new()),
        Err(Obstacle::Absent(reason)) => Ok(vec![format!("SKIPPED pages: {reason}")]),
        Err(Obstacle::Failure(failure)) => Err(failure),
    }
}

/// Measures on a GPU, and renders docs/gpu.md.
pub fn gpu() -> Outcome {
    let file = process::root().join("docs/gpu.json");
    let mut times = program("gpu-times");
    process::run(times.args(["--features", "cuda", "--"]).arg(file))?;
    render(&["gpu"])
}

/// A program of `isograd-benches`.
fn program(name: &str) -> Command {
    let package = ["run", "--release", "--package", "isograd-benches", "--bin"];
    let mut command = process::cargo(package);
    command.arg(name);
    command
}

/// `render.py` in its virtual environment.
fn renderer() -> Result<Command, Obstacle> {
    let folder = process::root().join("benches/pages");
    let environment = Workspace::load()?.target.join("xtask/pages");
    let requirements = folder.join("requirements.txt");
    let python = Environment::with_requirements(environment, &requirements)?.python;
    let mut command = Command::new(python);
    command.arg(folder.join("render.py"));
    Ok(command)
}
