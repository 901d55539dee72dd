//! Tests of the published packages: every crate builds from its `.crate`, the Python package from its source
//! distribution.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::environment::{self, Environment, Obstacle};
use crate::process::{self, Outcome};
use crate::python;
use crate::workspace::Workspace;

/// Files that every `.crate` holds besides its sources.
const REQUIRED: [&str; 4] = ["Cargo.toml", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];

/// Both tests.
pub fn run() -> Outcome {
    for line in [crates()?, source_distribution()?].concat() {
        println!("{line}");
    }
    Ok(())
}

/// Packages every crate that can be published, and checks the unpacked crates in a copy of the workspace.
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

    let copy = target.join("xtask/packages");
    copy_workspace(&workspace.published, &copy)?;
    for name in &workspace.published {
        unpack(target, name, &copy.join("crates"))?;
    }
    let mut check = process::cargo(["check", "--workspace", "--all-features", "--all-targets"]);
    check.current_dir(&copy).env("CARGO_TARGET_DIR", target);
    process::run(&mut check)?;
    let count = workspace.published.len();
    println!("{count} crates build from their packages");
    Ok(Vec::new())
}

/// Copies the workspace without its crates, whose packages take their place: the same selection of packages and
/// features as elsewhere, so that dependencies are not built again.
fn copy_workspace(published: &[String], copy: &Path) -> Outcome {
    environment::remove_folder(copy)?;
    let root = process::root();
    for folder in ["benches", "bindings", "fuzz", "xtask"] {
        environment::copy_folder(&root.join(folder), &copy.join(folder))?;
    }
    let crates = copy.join("crates");
    fs::create_dir_all(&crates).map_err(|e| format!("{}: {e}", crates.display()))?;
    environment::copy(&root.join("Cargo.lock"), &copy.join("Cargo.lock"))?;
    let path = root.join("Cargo.toml");
    let mut manifest = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    // A package names its siblings by their versions alone.
    manifest += "\n[patch.crates-io]\n";
    for name in published {
        manifest += &format!("{name} = {{ path = \"crates/{name}\" }}\n");
    }
    let path = copy.join("Cargo.toml");
    fs::write(&path, manifest).map_err(|e| format!("{}: {e}", path.display()))
}

/// Unpacks the `.crate` of a package into a folder of its name.
fn unpack(target: &Path, name: &str, crates: &Path) -> Outcome {
    let version = env!("CARGO_PKG_VERSION");
    let mut tar = Command::new("tar");
    // With the time of now: by those in the package, older than all that was built before, Cargo would take that for it.
    tar.arg("-xmzf")
        .arg(target.join(format!("package/{name}-{version}.crate")));
    process::run(tar.arg("-C").arg(crates))?;
    let unpacked = crates.join(name);
    fs::rename(crates.join(format!("{name}-{version}")), &unpacked)
        .map_err(|e| format!("{}: {e}", unpacked.display()))?;
    match REQUIRED.iter().find(|file| !unpacked.join(file).is_file()) {
        Some(file) => Err(format!("the package of {name} lacks {file}")),
        None => Ok(()),
    }
}

/// Installs the Python package from its source distribution into an empty environment, and reconstructs a cloud.
pub fn source_distribution() -> Outcome<Vec<String>> {
    match install_source_distribution(&Workspace::load()?) {
        Ok(()) => Ok(Vec::new()),
        Err(Obstacle::Absent(reason)) => Ok(vec![format!("SKIPPED source distribution: {reason}")]),
        Err(Obstacle::Failure(failure)) => Err(failure),
    }
}

fn install_source_distribution(workspace: &Workspace) -> Result<(), Obstacle> {
    let target = &workspace.target;
    let folder = target.join("xtask/sdist");
    environment::remove_folder(&folder)?;
    let mut sdist = python::environment(target)?.module("maturin", &["sdist", "--out"]);
    environment::capture(sdist.arg(&folder))?;
    let archive = fs::read_dir(&folder)
        .ok()
        .and_then(|mut entries| entries.next()?.ok())
        .ok_or("maturin made no source distribution".to_owned())?
        .path();
    forget_builds(&workspace.default_members)?;
    let clean = Environment::create(folder.join("environment"))?;
    let settings = [
        ("CARGO_TARGET_DIR", target.display().to_string()),
        (
            "MATURIN_PEP517_ARGS",
            format!("--features pyo3/extension-module --profile {PROFILE}"),
        ),
    ];
    clean.install(&[&archive], &settings)?;
    let mut script = Command::new(&clean.python);
    environment::capture(script.args(["-c", SCRIPT]).current_dir(&folder))?;
    environment::capture(&mut clean.module("isograd", &["--version"]))?;
    Ok(())
}

/// Removes what earlier tests of the source distribution built of its crates: its files are older than that, so Cargo would
/// take it for theirs.
fn forget_builds(packages: &[String]) -> Outcome {
    let mut clean = process::cargo(["clean", "--quiet", "--profile", PROFILE]);
    for name in packages {
        clean.args(["--package", name]);
    }
    process::run(&mut clean)
}

/// The profile of the build within pip, which takes the least time.
const PROFILE: &str = "package-test";

/// Runs with the package and NumPy alone.
const SCRIPT: &str = "\
import numpy, isograd
points = numpy.random.default_rng(1).normal(size=(2000, 3))
points /= numpy.linalg.norm(points, axis=1, keepdims=True)
result = isograd.reconstruct(points, isograd.Grid.fit(points, 24))
assert result.sdf.min() < 0 < result.sdf.max()
assert numpy.isfinite(result.pullback(sdf=result.sdf).points).all()";
