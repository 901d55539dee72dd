//! Wrong signs on clouds whose normals are known, as JSON: `cargo run --release -p isograd-benches --bin orientation
//! [FILE]` writes FILE, or docs/orientation.json.
//!
//! With `--only WORD...` it prints a table of the clouds whose names contain one of the words, and writes nothing.

use std::process::ExitCode;

use isograd::orient::Method;
use isograd_benches::orientation::measure::measure;
use isograd_benches::orientation::{clouds, run};
use isograd_benches::output::{self, root};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.split_first() {
        Some((flag, words)) if flag == "--only" => {
            print(words);
            ExitCode::SUCCESS
        }
        _ => output::run("orientation", || {
            run(&root().join("target/pages/orientation"))
        }),
    }
}

/// Prints a line for each cloud whose name contains one of the words, or for all clouds without words.
fn print(words: &[String]) {
    let mut clouds = clouds();
    clouds.retain(|c| words.is_empty() || words.iter().any(|w| c.name.contains(w.as_str())));
    println!(
        "{:22} {:>7} {:>7} {:>7} {:>7} {:>7} {:>9} {:>7} {:>8} {:>8}",
        "cloud",
        "points",
        "wrong %",
        "bound",
        "axis °",
        "eval. %",
        "doubtful",
        "caught",
        "axes s",
        "signs s"
    );
    let mut total = 0.0;
    for cloud in clouds {
        let measured = measure(&cloud.body(), &Method::Auto, 1);
        let errors = &measured.errors;
        total += errors.wrong;
        let bound = errors
            .lower_bound
            .map_or(String::new(), |l| format!("{l:.2}"));
        let caught = errors.caught.map_or(String::new(), |c| format!("{c:.0}"));
        println!(
            "{:22} {:7} {:7.2} {bound:>7} {:7.1} {:7.1} {:9.2} {caught:>7} {:8.3} {:8.3}",
            cloud.name,
            measured.points,
            errors.wrong,
            errors.axis_mean,
            errors.evaluated,
            errors.doubtful,
            measured.seconds[0],
            measured.seconds[1]
        );
    }
    println!("sum of the wrong signs, %: {total:.2}");
}
