//! Angle-weighted pseudonormals: they distinguish inside from outside at the edges and corners of a mesh.
//!
//! The pseudonormal of an edge is the sum of the normals of its faces, that of a vertex the sum weighted by the
//! angles of the faces there. For the point `y` of a closed mesh that is closest to `q`, the sign of
//! `(q − y)·n` is positive outside (J. A. Bærentzen and H. Aanæs, IEEE TVCG 11, 2005). Faces must share their
//! vertices, by index.

use rayon::prelude::*;

use super::bvh::corners;
use super::triangle::{Feature, unit_normal};
use crate::vector::{add, dot, norm, scale, sub};
use crate::{Mesh, Real};

/// Pseudonormals of all features of a mesh; not of unit length.
#[derive(Clone, Debug)]
pub(super) struct Pseudonormals {
    faces: Vec<[f64; 3]>,
    /// Of the edges of each face, from each corner to the next.
    edges: Vec<[[f64; 3]; 3]>,
    vertices: Vec<[f64; 3]>,
}

impl Pseudonormals {
    pub(super) fn new<T: Real>(mesh: &Mesh<T>) -> Self {
        let faces: Vec<[f64; 3]> = (0..mesh.faces().len() as u32)
            .into_par_iter()
            .map(|face| unit_normal(corners(mesh, face)).unwrap_or([0.0; 3]))
            .collect();
        Self {
            edges: of_edges(mesh, &faces),
            vertices: of_vertices(mesh, &faces),
            faces,
        }
    }

    /// Pseudonormal of a feature of a face; zero for a face without area.
    pub(super) fn of<T: Real>(&self, mesh: &Mesh<T>, face: u32, feature: Feature) -> [f64; 3] {
        match feature {
            Feature::Face => self.faces[face as usize],
            Feature::Edge(k) => self.edges[face as usize][k],
            Feature::Vertex(k) => self.vertices[mesh.faces()[face as usize][k] as usize],
        }
    }
}

/// Sums over the faces of each edge: the sides of all faces are sorted by their two vertices, so that those of
/// one edge follow each other.
fn of_edges<T: Real>(mesh: &Mesh<T>, normals: &[[f64; 3]]) -> Vec<[[f64; 3]; 3]> {
    let mut sides: Vec<([u32; 2], u32, u8)> = (0..mesh.faces().len() as u32)
        .into_par_iter()
        .flat_map_iter(|face| (0..3).map(move |k| (edge(mesh, face, k), face, k as u8)))
        .collect();
    sides.par_sort_unstable();
    let mut edges = vec![[[0.0; 3]; 3]; normals.len()];
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        let sum = run.iter().fold([0.0; 3], |sum, &(_, face, _)| {
            add(sum, normals[face as usize])
        });
        for &(_, face, k) in run {
            edges[face as usize][k as usize] = sum;
        }
    }
    edges
}

/// The two vertices of edge `k` of a face, the lower first.
fn edge<T: Real>(mesh: &Mesh<T>, face: u32, k: usize) -> [u32; 2] {
    let corners = mesh.faces()[face as usize];
    let (a, b) = (corners[k], corners[(k + 1) % 3]);
    [a.min(b), a.max(b)]
}

fn of_vertices<T: Real>(mesh: &Mesh<T>, normals: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut vertices = vec![[0.0; 3]; mesh.vertices().len()];
    for (face, &normal) in normals.iter().enumerate() {
        let points = corners(mesh, face as u32);
        for (k, &vertex) in mesh.faces()[face].iter().enumerate() {
            let sum = &mut vertices[vertex as usize];
            *sum = add(*sum, scale(normal, angle(points, k)));
        }
    }
    vertices
}

/// Angle of a triangle at corner `k`, in radians.
fn angle(corners: [[f64; 3]; 3], k: usize) -> f64 {
    let a = sub(corners[(k + 1) % 3], corners[k]);
    let b = sub(corners[(k + 2) % 3], corners[k]);
    let across = norm(crate::vector::cross(a, b));
    across.atan2(dot(a, b))
}
