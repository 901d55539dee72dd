//! Clouds with known normals, and what is done to them.

use std::path::Path;

use isograd_element::vector::{add, norm, normalized, sub};
use isograd_shapes::{Density, Layout, Sampling, by_name};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// A sampled body: points and outward normals, `(N, 3)` each. A normal of 0 belongs to a point that is not
/// on the surface, whose sign nobody judges.
#[derive(Clone, Debug, Default)]
pub struct Body {
    /// Where the samples are.
    pub points: Vec<[f64; 3]>,
    /// Unit vectors that point away from matter.
    pub normals: Vec<[f64; 3]>,
    /// What the samples were before noise moved them.
    pub clean: Option<Box<Clean>>,
}

/// Samples of the surface itself, and the noise that others of it have.
#[derive(Clone, Debug)]
pub struct Clean {
    /// The surface.
    pub body: Body,
    /// Standard deviation of the noise along each axis, in the unit of the points.
    pub deviation: f64,
}

/// Random samples, each place as likely as its area.
pub const RANDOM: Sampling = Sampling {
    layout: Layout::Random,
    density: Density::Uniform,
};

impl Body {
    /// Samples of a shape of `isograd-shapes`.
    ///
    /// # Panics
    /// A shape or parameter that does not exist: the suite is fixed.
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
            clean: None,
        }
    }

    /// The samples in a file, with the normals that it has.
    ///
    /// # Panics
    /// A file that can't be read, or has no normals: the data of the suite are fixed.
    pub fn read(path: &Path) -> Self {
        let file = isograd_io::read_geometry(path).expect("a readable file");
        Self {
            points: file.points,
            normals: file.normals.expect("normals"),
            clean: None,
        }
    }

    /// Random samples of a sphere round the origin.
    pub fn sphere(radius: f64, n: usize, seed: u64) -> Self {
        Self::of("sphere", &[("radius", radius)], n, &RANDOM, seed)
    }

    /// Random samples of a sharp-edged box round the origin.
    pub fn cuboid([x, y, z]: [f64; 3], n: usize, seed: u64) -> Self {
        let sides = [("x", x), ("y", y), ("z", z), ("radius", 0.0)];
        Self::of("box", &sides, n, &RANDOM, seed)
    }

    /// This body and another.
    #[must_use]
    pub fn with(mut self, other: Self) -> Self {
        self.points.extend(other.points);
        self.normals.extend(other.normals);
        self
    }

    /// The same surface with matter on the other side: the wall of a cavity.
    #[must_use]
    pub fn inside_out(mut self) -> Self {
        self.normals.iter_mut().for_each(|n| *n = n.map(|x| -x));
        self
    }

    /// The body moved by `offset`.
    #[must_use]
    pub fn moved(mut self, offset: [f64; 3]) -> Self {
        self.points.iter_mut().for_each(|x| *x = add(*x, offset));
        self
    }

    /// The samples for which `keep(point)` holds.
    #[must_use]
    pub fn kept(self, keep: impl Fn([f64; 3]) -> bool) -> Self {
        let pairs = self.points.into_iter().zip(self.normals);
        let (points, normals) = pairs.filter(|&(x, _)| keep(x)).unzip();
        Self {
            points,
            normals,
            clean: None,
        }
    }

    /// The same samples, of which nobody judges those for which `apart(point)` holds.
    #[must_use]
    pub fn unjudged(mut self, apart: impl Fn([f64; 3]) -> bool) -> Self {
        for (x, n) in self.points.iter().zip(&mut self.normals) {
            if apart(*x) {
                *n = [0.0; 3];
            }
        }
        self
    }

    /// Gaussian noise along all axes, of this standard deviation in longest sides of the bounding box.
    #[must_use]
    pub fn noisy(mut self, deviation: f64, seed: u64) -> Self {
        let sigma = deviation * self.longest();
        let clean = self.clone();
        self = self.of_clean(clean, deviation);
        let mut random = Random::new(seed);
        for x in &mut self.points {
            *x = add(*x, [(); 3].map(|()| sigma * random.normal()));
        }
        self
    }

    /// These samples as what is left of `clean` ones after noise of this deviation, in longest sides.
    #[must_use]
    pub fn of_clean(mut self, clean: Self, deviation: f64) -> Self {
        let deviation = deviation * clean.longest();
        self.clean = Some(Box::new(Clean {
            body: clean,
            deviation,
        }));
        self
    }

    /// Round holes, one after the other, until at most this share of the samples is left. A hole takes
    /// the samples within 3 to 8 % of the longest side of a random sample.
    #[must_use]
    pub fn holed(mut self, share: f64, seed: u64) -> Self {
        let (longest, all) = (self.longest(), self.points.len() as f64);
        let mut random = Random::new(seed);
        while self.points.len() as f64 > share * all {
            let center = self.points[(random.unit() * self.points.len() as f64) as usize];
            let radius = longest * (0.03 + 0.05 * random.unit());
            self = self.kept(|x| norm(sub(x, center)) > radius);
        }
        self
    }

    /// Outliers, this share of the samples, anywhere in the bounding box grown by a half.
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

/// Samples of the upper and lower side of a wing without a fuselage, `thickness` chords thick at the most,
/// with a sharp trailing edge: chord 1 along x, span 3 along y, random samples.
pub fn wing(thickness: f64, n: usize, seed: u64) -> Body {
    let mut random = Random::new(seed);
    let mut body = Body::default();
    for _ in 0..n {
        let (x, y, side) = (
            random.unit(),
            3.0 * random.unit(),
            if random.unit() < 0.5 { -1.0 } else { 1.0 },
        );
        // A parabola from edge to edge; random along x is random along the surface to a per cent.
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

/// A seeded stream of numbers, the same on every platform.
#[derive(Debug)]
pub struct Random(Pcg64);

impl Random {
    /// The stream of a seed.
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
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}

/// Both sheets of a spherical shell of outer radius 1, in equal numbers per area.
pub fn shell(wall: f64, n: usize, seed: u64) -> Body {
    let inner = 1.0 - wall;
    let share = inner * inner / (1.0 + inner * inner);
    let inside = (share * n as f64).round() as usize;
    Body::sphere(1.0, n - inside, seed).with(Body::sphere(inner, inside, seed + 1).inside_out())
}
