//! `cargo xtask fit`: docs/fit.md, the paper's inverse problem, as the command line does it.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::process::{self, Outcome};

/// The command that the page shows; `DIR` stands for where it runs.
const SAMPLE: &str = "sample fish -n 40000 --seed 77 --precision f64 -o DIR/fish.ply";
const FIT: &str = "fit --shape fish --only width*,height* --target DIR/fish.ply --random-start 0.5 \
    -n 40000 --resample 8 --resolution 128 --padding 0.05 --pictures-at 0,20 -o DIR/fit";
/// For the parameters of the target: a fit of no epochs from the defaults.
const TRUTH: &str = "fit --shape fish --target DIR/fish.ply --epochs 0 -n 2000 --resolution 64 \
    --pictures-at 1 -o DIR/truth";
/// Other random starts, without pictures on the way.
const OTHERS: std::ops::RangeInclusive<u32> = 2..=5;
/// Below the target's folder, and what a reader would type.
const FOLDER: &str = "target/xtask/fit";
const NO_FIELD: &str = "fit.json or history.json has no such field";
const PICTURES: [(&str, &str); 2] = [
    ("epochs.png", "fit_epochs.png"),
    ("loss.png", "fit_loss.png"),
];

/// Runs the fit, and writes the page and its pictures.
pub fn run() -> Outcome {
    let root = process::root();
    let folder = root.join(FOLDER);
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for line in [SAMPLE, TRUTH, FIT] {
        isograd(line)?;
    }
    let fit = read(&folder.join("fit").join("fit.json"))?;
    let history = read(&folder.join("fit").join("history.json"))?;
    let truth = read(&folder.join("truth").join("fit.json"))?;
    let mut others = String::new();
    for seed in OTHERS {
        let line = FIT.replace("-o DIR/fit", &format!("-o DIR/fit{seed} --seed {seed} -q"));
        isograd(&line.replace("--pictures-at 0,20", "--pictures-at 0"))?;
        let other = read(&folder.join(format!("fit{seed}")).join("history.json"))?;
        let row = other_start(seed, &other, &truth).ok_or(NO_FIELD)?;
        others.push_str(&row);
    }
    let docs = root.join("docs");
    for (from, to) in PICTURES {
        let (from, to) = (folder.join("fit").join(from), docs.join("images").join(to));
        fs::copy(&from, &to).map_err(|e| format!("{}: {e}", to.display()))?;
    }
    let page = page(&fit, &history, &truth, &others).ok_or(NO_FIELD)?;
    let path = docs.join("fit.md");
    fs::write(&path, page).map_err(|e| format!("{}: {e}", path.display()))?;
    println!("wrote {}", path.display());
    Ok(())
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

/// The row of another start: how far off at both ends.
fn other_start(seed: u32, history: &Value, truth: &Value) -> Option<String> {
    let epochs = history["epochs"].as_array()?;
    let names = history["parameters"].as_array()?;
    let (first, last) = (epochs.first()?, epochs.last()?);
    let [start, end] = [first, last].map(|epoch| worst(epoch, names, truth));
    let mean = last["mean_error"].as_f64()?;
    let count = epochs.len() - 1;
    let (start, end) = (100.0 * start?, 100.0 * end?);
    Some(format!(
        "| {seed} | {start:.0} % | {end:.2} % | {mean:.4} | {count} |\n"
    ))
}

/// Greatest relative error of a parameter.
fn worst(epoch: &Value, names: &[Value], truth: &Value) -> Option<f64> {
    let mut errors = names.iter().enumerate().map(|(i, name)| {
        let target = truth["parameters"][name.as_str()?].as_f64()?;
        Some((epoch["parameters"][i].as_f64()? / target - 1.0).abs())
    });
    errors.try_fold(0.0, |worst: f64, error| Some(worst.max(error?)))
}

/// The page; `None` where a number is not there.
fn page(fit: &Value, history: &Value, truth: &Value, others: &str) -> Option<String> {
    let epochs = history["epochs"].as_array()?;
    let (first, last) = (epochs.first()?, epochs.last()?);
    let names = history["parameters"].as_array()?;
    let mut table = String::new();
    for (i, name) in names.iter().enumerate() {
        let name = name.as_str()?;
        let target = truth["parameters"][name].as_f64()?;
        let [start, end] = [first, last].map(|epoch| epoch["parameters"][i].as_f64());
        let off = |value: f64| 100.0 * (value / target - 1.0);
        let (start, end) = (start?, end?);
        let row = format!(
            "| {name} | {target:.4} | {start:.4} | {:+.1} % | {end:.5} | {:+.2} % |",
            off(start),
            off(end)
        );
        writeln!(table, "{row}").ok()?;
    }
    let command = |line: &str| format!("isograd {}", line.replace("DIR/", ""));
    let (sample, run) = (
        command(SAMPLE),
        command(FIT).replace("width*,height*", "'width*,height*'"),
    );
    let error = last["mean_error"].as_f64()?;
    let start_error = first["mean_error"].as_f64()?;
    let (evaluations, seconds) = (last["evaluations"].as_u64()?, fit["seconds"].as_f64()?);
    let within = within(epochs, names, truth)?;
    let worst = 100.0 * worst(last, names, truth)?;
    Some(format!(
        "# A fish found from its distance field

The inverse problem of the paper's section \"Gradient-based shape optimization\": 14 of the fish's parameters, its
half-widths and half-heights, begin at random, each multiplied or divided by up to 1.5, and are changed until
the signed distance field of the body is that of the target. The gradient comes back through the whole chain,
parameters → points → φ → loss. `cargo xtask fit` writes this page and its pictures:

```text
{sample}
{run}
```

The target is known by samples of its own: another seed than that of the fit, whose samples move with the shape and
are drawn anew every 8 epochs. So the two fields can't agree to the last bit, and the loss ends at what the
samples leave open. (With the *same* places on the surface for both, as in
[the example](../crates/isograd-fit/examples/fish_fit.rs), all that is left is the optimizer.)

## What is seen

- The fields differ by **{error:.4} cells** in the mean at the end, {start_error:.2} at the start (over the cells
  within 8 of the target's surface, which are those that are compared).
- The worst of the 14 parameters is **{worst:.2} %** off. All are within 1 % from epoch {within} on.
- {} epochs of L-BFGS took {evaluations} evaluations of field and gradient, {seconds:.0} s on the machine that wrote
  this page.

![Four views of the fish at chosen epochs](images/fit_epochs.png)

From above: the fitted surface (dark blue) with the target over it (light gray, translucent); the field in the planes
y = 0 (the paper's x–z plane) and x = const. (its y–z plane), with the zero contour in black and the target's in
orange; the error φ − φ̃ in the same planes, each on a scale of its own.

![Loss and mean difference against the epoch](images/fit_loss.png)

The small steps upwards are new samples.

## Parameters

In lengths of the body.

| parameter | target | start | off | end | off |
|---|---|---|---|---|---|
{table}
## Other starts

The same command with other seeds (`--seed`), which are other starts and other samples.

| seed | worst parameter at the start | at the end | mean difference, cells | epochs |
|--:|--:|--:|--:|--:|
{others}",
        epochs.len() - 1
    ))
}

/// The first epoch from which on every parameter is within 1 % of the truth.
fn within(epochs: &[Value], names: &[Value], truth: &Value) -> Option<usize> {
    let is_within = |epoch: &Value| worst(epoch, names, truth).is_some_and(|worst| worst < 0.01);
    let last_outside = epochs.iter().rposition(|epoch| !is_within(epoch));
    let first = last_outside.map_or(0, |epoch| epoch + 1);
    (first < epochs.len()).then_some(first)
}
