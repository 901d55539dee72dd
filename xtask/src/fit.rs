//! `cargo xtask fit`: the paper's inverse problem on the command line, for docs/fit.md.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::pages;
use crate::process::{self, Outcome};

/// The commands shown on the page; `DIR` is the working folder.
const SAMPLE: &str = "sample fish -n 40000 --seed 77 --precision f64 -o DIR/fish.ply";
const FIT: &str = "fit --shape fish --only width*,height* --target DIR/fish.ply --random-start 0.5 \
    -n 40000 --resample 8 --resolution 128 --padding 0.05 --pictures-at 0,20 -o DIR/fit";
/// Gives the parameters of the target: a fit of no epochs from the defaults.
const TRUTH: &str = "fit --shape fish --target DIR/fish.ply --epochs 0 -n 2000 --resolution 64 \
    --pictures-at 1 -o DIR/truth";
/// Seeds of other random starts.
const OTHERS: std::ops::RangeInclusive<u32> = 2..=5;
const FOLDER: &str = "target/xtask/fit";
const NO_FIELD: &str = "fit.json or history.json has no such field";
const PICTURES: [(&str, &str); 2] = [
    ("epochs.png", "fit_epochs.png"),
    ("loss.png", "fit_loss.png"),
];

/// Runs the fits, writes docs/fit.json, and renders the page.
pub fn run() -> Outcome {
    let folder = process::root().join(FOLDER);
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for line in [SAMPLE, TRUTH, FIT] {
        isograd(line)?;
    }
    let truth = read(&folder.join("truth/fit.json"))?;
    let fit = read(&folder.join("fit/fit.json"))?;
    let history = History::read(&folder.join("fit"))?;
    let mut others = Vec::new();
    for seed in OTHERS {
        let line = FIT.replace("-o DIR/fit", &format!("-o DIR/fit{seed} --seed {seed} -q"));
        isograd(&line.replace("--pictures-at 0,20", "--pictures-at 0"))?;
        let other = History::read(&folder.join(format!("fit{seed}")))?;
        others.push(other.summary(seed, &truth).ok_or(NO_FIELD)?);
    }
    let docs = process::root().join("docs");
    for (from, to) in PICTURES {
        let (from, to) = (folder.join("fit").join(from), docs.join("images").join(to));
        fs::copy(&from, &to).map_err(|e| format!("{}: {e}", to.display()))?;
    }
    let results = history.results(&fit, &truth, others).ok_or(NO_FIELD)?;
    let text = serde_json::to_string_pretty(&results).map_err(|e| e.to_string())?;
    fs::write(docs.join("fit.json"), text + "\n").map_err(|e| format!("docs/fit.json: {e}"))?;
    pages::render(&["fit"])
}

fn isograd(line: &str) -> Outcome {
    let mut command = process::cargo(["run", "--release", "--quiet", "--"]);
    command.args(line.replace("DIR", FOLDER).split_whitespace());
    process::run(&mut command)
}

fn read(path: &Path) -> Outcome<Value> {
    let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_slice(&bytes).map_err(|e| format!("{}: {e}", path.display()))
}

/// Names of the parameters, and the epochs of a fit.
struct History {
    names: Vec<String>,
    epochs: Vec<Value>,
}

impl History {
    fn read(folder: &Path) -> Outcome<Self> {
        let history = read(&folder.join("history.json"))?;
        let names = history["parameters"].as_array().ok_or(NO_FIELD)?.iter();
        Ok(Self {
            names: names.filter_map(Value::as_str).map(str::to_owned).collect(),
            epochs: history["epochs"].as_array().ok_or(NO_FIELD)?.clone(),
        })
    }

    /// Largest relative error of a parameter.
    fn worst(&self, epoch: &Value, truth: &Value) -> Option<f64> {
        let mut errors = self.names.iter().enumerate().map(|(i, name)| {
            let target = truth["parameters"][name].as_f64()?;
            Some((epoch["parameters"][i].as_f64()? / target - 1.0).abs())
        });
        errors.try_fold(0.0, |worst: f64, error| Some(worst.max(error?)))
    }

    /// Errors at both ends.
    fn summary(&self, seed: u32, truth: &Value) -> Option<Value> {
        let (first, last) = (self.epochs.first()?, self.epochs.last()?);
        Some(json!({
            "seed": seed,
            "worst": [self.worst(first, truth)?, self.worst(last, truth)?],
            "mean_error": last["mean_error"].as_f64()?,
            "epochs": self.epochs.len() - 1,
        }))
    }

    /// First epoch from which on every parameter is within 1 % of the truth.
    fn within_one_percent(&self, truth: &Value) -> Option<usize> {
        let is_within = |epoch: &Value| self.worst(epoch, truth).is_some_and(|worst| worst < 0.01);
        let last_outside = self.epochs.iter().rposition(|epoch| !is_within(epoch));
        let first = last_outside.map_or(0, |epoch| epoch + 1);
        (first < self.epochs.len()).then_some(first)
    }

    /// The content of docs/fit.json.
    fn results(&self, fit: &Value, truth: &Value, others: Vec<Value>) -> Option<Value> {
        let (first, last) = (self.epochs.first()?, self.epochs.last()?);
        let parameters = self.names.iter().enumerate().map(|(i, name)| {
            json!({
                "name": name,
                "target": truth["parameters"][name],
                "start": first["parameters"][i],
                "end": last["parameters"][i],
            })
        });
        let command = |line: &str| format!("isograd {}", line.replace("DIR/", ""));
        let quoted = command(FIT).replace("width*,height*", "'width*,height*'");
        Some(json!({
            "commands": [command(SAMPLE), quoted],
            "parameters": parameters.collect::<Vec<_>>(),
            "mean_error": [first["mean_error"].as_f64()?, last["mean_error"].as_f64()?],
            "within_one_percent": self.within_one_percent(truth)?,
            "epochs": self.epochs.len() - 1,
            "evaluations": last["evaluations"].as_u64()?,
            "seconds": fit["seconds"].as_f64()?,
            "other_starts": others,
        }))
    }
}
