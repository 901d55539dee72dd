//! The gradient of a fit in the parameters of a shape, by the pullback and by differences.

use std::time::Instant;

use isograd::{
    CloudCotangent, Cotangent, Field, Options, PullbackScratch, Reconstruction, Reconstructor,
};
use isograd_element::vector;
use isograd_page::statistics::median;
use isograd_shapes::Shape;
use serde::Serialize;

use crate::Outcome;
use crate::body::{Body, Draw, SEED, Sampled, points_alone};

/// By how much a parameter is off at most, as a share of itself.
pub const OFF: f64 = 0.15;
/// First step of the differences with everything held, in cells of the fastest point.
const SMALL: f64 = 1e-6;
/// A step below this says more about rounding than about slopes.
const SMALLEST: f64 = 1e-9;
/// Step of the differences that an optimizer would see, in cells of the fastest point.
const REAL: f64 = 0.5;
/// Pullbacks that are timed.
const REPEATS: usize = 5;

/// One parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub name: &'static str,
    /// `∂L/∂p` by the pullback.
    pub pullback: f64,
    /// By central differences, with radii and signs of normals held.
    pub held: f64,
    /// Their step, in cells of the fastest point.
    pub held_step: f64,
    /// Neighborhoods whose number of samples is not the same on both sides of the step.
    pub changed: usize,
    /// By central differences of whole reconstructions, half a cell to either side.
    pub real: f64,
    /// Samples whose normal points to the other side at one end of that step than at the other.
    pub flipped: usize,
}

/// What was compared, and how long it took.
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
    /// Places where a derivative was bounded.
    pub guarded: usize,
    /// Threads.
    pub threads: usize,
    /// Seconds of one reconstruction, points of the shape included: mean over those of the differences.
    pub forward: f64,
    /// Seconds of all reconstructions that the differences of half a cell need.
    pub differences: f64,
    /// Their number.
    pub reconstructions: usize,
    /// Seconds of a warm pullback to the points: median.
    pub pullback: f64,
    /// Seconds from there to the parameters: median.
    pub chain: f64,
}

/// All of it.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// One for each parameter.
    pub rows: Vec<Row>,
    /// What they have in common.
    pub setting: Setting,
}

impl Row {
    /// Relative difference of the pullback to what it differentiates.
    pub fn relative(&self) -> f64 {
        (self.pullback / self.held - 1.0).abs()
    }

    /// Pullback over differences across half a cell to either side.
    pub fn ratio(&self) -> f64 {
        self.pullback / self.real
    }
}

impl Setting {
    /// How many times faster the pullback is than the differences, with the reconstruction before it or
    /// without.
    pub fn speedup(&self, with_forward: bool) -> f64 {
        let forward = if with_forward { self.forward } else { 0.0 };
        self.differences / (self.pullback + self.chain + forward)
    }
}

/// `L = Σ_o (φ_o − φ̃_o)²` between a fish whose parameters are off and the fish of the same samples.
///
/// # Errors
/// What the pipeline says.
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

/// A factor within `1 ± OFF` for each of `count` parameters, the same every time.
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
    /// The shape whose parameters are off.
    start: Shape,
    target: Field<f64>,
    base: Reconstruction<f64>,
    plan: Reconstructor<f64>,
}

/// A gradient, and the seconds of its two parts.
struct Pulled {
    gradient: Vec<f64>,
    guarded: usize,
    pullback: f64,
    chain: f64,
}

impl<'a> Bench<'a> {
    fn new(sampled: &'a Sampled, names: &[&'static str]) -> Outcome<Self> {
        let options = Options::default().checks(false);
        let mut plan = Reconstructor::new(sampled.grid, options)?;
        let points = sampled.shape.points_at::<f64>(&sampled.coordinates)?;
        let target = plan.reconstruct(&points_alone(&points)?)?.sdf().clone();
        let mut start = sampled.shape.clone();
        let mut changes = Vec::new();
        for (&name, factor) in names.iter().zip(factors(names.len())) {
            changes.push((name, start.get(name)? * factor));
        }
        start.set_all(changes)?;
        let points = start.points_at::<f64>(&sampled.coordinates)?;
        let base = plan.reconstruct(&points_alone(&points)?)?.clone();
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

    /// The gradient by the pullback; the first call, in which memory is taken, is not timed.
    fn pull(&self, names: &[&'static str]) -> Outcome<Pulled> {
        let coordinates = &self.sampled.coordinates;
        let cloud = points_alone(&self.start.points_at::<f64>(coordinates)?)?;
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
        let mut scratch = PullbackScratch::default();
        let mut out = CloudCotangent::default();
        let (mut pullback, mut chain, mut gradient) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..=REPEATS {
            let start = Instant::now();
            self.base
                .pullback_into(&cloud, &cotangent, &mut scratch, &mut out)?;
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

    /// Change of the parameter for which the fastest point moves by a cell.
    fn cell_of(&self, name: &str) -> Outcome<f64> {
        let tangent = self.start.tangent(name, &self.sampled.coordinates)?;
        let fastest = tangent.iter().map(|&t| vector::norm(t)).fold(0.0, f64::max);
        if !(fastest > 0.0) {
            return Err(format!("{name} moves no point").into());
        }
        Ok(self.sampled.grid.spacing() / fastest)
    }

    /// φ with one parameter changed.
    fn reconstruct(&mut self, name: &str, step: f64, held: bool) -> Outcome<&Reconstruction<f64>> {
        let mut shape = self.start.clone();
        shape.set(name, self.start.get(name)? + step)?;
        let cloud = points_alone(&shape.points_at::<f64>(&self.sampled.coordinates)?)?;
        Ok(if held {
            self.plan.reconstruct_held(&cloud, &self.base)?
        } else {
            self.plan.reconstruct(&cloud)?
        })
    }

    /// `∂L/∂p` across half a cell to either side, and how many normals change sides on the way.
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

    /// `∂L/∂p` with everything held, its step in cells, and how many neighborhoods changed all the same.
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

    /// `L(φ⁺) − L(φ⁻)`, as a sum of products, in which less cancels.
    fn difference(&self, plus: &Field<f64>, minus: &Field<f64>) -> f64 {
        let pairs = plus.values().iter().zip(minus.values());
        let terms = pairs.zip(self.target.values());
        terms.map(|((p, m), t)| (p - m) * (p + m - 2.0 * t)).sum()
    }
}

/// Number of normals that point to the other side in `b` than in `a`.
pub fn flipped(a: &[[f64; 3]], b: &[[f64; 3]]) -> usize {
    let pairs = a.iter().zip(b);
    pairs.filter(|(a, b)| vector::dot(**a, **b) < 0.0).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_off_by_as_much_as_allowed_and_no_more() {
        let factors = factors(14);
        let off = factors.iter().map(|f| (f - 1.0).abs());
        let most = off.fold(0.0, f64::max);
        assert!(most <= OFF && most > 0.5 * OFF, "{factors:?}");
    }
}
