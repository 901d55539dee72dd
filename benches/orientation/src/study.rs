//! All that the page is made of.

use std::path::Path;

use isograd::orient::{self, Known, Method, MethodUsed, ParityOptions};
use isograd_element::vector;
use isograd_shapes::{Layout, Sampling, by_name};
use serde::Serialize;

use crate::measure::{Errors, Prepared, measure};
use crate::suite::{self, Cloud, Family};

/// Runs of the automatic method on each cloud, of which the fastest counts.
const RUNS: usize = 2;

/// Samples of the fish that swims, and steps of one beat of its tail.
const SWIMMER: usize = 50_000;
const STEPS: usize = 20;

/// One cloud.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub cloud: String,
    /// What makes it hard.
    #[serde(skip)]
    pub family: Family,
    /// Number of points.
    pub points: usize,
    /// The automatic method.
    pub auto: Errors,
    /// The paper's method.
    pub parity: Errors,
    /// Time of the automatic method for a point, over that of the cloud in the middle.
    pub time: f64,
}

/// One step of the fish.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// Wrong signs, in per cent of those that are judged.
    pub wrong: f64,
    /// Axes that have turned far since the step before.
    pub turned: usize,
    /// Whether the signs follow the step before.
    pub follows: bool,
    /// Time for following over that of the automatic method on the same cloud.
    pub time: f64,
}

/// All results.
pub struct Results {
    /// One for each cloud.
    pub rows: Vec<Row>,
    /// Steps of the fish that swims.
    pub steps: Vec<Step>,
}

/// Measures everything; says on stderr where it is. `data` is the folder of the real clouds.
pub fn run(data: Option<&Path>) -> Results {
    let mut clouds = data.map(suite::real).unwrap_or_default();
    clouds.extend(suite::made());
    let mut rows: Vec<Row> = clouds.iter().map(row).collect();
    let mut times: Vec<f64> = rows.iter().map(|row| row.time).collect();
    times.sort_by(f64::total_cmp);
    let middle = times.get(times.len() / 2).copied().unwrap_or(1.0);
    rows.iter_mut().for_each(|row| row.time /= middle);
    Results {
        rows,
        steps: swim(),
    }
}

/// The row of a cloud, its time still in seconds for a point.
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

/// The fish through one beat of its tail, each step from the signs of the one before.
///
/// # Panics
/// Never: the fish and its parameters are fixed.
fn swim() -> Vec<Step> {
    eprintln!("the fish swims");
    let mut fish = by_name("fish").expect("a shape");
    fish.set("amplitude", 0.12).expect("in range");
    let period = fish.get("period").expect("a parameter");
    let sampling = Sampling {
        layout: Layout::Random,
        ..Sampling::default()
    };
    let samples = fish.sample::<f64>(SWIMMER, &sampling, 3).expect("samples");
    let (mut plan, mut anew) = (orient::Scratch::default(), orient::Scratch::default());
    let mut steps = Vec::new();
    for step in 0..=STEPS {
        let time = period * step as f64 / STEPS as f64;
        fish.set("time", time).expect("in range");
        let points = fish.points_at(&samples.coordinates).expect("points");
        let truth = fish.normals_at(&samples.coordinates).expect("normals");
        let prepared = Prepared::new(&points);
        let known = || Known::from(None);
        let (out, seconds) = prepared.orient(known(), &Method::Previous, &mut plan);
        let (_, whole) = prepared.orient(known(), &Method::Auto, &mut anew);
        let cosines = out.normals.iter().zip(&truth);
        let cosines = cosines.map(|(&n, &t)| vector::dot(vector::to_f64(n), t));
        let judged: Vec<f64> = cosines.filter(|c: &f64| c.abs() > 0.5).collect();
        let wrong = judged.iter().filter(|&&c| c < 0.0).count();
        steps.push(Step {
            wrong: 100.0 * wrong as f64 / judged.len() as f64,
            turned: match out.method {
                MethodUsed::Previous { turned } => turned,
                _ => 0,
            },
            follows: matches!(out.method, MethodUsed::Previous { .. }),
            time: seconds / whole,
        });
    }
    steps
}
