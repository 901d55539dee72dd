//! A swimming fish on a fixed grid: the first call compared with the time steps after it.
//!
//! `time-steps [THREADS] [STEPS]` prints a table in Markdown. The first call gets only points, and allocates. The steps run in
//! a second plan with the radius of the first call and the normals of the previous step ([`Method::Signs`]). The first step
//! of the second plan, which allocates as well, has its own column.

use std::error::Error;
use std::time::Instant;

use isograd::neighbors::Radius;
use isograd::orient::Method;
use isograd::{Grid, Options, PointCloud, Reconstructor, Seconds, Stage, SurfaceResolution};
use isograd_benches::pool;
use isograd_benches::sampling::{Body, centered_grid};
use isograd_benches::statistics::median;
use isograd_shapes::{Sampling, Shape, SurfaceCoordinate, by_name};

type Outcome<T = ()> = Result<T, Box<dyn Error + Send + Sync>>;

/// Time steps per tail beat.
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
    let samples = fish.sample::<f64>(Body::FISH.samples, &Sampling::default(), 1)?;
    let mut clouds = Vec::new();
    for step in 0..=steps {
        clouds.push(at(&mut fish, &samples.coordinates, step)?);
    }
    let grid = grid_around(&clouds)?;
    let (first, carried) = first_call(&clouds[0], grid)?;
    let mut later = steps_after(&carried, &clouds[1..], grid)?;
    let second = later.remove(0);
    show(threads, &first, &second, &later);
    Ok(())
}

/// Points of the skin at a time step.
fn at(fish: &mut Shape, skin: &[SurfaceCoordinate], step: usize) -> Outcome<Vec<[f32; 3]>> {
    fish.set("time", step as f64 / STEPS_A_BEAT as f64)?;
    Ok(fish.points_at(skin)?)
}

/// Grid around all clouds.
fn grid_around(clouds: &[Vec<[f32; 3]>]) -> Outcome<Grid<f32>> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in clouds.iter().flatten() {
        for a in 0..3 {
            low[a] = low[a].min(f64::from(point[a]));
            high[a] = high[a].max(f64::from(point[a]));
        }
    }
    centered_grid((low, high), Body::FISH.shape).map_err(|error| error.to_string().into())
}

/// Seconds of a call, including the creation of a new plan, and of its stages.
struct Call {
    seconds: f64,
    stages: Seconds,
}

/// Result of a call that the next one uses.
struct Carried {
    radius: f64,
    normals: Vec<[f32; 3]>,
}

fn first_call(points: &[[f32; 3]], grid: Grid<f32>) -> Outcome<(Call, Carried)> {
    let cloud = PointCloud::new(points.to_vec())?;
    let start = Instant::now();
    let mut plan = Reconstructor::new(grid, unchecked())?;
    let result = plan.reconstruct(&cloud)?;
    let call = Call {
        seconds: start.elapsed().as_secs_f64(),
        stages: result.report().seconds,
    };
    let carried = Carried {
        radius: result.report().radius,
        normals: result.normals().to_vec(),
    };
    Ok((call, carried))
}

fn steps_after(carried: &Carried, clouds: &[Vec<[f32; 3]>], grid: Grid<f32>) -> Outcome<Vec<Call>> {
    let options = unchecked()
        .radius(Radius::Fixed(carried.radius))
        .orient(Method::Signs);
    let mut plan = Reconstructor::new(grid, options)?;
    let mut normals = carried.normals.clone();
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
    Options::default()
        .surface(SurfaceResolution::Grid)
        .checks(false)
}

fn show(threads: usize, first: &Call, second: &Call, later: &[Call]) {
    let Body {
        samples,
        shape: [x, y, z],
        ..
    } = Body::FISH;
    let count = later.len();
    println!("Fish, {samples} samples, {x} × {y} × {z} cells, f32, {threads} threads; seconds.\n");
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
    let median = median(later.collect());
    let ratio = median / first;
    println!("| {name} | {first:.4} | {second:.4} | {median:.4} | {ratio:.2} |");
}
