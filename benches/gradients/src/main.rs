//! Measures the reverse mode against differences and closed forms, and writes `docs/gradients.md` with its
//! pictures and numbers: `cargo run --release -p isograd-gradients [FOLDER]`.

mod body;
mod cost;
mod functional;
mod memory;
mod motion;
mod page;
mod parameters;
mod pictures;
mod ratios;
mod sphere;
mod study;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use study::{Results, Study};

/// What can go wrong here ends the program with a message.
type Outcome<T = ()> = Result<T, Box<dyn Error>>;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Outcome {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2);
    let docs = root.unwrap_or(Path::new("")).join("docs");
    let folder = std::env::args_os().nth(1).map_or(docs, PathBuf::from);
    let study = Study::full();
    let results = study.run()?;
    write(&study, &results, &folder)
}

/// All numbers, one case a line, so that a change of one is a change of one line.
fn json(results: &Results) -> Outcome<String> {
    fn lines<V: serde::Serialize>(name: &str, values: &[V]) -> Outcome<String> {
        let lines: Result<Vec<_>, _> = values.iter().map(serde_json::to_string).collect();
        Ok(format!("\"{name}\": [\n{}\n]", lines?.join(",\n")))
    }
    let fish = &results.parameters;
    let parts = [
        lines("parameters", &fish.rows)?,
        lines("parameters_setting", std::slice::from_ref(&fish.setting))?,
        lines("costs", &results.costs)?,
        lines("memory", &results.memory)?,
        lines("ratios", &results.ratios)?,
        lines("spheres", &results.spheres)?,
    ];
    Ok(format!("{{{}}}\n", parts.join(",\n")))
}

/// The page, the numbers and the pictures.
fn write(study: &Study, results: &Results, folder: &Path) -> Outcome {
    let pictures = folder.join("images");
    fs::create_dir_all(&pictures)?;
    fs::write(folder.join("gradients.json"), json(results)?)?;
    fs::write(folder.join("gradients.md"), page::page(study, results)?)?;
    pictures::draw(results, &pictures)?;
    println!("{}", folder.join("gradients.md").display());
    Ok(())
}
