//! Measures the pipeline on bodies whose distance is known exactly, and writes `docs/accuracy.md` with its
//! pictures and numbers: `cargo run --release -p isograd-accuracy [FOLDER]`.

mod case;
mod exact;
mod measure;
mod page;
mod pictures;
mod spread;
mod study;

use std::fs;
use std::process::ExitCode;

use isograd_page::program::{Outcome, json_lines, run};

use study::{Results, Study};

fn main() -> ExitCode {
    run(|folder, pictures| {
        let study = Study::full();
        let results = study.run()?;
        fs::write(folder.join("accuracy.json"), json(&results)?)?;
        fs::write(folder.join("accuracy.md"), page::page(&study, &results)?)?;
        pictures::draw(&study, &results, pictures)?;
        println!("{}", folder.join("accuracy.md").display());
        Ok(())
    })
}

/// All numbers.
fn json(results: &Results) -> Outcome<String> {
    let (rows, floors) = (
        json_lines("rows", &results.rows)?,
        json_lines("floors", &results.floors)?,
    );
    Ok(format!("{{{rows},\n{floors}}}\n"))
}
