//! Wrong signs on clouds whose normals are known.

pub mod body;
pub mod measure;
pub mod parts;
pub mod suite;

use std::fs;
use std::path::Path;

use isograd::Stage;
use isograd::neighbors::Radius;
use isograd::orient::{Method, MethodUsed, ParityOptions};
use isograd_element::vector;
use isograd_shapes::by_name;
use serde::Serialize;

use crate::output::{Json, Outcome, root};
use body::RANDOM;
use measure::{Errors, measure};
use suite::{Cloud, Family};

/// Runs of the automatic method on each cloud; the fastest counts.
const RUNS: usize = 2;

/// Samples of the swimming fish, and time steps of one tail beat.
const SWIMMER: usize = 50_000;
const STEPS: usize = 20;

/// Clouds of the picture: thin, with holes, noisy, open.
const SHOWN: [&str; 5] = [
    "airliner",
    "wing 0.02",
    "knot holes",
    "vessels noise 0.005",
    "hemisphere",
];

/// Errors on one cloud.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the cloud.
    pub cloud: String,
    /// Kind of difficulty.
    pub family: Family,
    /// Number of points.
    pub points: usize,
    /// Errors of the automatic method.
    pub auto: Errors,
    /// Errors of the paper's method.
    pub parity: Errors,
    /// Time per point of the automatic method, relative to the median cloud.
    pub time: f64,
}

/// Errors at one time step of the fish.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// Wrong signs, in percent of those evaluated.
    pub wrong: f64,
    /// Axes that turned too far since the previous step.
    pub turned: usize,
    /// Whether the signs follow from the previous step.
    pub follows: bool,
    /// Time of this step relative to the automatic method on the same cloud.
    pub time: f64,
}

/// Measures everything, with progress on stderr, and returns it as JSON. Samples with their signs, for the picture of
/// the page, are written to the folder `pictures`.
pub fn run(pictures: &Path) -> Outcome<String> {
    let mut rows: Vec<Row> = clouds().iter().map(row).collect();
    let median = crate::statistics::median(rows.iter().map(|row| row.time).collect());
    rows.iter_mut().for_each(|row| row.time /= median);
    write_pictures(pictures)?;
    Ok(Json::default()
        .with("classes", &measure::CLASSES)?
        .with("rows", &rows)?
        .with("steps", &swim())?
        .text())
}

/// All clouds: the real ones, where `../shared/data` is there, and the generated ones.
pub fn clouds() -> Vec<Cloud> {
    let mut clouds = suite::real(&root().join("../shared/data"));
    clouds.extend(suite::generated());
    clouds
}

/// Writes `CLOUD.METHOD.f32` for the clouds of the picture: point, true normal and sign of every sample, in rows of 7. The
/// sign is 0 if right, 1 if doubtful, 2 if wrong.
fn write_pictures(folder: &Path) -> Outcome {
    fs::create_dir_all(folder)?;
    for name in SHOWN {
        let cloud = suite::by_name(name).ok_or_else(|| format!("no cloud '{name}'"))?;
        let body = cloud.body();
        for (method_name, method) in [
            ("auto", Method::Auto),
            ("parity", Method::Parity(ParityOptions::default())),
        ] {
            let out = measure(&body, &method, 1).orientation;
            let mut bytes = Vec::new();
            for (i, (x, n)) in body.points.iter().zip(&body.normals).enumerate() {
                let cosine = vector::dot(vector::to_f64(out.normals[i]), *n);
                let sign = match cosine < -0.5 {
                    true => 2.0,
                    false => f64::from(u8::from(out.is_doubtful(i))),
                };
                let row = x.iter().chain(n).chain(std::iter::once(&sign));
                bytes.extend(row.flat_map(|&value| (value as f32).to_le_bytes()));
            }
            fs::write(folder.join(format!("{name}.{method_name}.f32")), bytes)?;
        }
    }
    Ok(())
}

/// Errors on a cloud; `time` is in seconds per point.
fn row(cloud: &Cloud) -> Row {
    eprintln!("{}", cloud.name);
    let body = cloud.body();
    let auto = measure(&body, &Method::Auto, RUNS);
    let parity = measure(&body, &Method::Parity(ParityOptions::default()), 1);
    Row {
        cloud: cloud.name.clone(),
        family: cloud.family,
        points: auto.points,
        time: auto.seconds[1] / auto.points as f64,
        auto: auto.errors,
        parity: parity.errors,
    }
}

/// The fish over one tail beat; the signs of each step follow from the previous one.
fn swim() -> Vec<Step> {
    eprintln!("the fish swims");
    let mut fish = by_name("fish").expect("a shape");
    fish.set("amplitude", 0.12).expect("in range");
    let period = fish.get("period").expect("a parameter");
    let samples = fish.sample::<f64>(SWIMMER, &RANDOM, 3).expect("samples");
    let methods = [Method::Previous, Method::Auto];
    let [mut plan, mut auto] = methods.map(|method| measure::plan(Radius::Auto, method));
    let mut steps = Vec::new();
    for step in 0..=STEPS {
        let time = period * step as f64 / STEPS as f64;
        fish.set("time", time).expect("in range");
        let points = fish.points_at(&samples.coordinates).expect("points");
        let truth = fish.normals_at(&samples.coordinates).expect("normals");
        let cloud = measure::cloud(&points);
        for plan in [&mut plan, &mut auto] {
            plan.orient(&cloud).expect("signs");
        }
        let [seconds, of_auto] = [&plan, &auto].map(|plan| plan.report().seconds.of(Stage::Orient));
        let out = plan.orientation();
        let cosines = out.normals.iter().zip(&truth);
        let cosines = cosines.map(|(&n, &t)| vector::dot(vector::to_f64(n), t));
        let evaluated: Vec<f64> = cosines.filter(|c: &f64| c.abs() > 0.5).collect();
        let wrong = evaluated.iter().filter(|&&c| c < 0.0).count();
        steps.push(Step {
            wrong: 100.0 * wrong as f64 / evaluated.len() as f64,
            turned: match out.method {
                MethodUsed::Previous { turned } => turned,
                _ => 0,
            },
            follows: matches!(out.method, MethodUsed::Previous { .. }),
            time: seconds / of_auto,
        });
    }
    steps
}

#[cfg(test)]
mod tests;
