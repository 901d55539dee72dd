//! Clouds with known normals, and ways to degrade them.

use std::collections::HashSet;
use std::f64::consts::TAU;
use std::path::Path;

use isograd_element::vector::{add, dot, norm, normalized, sub};
use isograd_shapes::{Density, Layout, Sampling, by_name};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// A sampled body: points and outward normals, `(N, 3)` each. A zero normal marks a point that is not on the surface and
/// whose sign is not evaluated.
#[derive(Clone, Debug, Default)]
pub struct Body {
    /// Positions of the samples.
    pub points: Vec<[f64; 3]>,
    /// Outward unit normals.
    pub normals: Vec<[f64; 3]>,
    /// The samples before noise was added.
    pub clean: Option<Box<Clean>>,
    /// Whether the surface has no inside: normals that all point the other way are as right.
    pub open: bool,
}

/// Samples of the clean surface, and the noise added to them.
#[derive(Clone, Debug)]
pub struct Clean {
    /// Samples of the surface.
    pub body: Body,
    /// Standard deviation of the noise along each axis, in the unit of the points.
    pub deviation: f64,
}

/// Random samples, uniform by area.
pub const RANDOM: Sampling = Sampling {
    layout: Layout::Random,
    density: Density::Uniform,
};

/// Samples that are drawn for one that is on a line.
const DRAWN_FOR_LINES: usize = 50;

impl Body {
    /// Samples of a shape of `isograd-shapes`.
    ///
    /// # Panics
    /// On an unknown shape or parameter: the suite is fixed.
    pub fn of(
        name: &str,
        parameters: &[(&str, f64)],
        n: usize,
        sampling: &Sampling,
        seed: u64,
    ) -> Self {
        let mut shape = by_name(name).expect("a shape of the list");
        shape
            .set_all(parameters.iter().copied())
            .expect("parameters in range");
        let samples = shape.sample::<f64>(n, sampling, seed).expect("samples");
        Self {
            points: samples.cloud.points().to_vec(),
            normals: samples
                .cloud
                .normals()
                .map(<[_]>::to_vec)
                .unwrap_or_default(),
            ..Self::default()
        }
    }

    /// Samples and normals read from a file.
    ///
    /// # Panics
    /// On an unreadable file or one without normals: the data of the suite are fixed.
    pub fn read(path: &Path) -> Self {
        let file = isograd_io::read_geometry(path).expect("a readable file");
        Self {
            points: file.points,
            normals: file.normals.expect("normals"),
            ..Self::default()
        }
    }

    /// Random samples of a sphere around the origin.
    pub fn sphere(radius: f64, n: usize, seed: u64) -> Self {
        Self::of("sphere", &[("radius", radius)], n, &RANDOM, seed)
    }

    /// Random samples of a sharp-edged box around the origin.
    pub fn cuboid([x, y, z]: [f64; 3], n: usize, seed: u64) -> Self {
        let sides = [("x", x), ("y", y), ("z", z), ("radius", 0.0)];
        Self::of("box", &sides, n, &RANDOM, seed)
    }

    /// Union of the samples of this body and another.
    #[must_use]
    pub fn with(mut self, other: Self) -> Self {
        self.points.extend(other.points);
        self.normals.extend(other.normals);
        self
    }

    /// Inverted normals: the wall of a cavity.
    #[must_use]
    pub fn inside_out(mut self) -> Self {
        self.normals.iter_mut().for_each(|n| *n = n.map(|x| -x));
        self
    }

    /// Translates the body by `offset`.
    #[must_use]
    pub fn moved(mut self, offset: [f64; 3]) -> Self {
        self.points.iter_mut().for_each(|x| *x = add(*x, offset));
        self
    }

    /// The samples that satisfy `keep(point)`.
    #[must_use]
    pub fn filtered(self, mut keep: impl FnMut([f64; 3]) -> bool) -> Self {
        let pairs = self.points.into_iter().zip(self.normals);
        let (points, normals) = pairs.filter(|&(x, _)| keep(x)).unzip();
        Self {
            points,
            normals,
            clean: None,
            open: self.open,
        }
    }

    /// Turns the body by this angle, in degrees, about the x axis, and then about the y axis.
    #[must_use]
    pub fn turned(mut self, degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        for x in self.points.iter_mut().chain(&mut self.normals) {
            let [y, z] = [cos * x[1] - sin * x[2], sin * x[1] + cos * x[2]];
            *x = [cos * x[0] + sin * z, y, cos * z - sin * x[0]];
        }
        self
    }

    /// Rounds all coordinates to multiples of a step, in longest sides. Of the samples that then coincide one remains.
    #[must_use]
    pub fn rounded(mut self, step: f64) -> Self {
        let step = step * self.longest();
        for x in &mut self.points {
            *x = x.map(|x| (x / step).round() * step);
        }
        let mut places = HashSet::new();
        self.filtered(|x| places.insert(x.map(f64::to_bits)))
    }

    /// About `n` samples of a shape of `isograd-shapes` on lines, as a scanner or slices leave them: in parallel planes that
    /// slant against the axes, `ratio` times as far apart as the samples on one line.
    ///
    /// # Panics
    /// On an unknown shape: the suite is fixed.
    pub fn on_lines(name: &str, ratio: f64, n: usize, seed: u64) -> Self {
        let area = by_name(name).expect("a shape of the list").area();
        let between = (area * ratio / n as f64).sqrt();
        let across = normalized([0.3, 0.5, 0.8]).expect("a direction");
        let all = Self::of(name, &[], DRAWN_FOR_LINES * n, &RANDOM, seed);
        all.filtered(|x| {
            let place = dot(x, across) / between;
            (place - place.round()).abs() < 0.5 / DRAWN_FOR_LINES as f64
        })
    }

    /// Excludes the samples that satisfy `ambiguous(point)` from evaluation.
    #[must_use]
    pub fn excluding(mut self, ambiguous: impl Fn([f64; 3]) -> bool) -> Self {
        for (x, n) in self.points.iter().zip(&mut self.normals) {
            if ambiguous(*x) {
                *n = [0.0; 3];
            }
        }
        self
    }

    /// Adds Gaussian noise along all axes; the standard deviation is in longest sides of the bounding box.
    #[must_use]
    pub fn noisy(mut self, deviation: f64, seed: u64) -> Self {
        let sigma = deviation * self.longest();
        let clean = self.clone();
        self = self.with_clean(clean, deviation);
        let mut random = Random::new(seed);
        for x in &mut self.points {
            *x = add(*x, [(); 3].map(|()| sigma * random.normal()));
        }
        self
    }

    /// Records the clean samples and the deviation of the noise, in longest sides.
    #[must_use]
    pub fn with_clean(mut self, clean: Self, deviation: f64) -> Self {
        let deviation = deviation * clean.longest();
        self.clean = Some(Box::new(Clean {
            body: clean,
            deviation,
        }));
        self
    }

    /// Cuts round holes until at most this fraction of the samples remains. A hole has a radius of 3 to 8 % of the longest
    /// side, around a random sample.
    #[must_use]
    pub fn with_holes(mut self, share: f64, seed: u64) -> Self {
        let (longest, all) = (self.longest(), self.points.len() as f64);
        let mut random = Random::new(seed);
        while self.points.len() as f64 > share * all {
            let center = self.points[(random.unit() * self.points.len() as f64) as usize];
            let radius = longest * (0.03 + 0.05 * random.unit());
            self = self.filtered(|x| norm(sub(x, center)) > radius);
        }
        self
    }

    /// Adds outliers, as a fraction of the samples, uniform in the bounding box scaled by 1.5.
    #[must_use]
    pub fn with_outliers(mut self, share: f64, seed: u64) -> Self {
        let (low, high) = self.bounds();
        let mut random = Random::new(seed);
        for _ in 0..(share * self.points.len() as f64) as usize {
            let place =
                |a: usize, t: f64| 0.5 * (low[a] + high[a]) + 1.5 * (t - 0.5) * (high[a] - low[a]);
            self.points.push([0, 1, 2].map(|a| place(a, random.unit())));
            self.normals.push([0.0; 3]);
        }
        self
    }

    /// Low and high corner of the bounding box.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        self.points.iter().fold(start, |(low, high), x| {
            (
                [0, 1, 2].map(|a| low[a].min(x[a])),
                [0, 1, 2].map(|a| high[a].max(x[a])),
            )
        })
    }

    /// Longest side of the bounding box.
    pub fn longest(&self) -> f64 {
        let (low, high) = self.bounds();
        sub(high, low).into_iter().fold(0.0, f64::max)
    }
}

/// Random samples of the upper and lower side of a wing with a sharp trailing edge: chord 1 along x, span 3 along y,
/// maximum thickness `thickness`.
pub fn wing(thickness: f64, n: usize, seed: u64) -> Body {
    let mut random = Random::new(seed);
    let mut body = Body::default();
    for _ in 0..n {
        let (x, y, side) = (
            random.unit(),
            3.0 * random.unit(),
            if random.unit() < 0.5 { -1.0 } else { 1.0 },
        );
        // A parabola from edge to edge; uniform along x is uniform by area to one percent.
        let (z, slope) = (
            2.0 * thickness * x * (1.0 - x),
            2.0 * thickness * (1.0 - 2.0 * x),
        );
        body.points.push([x, y, side * z]);
        body.normals
            .push(normalized([-slope, 0.0, side]).unwrap_or([0.0, 0.0, side]));
    }
    body
}

/// Random samples of hills and valleys of several sizes over the unit square, with this root mean square slope: an open
/// surface.
pub fn terrain(slope: f64, n: usize, seed: u64) -> Body {
    const WAVES: usize = 12;
    let mut random = Random::new(seed);
    let waves = [(); WAVES].map(|()| {
        let (angle, phase) = (TAU * random.unit(), TAU * random.unit());
        let number = TAU * 8.0f64.powf(random.unit());
        ([number * angle.cos(), number * angle.sin()], phase, number)
    });
    let slope = slope * (2.0 / WAVES as f64).sqrt();
    let mut body = Body {
        open: true,
        ..Body::default()
    };
    for _ in 0..n {
        let (x, y) = (random.unit(), random.unit());
        let [z, dx, dy] = waves
            .iter()
            .fold([0.0; 3], |sum, &([u, v], phase, number)| {
                let (sin, cos) = (u * x + v * y + phase).sin_cos();
                add(
                    sum,
                    [sin, u * cos, v * cos].map(|value| slope / number * value),
                )
            });
        body.points.push([x, y, z]);
        body.normals
            .push(normalized([-dx, -dy, 1.0]).expect("upward"));
    }
    body
}

/// A seeded random generator, the same on every platform.
#[derive(Debug)]
pub struct Random(Pcg64);

impl Random {
    /// Generator for a seed.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }
}

/// Both sheets of a spherical shell of outer radius 1, in equal numbers per area.
pub fn shell(wall: f64, n: usize, seed: u64) -> Body {
    let inner = 1.0 - wall;
    let share = inner * inner / (1.0 + inner * inner);
    let inside = (share * n as f64).round() as usize;
    Body::sphere(1.0, n - inside, seed).with(Body::sphere(inner, inside, seed + 1).inside_out())
}
