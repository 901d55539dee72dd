//! A program that measures and writes a page: where it writes, and how it ends.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What can go wrong ends the program with a message.
pub type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// Runs `work` with the folder that the command line names, or `docs`, and with its folder of pictures, which
/// is made.
pub fn run(work: impl FnOnce(&Path, &Path) -> Outcome) -> ExitCode {
    match in_folder(work) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn in_folder(work: impl FnOnce(&Path, &Path) -> Outcome) -> Outcome {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2);
    let docs = root.unwrap_or(Path::new("")).join("docs");
    let folder = std::env::args_os().nth(1).map_or(docs, PathBuf::from);
    let pictures = folder.join("images");
    fs::create_dir_all(&pictures)?;
    work(&folder, &pictures)
}

/// `"name": [...]` with one value a line, so that a change of one is a change of one line.
///
/// # Errors
/// A value that can't be written as JSON.
pub fn json_lines<V: serde::Serialize>(name: &str, values: &[V]) -> Outcome<String> {
    let lines: Result<Vec<_>, _> = values.iter().map(serde_json::to_string).collect();
    Ok(format!("\"{name}\": [\n{}\n]", lines?.join(",\n")))
}
