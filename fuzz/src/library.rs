//! Random clouds and options: no panic, results that are finite or an error, and the same bits on one thread and on two.

use std::path::Path;

use isograd::distance::Band;
use isograd::isosurface::Level;
use isograd::neighbors::Radius;
use isograd::orient::{Method, ParityOptions};
use isograd::poisson::{Smoothing, Walls};
use isograd::splat::Weights;
use isograd::{
    Cotangent, Grid, Options, Outliers, Pipeline, PointCloud, Reconstruction, Reconstructor,
    Resolution, Sensors, Solve, SurfaceResolution,
};
use isograd_shapes::Shape;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::case::{Inputs, Outcome, catch, check_message};
use crate::clouds::{Rows, Scales, cloud, vectors};
use crate::random::Random;

/// Scales of `f32`.
const SINGLE: Scales = Scales {
    moderate: 8.0,
    extreme: 37.0,
};
/// Scales of `f64`.
const DOUBLE: Scales = Scales {
    moderate: 12.0,
    extreme: 300.0,
};

/// Shapes, and one pool of threads for each number of threads that is compared.
pub struct Library {
    shapes: Vec<Shape>,
    pools: [ThreadPool; 2],
}

/// One input: a cloud, options, and the seed of grid and cotangents.
struct Setup {
    points: Rows,
    normals: Option<Rows>,
    sensors: Option<Rows>,
    options: Options,
    scales: Scales,
    random: Random,
}

/// Bits of the results, by name; or the error.
type Results = Result<Vec<(&'static str, Vec<u64>)>, String>;

impl Library {
    /// Starts the threads.
    pub fn new() -> Result<Self, String> {
        let pool = |threads| {
            let builder = ThreadPoolBuilder::new().num_threads(threads);
            builder.build().map_err(|e| format!("no threads: {e}"))
        };
        Ok(Self {
            shapes: isograd_shapes::all(),
            pools: [pool(1)?, pool(2)?],
        })
    }

    fn check<T: Pipeline>(&self, setup: &Setup) -> (bool, Option<String>) {
        let run = |pool: &ThreadPool| catch(|| pool.install(|| results::<T>(setup)));
        let [one, two] = match self.pools.each_ref().map(run) {
            [Ok(one), Ok(two)] => [one, two],
            [Err(panic), _] | [_, Err(panic)] => return (false, Some(panic)),
        };
        let failure = match (&one, &two) {
            (Err(a), Err(b)) if a != b => Some(format!("1 thread: {a}; 2 threads: {b}")),
            (Err(message), Err(_)) => check_message(message).err(),
            (Ok(a), Ok(b)) => different(a, b).or_else(|| not_finite(a)),
            (Err(e), _) | (_, Err(e)) => {
                Some(format!("an error with one number of threads only: {e}"))
            }
        };
        (one.is_ok(), failure)
    }
}

impl Inputs for Library {
    fn run(&mut self, mut random: Random, folder: &Path, name: &str) -> Outcome {
        let is_single = random.one_in(2);
        let scales = if is_single { SINGLE } else { DOUBLE };
        let (points, history) = cloud(&self.shapes, scales, &mut random);
        let n = points.len();
        let has = [2, 3].map(|chance| random.one_in(chance));
        let [normals, sensors] = has.map(|has| has.then(|| vectors(n, scales, &mut random)));
        let setup = Setup {
            normals,
            sensors,
            options: options(&mut random),
            points,
            scales,
            random,
        };
        let (row, (accepted, failure)) = match is_single {
            true => ("f32", self.check::<f32>(&setup)),
            false => ("f64", self.check::<f64>(&setup)),
        };
        if failure.is_some()
            && let Ok(cloud) = typed_cloud::<f64>(&setup)
        {
            // Without sensors; the command repeats the input in any case.
            let _ = isograd_io::write_cloud(&folder.join(name).with_extension("npz"), &cloud);
        }
        Outcome {
            row,
            accepted,
            failure: failure.map(|failure| format!("{failure} [{history}; {:?}]", setup.options)),
            ..Outcome::default()
        }
    }
}

/// Options, most of them default.
fn options(random: &mut Random) -> Options {
    let mut options = Options::default();
    if random.one_in(3) {
        let radius = random.power(-3.0, 1.0);
        options.radius = match random.one_in(3) {
            true => Radius::Cut(radius),
            false => Radius::Fixed(radius),
        };
    }
    if random.one_in(2) {
        let parity = ParityOptions {
            gamma: random.pick(&[2.5, 1.0, 10.0, 1e6, 1e30]),
            tolerance: random.pick(&[2, 0, usize::MAX]),
            step: random.pick(&[1.0, 0.01, 3.0, 1e30]),
        };
        let methods = [
            Method::Given,
            Method::Signs,
            Method::Sensors,
            Method::Previous,
            Method::Parity(parity),
        ];
        options.orient = random.pick(&methods);
    }
    if random.one_in(4) {
        options.smoothing =
            Smoothing::Cells(random.pick(&[0.0, 1e-9, 0.5, 3.0, 40.0, 1e10, 1e300]));
    }
    if random.one_in(4) {
        options.screening = random.pick(&[1e-30, 0.1, 4.0, 1e3, 1e30]);
    }
    if random.one_in(3) {
        options.surface = random.pick(&[
            SurfaceResolution::Grid,
            SurfaceResolution::Factor(1.5),
            SurfaceResolution::Factor(3.0),
            SurfaceResolution::Spacing(1e300),
        ]);
    }
    options.walls = random.pick(&[Walls::Auto, Walls::Free, Walls::Closed]);
    options.outliers = random.pick(&[Outliers::Ignore, Outliers::Ignore, Outliers::Keep]);
    if random.one_in(4) {
        options.solve = Solve::Sparse;
    }
    if random.one_in(4) {
        options.band = Band::Within(random.power(-4.0, 2.0));
    }
    options.level = random.pick(&[Level::Local, Level::Local, Level::Thin, Level::Mean]);
    options.splat = random.pick(&[Weights::BSpline, Weights::BSpline, Weights::Paper]);
    options.area = !random.one_in(4);
    options.checks = !random.one_in(4);
    options
}

/// Reconstructs the cloud and pulls random cotangents back.
fn results<T: Pipeline>(setup: &Setup) -> Results {
    let mut random = setup.random.clone();
    let cloud = typed_cloud::<T>(setup)?;
    let grid = grid(&cloud, &mut random)?;
    let mut plan = Reconstructor::new(grid, setup.options.clone()).map_err(|e| e.to_string())?;
    let result = plan.reconstruct(&cloud).map_err(|e| e.to_string())?;
    let mut bits = forward_bits(result);
    bits.extend(pullback_bits(result, setup.scales, &mut random)?);
    Ok(bits)
}

fn typed<T: Pipeline>(rows: &Rows) -> Vec<[T; 3]> {
    rows.iter().map(|row| row.map(T::of)).collect()
}

fn typed_cloud<T: Pipeline>(setup: &Setup) -> Result<PointCloud<T>, String> {
    let build = || {
        let mut cloud = PointCloud::new(typed(&setup.points))?;
        if let Some(normals) = &setup.normals {
            cloud = cloud.with_normals(typed(normals))?;
        }
        match &setup.sensors {
            Some(sensors) => cloud.with_sensors(Sensors::Each(typed(sensors))),
            None => Ok(cloud),
        }
    };
    build().map_err(|e: isograd::PointCloudError| e.to_string())
}

/// A small grid around the cloud, or one that need not contain it.
fn grid<T: Pipeline>(cloud: &PointCloud<T>, random: &mut Random) -> Result<Grid<T>, String> {
    let grid = if random.one_in(6) {
        let spacing = random.power(-2.0, 0.0);
        let shape = [(); 3].map(|()| 2 + random.below(24));
        let lower = shape.map(|n| T::of(-0.5 * spacing * n as f64));
        Grid::new(lower, T::of(spacing), shape)
    } else {
        let cells = 10 + random.below(12);
        Grid::fit(
            cloud,
            Resolution::Cells(cells),
            T::of(random.between(0.0, 0.3)),
        )
    };
    let grid = grid.map_err(|e| e.to_string())?;
    match grid.cells() > 100_000 {
        true => Err("the grid is too large for this test".into()),
        false => Ok(grid),
    }
}

fn bits<'a, T: Pipeline>(values: impl IntoIterator<Item = &'a T>) -> Vec<u64> {
    values.into_iter().map(|x| x.f64().to_bits()).collect()
}

fn forward_bits<T: Pipeline>(result: &Reconstruction<T>) -> Vec<(&'static str, Vec<u64>)> {
    let faces = result.mesh().faces().as_flattened();
    vec![
        ("φ", bits(result.sdf().values())),
        ("the indicator", bits(result.indicator().values())),
        ("the iso-value", bits(&[result.iso_value()])),
        (
            "the vertices",
            bits(result.mesh().vertices().as_flattened()),
        ),
        ("the faces", faces.iter().map(|&i| u64::from(i)).collect()),
        ("the normals", bits(result.normals().as_flattened())),
        ("the confidence", bits(result.confidence())),
        ("the areas", bits(result.areas())),
    ]
}

fn pullback_bits<T: Pipeline>(
    result: &Reconstruction<T>,
    scales: Scales,
    random: &mut Random,
) -> Result<Vec<(&'static str, Vec<u64>)>, String> {
    let size = match random.below(4) {
        0 => random.power(-scales.extreme, scales.extreme),
        _ => 1.0,
    };
    let mut numbers = |n: usize, chance| {
        let is_there = random.one_in(chance);
        let mut number = |_| T::of(size * random.between(-1.0, 1.0));
        is_there.then(|| (0..n).map(&mut number).collect::<Vec<T>>())
    };
    let (cells, vertices, points) = (
        result.sdf().values().len(),
        result.mesh().vertices().len(),
        result.points().len(),
    );
    let (sdf, indicator) = (numbers(cells, 1), numbers(cells, 3));
    let (of_vertices, normals) = (numbers(3 * vertices, 3), numbers(3 * points, 3));
    let (areas, iso_value) = (numbers(points, 3), numbers(1, 3));
    let cotangent = Cotangent {
        sdf: sdf.as_deref(),
        indicator: indicator
            .as_deref()
            .filter(|_| result.solve() == Solve::Dense),
        iso_value: iso_value.map_or(T::zero(), |value| value[0]),
        vertices: of_vertices.as_deref().map(|v| v.as_chunks().0),
        normals: normals.as_deref().map(|v| v.as_chunks().0),
        areas: areas.as_deref(),
        extensions: &[],
    };
    let bar = result.pullback(&cotangent).map_err(|e| e.to_string())?;
    Ok(vec![
        (
            "the gradient of the points",
            bits(bar.points.as_flattened()),
        ),
        (
            "the gradient of the normals",
            bits(bar.normals.as_flattened()),
        ),
        (
            "the gradient of the grid",
            bits(bar.grid.lower.iter().chain([&bar.grid.spacing])),
        ),
    ])
}

/// The first array whose bits differ.
fn different(a: &[(&'static str, Vec<u64>)], b: &[(&'static str, Vec<u64>)]) -> Option<String> {
    let mut pairs = a.iter().zip(b);
    let (a, _) = pairs.find(|(a, b)| a.1 != b.1)?;
    Some(format!("{} differ between 1 and 2 threads", a.0))
}

/// The first array with a number that is not finite. Indices of faces are all finite as numbers.
fn not_finite(results: &[(&'static str, Vec<u64>)]) -> Option<String> {
    let is_bad = |bits: &&u64| !f64::from_bits(**bits).is_finite();
    results.iter().find_map(|(name, bits)| {
        let count = bits.iter().filter(is_bad).count();
        let all = bits.len();
        (count > 0).then(|| format!("{name}: {count} of {all} numbers are not finite"))
    })
}
