//! Test programs, two at a time: where one waits for its last test, which runs on one core, the next one works.

use std::cmp::Reverse;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::{Mutex, mpsc};
use std::thread;

use serde_json::Value;

use crate::process::{self, Outcome};

const AT_A_TIME: usize = 2;

/// A program that `cargo test` has built.
struct Program {
    path: PathBuf,
    /// The folder of its package.
    folder: PathBuf,
}

/// Runs all test programs of `cargo test …` to the end, failures or not. `prepare` sets variables for a program; `line`
/// gets the output of each, line by line, when it has ended.
pub fn run(
    cargo: &mut Command,
    prepare: impl Fn(&mut Command) + Sync,
    mut line: impl FnMut(&str),
) -> Outcome {
    let programs = Mutex::new(built(cargo)?.into_iter());
    let next = || programs.lock().ok()?.next();
    let (sender, ended) = mpsc::channel();
    let mut failed = Vec::new();
    thread::scope(|scope| {
        for _ in 0..AT_A_TIME {
            let (sender, next, prepare) = (sender.clone(), &next, &prepare);
            scope.spawn(move || {
                while let Some(program) = next() {
                    let result = program.run(prepare);
                    // The other end is there until the last program has ended.
                    let _ = sender.send((program, result));
                }
            });
        }
        drop(sender);
        for (program, result) in ended {
            if let Err(failure) = show(&program, result, &mut line) {
                line(&failure);
                failed.push(failure);
            }
        }
    });
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("; ")),
    }
}

impl Program {
    fn run(&self, prepare: impl Fn(&mut Command)) -> std::io::Result<Output> {
        let mut command = Command::new(&self.path);
        // As `cargo test` does.
        command.current_dir(&self.folder);
        command.env("CARGO_MANIFEST_DIR", &self.folder);
        prepare(&mut command);
        command.arg("--show-output").output()
    }
}

/// Passes on what a program printed, and fails if it failed.
fn show(
    program: &Program,
    result: std::io::Result<Output>,
    line: &mut impl FnMut(&str),
) -> Outcome {
    let name = program.path.display();
    let output = result.map_err(|error| format!("{name} could not be started: {error}"))?;
    line(&format!("     Running {name}"));
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    // Tests may print bytes that are not UTF-8.
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .for_each(line);
    match output.status.success() {
        true => Ok(()),
        false => Err(format!("{name} ended with {}", output.status)),
    }
}

/// Builds the test programs of `cargo test …`. Large ones come first: they take longest.
fn built(cargo: &mut Command) -> Outcome<Vec<Program>> {
    cargo.args(["--no-run", "--message-format", "json-render-diagnostics"]);
    let mut programs = Vec::new();
    process::run_by_line(cargo, |line| programs.extend(program(line)))?;
    programs.sort_by_key(|program| {
        Reverse(fs::metadata(&program.path).map_or(0, |metadata| metadata.len()))
    });
    Ok(programs)
}

/// The test program of a message of cargo, if that is what it is about.
fn program(message: &str) -> Option<Program> {
    let message: Value = serde_json::from_str(message).ok()?;
    let is_test = message["profile"]["test"].as_bool()?;
    let manifest = PathBuf::from(message["manifest_path"].as_str()?);
    is_test.then_some(Program {
        path: message["executable"].as_str()?.into(),
        folder: manifest.parent()?.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_of_tests_are_found_in_the_messages_of_cargo() {
        let message = |test, executable: &str| {
            format!(
                r#"{{"reason":"compiler-artifact","manifest_path":"/a/b/Cargo.toml",
                "profile":{{"test":{test}}},"executable":{executable}}}"#
            )
        };
        let found = program(&message(true, r#""/t/x-1""#)).unwrap();
        assert_eq!(found.path, PathBuf::from("/t/x-1"));
        assert_eq!(found.folder, PathBuf::from("/a/b"));
        assert!(program(&message(false, r#""/t/x""#)).is_none());
        assert!(program(&message(true, "null")).is_none());
        assert!(program("text").is_none());
    }
}
