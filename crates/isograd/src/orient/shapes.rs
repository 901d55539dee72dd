//! Sampled bodies with known outward normals, for the tests.

use super::graph::{Graph, NEIGHBORS};
use super::signs::Place;
use super::{Error, Method, Orientation, Scratch, forward};
use crate::neighbors::{self, Neighborhoods, Radius};
use crate::{Real, vector};

/// Neighborhoods with automatic radii.
pub(super) fn neighborhoods<T: Real>(points: &[[T; 3]]) -> Neighborhoods<T> {
    let mut out = Neighborhoods::default();
    neighbors::forward(points, Radius::Auto, &mut out).unwrap();
    out
}

/// The orientation of axes, with given normals or without.
pub(super) fn oriented<T: Real>(
    points: &[[T; 3]],
    axes: &Vec<[T; 3]>,
    near: &Neighborhoods<T>,
    given: Option<&[[T; 3]]>,
    method: &Method,
) -> Result<Orientation<T>, Error> {
    let (scratch, mut out) = (&mut Scratch::default(), Orientation::default());
    forward(points, axes, near, given, method, scratch, &mut out)?;
    Ok(out)
}

/// Points and their outward normals.
pub(super) type Sampled = (Vec<[f64; 3]>, Vec<[f64; 3]>);

impl Place for Vec<[f64; 3]> {
    fn user(&self, p: usize) -> [f64; 3] {
        self[p]
    }

    fn spacing(&self) -> f64 {
        1.0
    }
}

/// Samples with correct axes, each for an area of 1. The faces of a box are hardly coupled to each other.
pub(super) fn graph((points, normals): &Sampled) -> Graph {
    let axis: Vec<[f32; 3]> = normals.iter().map(|&n| vector::of_f64(n)).collect();
    let nearest = |p: &[f64; 3]| -> [u32; NEIGHBORS] {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let distance = |&q: &u32| vector::norm_squared(vector::sub(points[q as usize], *p));
        order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        std::array::from_fn(|slot| order[slot + 1])
    };
    let near: Vec<_> = points.iter().map(nearest).collect();
    let offset = |(p, near): (&[f64; 3], &[u32; NEIGHBORS])| {
        near.map(|q| vector::of_f64(vector::sub(points[q as usize], *p)))
    };
    let coupling = |(a, near): (&[f32; 3], &[u32; NEIGHBORS])| {
        near.map(|q| vector::dot(*a, axis[q as usize]).max(0.1))
    };
    Graph {
        offset: points.iter().zip(&near).map(offset).collect(),
        coupling: axis.iter().zip(&near).map(coupling).collect(),
        area: vec![1.0; points.len()],
        spread: vec![0.0; points.len()],
        scatter: vec![0.0; points.len()],
        exposed: vec![0.0; points.len()],
        near,
        axis,
        ..Graph::default()
    }
}

/// A seeded xorshift generator.
pub(super) struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    pub(super) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform on the unit sphere.
    pub(super) fn direction(&mut self) -> [f64; 3] {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * self.unit()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [r * cos, r * sin, z]
    }
}

/// `n` uniform random samples of a sphere.
pub(super) fn sphere(n: usize, center: [f64; 3], radius: f64, seed: u64) -> Sampled {
    let mut random = Random(seed);
    let normals: Vec<[f64; 3]> = (0..n).map(|_| random.direction()).collect();
    let at = |&d: &[f64; 3]| vector::add(center, vector::scale(d, radius));
    (normals.iter().map(at).collect(), normals)
}

/// `n` uniform random samples of the torus with radii 0.7 and 0.25.
pub(super) fn torus(n: usize, seed: u64) -> Sampled {
    let mut random = Random(seed);
    let mut sampled: Sampled = Default::default();
    while sampled.0.len() < n {
        let (u, v) = (random.unit(), random.unit());
        let (sin_u, cos_u) = (std::f64::consts::TAU * u).sin_cos();
        let (sin_v, cos_v) = (std::f64::consts::TAU * v).sin_cos();
        let ring = 0.7 + 0.25 * cos_v;
        // Area grows with the distance from the axis.
        if random.unit() * 0.95 <= ring {
            sampled.0.push([ring * cos_u, ring * sin_u, 0.25 * sin_v]);
            sampled.1.push([cos_v * cos_u, cos_v * sin_u, sin_v]);
        }
    }
    sampled
}

/// `n` uniform random samples of the box with these half extents.
pub(super) fn cuboid(n: usize, half: [f64; 3], seed: u64) -> Sampled {
    let mut random = Random(seed);
    let area = [half[1] * half[2], half[2] * half[0], half[0] * half[1]];
    let total: f64 = area.iter().sum();
    let mut sampled: Sampled = Default::default();
    for _ in 0..n {
        let pick = random.unit() * total;
        let axis = if pick < area[0] {
            0
        } else {
            1 + usize::from(pick >= area[0] + area[1])
        };
        let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
        let mut point = [0, 1, 2].map(|a| half[a] * (2.0 * random.unit() - 1.0));
        let mut normal = [0.0; 3];
        point[axis] = side * half[axis];
        normal[axis] = side;
        sampled.0.push(point);
        sampled.1.push(normal);
    }
    sampled
}

/// A square plate at a height, with about one sample for each unit of area; and its area. Its size is side and thickness.
pub(super) fn plate([side, thickness]: [f64; 2], height: f64, seed: u64) -> (Sampled, f64) {
    let area = 2.0 * side * side + 4.0 * side * thickness;
    let half = [side, side, thickness].map(|size| 0.5 * size);
    let (points, normals) = cuboid(area as usize, half, seed);
    let points = points.iter().map(|&x| vector::add(x, [0.0, 0.0, height]));
    ((points.collect(), normals), area)
}

/// Both together.
pub(super) fn join(a: Sampled, b: Sampled) -> Sampled {
    ([a.0, b.0].concat(), [a.1, b.1].concat())
}

/// The samples for which `keep` holds.
pub(super) fn cut(sampled: Sampled, keep: impl Fn([f64; 3]) -> bool) -> Sampled {
    sampled
        .0
        .into_iter()
        .zip(sampled.1)
        .filter(|&(x, _)| keep(x))
        .unzip()
}

/// The surface with its normals turned.
pub(super) fn inside_out(sampled: Sampled) -> Sampled {
    (sampled.0, sampled.1.iter().map(|n| n.map(|x| -x)).collect())
}
