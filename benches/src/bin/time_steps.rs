//! A swimming fish on a fixed grid: the first call against those of the time steps after it.
//!
//! `time-steps [THREADS] [STEPS]` prints a table in Markdown. The first call knows nothing but the points,
//! and takes all memory. The steps run in a second plan, with what the step before found: its radius, and
//! its normals for the sides ([`Method::Signs`]). The second plan's own first step, which takes its memory,
//! is shown apart.

use std::error::Error;
use std::time::Instant;

use isograd::neighbors::Radius;
use isograd::orient::Method;
use isograd::{Grid, Options, PointCloud, Reconstructor, Seconds, Stage};
use isograd_benches::pool;
use isograd_element::vector;
use isograd_shapes::{Sampling, Shape, SurfaceCoordinate, by_name};

type Outcome<T = ()> = Result<T, Box<dyn Error + Send + Sync>>;

/// Grid of the paper's fish.
const SHAPE: [usize; 3] = [338, 120, 151];
/// Samples that stay with the skin.
const SAMPLES: usize = 50_000;
/// Longest side of the grid over the length swept by the body.
const AIR: f64 = 1.2;
/// Steps in one beat of the tail.
const STEPS_A_BEAT: usize = 50;

fn main() -> Outcome {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: usize| arguments.next().map_or(Ok(default), |a| a.parse());
    let (threads, steps) = (number(2)?, number(12)?);
    pool(threads).install(|| swim(threads, steps.max(2)))
}

fn swim(threads: usize, steps: usize) -> Outcome {
    let mut fish = by_name("fish")?;
    fish.set("amplitude", 0.125)?;
    let samples = fish.sample::<f64>(SAMPLES, &Sampling::default(), 1)?;
    let mut clouds = Vec::new();
    for step in 0..=steps {
        clouds.push(at(&mut fish, &samples.coordinates, step)?);
    }
    let grid = round(&clouds)?;
    let (first, found) = first_call(&clouds[0], grid)?;
    let mut later = steps_after(&found, &clouds[1..], grid)?;
    let second = later.remove(0);
    show(threads, &first, &second, &later);
    Ok(())
}

/// The skin's points at a time.
fn at(fish: &mut Shape, skin: &[SurfaceCoordinate], step: usize) -> Outcome<Vec<[f32; 3]>> {
    fish.set("time", step as f64 / STEPS_A_BEAT as f64)?;
    Ok(fish.points_at(skin)?)
}

/// A grid with room for all clouds.
fn round(clouds: &[Vec<[f32; 3]>]) -> Outcome<Grid<f32>> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in clouds.iter().flatten() {
        for a in 0..3 {
            low[a] = low[a].min(f64::from(point[a]));
            high[a] = high[a].max(f64::from(point[a]));
        }
    }
    let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    let spacing = AIR * longest / SHAPE[0] as f64;
    let corner = |a: usize| 0.5 * (low[a] + high[a]) - 0.5 * spacing * SHAPE[a] as f64;
    let lower = vector::of_f64(std::array::from_fn(corner));
    Ok(Grid::new(lower, spacing as f32, SHAPE)?)
}

/// What a call took: as a whole, the making of the plan included where it is new, and stage by stage.
struct Call {
    seconds: f64,
    stages: Seconds,
}

/// What a call leaves for the next.
struct Found {
    radius: f64,
    normals: Vec<[f32; 3]>,
}

fn first_call(points: &[[f32; 3]], grid: Grid<f32>) -> Outcome<(Call, Found)> {
    let cloud = PointCloud::new(points.to_vec())?;
    let start = Instant::now();
    let mut plan = Reconstructor::new(grid, unchecked())?;
    let result = plan.reconstruct(&cloud)?;
    let call = Call {
        seconds: start.elapsed().as_secs_f64(),
        stages: result.report().seconds,
    };
    let found = Found {
        radius: result.report().radius,
        normals: result.normals().to_vec(),
    };
    Ok((call, found))
}

fn steps_after(found: &Found, clouds: &[Vec<[f32; 3]>], grid: Grid<f32>) -> Outcome<Vec<Call>> {
    let options = unchecked()
        .radius(Radius::Fixed(found.radius))
        .orient(Method::Signs);
    let mut plan = Reconstructor::new(grid, options)?;
    let mut normals = found.normals.clone();
    let mut calls = Vec::new();
    for points in clouds {
        let cloud = PointCloud::new(points.clone())?.with_normals(normals)?;
        let start = Instant::now();
        let result = plan.reconstruct(&cloud)?;
        calls.push(Call {
            seconds: start.elapsed().as_secs_f64(),
            stages: result.report().seconds,
        });
        normals = result.normals().to_vec();
    }
    Ok(calls)
}

fn unchecked() -> Options {
    Options::default().checks(false)
}

fn show(threads: usize, first: &Call, second: &Call, later: &[Call]) {
    let [x, y, z] = SHAPE;
    let count = later.len();
    println!("Fish, {SAMPLES} samples, {x} × {y} × {z} cells, f32, {threads} threads; seconds.\n");
    println!(
        "| | first call | first step | later steps, median of {count} | over the first call |"
    );
    println!("|---|--:|--:|--:|--:|");
    for stage in Stage::ALL.into_iter().filter(|&s| s != Stage::Checks) {
        let of = |call: &Call| call.stages.of(stage);
        row(stage.name(), of(first), of(second), later.iter().map(of));
    }
    let of = |call: &Call| call.seconds;
    row("all", of(first), of(second), later.iter().map(of));
}

fn row(name: &str, first: f64, second: f64, later: impl Iterator<Item = f64>) {
    let mut later: Vec<f64> = later.collect();
    later.sort_by(f64::total_cmp);
    let median = later[later.len() / 2];
    let ratio = median / first;
    println!("| {name} | {first:.4} | {second:.4} | {median:.4} | {ratio:.2} |");
}
