//! Measures the signs of normals on many clouds, and writes `docs/orientation.md` with its pictures and numbers:
//! `cargo run --release -p isograd-orientation [FOLDER]`.
//!
//! `cargo run --release -p isograd-orientation -- --only WORD...` prints the table of the clouds whose names have
//! one of the words, and writes nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use isograd::orient::Method;
use isograd_orientation::measure::measure;
use isograd_orientation::{page, pictures, study, suite};
use isograd_page::program::{json_lines, run};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some((flag, words)) = arguments.split_first()
        && flag == "--only"
    {
        print(words);
        return ExitCode::SUCCESS;
    }
    run(|folder, images| {
        let results = study::run(data().as_deref());
        let rows = json_lines("rows", &results.rows)?;
        let steps = json_lines("steps", &results.steps)?;
        fs::write(
            folder.join("orientation.json"),
            format!("{{{rows},\n{steps}}}\n"),
        )?;
        fs::write(folder.join("orientation.md"), page::page(&results))?;
        pictures::draw(images)?;
        println!("{}", folder.join("orientation.md").display());
        Ok(())
    })
}

/// The folder of the real clouds, where it is.
fn data() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2)?;
    let folder = root.join("../shared/data");
    folder.is_dir().then_some(folder)
}

/// One line for each cloud whose name has one of the words; for all, where there is none.
fn print(words: &[String]) {
    let mut clouds = data()
        .map(|folder| suite::real(&folder))
        .unwrap_or_default();
    clouds.extend(suite::made());
    clouds.retain(|c| words.is_empty() || words.iter().any(|w| c.name.contains(w.as_str())));
    println!(
        "{:22} {:>7} {:>7} {:>7} {:>7} {:>7} {:>9} {:>7} {:>8} {:>8}",
        "cloud",
        "points",
        "wrong %",
        "least",
        "axis °",
        "judged",
        "doubtful",
        "caught",
        "axes s",
        "signs s"
    );
    let mut total = 0.0;
    for cloud in clouds {
        let found = measure(&cloud.body(), &Method::Auto, 1);
        let errors = &found.errors;
        total += errors.wrong;
        let least = errors.least.map_or(String::new(), |l| format!("{l:.2}"));
        let caught = errors.caught.map_or(String::new(), |c| format!("{c:.0}"));
        println!(
            "{:22} {:7} {:7.2} {least:>7} {:7.1} {:7.1} {:9.2} {caught:>7} {:8.3} {:8.3}",
            cloud.name,
            found.points,
            errors.wrong,
            errors.axis_mean,
            errors.judged,
            errors.doubtful,
            found.seconds[0],
            found.seconds[1]
        );
    }
    println!("sum of wrong shares {total:.2}");
}
