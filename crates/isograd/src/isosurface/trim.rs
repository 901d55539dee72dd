//! Trimming: the part of a surface that has samples nearby.
//!
//! # Map
//! A face stays if each of its corners is within a distance of some sample. What stays is an open mesh, unless nothing is
//! removed; the order of vertices and faces is that of the whole mesh.
//!
//! # Residual
//! The index of each vertex in the whole mesh.
//!
//! # Pullback
//! A gather: vertices that were removed have the cotangent 0.
//!
//! # Not differentiable
//! Which faces stay.

use rayon::slice::ParallelSliceMut;

use crate::data::Mesh;
use crate::neighbors::CellIndex;
use crate::{Real, parallel, vector};

/// Automatic distance, in sample spacings: beyond gaps of clouds whose density varies by a factor of ten.
const SPACINGS: f64 = 4.0;

/// Removal of the faces that have no samples nearby.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Trim {
    /// All faces stay.
    #[default]
    Off,
    /// Faces further than four times the typical distance between samples are removed.
    Auto,
    /// Faces further than this from all samples, in the cloud's unit, are removed.
    Distance(f64),
}

impl Trim {
    /// The distance for samples that are `spacing` apart; `None` if all faces stay.
    pub fn distance(self, spacing: f64) -> Option<f64> {
        match self {
            Self::Off => None,
            Self::Auto => Some(SPACINGS * spacing),
            Self::Distance(distance) => Some(distance),
        }
    }

    /// Whether the distance is positive and finite.
    pub fn is_valid(self) -> bool {
        match self {
            Self::Off | Self::Auto => true,
            Self::Distance(distance) => distance > 0.0 && distance.is_finite(),
        }
    }
}

/// The part of a mesh that has samples nearby.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trimmed<T> {
    /// The part.
    pub mesh: Mesh<T>,
    /// Index of each of its vertices in the whole mesh, ascending.
    pub vertices: Vec<u32>,
    /// The distance.
    pub distance: f64,
    /// Number of faces that were removed.
    pub removed: usize,
}

/// The part of `mesh` whose corners are within `distance` of the points.
pub fn forward<T: Real>(mesh: &Mesh<T>, points: &[[T; 3]], distance: f64) -> Trimmed<T> {
    let samples = SampleCells::new(points, distance);
    let vertices = mesh.vertices();
    let is_near = |v: usize| samples.any_near(vector::to_f64(vertices[v]));
    let is_near = parallel::map(vertices.len(), is_near);
    let stays = |face: &&[u32; 3]| face.iter().all(|&v| is_near[v as usize]);
    let mut faces: Vec<[u32; 3]> = mesh.faces().iter().filter(stays).copied().collect();
    let mut is_used = vec![false; is_near.len()];
    faces
        .iter()
        .flatten()
        .for_each(|&v| is_used[v as usize] = true);
    let used = |&v: &u32| is_used[v as usize];
    let vertices: Vec<u32> = (0..is_used.len() as u32).filter(used).collect();
    let mut new = vec![0; is_used.len()];
    for (to, &from) in (0..).zip(&vertices) {
        new[from as usize] = to;
    }
    faces
        .iter_mut()
        .flatten()
        .for_each(|v| *v = new[*v as usize]);
    let removed = mesh.faces().len() - faces.len();
    let at = |&v: &u32| mesh.vertices()[v as usize];
    Trimmed {
        mesh: Mesh {
            vertices: vertices.iter().map(at).collect(),
            faces,
            ..Mesh::default()
        },
        vertices,
        distance,
        removed,
    }
}

/// Share of the vertices of a mesh, from 0 to 1, that are further than `distance` from all points of an index. Of large
/// meshes about 2¹⁶ vertices are looked at.
pub(crate) fn far_share<T: Real>(mesh: &Mesh<T>, index: &CellIndex<T>, distance: T) -> f64 {
    let step = (mesh.vertices().len() >> 16).max(1);
    let looked_at = mesh.vertices().len().div_ceil(step);
    let is_far = |n: usize| !index.any_within(mesh.vertices()[n * step], distance);
    parallel::count(looked_at, is_far) as f64 / looked_at.max(1) as f64
}

/// Adds the cotangents of the vertices that stay to those of the whole mesh.
pub fn pullback<T: Real>(trimmed: &Trimmed<T>, bars: &[[T; 3]], whole: &mut [[T; 3]]) {
    for (&v, &bar) in trimmed.vertices.iter().zip(bars) {
        let sum = &mut whole[v as usize];
        *sum = vector::add(*sum, bar);
    }
}

/// Samples sorted by cubic cells, whose side is the distance.
struct SampleCells {
    cells: Vec<([i64; 3], [f64; 3])>,
    size: f64,
}

impl SampleCells {
    fn new<T: Real>(points: &[[T; 3]], size: f64) -> Self {
        let mut cells = parallel::map(points.len(), |i| {
            let p = vector::to_f64(points[i]);
            (cell(p, size), p)
        });
        cells.par_sort_unstable_by_key(|(cell, _)| *cell);
        Self { cells, size }
    }

    /// Whether there is a sample within the distance.
    fn any_near(&self, p: [f64; 3]) -> bool {
        let [i, j, k] = cell(p, self.size);
        let around = |i: i64| i.saturating_sub(1)..=i.saturating_add(1);
        around(i).any(|x| around(j).any(|y| self.any_in_row(x, y, k, p)))
    }

    fn any_in_row(&self, x: i64, y: i64, k: i64, p: [f64; 3]) -> bool {
        let first = [x, y, k.saturating_sub(1)];
        let last = [x, y, k.saturating_add(1)];
        let from = self.cells.partition_point(|(cell, _)| *cell < first);
        let row = self.cells[from..]
            .iter()
            .take_while(|(cell, _)| *cell <= last);
        row.into_iter().any(|(_, sample)| {
            let d = vector::sub(*sample, p);
            d[0].hypot(d[1]).hypot(d[2]) <= self.size
        })
    }
}

fn cell(p: [f64; 3], size: f64) -> [i64; 3] {
    p.map(|x| (x / size).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::noise;

    #[test]
    fn faces_stay_where_each_corner_has_a_sample_nearby() {
        for (seed, size) in [(1, 0.05), (2, 0.3), (3, 1e-9), (4, 1e9)] {
            let mut next = noise(seed);
            let mut vectors =
                |n: usize| -> Vec<[f64; 3]> { (0..n).map(|_| [0; 3].map(|_| next())).collect() };
            let (points, vertices) = (vectors(300), vectors(200));
            let faces: Vec<[u32; 3]> = (0..150).map(|k| [k, (7 * k + 1) % 200, k + 50]).collect();
            let mesh = Mesh::new(vertices.clone(), faces.clone()).expect("a mesh");
            let is_near = |v: u32| {
                let d = |p: &[f64; 3]| vector::norm(vector::sub(*p, vertices[v as usize]));
                points.iter().any(|p| d(p) <= size)
            };
            let mut expected = faces;
            expected.retain(|face| face.iter().all(|&v| is_near(v)));
            let found = forward(&mesh, &points, size);
            let whole = |face: &[u32; 3]| face.map(|v| found.vertices[v as usize]);
            let stays: Vec<_> = found.mesh.faces().iter().map(whole).collect();
            assert_eq!(stays, expected, "{size}");
            assert_eq!(found.removed, 150 - expected.len());
            let at = |&v: &u32| vertices[v as usize];
            let kept: Vec<_> = found.vertices.iter().map(at).collect();
            assert_eq!(found.mesh.vertices(), kept);
            let far = (0..200).filter(|&v| !is_near(v)).count();
            let share = far_share(&mesh, &CellIndex::new(&points), size);
            assert_eq!(share, far as f64 / 200.0);
            let mut bars = vec![[1.0; 3]; 200];
            pullback(&found, &vec![[2.0; 3]; kept.len()], &mut bars);
            let moved = bars.iter().filter(|bar| bar[0] == 3.0).count();
            assert_eq!(moved, found.vertices.len());
        }
    }
}
