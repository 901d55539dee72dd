//! The tests of the Python package, in a virtual environment below the target folder.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::environment::{
    Environment, Obstacle, capture, copy, copy_folder, reason, remove_folder,
};
use crate::process::{self, Outcome};
use crate::tally::Tally;
use crate::test::Scope;
use crate::workspace::Workspace;

/// Runs the tests of the package that the last build made, or returns a `SKIPPED` line.
pub fn run(scope: Scope, tally: &mut Tally) -> Outcome<Vec<String>> {
    let before = tally.skipped_lines().len();
    match test_package(scope, tally) {
        Ok(mut lines) => {
            lines.extend(tally.skipped_lines().split_off(before));
            Ok(lines)
        }
        Err(Obstacle::Absent(reason)) => {
            let line = format!("SKIPPED Python tests: {reason}");
            println!("{line}");
            Ok(vec![line])
        }
        Err(Obstacle::Failure(failure)) => Err(failure),
    }
}

/// Installs what the tests need, if it is not there. What can't be installed, [`run`] reports.
pub fn install(scope: Scope) {
    let target = Workspace::load().map(|workspace| workspace.target);
    let environment = target.ok().and_then(|target| environment(&target).ok());
    if let (Some(environment), Scope::All) = (environment, scope) {
        let _ = add_torch(&environment);
    }
}

/// Returns a line for each part that is missing.
fn test_package(scope: Scope, tally: &mut Tally) -> Result<Vec<String>, Obstacle> {
    let workspace = Workspace::load()?;
    let target = &workspace.target;
    let environment = environment(target)?;
    let missing = match scope {
        Scope::Default => Vec::new(),
        Scope::All => add_torch(&environment)?,
    };
    let packages = target.join("xtask/python/packages");
    assemble_package(&environment, &target.join("debug"), &packages)?;
    let mut pytest = environment.module("pytest", &["-q", "-rs", "--color=no"]);
    // Two processes: XLA compiles on one core. Tests of a file share random numbers and caches, and run in their order.
    pytest.args(["--numprocesses", "2", "--dist", "loadfile"]);
    pytest.arg("--no-loadscope-reorder");
    pytest.args(["-p", "no:cacheprovider"]).arg(tests_folder());
    pytest.env("PYTHONPATH", packages);
    pytest.env("ISOGRAD_PROGRAM", workspace.program());
    // Less time of XLA's compiler, most of what these tests spend; what it computes is not ours to test.
    if std::env::var_os("XLA_FLAGS").is_none() {
        pytest.env("XLA_FLAGS", "--xla_backend_optimization_level=0");
    }
    // Packages that draw must not look for a screen.
    pytest.env("MPLBACKEND", "Agg").env_remove("DISPLAY");
    process::run_by_line(&mut pytest, |line| {
        println!("{line}");
        tally.read_pytest(line);
    })?;
    Ok(missing)
}

/// The environment of the tests, with everything but PyTorch.
pub fn environment(target: &Path) -> Result<Environment, Obstacle> {
    let requirements = tests_folder().join("requirements.txt");
    Environment::with_requirements(target.join("xtask/python/environment"), &requirements)
}

fn tests_folder() -> PathBuf {
    process::root().join("bindings/python/tests")
}

/// Installs PyTorch, once. If that fails, returns a line with the reason, and its tests are skipped.
fn add_torch(environment: &Environment) -> Outcome<Vec<String>> {
    let [requirements, script] =
        ["requirements-torch.txt", "torch_without_cuda.py"].map(|name| tests_folder().join(name));
    let stamp = environment.stamp(&[&requirements, &script])?;
    if stamp.is_current() {
        return Ok(Vec::new());
    }
    println!("installing {}", requirements.display());
    if let Err(output) = capture(Command::new(&environment.python).arg(script)) {
        let line = format!("SKIPPED PyTorch: {}", reason(&output));
        println!("{line}");
        return Ok(vec![line]);
    }
    stamp.write()?;
    Ok(Vec::new())
}

/// Assembles the package in a folder as a wheel has it, from the library in the folder `built`.
pub fn assemble_package(environment: &Environment, built: &Path, packages: &Path) -> Outcome {
    remove_folder(packages)?;
    let mut metadata = environment.module("maturin", &["pep517", "write-dist-info"]);
    metadata.arg("--metadata-directory").arg(packages);
    metadata.arg("--interpreter").arg(&environment.python);
    process::run(metadata.stdout(Stdio::null()))?;
    let package = packages.join("isograd");
    copy_folder(
        &process::root().join("bindings/python/python/isograd"),
        &package,
    )?;
    let library = format!("{DLL_PREFIX}_core{DLL_SUFFIX}");
    let module = if cfg!(windows) {
        "_core.pyd"
    } else {
        "_core.abi3.so"
    };
    copy(&built.join(library), &package.join(module))
}
