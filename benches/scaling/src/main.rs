//! Measures time and memory against the number of cells and of points, and writes `docs/scaling.md` with its
//! picture and numbers: `cargo run --release -p isograd-scaling [FOLDER]`.

mod copy;
mod page;
mod picture;
mod size;
mod slope;
mod study;

use std::fs;
use std::process::ExitCode;

use isograd_page::program::{Outcome, json_lines, run};

use study::Results;

fn main() -> ExitCode {
    run(|folder, pictures| {
        let results = study::run()?;
        fs::write(folder.join("scaling.json"), json(&results)?)?;
        fs::write(folder.join("scaling.md"), page::page(&results))?;
        picture::draw(&results, pictures)?;
        println!("{}", folder.join("scaling.md").display());
        Ok(())
    })
}

/// All numbers.
fn json(results: &Results) -> Outcome<String> {
    let parts = [
        json_lines("cells", &results.cells)?,
        json_lines("points", &results.points)?,
        json_lines("fish", std::slice::from_ref(&results.fish))?,
        json_lines("copy_bytes_per_second", &[results.copy])?,
    ];
    Ok(format!("{{{}}}\n", parts.join(",\n")))
}
