//! The tests of the Python package, with a virtual environment below the target folder.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::process::{self, Outcome};
use crate::tally::Tally;
use crate::test;
use crate::workspace::Workspace;

/// The oldest Python that the pinned packages are made for; the package itself takes an older one.
const OLDEST: (u32, u32) = (3, 11);

/// Why the tests did not run.
enum Obstacle {
    /// Something that they need is not on this machine: they are left out, and a line says so.
    Absent(String),
    /// Something went wrong.
    Failure(String),
}

impl From<String> for Obstacle {
    fn from(failure: String) -> Self {
        Self::Failure(failure)
    }
}

/// Builds the package and runs its tests, or returns a line that says why not.
pub fn run(tally: &mut Tally) -> Outcome<Vec<String>> {
    let before = tally.skipped_lines().len();
    match test_package(tally) {
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

/// Returns a line for what the environment lacks.
fn test_package(tally: &mut Tally) -> Result<Vec<String>, Obstacle> {
    let target = Workspace::load()?.target;
    let folder = target.join("xtask").join("python");
    let environment = Environment::make(folder.join("environment"))?;
    let lacking = environment.add_torch()?;
    let packages = folder.join("packages");
    environment.assemble_package(&target, &packages)?;
    let mut pytest = environment.module("pytest", &["-q", "-rs", "--color=no"]);
    pytest.args(["-p", "no:cacheprovider"]).arg(tests_folder());
    pytest.env("PYTHONPATH", packages);
    // The packages that draw must not look for a screen.
    pytest.env("MPLBACKEND", "Agg").env_remove("DISPLAY");
    process::run_by_line(&mut pytest, |line| {
        println!("{line}");
        tally.read_pytest(line);
    })?;
    Ok(lacking)
}

fn tests_folder() -> PathBuf {
    process::root().join("bindings/python/tests")
}

/// A virtual environment.
struct Environment {
    folder: PathBuf,
    python: PathBuf,
}

impl Environment {
    /// The environment with what `requirements.txt` lists; made anew where that file has changed.
    fn make(folder: PathBuf) -> Result<Self, Obstacle> {
        let python = folder.join(if cfg!(windows) {
            "Scripts/python.exe"
        } else {
            "bin/python"
        });
        let environment = Self { folder, python };
        let stamp = environment.stamp(&["requirements.txt"])?;
        if !stamp.fits() {
            let system = interpreter().map_err(Obstacle::Absent)?;
            remove_folder(&environment.folder)?;
            let mut venv = Command::new(system);
            venv.args(["-m", "venv"]).arg(&environment.folder);
            capture(&mut venv).map_err(|output| {
                let reason = reason(&output);
                Obstacle::Absent(format!("`{system} -m venv` does not work: {reason}"))
            })?;
            environment.install_requirements()?;
            stamp.write()?;
        }
        Ok(environment)
    }

    fn install_requirements(&self) -> Result<(), Obstacle> {
        println!("installing bindings/python/tests/requirements.txt");
        let mut pip = self.module(
            "pip",
            &["install", "--quiet", "--disable-pip-version-check"],
        );
        pip.arg("--requirement")
            .arg(tests_folder().join("requirements.txt"));
        capture(&mut pip).map_err(|output| {
            let reason = reason(&output);
            if cannot_connect(&output) {
                Obstacle::Absent(format!("no package index can be reached: {reason}"))
            } else {
                Obstacle::Failure(format!("pip could not install the requirements: {reason}"))
            }
        })
    }

    /// Adds PyTorch, once. Where that does not work, a line says why, and its tests are skipped.
    fn add_torch(&self) -> Outcome<Vec<String>> {
        let files = ["requirements-torch.txt", "torch_without_cuda.py"];
        let stamp = self.stamp(&files)?;
        if stamp.fits() {
            return Ok(Vec::new());
        }
        println!("installing bindings/python/tests/requirements-torch.txt");
        let mut script = Command::new(&self.python);
        if let Err(output) = capture(script.arg(tests_folder().join(files[1]))) {
            let line = format!("SKIPPED PyTorch: {}", reason(&output));
            println!("{line}");
            return Ok(vec![line]);
        }
        stamp.write()?;
        Ok(Vec::new())
    }

    /// Puts the package together in a folder, as a wheel has it.
    ///
    /// The library is built with the whole workspace, as the tests in Rust are: by itself it would have other features
    /// of many dependencies, and Vulkan's would be built a second time, which takes longer than all tests.
    fn assemble_package(&self, target: &Path, packages: &Path) -> Outcome {
        // One test, so that cargo counts what tests depend on.
        let mut build = process::cargo(["build", "--workspace", "--lib", "--test", "bad_input"]);
        build.args(["--features", test::FEATURES]);
        process::run(build.env("CARGO_TARGET_DIR", target))?;
        remove_folder(packages)?;
        let mut metadata = self.module("maturin", &["pep517", "write-dist-info"]);
        metadata.arg("--metadata-directory").arg(packages);
        metadata.arg("--interpreter").arg(&self.python);
        process::run(metadata.stdout(Stdio::null()))?;
        let package = packages.join("isograd");
        copy_folder(
            &process::root().join("bindings/python/python/isograd"),
            &package,
        )?;
        let built = format!("{DLL_PREFIX}_core{DLL_SUFFIX}");
        let module = if cfg!(windows) {
            "_core.pyd"
        } else {
            "_core.abi3.so"
        };
        copy(&target.join("debug").join(built), &package.join(module))
    }

    /// `python -m NAME ARGUMENTS` in the root of the repository.
    fn module(&self, name: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.python);
        command.args(["-m", name]).args(arguments);
        command.current_dir(process::root());
        // What the user has set for a Python of their own.
        command.env_remove("PYTHONPATH").env_remove("PYTHONHOME");
        command
    }

    /// What says that the environment holds what these files of the tests' folder ask for.
    fn stamp(&self, files: &[&str]) -> Outcome<Stamp> {
        let mut text = String::new();
        for name in files {
            let path = tests_folder().join(name);
            text += &fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        let file = self.folder.join(format!("installed-{}", files[0]));
        Ok(Stamp::new(file, text))
    }
}

/// A copy of what was asked for, written once it is there.
pub struct Stamp {
    file: PathBuf,
    text: String,
}

impl Stamp {
    /// To be written to `file` when what `text` asks for is there.
    pub fn new(file: PathBuf, text: String) -> Self {
        Self { file, text }
    }

    /// Whether the same was asked for before, and is there.
    pub fn fits(&self) -> bool {
        fs::read_to_string(&self.file).is_ok_and(|text| text == self.text)
    }

    /// Says that it is there.
    pub fn write(&self) -> Outcome {
        fs::write(&self.file, &self.text).map_err(|e| format!("{}: {e}", self.file.display()))
    }
}

/// A Python of this machine that is new enough.
pub fn interpreter() -> Outcome<&'static str> {
    let (major, minor) = OLDEST;
    let question = format!("import sys; sys.exit(sys.version_info < ({major}, {minor}))");
    let good = |name: &&str| {
        let answer = Command::new(name).args(["-c", &question]).output();
        answer.is_ok_and(|output| output.status.success())
    };
    ["python3", "python"]
        .into_iter()
        .find(good)
        .ok_or_else(|| format!("there is no python3 of version {major}.{minor} or later"))
}

/// Runs a command silently; the error is all that it printed.
pub fn capture(command: &mut Command) -> Outcome {
    let output = command.output().map_err(|error| error.to_string())?;
    if output.status.success() {
        return Ok(());
    }
    let text = [output.stdout, output.stderr].concat();
    Err(String::from_utf8_lossy(&text).into_owned())
}

/// The line of an output that says what is wrong: pip's last error, or else the last line.
pub fn reason(output: &str) -> &str {
    let lines = || output.lines().rev().map(str::trim);
    lines()
        .find(|line| line.starts_with("ERROR"))
        .or_else(|| lines().find(|line| !line.is_empty()))
        .unwrap_or("it says nothing")
}

/// Whether pip failed since it found no package index, not for what it was asked to install.
fn cannot_connect(output: &str) -> bool {
    [
        "connection broken by",
        "Max retries exceeded",
        "(from versions: none)",
    ]
    .iter()
    .any(|sign| output.contains(sign))
}

/// Removes a folder, if it is there, and all that is in it.
pub fn remove_folder(folder: &Path) -> Outcome {
    if !folder.exists() {
        return Ok(());
    }
    fs::remove_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))
}

/// Copies the files of a folder, and of those in it, but what Python has compiled.
fn copy_folder(from: &Path, to: &Path) -> Outcome {
    fs::create_dir_all(to).map_err(|e| format!("{}: {e}", to.display()))?;
    let entries = fs::read_dir(from).map_err(|e| format!("{}: {e}", from.display()))?;
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        let Some(name) = path.file_name().filter(|name| *name != "__pycache__") else {
            continue;
        };
        match path.is_dir() {
            true => copy_folder(&path, &to.join(name))?,
            false => copy(&path, &to.join(name))?,
        }
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Outcome {
    let copied = fs::copy(from, to).map_err(|e| format!("{}: {e}", from.display()));
    copied.map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    const OFFLINE: &str = "\
WARNING: Retrying after connection broken by 'NewConnectionError('refused')': /jax/
ERROR: Could not find a version that satisfies the requirement jax (from versions: none)
ERROR: No matching distribution found for jax
[notice] A new release of pip is available
";

    #[test]
    fn a_package_index_out_of_reach_is_told_from_a_wrong_pin() {
        let wrong_pin = "\
ERROR: Could not find a version that satisfies the requirement numpy==99 (from versions: 2.4.6)
ERROR: No matching distribution found for numpy==99
";
        assert!(cannot_connect(OFFLINE));
        assert!(!cannot_connect(wrong_pin));
    }

    #[test]
    fn the_reason_is_the_last_error() {
        let expected = "ERROR: No matching distribution found for jax";
        assert_eq!(reason(OFFLINE), expected);
        assert_eq!(
            reason("no errors here\ngcc is not there\n\n"),
            "gcc is not there"
        );
        assert_eq!(reason(""), "it says nothing");
    }
}
