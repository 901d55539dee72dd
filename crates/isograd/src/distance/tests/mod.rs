//! Meshes for the tests of the stage, and the plain slow distance.

mod interpolate;
mod lattice;
mod of_mesh;
mod query;
mod query_pullback;
mod samples;
mod spread;
mod triangle;

use super::triangle::{Closest, closest_point};
use crate::vector::{norm, to_f64};
use crate::{Mesh, Real};

/// A small random generator (xorshift64*), the same on every machine.
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// Uniform in `-1..1`.
    pub(super) fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(super) fn point(&mut self) -> [f64; 3] {
        [self.signed(), self.signed(), self.signed()]
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// A point within `size` of `center` along each axis.
    pub(super) fn near(&mut self, center: [f64; 3], size: f64) -> [f64; 3] {
        let p = self.point();
        std::array::from_fn(|a| center[a] + size * p[a])
    }

    /// A triangle of any kind: well shaped, huge, tiny, a sliver, a needle, a segment, a point.
    pub(super) fn triangle(&mut self) -> [[f64; 3]; 3] {
        let center = self.point();
        let kind = self.below(8);
        let size = [0.1, 0.1, 2.0, 1e-3, 0.3, 0.3, 0.3, 0.0][kind];
        let [a, b, mut c] = [(); 3].map(|()| self.near(center, size));
        let t = 0.5 + 0.5 * self.signed();
        let on_edge: [f64; 3] = std::array::from_fn(|k| a[k] + t * (b[k] - a[k]));
        match kind {
            4 => c = self.near(on_edge, 1e-4),
            5 => c = self.near(a, 1e-5),
            6 => c = [on_edge, a, b][self.below(3)],
            _ => (),
        }
        [a, b, c]
    }
}

/// Unconnected triangles of every kind.
pub(super) fn soup<T: Real>(triangles: usize, seed: u64) -> Mesh<T> {
    let mut random = Random::new(seed);
    let corners = (0..triangles).flat_map(|_| random.triangle());
    let vertices = corners.map(crate::vector::of_f64).collect();
    let faces = (0..triangles as u32)
        .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
        .collect();
    Mesh::new(vertices, faces).expect("finite")
}

/// A closed torus around the z axis, its quads cut in two, normals outward.
pub(super) fn torus<T: Real>(around: usize, across: usize) -> Mesh<T> {
    let tau = std::f64::consts::TAU;
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let (s, t) = (
                tau * i as f64 / around as f64,
                tau * j as f64 / across as f64,
            );
            let r = 0.7 + 0.25 * t.cos();
            vertices.push([r * s.cos(), r * s.sin(), 0.25 * t.sin()].map(T::of));
            let id = |i: usize, j: usize| ((i % around) * across + j % across) as u32;
            faces.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
            faces.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
        }
    }
    Mesh::new(vertices, faces).expect("finite")
}

/// A closed sphere of radius `r` around the origin: a cube of `n × n` quads a side, blown up.
pub(super) fn sphere<T: Real>(n: usize, r: f64) -> Mesh<T> {
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for side in 0..6 {
        let first = vertices.len() as u32;
        for i in 0..=n {
            for j in 0..=n {
                let [u, v] = [i, j].map(|k| 2.0 * k as f64 / n as f64 - 1.0);
                let w = if side < 3 { 1.0 } else { -1.0 };
                let mut p = [0.0; 3];
                p[side % 3] = w;
                p[(side + 1) % 3] = if side < 3 { u } else { v };
                p[(side + 2) % 3] = if side < 3 { v } else { u };
                let length = norm(p);
                vertices.push(p.map(|x| T::of(r * x / length)));
            }
        }
        let id = |i: usize, j: usize| first + (i * (n + 1) + j) as u32;
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            faces.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
            faces.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
        }
    }
    Mesh::new(vertices, faces).expect("finite")
}

/// The closest face and where on it, by trying all.
pub(super) fn brute_force<T: Real>(mesh: &Mesh<T>, q: [f64; 3]) -> (usize, Closest) {
    (0..mesh.faces().len())
        .map(|face| (face, closest_point(q, mesh.corners(face).map(to_f64))))
        .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))
        .expect("a face")
}
