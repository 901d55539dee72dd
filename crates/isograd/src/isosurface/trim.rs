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

use super::measure::pieces::Pieces;
use crate::data::Mesh;
use crate::neighbors::Neighborhoods;
use crate::{Real, parallel, splat, vector};

/// Automatic distance, in typical distances between samples.
const SPACINGS: f64 = 4.0;
/// Automatic distance, in distances between samples around the nearest one. At the rim of a hole that distance is found √2 times
/// too large: where samples are even, [`SPACINGS`] decides there.
const LOCAL_SPACINGS: f64 = 2.5;

/// Removal of the faces that have no samples nearby.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Trim {
    /// All faces stay.
    #[default]
    Off,
    /// Faces further than four times the typical distance between samples are removed; where samples are sparse, those
    /// further than 2.5 times their distance there.
    Auto,
    /// Faces further than this from all samples, in the cloud's unit, are removed.
    Distance(f64),
}

impl Trim {
    /// The distance where samples are `spacing` apart, as they typically are; `None` if all faces stay.
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
pub(crate) struct Trimmed<T> {
    /// The part.
    pub mesh: Mesh<T>,
    /// Index of each of its vertices in the whole mesh, ascending.
    pub vertices: Vec<u32>,
    /// Number of faces that were removed.
    pub removed: usize,
}

/// Where a surface has samples nearby.
#[derive(Clone, Copy)]
pub(crate) struct Nearby<'a, T> {
    pub(crate) neighborhoods: &'a Neighborhoods<T>,
    /// From some sample, in the cloud's unit.
    pub(crate) distance: f64,
    /// Whether it is larger where samples are sparse.
    pub(crate) is_local: bool,
}

impl<T: Real> Nearby<'_, T> {
    fn holds(&self, place: [T; 3]) -> bool {
        let Self { neighborhoods, .. } = *self;
        let is_near = neighborhoods.index.any_within(place, T::of(self.distance));
        is_near || self.is_local && is_near_sparse(neighborhoods, place)
    }

    /// Share of the vertices of a mesh, from 0 to 1, that have no sample nearby; of several pieces the share of each. Of large
    /// meshes about 2¹⁶ vertices are looked at.
    pub(crate) fn far_shares(&self, mesh: &Mesh<T>, pieces: Option<&Pieces>) -> Vec<f64> {
        let vertices = mesh.vertices();
        let step = (vertices.len() >> 16).max(1);
        let is_near = |n: usize| self.holds(vertices[n * step]);
        let is_near = parallel::map(vertices.len().div_ceil(step), is_near);
        let mut counts = vec![[0usize; 2]; pieces.map_or(1, |pieces| pieces.areas.len())];
        let piece_of = pieces.map(|pieces| pieces.of_vertices(mesh));
        for (n, is_near) in is_near.into_iter().enumerate() {
            let piece = piece_of.as_ref().map_or(0, |of| of[n * step]);
            counts[piece as usize][usize::from(is_near)] += 1;
        }
        let share = |[far, near]: [usize; 2]| far as f64 / (far + near).max(1) as f64;
        counts.into_iter().map(share).collect()
    }
}

/// Whether the nearest sample is as near as samples are to each other there.
fn is_near_sparse<T: Real>(neighborhoods: &Neighborhoods<T>, place: [T; 3]) -> bool {
    let mut nearest = Vec::with_capacity(1);
    neighborhoods.index.nearest(place, 1, &mut nearest);
    nearest.iter().any(|&(sample, distance_squared)| {
        let area = splat::area::at(neighborhoods, sample as usize);
        distance_squared.f64() <= LOCAL_SPACINGS * LOCAL_SPACINGS * area.f64()
    })
}

/// The part of `mesh` whose corners have samples nearby.
pub(crate) fn forward<T: Real>(mesh: &Mesh<T>, nearby: Nearby<'_, T>) -> Trimmed<T> {
    let vertices = mesh.vertices();
    let is_near = parallel::map(vertices.len(), |v| nearby.holds(vertices[v]));
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
        removed,
    }
}

/// Adds the cotangents of the vertices that stay to those of the whole mesh.
pub(crate) fn pullback<T: Real>(trimmed: &Trimmed<T>, bars: &[[T; 3]], whole: &mut [[T; 3]]) {
    for (&v, &bar) in trimmed.vertices.iter().zip(bars) {
        let sum = &mut whole[v as usize];
        *sum = vector::add(*sum, bar);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::{self, Radius};
    use crate::testing::noise;

    fn neighborhoods(points: &[[f64; 3]]) -> Neighborhoods<f64> {
        let mut found = Neighborhoods::default();
        neighbors::forward(points, Radius::Auto, &mut found).expect("a valid cloud");
        found
    }

    #[test]
    fn faces_stay_where_each_corner_has_a_sample_nearby() {
        for (seed, size) in [(1, 0.05), (2, 0.3), (3, 1e-9), (4, 1e9)] {
            let mut next = noise(seed);
            let mut vectors =
                |n: usize| -> Vec<[f64; 3]> { (0..n).map(|_| [0; 3].map(|_| next())).collect() };
            let (points, vertices) = (vectors(300), vectors(200));
            let faces: Vec<[u32; 3]> = (0..150).map(|k| [k, (7 * k + 1) % 200, k + 50]).collect();
            let mesh = Mesh::new(vertices.clone(), faces.clone()).expect("a mesh");
            let neighborhoods = neighborhoods(&points);
            for is_local in [false, true] {
                let is_near = |v: u32| {
                    let d = |i: usize| vector::norm(vector::sub(points[i], vertices[v as usize]));
                    let nearest = (0..300).min_by(|&i, &j| d(i).total_cmp(&d(j))).unwrap();
                    let around = splat::area::at(&neighborhoods, nearest).sqrt();
                    let local = if is_local { 2.5 * around } else { 0.0 };
                    d(nearest) <= local.max(size)
                };
                let mut expected = faces.clone();
                expected.retain(|face| face.iter().all(|&v| is_near(v)));
                let nearby = Nearby {
                    neighborhoods: &neighborhoods,
                    distance: size,
                    is_local,
                };
                let found = forward(&mesh, nearby);
                let whole = |face: &[u32; 3]| face.map(|v| found.vertices[v as usize]);
                let stays: Vec<_> = found.mesh.faces().iter().map(whole).collect();
                assert_eq!(stays, expected, "{size}");
                assert_eq!(found.removed, 150 - expected.len());
                let at = |&v: &u32| vertices[v as usize];
                let kept: Vec<_> = found.vertices.iter().map(at).collect();
                assert_eq!(found.mesh.vertices(), kept);
                let far = (0..200).filter(|&v| !is_near(v)).count();
                assert_eq!(nearby.far_shares(&mesh, None), [far as f64 / 200.0]);
                let mut bars = vec![[1.0; 3]; 200];
                pullback(&found, &vec![[2.0; 3]; kept.len()], &mut bars);
                let moved = bars.iter().filter(|bar| bar[0] == 3.0).count();
                assert_eq!(moved, found.vertices.len());
            }
        }
    }
}
