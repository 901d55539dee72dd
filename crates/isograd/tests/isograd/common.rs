//! Clouds with closed forms for the integration tests.
#![allow(dead_code, reason = "each test file uses the part it needs")]

use isograd::{PointCloud, Real};

/// A small generator of uniform numbers (xorshift64*), so that tests need no dependency and no seed file.
pub struct Uniform(u64);

impl Uniform {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A torus around the z axis.
pub struct Torus {
    pub major: f64,
    pub minor: f64,
}

pub const TORUS: Torus = Torus {
    major: 0.7,
    minor: 0.25,
};

impl Torus {
    /// Exact signed distance, negative inside.
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        (p[0].hypot(p[1]) - self.major).hypot(p[2]) - self.minor
    }

    /// One uniform random sample by area: point and outward normal.
    fn sample(&self, random: &mut Uniform) -> ([f64; 3], [f64; 3]) {
        let u = std::f64::consts::TAU * random.next();
        let v = loop {
            // The area element is R + r cos v: rejection makes the samples uniform.
            let v = std::f64::consts::TAU * random.next();
            if random.next() * (self.major + self.minor) <= self.major + self.minor * v.cos() {
                break v;
            }
        };
        let normal = [v.cos() * u.cos(), v.cos() * u.sin(), v.sin()];
        let ring = self.major + self.minor * v.cos();
        (
            [ring * u.cos(), ring * u.sin(), self.minor * v.sin()],
            normal,
        )
    }

    /// `n` candidates, each kept with the probability that `keep` gives it; with exact normals.
    pub fn cloud<T: Real>(
        &self,
        n: usize,
        seed: u64,
        keep: impl Fn([f64; 3]) -> f64,
    ) -> PointCloud<T> {
        let mut random = Uniform::new(seed);
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        for _ in 0..n {
            let (p, normal) = self.sample(&mut random);
            if random.next() < keep(p) {
                points.push(p.map(T::of));
                normals.push(normal.map(T::of));
            }
        }
        let cloud = PointCloud::new(points).expect("finite points");
        cloud.with_normals(normals).expect("one normal a point")
    }

    /// `n` uniform random samples with exact normals.
    pub fn uniform<T: Real>(&self, n: usize, seed: u64) -> PointCloud<T> {
        self.cloud(n, seed, |_| 1.0)
    }

    /// The sampling density falls from 1 to 1/10 along x.
    pub fn ten_to_one<T: Real>(&self, n: usize, seed: u64) -> PointCloud<T> {
        let reach = self.major + self.minor;
        self.cloud(n, seed, move |p| {
            10f64.powf(-(p[0] + reach) / (2.0 * reach))
        })
    }
}
