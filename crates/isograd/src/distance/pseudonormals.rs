//! Angle-weighted pseudonormals: they distinguish inside from outside at the edges and corners of a mesh.
//!
//! The pseudonormal of an edge is the sum of the normals of its faces, that of a vertex the sum weighted by the
//! angles of the faces there. For the point `y` of a closed mesh that is closest to `q`, the sign of
//! `(q − y)·n` is positive outside (J. A. Bærentzen and H. Aanæs, IEEE TVCG 11, 2005). Faces must share their
//! vertices, by index.

use super::bvh::corners;
use super::triangle::{Feature, unit_normal};
use crate::gather::Buckets;
use crate::vector::{add, dot, norm, scale, sub};
use crate::{Mesh, Real};

/// The faces of each vertex of a mesh. A pseudonormal is summed where it is needed: few are, and stored they would take
/// six times the memory of the mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Pseudonormals {
    faces: Buckets,
}

impl Pseudonormals {
    /// Pseudonormals of a mesh.
    pub(super) fn new<T: Real>(mesh: &Mesh<T>) -> Self {
        let mut new = Self::default();
        new.rebuild(mesh);
        new
    }

    /// Replaces them by the pseudonormals of another mesh, in the same memory.
    pub(super) fn rebuild<T: Real>(&mut self, mesh: &Mesh<T>) {
        self.faces.fill_with_faces(mesh);
    }

    /// The outward pseudonormal of a feature of a face, not of unit length; zero where faces have no area.
    pub(super) fn of<T: Real>(&self, mesh: &Mesh<T>, face: u32, feature: Feature) -> [f64; 3] {
        let named = mesh.faces()[face as usize];
        match feature {
            Feature::Face => normal(mesh, face as usize),
            Feature::Edge(k) => self.of_edge(mesh, [named[k], named[(k + 1) % 3]]),
            Feature::Vertex(k) => self.of_vertex(mesh, named[k]),
        }
    }

    /// Sum over the faces of an edge, in their order.
    fn of_edge<T: Real>(&self, mesh: &Mesh<T>, [a, b]: [u32; 2]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let faces = mesh.faces();
        let visit = |face: usize, k: usize| {
            let [before, after] = [2, 1].map(|step| faces[face][(k + step) % 3]);
            for other in [before, after] {
                if other == b {
                    sum = add(sum, normal(mesh, face));
                }
            }
        };
        self.faces.for_each_corner(faces, a as usize, visit);
        sum
    }

    /// Sum over the faces of a vertex, in their order.
    fn of_vertex<T: Real>(&self, mesh: &Mesh<T>, vertex: u32) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let visit = |face: usize, k: usize| {
            let weight = angle(corners(mesh, face as u32), k);
            sum = add(sum, scale(normal(mesh, face), weight));
        };
        let faces = mesh.faces();
        self.faces.for_each_corner(faces, vertex as usize, visit);
        sum
    }
}

/// Unit normal of a face; zero without area.
fn normal<T: Real>(mesh: &Mesh<T>, face: usize) -> [f64; 3] {
    unit_normal(corners(mesh, face as u32)).unwrap_or([0.0; 3])
}

/// Angle of a triangle at corner `k`, in radians.
fn angle(corners: [[f64; 3]; 3], k: usize) -> f64 {
    let a = sub(corners[(k + 1) % 3], corners[k]);
    let b = sub(corners[(k + 2) % 3], corners[k]);
    let across = norm(crate::vector::cross(a, b));
    across.atan2(dot(a, b))
}
