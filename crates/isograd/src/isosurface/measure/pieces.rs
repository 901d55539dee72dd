//! Connected components of a mesh, one by one.

use super::Scratch;
use crate::data::Mesh;
use crate::{Real, union_find, vector};

/// Share of the area of the largest piece below which another one is small.
const SMALL: f64 = 0.01;

/// The connected components of a mesh, in the order of their first faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pieces {
    /// Number of the piece of each face.
    pub of_face: Vec<u32>,
    /// Area of each piece, in unit length².
    pub areas: Vec<f64>,
}

impl Pieces {
    /// The pieces of a mesh. `scratch` must be that of the last [`measure`](super::measure), of this mesh.
    pub(crate) fn new<T: Real>(mesh: &Mesh<T>, scratch: &mut Scratch) -> Self {
        const NONE: u32 = u32::MAX;
        let mut of_root = vec![NONE; mesh.vertices().len()];
        let mut pieces = Self::default();
        for (f, face) in mesh.faces().iter().enumerate() {
            let root = union_find::root(&mut scratch.parent, face[0]) as usize;
            if of_root[root] == NONE {
                of_root[root] = pieces.areas.len() as u32;
                pieces.areas.push(0.0);
            }
            let piece = of_root[root];
            let [a, b, c] = mesh.corners(f).map(vector::to_f64);
            let normal = vector::cross(vector::sub(b, a), vector::sub(c, a));
            pieces.of_face.push(piece);
            pieces.areas[piece as usize] += vector::norm(normal) / 2.0;
        }
        pieces
    }

    /// Whether a piece is large enough to be a body, and no crumb.
    pub(crate) fn are_large(&self) -> Vec<bool> {
        let largest = self.areas.iter().copied().fold(0.0, f64::max);
        let is_large = |&area: &f64| area >= SMALL * largest;
        self.areas.iter().map(is_large).collect()
    }

    /// Number of the piece of each vertex of the mesh; 0 for one without faces.
    pub(crate) fn of_vertices<T: Real>(&self, mesh: &Mesh<T>) -> Vec<u32> {
        let mut of = vec![0; mesh.vertices().len()];
        for (face, &piece) in mesh.faces().iter().zip(&self.of_face) {
            face.iter().for_each(|&v| of[v as usize] = piece);
        }
        of
    }
}
