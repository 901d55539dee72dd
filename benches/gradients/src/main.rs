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

use std::fs;
use std::process::ExitCode;

use isograd_page::program::{Outcome, json_lines, run};

use study::{Results, Study};

fn main() -> ExitCode {
    run(|folder, pictures| {
        let study = Study::full();
        let results = study.run()?;
        fs::write(folder.join("gradients.json"), json(&results)?)?;
        fs::write(folder.join("gradients.md"), page::page(&study, &results)?)?;
        pictures::draw(&results, pictures)?;
        println!("{}", folder.join("gradients.md").display());
        Ok(())
    })
}

/// All numbers.
fn json(results: &Results) -> Outcome<String> {
    let fish = &results.parameters;
    let parts = [
        json_lines("parameters", &fish.rows)?,
        json_lines("parameters_setting", std::slice::from_ref(&fish.setting))?,
        json_lines("costs", &results.costs)?,
        json_lines("memory", &results.memory)?,
        json_lines("ratios", &results.ratios)?,
        json_lines("spheres", &results.spheres)?,
    ];
    Ok(format!("{{{}}}\n", parts.join(",\n")))
}
