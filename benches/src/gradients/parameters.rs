//! Gradient of a shape fit with respect to the shape parameters, by the pullback and by differences.

use std::time::Instant;

use isograd::isosurface::Level;
use isograd::{
    CloudCotangent, Cotangent, Field, Options, Reconstruction, Reconstructor, SurfaceResolution,
};
use isograd_element::vector;
use isograd_shapes::Shape;
use serde::Serialize;

use super::functional::LAYER;
use crate::output::Outcome;
use crate::sampling::{Body, Draw, SEED, Sampled, points_only};
use crate::statistics::median;

/// Largest relative perturbation of a parameter.
const OFF: f64 = 0.15;
/// First step of the held differences, in cells of the fastest point.
const SMALL: f64 = 1e-6;
/// Smallest step, below which rounding dominates.
const SMALLEST: f64 = 1e-9;
/// Step of the differences across a cell, in cells of the fastest point.
const REAL: f64 = 0.5;
/// Number of timed pullbacks.
const REPEATS: usize = 5;

/// One parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub name: &'static str,
    /// `∂L/∂p` by the pullback.
    pub pullback: f64,
    /// By central differences, with radii and signs of the normals held.
    pub held: f64,
    /// Step of the held differences, in cells of the fastest point.
    pub held_step: f64,
    /// Neighborhoods whose number of samples changes over that step.
    pub changed: usize,
    /// By central differences of complete reconstructions, half a cell to either side.
    pub real: f64,
    /// Samples whose normal changes sign over that step.
    pub flipped: usize,
}

/// Settings and timings of the comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Setting {
    /// Name of the body.
    pub body: &'static str,
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub samples: usize,
    /// Cell size, in the body's unit.
    pub cell: f64,
    /// The loss.
    pub loss: f64,
    /// Number of bounded derivatives.
    pub guarded: usize,
    /// Largest relative perturbation of a parameter.
    pub perturbation: f64,
    /// Half width of the layer of the functionals, in cells.
    pub layer: f64,
    /// Threads.
    pub threads: usize,
    /// Mean seconds of one reconstruction, including the points of the shape.
    pub forward: f64,
    /// Seconds of all reconstructions of the differences across a cell.
    pub differences: f64,
    /// Number of those reconstructions.
    pub reconstructions: usize,
    /// Seconds of a warm pullback to the points: median.
    pub pullback: f64,
    /// Seconds from there to the parameters: median.
    pub chain: f64,
}

/// Gradient and settings.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// One for each parameter.
    pub rows: Vec<Row>,
    /// Settings and timings.
    pub setting: Setting,
}

impl Row {
    /// Relative difference of pullback and held differences.
    pub fn relative(&self) -> f64 {
        (self.pullback / self.held - 1.0).abs()
    }
}

/// `L = Σ_o (φ_o − φ̃_o)²` between a fish whose parameters are off and the fish of the same samples.
pub fn measure(body: &Body, draw: Draw) -> Outcome<Parameters> {
    let sampled = body.sample(draw)?;
    let names = varied(&sampled.shape);
    let mut bench = Bench::new(&sampled, &names)?;
    let mut rows = Vec::new();
    let (mut seconds, mut reconstructions) = (0.0, 0);
    let pulled = bench.pull(&names)?;
    for (&name, &pullback) in names.iter().zip(&pulled.gradient) {
        eprintln!("{}: {name}", body.name);
        let start = Instant::now();
        let (real, flipped) = bench.real(name)?;
        seconds += start.elapsed().as_secs_f64();
        reconstructions += 2;
        let (held, held_step, changed) = bench.held(name)?;
        rows.push(Row {
            name,
            pullback,
            held,
            held_step,
            changed,
            real,
            flipped,
        });
    }
    let setting = Setting {
        body: body.name,
        shape: body.shape,
        samples: body.samples,
        cell: sampled.grid.spacing(),
        loss: bench.loss(),
        guarded: pulled.guarded,
        perturbation: OFF,
        layer: LAYER,
        threads: rayon::current_num_threads(),
        forward: seconds / reconstructions.max(1) as f64,
        differences: seconds,
        reconstructions,
        pullback: pulled.pullback,
        chain: pulled.chain,
    };
    Ok(Parameters { rows, setting })
}

/// Names of the widths and heights of a shape.
fn varied(shape: &Shape) -> Vec<&'static str> {
    let names = shape.parameters().map(|(parameter, _)| parameter.name);
    names
        .filter(|name| name.starts_with("width") || name.starts_with("height"))
        .collect()
}

/// Reproducible factors within `1 ± OFF` for `count` parameters.
fn factors(count: usize) -> Vec<f64> {
    // Steele, Lea and Flood's generator.
    let mut state = SEED;
    let mut next = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as f64 / 2f64.powi(64)
    };
    (0..count)
        .map(|_| 1.0 + OFF * (2.0 * next() - 1.0))
        .collect()
}

struct Bench<'a> {
    sampled: &'a Sampled,
    /// The shape with perturbed parameters.
    start: Shape,
    target: Field<f64>,
    base: Reconstruction<f64>,
    plan: Reconstructor<f64>,
}

/// A gradient and the seconds of its two parts.
struct Pulled {
    gradient: Vec<f64>,
    guarded: usize,
    pullback: f64,
    chain: f64,
}

impl<'a> Bench<'a> {
    fn new(sampled: &'a Sampled, names: &[&'static str]) -> Outcome<Self> {
        let options = Options::default()
            .surface(SurfaceResolution::Grid)
            .level(Level::Local)
            .checks(false);
        let mut plan = Reconstructor::new(sampled.grid, options)?;
        let points = sampled.shape.points_at::<f64>(&sampled.coordinates)?;
        let target = plan.reconstruct(&points_only(&points)?)?.sdf().clone();
        let mut start = sampled.shape.clone();
        let mut changes = Vec::new();
        for (&name, factor) in names.iter().zip(factors(names.len())) {
            changes.push((name, start.get(name)? * factor));
        }
        start.set_all(changes)?;
        let points = start.points_at::<f64>(&sampled.coordinates)?;
        let base = plan.reconstruct(&points_only(&points)?)?.clone();
        Ok(Self {
            sampled,
            start,
            target,
            base,
            plan,
        })
    }

    fn loss(&self) -> f64 {
        let pairs = self.base.sdf().values().iter().zip(self.target.values());
        pairs.map(|(phi, target)| (phi - target).powi(2)).sum()
    }

    /// Gradient by the pullback. The first call, which allocates, is not timed.
    fn pull(&self, names: &[&'static str]) -> Outcome<Pulled> {
        let coordinates = &self.sampled.coordinates;
        let pairs = self.base.sdf().values().iter().zip(self.target.values());
        let bar: Vec<f64> = pairs.map(|(phi, target)| 2.0 * (phi - target)).collect();
        let cotangent = Cotangent {
            sdf: Some(&bar),
            ..Cotangent::default()
        };
        let places = names.iter().filter_map(|&name| {
            let mut all = self.start.parameters();
            all.position(|(parameter, _)| parameter.name == name)
        });
        let places: Vec<usize> = places.collect();
        let mut out = CloudCotangent::default();
        let (mut pullback, mut chain, mut gradient) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..=REPEATS {
            let start = Instant::now();
            self.base.pullback_into(&cotangent, &mut out)?;
            pullback.push(start.elapsed().as_secs_f64());
            let start = Instant::now();
            gradient = self.start.pullback_of(&places, coordinates, &out.points)?;
            chain.push(start.elapsed().as_secs_f64());
        }
        Ok(Pulled {
            gradient,
            guarded: out.guarded,
            pullback: median(pullback.split_off(1)),
            chain: median(chain.split_off(1)),
        })
    }

    /// Change of the parameter that moves the fastest point by a cell.
    fn cell_of(&self, name: &str) -> Outcome<f64> {
        let tangent = self.start.tangent(name, &self.sampled.coordinates)?;
        let fastest = tangent.iter().map(|&t| vector::norm(t)).fold(0.0, f64::max);
        if !(fastest > 0.0) {
            return Err(format!("{name} moves no point").into());
        }
        Ok(self.sampled.grid.spacing() / fastest)
    }

    /// Reconstruction with one parameter changed.
    fn reconstruct(&mut self, name: &str, step: f64, held: bool) -> Outcome<&Reconstruction<f64>> {
        let mut shape = self.start.clone();
        shape.set(name, self.start.get(name)? + step)?;
        let cloud = points_only(&shape.points_at::<f64>(&self.sampled.coordinates)?)?;
        Ok(if held {
            self.plan.reconstruct_held(&cloud, &self.base)?
        } else {
            self.plan.reconstruct(&cloud)?
        })
    }

    /// `∂L/∂p` across half a cell to either side, and the number of normals that change sign.
    fn real(&mut self, name: &str) -> Outcome<(f64, usize)> {
        let step = REAL * self.cell_of(name)?;
        let mut end = |step| -> Outcome<(Field<f64>, Vec<[f64; 3]>)> {
            let result = self.reconstruct(name, step, false)?;
            Ok((result.sdf().clone(), result.normals().to_vec()))
        };
        let ((plus, above), (minus, below)) = (end(step)?, end(-step)?);
        let slope = self.difference(&plus, &minus) / (2.0 * step);
        Ok((slope, flipped(&above, &below)))
    }

    /// `∂L/∂p` by held differences, the step in cells, and the number of neighborhoods that still changed.
    fn held(&mut self, name: &str) -> Outcome<(f64, f64, usize)> {
        let cell = self.cell_of(name)?;
        let mut size = SMALL;
        loop {
            let step = size * cell;
            let (plus, above) = self.held_side(name, step)?;
            let (minus, below) = self.held_side(name, -step)?;
            let changed = above + below;
            if changed == 0 || size / 10.0 < SMALLEST {
                let slope = self.difference(&plus, &minus) / (2.0 * step);
                return Ok((slope, size, changed));
            }
            size /= 10.0;
        }
    }

    fn held_side(&mut self, name: &str, step: f64) -> Outcome<(Field<f64>, usize)> {
        let counts = self.base.neighbor_counts().to_vec();
        let moved = self.reconstruct(name, step, true)?;
        let pairs = moved.neighbor_counts().iter().zip(&counts);
        let changed = pairs.filter(|(a, b)| a != b).count();
        Ok((moved.sdf().clone(), changed))
    }

    /// `L(φ⁺) − L(φ⁻)`, as a sum of products to limit cancellation.
    fn difference(&self, plus: &Field<f64>, minus: &Field<f64>) -> f64 {
        let pairs = plus.values().iter().zip(minus.values());
        let terms = pairs.zip(self.target.values());
        terms.map(|((p, m), t)| (p - m) * (p + m - 2.0 * t)).sum()
    }
}

/// Number of normals whose sign differs between `a` and `b`.
pub fn flipped(a: &[[f64; 3]], b: &[[f64; 3]]) -> usize {
    let pairs = a.iter().zip(b);
    pairs.filter(|(a, b)| vector::dot(**a, **b) < 0.0).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn perturbations_use_the_allowed_range() {
        let factors = factors(14);
        let off = factors.iter().map(|f| (f - 1.0).abs());
        let most = off.fold(0.0, f64::max);
        assert!(most <= OFF && most > 0.5 * OFF, "{factors:?}");
    }
}
