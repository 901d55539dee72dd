//! What is published builds by itself: every crate from its `.crate`, the Python package from its source distribution.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::environment::{self, Environment, Obstacle};
use crate::process::{self, Outcome};
use crate::python;
use crate::workspace::Workspace;

/// Files that every `.crate` holds besides its sources.
const REQUIRED: [&str; 4] = ["Cargo.toml", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];

/// Packages every crate that can be published, and checks the unpacked crates as a workspace of their own.
///
/// Cargo's own verification builds all dependencies again for each of them.
pub fn crates() -> Outcome<Vec<String>> {
    let workspace = Workspace::load()?;
    let target = &workspace.target;
    let mut package = process::cargo(["package", "--no-verify", "--allow-dirty", "--quiet"]);
    for name in &workspace.published {
        package.args(["--package", name]);
    }
    process::run(package.env("CARGO_TARGET_DIR", target))?;

    let folder = target.join("xtask").join("crates");
    environment::remove_folder(&folder)?;
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for name in &workspace.published {
        let archive = format!("package/{name}-{}.crate", env!("CARGO_PKG_VERSION"));
        unpack(&target.join(archive), &folder)?;
        let unpacked = folder.join(format!("{name}-{}", env!("CARGO_PKG_VERSION")));
        if let Some(file) = REQUIRED.iter().find(|file| !unpacked.join(file).is_file()) {
            return Err(format!("the package of {name} lacks {file}"));
        }
    }
    write(&folder.join("Cargo.toml"), &manifest(&workspace.published)?)?;
    environment::copy(
        &process::root().join("Cargo.lock"),
        &folder.join("Cargo.lock"),
    )?;
    let mut check = process::cargo(["check", "--workspace", "--all-features", "--all-targets"]);
    check.current_dir(&folder).env("CARGO_TARGET_DIR", target);
    process::run(&mut check)?;
    println!(
        "{} crates build from their packages",
        workspace.published.len()
    );
    Ok(Vec::new())
}

/// A workspace of the unpacked crates, with the profiles of this one, so that dependencies are not built again.
fn manifest(names: &[String]) -> Outcome<String> {
    let path = process::root().join("Cargo.toml");
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let profiles = text.find("\n[profile").map_or("", |start| &text[start..]);
    let version = env!("CARGO_PKG_VERSION");
    let patches: String = names
        .iter()
        .map(|name| format!("{name} = {{ path = \"{name}-{version}\" }}\n"))
        .collect();
    Ok(format!(
        "[workspace]\nresolver = \"3\"\nmembers = [\"*-{version}\"]\n\n[patch.crates-io]\n{patches}{profiles}"
    ))
}

/// Installs the Python package from its source distribution into an empty environment, and reconstructs a cloud.
pub fn source_distribution() -> Outcome<Vec<String>> {
    let target = Workspace::load()?.target;
    match install_source_distribution(&target) {
        Ok(()) => Ok(Vec::new()),
        Err(Obstacle::Absent(reason)) => Ok(vec![format!("SKIPPED source distribution: {reason}")]),
        Err(Obstacle::Failure(failure)) => Err(failure),
    }
}

fn install_source_distribution(target: &Path) -> Result<(), Obstacle> {
    let folder = target.join("xtask/sdist");
    environment::remove_folder(&folder)?;
    let mut sdist = python::environment(target)?.module("maturin", &["sdist", "--out"]);
    environment::capture(sdist.arg(&folder))?;
    let archive = fs::read_dir(&folder)
        .ok()
        .and_then(|mut entries| entries.next()?.ok())
        .ok_or("maturin made no source distribution".to_owned())?
        .path();
    let clean = Environment::create(folder.join("environment"))?;
    // With the dependencies of the tests; from nothing and optimized for release, it would take minutes more.
    let settings = [
        ("CARGO_TARGET_DIR", target.display().to_string()),
        ("MATURIN_PEP517_ARGS", PEP517.to_owned()),
    ];
    clean.install(&[&archive], &settings)?;
    let mut script = Command::new(&clean.python);
    process::run(script.args(["-c", SCRIPT]).current_dir(&folder))?;
    Ok(())
}

/// Options of the build within pip.
const PEP517: &str = "--features pyo3/extension-module --profile dev";

/// Runs with the package and NumPy alone.
const SCRIPT: &str = "\
import numpy, isograd
points = numpy.random.default_rng(1).normal(size=(2000, 3))
points /= numpy.linalg.norm(points, axis=1, keepdims=True)
result = isograd.reconstruct(points, isograd.Grid.fit(points, 24))
assert result.sdf.min() < 0 < result.sdf.max()
assert numpy.isfinite(result.pullback(sdf=result.sdf).points).all()";

fn unpack(archive: &Path, folder: &Path) -> Outcome {
    let mut tar = Command::new("tar");
    process::run(tar.arg("-xzf").arg(archive).arg("-C").arg(folder))
}

fn write(path: &Path, text: &str) -> Outcome {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
