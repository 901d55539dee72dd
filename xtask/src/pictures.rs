//! The picture of README.md, and those of docs/bad-results.md: bad results, and the same samples with the option that helps.

use std::fs;
use std::path::Path;

use crate::process::{self, Outcome};

const FOLDER: &str = "target/xtask/pictures";

/// Whether a sample is kept.
type Filter = fn([f64; 3]) -> bool;

/// Clouds: the name of the file, the arguments of `sample`, and which samples are kept.
const CLOUDS: [(&str, &str, Filter); 2] = [
    ("airliner", "airliner -n 30000", |_| true),
    ("bowl", "sphere -n 8000", |[x, _, _]| x < 0.1),
];

/// Pictures: the name below `docs/images`, the cloud, and the options.
const PICTURES: [(&str, &str, &str); 4] = [
    ("bad-missed", "airliner", "--resolution 48 --level mean"),
    (
        "bad-missed-cured",
        "airliner",
        "--resolution 48 --level thin",
    ),
    (
        "bad-open",
        "bowl",
        "--resolution 64 --padding 0.4 --walls closed",
    ),
    (
        "bad-open-cured",
        "bowl",
        "--resolution 64 --padding 0.4 --walls closed --sheet 0.06",
    ),
];

/// Draws all pictures.
pub fn all() -> Outcome {
    isograd(
        "reconstruct examples/clouds/aircraft.ply --picture docs/images/aircraft.png --view 60 30",
    )?;
    let folder = process::root().join(FOLDER);
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for (name, shape, keep) in CLOUDS {
        isograd(&format!(
            "sample {shape} --layout random -o {FOLDER}/{name}.xyz"
        ))?;
        filter(&folder.join(name).with_extension("xyz"), keep)?;
    }
    for (name, cloud, options) in PICTURES {
        let picture = format!("--picture docs/images/{name}.png --view 60 30");
        isograd(&format!(
            "reconstruct {FOLDER}/{cloud}.xyz {options} {picture}"
        ))?;
    }
    Ok(())
}

/// Keeps the lines of a text file of points that satisfy `keep`.
fn filter(path: &Path, keep: Filter) -> Outcome {
    let failed = |e| format!("{}: {e}", path.display());
    let text = fs::read_to_string(path).map_err(failed)?;
    let is_kept = |line: &&str| {
        let mut numbers = line.split_whitespace().filter_map(|word| word.parse().ok());
        let point = [(); 3].map(|()| numbers.next().unwrap_or(f64::NAN));
        keep(point)
    };
    let kept: Vec<&str> = text.lines().filter(is_kept).collect();
    fs::write(path, kept.join("\n") + "\n").map_err(failed)
}

fn isograd(line: &str) -> Outcome {
    let mut command = process::cargo(["run", "--release", "--quiet", "--"]);
    process::run(
        command
            .args(line.split_whitespace())
            .current_dir(process::root()),
    )
}
