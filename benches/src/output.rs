//! JSON files with one row a line, and the frame of the programs that write them.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde::Serialize;

/// Result of a measurement; an error ends the program with its message.
pub type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// An object whose values are lists with one row a line, so that diffs show the rows that changed.
#[derive(Default)]
pub struct Json(Vec<String>);

impl Json {
    /// Adds `"name": [rows]`.
    pub fn with<V: Serialize>(mut self, name: &str, rows: &[V]) -> Outcome<Self> {
        let lines: Result<Vec<_>, _> = rows.iter().map(serde_json::to_string).collect();
        self.0
            .push(format!("\"{name}\": [\n{}\n]", lines?.join(",\n")));
        Ok(self)
    }

    /// The whole text.
    pub fn text(&self) -> String {
        format!("{{{}}}\n", self.0.join(",\n"))
    }
}

/// Measures, and writes the result to the file named on the command line, or else to `docs/NAME.json`.
pub fn run(name: &str, measure: impl FnOnce() -> Outcome<String>) -> ExitCode {
    let file = std::env::args_os().nth(1).map(PathBuf::from);
    let file = file.unwrap_or_else(|| root().join("docs").join(name).with_extension("json"));
    let written = measure().and_then(|text| Ok(fs::write(&file, text)?));
    match written {
        Ok(()) => {
            println!("{}", file.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Root of the repository.
pub fn root() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here)
}
