//! The pages and pictures below `docs/` that commands make.

use std::fs;
use std::path::{Path, PathBuf};

use crate::process::{self, Outcome};

/// Everything that a command makes, but for the comparison with peers, which needs Python, and what needs a GPU.
pub fn all() -> Outcome {
    accuracy()?;
    gradients()?;
    orientation()?;
    scaling()?;
    gallery()?;
    crate::fit::run()
}

/// `docs/accuracy.md`, with its numbers and pictures.
pub fn accuracy() -> Outcome {
    program("isograd-accuracy")
}

/// `docs/gradients.md`, with its numbers and pictures.
pub fn gradients() -> Outcome {
    program("isograd-gradients")
}

/// `docs/orientation.md`, with its numbers and pictures.
pub fn orientation() -> Outcome {
    program("isograd-orientation")
}

/// `docs/scaling.md`, with its numbers and picture.
pub fn scaling() -> Outcome {
    program("isograd-scaling")
}

/// `docs/gpu.json`, and the part of `docs/gpu.md` about speed.
pub fn gpu() -> Outcome {
    process::run(&mut process::cargo([
        "run",
        "--release",
        "--package",
        "isograd-gpu-times",
        "--features",
        "cuda",
    ]))
}

/// Runs the program of a package, which writes its page.
fn program(package: &str) -> Outcome {
    process::run(&mut process::cargo([
        "run",
        "--release",
        "--package",
        package,
    ]))
}

/// `docs/images/NAME.png` for every cloud in `examples/clouds`.
pub fn gallery() -> Outcome {
    let pictures = process::root().join("docs").join("images");
    fs::create_dir_all(&pictures).map_err(|e| format!("{}: {e}", pictures.display()))?;
    for cloud in clouds()? {
        let name = cloud.file_stem().unwrap_or_default();
        let picture = pictures.join(name).with_extension("png");
        println!("{} → {}", cloud.display(), picture.display());
        process::run(&mut reconstruct(&cloud, &picture))?;
    }
    Ok(())
}

fn reconstruct(cloud: &Path, picture: &Path) -> std::process::Command {
    let mut command = process::cargo(["run", "--release", "--quiet", "--", "reconstruct"]);
    command.arg(cloud).arg("--picture").arg(picture);
    command
}

/// The clouds in the repository, sorted by name.
fn clouds() -> Outcome<Vec<PathBuf>> {
    let folder = process::root().join("examples").join("clouds");
    let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut clouds: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "ply"))
        .collect();
    clouds.sort();
    Ok(clouds)
}
