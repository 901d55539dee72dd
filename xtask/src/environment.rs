//! Python environments below the target folder, and files in them.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::process::{self, Outcome};

/// The oldest Python that the pinned packages support; the package itself supports older ones.
const OLDEST: (u32, u32) = (3, 11);

/// Why tests did not run.
pub enum Obstacle {
    /// Something they need is missing on this machine: they are skipped with this reason.
    Absent(String),
    /// Something went wrong.
    Failure(String),
}

impl From<String> for Obstacle {
    fn from(failure: String) -> Self {
        Self::Failure(failure)
    }
}

/// A virtual environment.
pub struct Environment {
    folder: PathBuf,
    pub python: PathBuf,
}

impl Environment {
    /// The environment in a folder, whether it exists or not.
    pub fn at(folder: PathBuf) -> Self {
        let python = folder.join(if cfg!(windows) {
            "Scripts/python.exe"
        } else {
            "bin/python"
        });
        Self { folder, python }
    }

    /// A new environment that holds nothing but pip.
    pub fn create(folder: PathBuf) -> Result<Self, Obstacle> {
        let system = interpreter().map_err(Obstacle::Absent)?;
        remove_folder(&folder)?;
        let mut venv = Command::new(system);
        capture(venv.args(["-m", "venv"]).arg(&folder)).map_err(|output| {
            let reason = reason(&output);
            Obstacle::Absent(format!("`{system} -m venv` failed: {reason}"))
        })?;
        Ok(Self::at(folder))
    }

    /// An environment with the packages that `requirements` lists, created anew if that file has changed.
    pub fn with_requirements(folder: PathBuf, requirements: &Path) -> Result<Self, Obstacle> {
        let environment = Self::at(folder);
        let stamp = environment.stamp(&[requirements])?;
        if stamp.is_current() {
            return Ok(environment);
        }
        let environment = Self::create(environment.folder)?;
        println!("installing {}", requirements.display());
        environment.install(&[&"--requirement", &requirements], &[])?;
        stamp.write()?;
        Ok(environment)
    }

    /// `pip install ARGUMENTS`, with environment variables.
    pub fn install(
        &self,
        arguments: &[&dyn AsRef<OsStr>],
        variables: &[(&str, String)],
    ) -> Result<(), Obstacle> {
        let mut pip = self.module(
            "pip",
            &["install", "--quiet", "--disable-pip-version-check"],
        );
        pip.args(arguments.iter().map(|argument| argument.as_ref()));
        pip.envs(variables.iter().map(|(name, value)| (name, value)));
        capture(&mut pip).map_err(|output| {
            let reason = reason(&output);
            if cannot_connect(&output) {
                Obstacle::Absent(format!("no package index can be reached: {reason}"))
            } else {
                Obstacle::Failure(format!("pip failed: {reason}"))
            }
        })
    }

    /// `python -m NAME ARGUMENTS` in the root of the repository.
    pub fn module(&self, name: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.python);
        command.args(["-m", name]).args(arguments);
        command.current_dir(process::root());
        // The user's settings for a Python of their own.
        command.env_remove("PYTHONPATH").env_remove("PYTHONHOME");
        command
    }

    /// A stamp for what these files list.
    pub fn stamp(&self, files: &[&Path]) -> Outcome<Stamp> {
        let mut text = String::new();
        for path in files {
            text += &fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        }
        let name = files[0].file_name().unwrap_or_default().to_string_lossy();
        Ok(Stamp::new(
            self.folder.join(format!("installed-{name}")),
            text,
        ))
    }
}

/// A record of what is installed, to tell whether it is current.
pub struct Stamp {
    file: PathBuf,
    text: String,
}

impl Stamp {
    /// A stamp in `file` for an installation that `text` describes.
    pub fn new(file: PathBuf, text: String) -> Self {
        Self { file, text }
    }

    /// Whether just this was installed before.
    pub fn is_current(&self) -> bool {
        fs::read_to_string(&self.file).is_ok_and(|text| text == self.text)
    }

    /// Records the installation.
    pub fn write(&self) -> Outcome {
        fs::write(&self.file, &self.text).map_err(|e| format!("{}: {e}", self.file.display()))
    }
}

/// A Python of this machine that is recent enough.
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
        .ok_or_else(|| format!("no python3 of version {major}.{minor} or later"))
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

/// The line of an output that gives the reason of a failure: pip's last error, or else the last line.
pub fn reason(output: &str) -> &str {
    let lines = || output.lines().rev().map(str::trim);
    lines()
        .find(|line| line.starts_with("ERROR"))
        .or_else(|| lines().find(|line| !line.is_empty()))
        .unwrap_or("no output")
}

/// Whether pip failed because it found no package index, not because of a requirement.
fn cannot_connect(output: &str) -> bool {
    [
        "connection broken by",
        "Max retries exceeded",
        "(from versions: none)",
    ]
    .iter()
    .any(|sign| output.contains(sign))
}

/// Removes a folder and its contents, if it exists.
pub fn remove_folder(folder: &Path) -> Outcome {
    if !folder.exists() {
        return Ok(());
    }
    fs::remove_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))
}

/// Copies a folder with its subfolders, without Python's caches.
pub fn copy_folder(from: &Path, to: &Path) -> Outcome {
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

/// Copies a file.
pub fn copy(from: &Path, to: &Path) -> Outcome {
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
    fn an_unreachable_package_index_differs_from_a_wrong_pin() {
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
        assert_eq!(reason(""), "no output");
    }
}
