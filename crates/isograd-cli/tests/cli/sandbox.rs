//! Runs the program in a temporary folder.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use isograd_io::{FieldFile, Geometry};
use serde_json::Value;
use tempfile::TempDir;

/// A temporary folder to run in.
pub struct Sandbox {
    folder: TempDir,
}

/// Result of a run.
#[derive(Debug)]
pub struct Run {
    pub status: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Sandbox {
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("temporary folder"),
        }
    }

    /// A folder in which `isograd LINE` was run.
    pub fn with(line: &str) -> Self {
        let sandbox = Self::new();
        sandbox.done(line);
        sandbox
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).expect("writes");
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Points of a file, a line each.
    pub fn rows(&self, name: &str, keep: impl Fn(&[f64; 3]) -> bool) -> String {
        let points = self.geometry(name).points.into_iter().filter(keep);
        points
            .map(|[x, y, z]| format!("{x:?} {y:?} {z:?}\n"))
            .collect()
    }

    pub fn geometry(&self, name: &str) -> Geometry {
        isograd_io::read_geometry(&self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn mesh(&self, name: &str) -> Geometry {
        isograd_io::read_mesh(&self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn field(&self, name: &str) -> FieldFile {
        isograd_io::read_field(&self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isograd"));
        command
            .args(line.split_whitespace())
            .current_dir(self.folder.path());
        command.stdin(Stdio::null());
        command
    }

    /// Runs `isograd LINE`.
    pub fn run(&self, line: &str) -> Run {
        Run::new(self.command(line).output().expect("the binary starts"))
    }

    /// Runs a row `STATUS LINE | PART | …`: checks the status of `isograd LINE`, and that standard error has every part.
    pub fn says(&self, row: &str) {
        let mut parts = row.split(" | ");
        let (status, line) = parts
            .next()
            .and_then(|start| start.split_once(' '))
            .expect("a row");
        let parts: Vec<&str> = parts.collect();
        self.run(line)
            .says(status.parse().expect("a status"), &parts);
    }

    /// Runs `isograd LINE` with `input` on standard input.
    pub fn run_with_input(&self, line: &str, input: &[u8]) -> Run {
        let mut command = self.command(line);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("the binary starts");
        // The program may stop reading on an error, which closes the pipe.
        let _ = child.stdin.take().expect("a pipe").write_all(input);
        Run::new(child.wait_with_output().expect("it ends"))
    }

    /// Runs `isograd LINE` and expects it to succeed.
    pub fn done(&self, line: &str) -> Run {
        let run = self.run(line);
        assert_eq!(run.status, Some(0), "{line}: {run:?}");
        run
    }

    /// Every file below the folder.
    pub fn files(&self) -> Vec<String> {
        let mut files = Vec::new();
        collect(self.folder.path(), self.folder.path(), &mut files);
        files.sort();
        files
    }
}

impl Run {
    pub fn new(output: Output) -> Self {
        Self {
            status: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Checks the status, and that standard error says all of `parts`.
    pub fn says(&self, status: i32, parts: &[&str]) {
        assert_eq!(self.status, Some(status), "{self:?}");
        for part in parts {
            assert!(self.stderr.contains(part), "'{part}' is missing: {self:?}");
        }
    }
}

fn collect(root: &Path, folder: &Path, files: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            let name = path.strip_prefix(root).expect("below the root");
            files.push(name.display().to_string());
        }
    }
}
