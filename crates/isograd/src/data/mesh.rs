//! A triangle mesh.

use crate::{Real, vector};

/// The lattice edge on which a vertex of an isosurface lies: from a cell center to the next one along
/// an axis. It names the vertex, whatever order the vertices are stored in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LatticeEdge(u64);

impl LatticeEdge {
    /// The edge from the cell at place `cell` in memory along `axis` (0, 1 or 2).
    pub fn new(cell: usize, axis: usize) -> Self {
        debug_assert!(axis < 3);
        Self(cell as u64 * 3 + axis as u64)
    }

    /// Place in memory of the cell that the edge starts from.
    pub fn cell(self) -> usize {
        (self.0 / 3) as usize
    }

    /// The axis along which it runs.
    pub fn axis(self) -> usize {
        (self.0 % 3) as usize
    }
}

/// A triangle mesh: `(V, 3)` vertices and `(F, 3)` faces, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh<T> {
    pub(crate) vertices: Vec<[T; 3]>,
    pub(crate) faces: Vec<[u32; 3]>,
    pub(crate) edges: Vec<LatticeEdge>,
}

/// Why a mesh was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("vertex {index} is not finite")]
    NotFinite {
        /// Index of the vertex, from 0.
        index: usize,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} names vertex {vertex}, but there are only {vertices}")]
    Index {
        /// Index of the face, from 0.
        face: usize,
        /// The vertex it names.
        vertex: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// More vertices than 32-bit indices can name.
    #[error("{vertices} vertices are more than 32-bit indices can name; simplify the mesh")]
    TooMany {
        /// Number of vertices.
        vertices: usize,
    },
}

impl<T: Real> Mesh<T> {
    /// Removes everything, keeping the memory.
    pub(crate) fn clear(&mut self) {
        self.vertices.clear();
        self.faces.clear();
        self.edges.clear();
    }

    /// A mesh of finite vertices and faces that name them, from 0.
    ///
    /// # Errors
    /// A vertex that is not finite or a face that names a vertex that is not there.
    pub fn new(vertices: Vec<[T; 3]>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if vertices.len() >= u32::MAX as usize {
            return Err(MeshError::TooMany {
                vertices: vertices.len(),
            });
        }
        if let Some(index) = vertices.iter().position(|&v| !vector::is_finite(v)) {
            return Err(MeshError::NotFinite { index });
        }
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&v) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
                return Err(MeshError::Index {
                    face,
                    vertex: v as usize,
                    vertices: vertices.len(),
                });
            }
        }
        Ok(Self {
            vertices,
            faces,
            edges: Vec::new(),
        })
    }

    /// `(V, 3)` vertices, in the user's unit.
    pub fn vertices(&self) -> &[[T; 3]] {
        &self.vertices
    }

    /// `(F, 3)` faces.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The lattice edge of each vertex, where the mesh is an isosurface; else empty.
    pub fn edges(&self) -> &[LatticeEdge] {
        &self.edges
    }

    /// The three corners of a face.
    #[inline(always)]
    pub fn corners(&self, face: usize) -> [[T; 3]; 3] {
        self.faces[face].map(|v| self.vertices[v as usize])
    }
}
