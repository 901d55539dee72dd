//! Signed distance to a triangle mesh on the device, at every cell center of a grid.
//!
//! # Map
//! As in [`isograd::distance`]: `φ(q) = σ(q) · min_y |q − y|` over all points `y` of the mesh, in the user's
//! unit, negative inside; exact but for rounding. [`lattice::forward`] takes the sign from `χ − c` at the cell.
//! [`mod@extend`] carries what is known at samples of the surface to the cells around it.
//! Triangles are found in a hierarchy of boxes that is made on the device; of triangles equally far, to the
//! last bit, the lowest face is named.
//!
//! # Residual
//! The closest face of every cell. The barycentric weights `β` of the closest point follow from it.
//!
//! # Pullback
//! [`lattice::pullback`]. By the envelope theorem, with `β` held constant: `ȳ_k += −β_k φ̄ ∇φ`, with
//! `∇φ = σ (q − y)/|q − y|`, or the normal of the face at distance 0. Every sum is cut into pieces of a fixed size,
//! however many cells have the same closest face.
//!
//! # Not differentiable
//! On the medial axis, where the closest point jumps, and on the mesh itself at its edges and corners. The sign
//! is discrete.
//!
//! # Range
//! All is computed in the number type of the mesh, squares of lengths too: in `f32` lengths, and cells, should
//! be between about 1e-15 and 1e15 of the unit.

mod bvh;
pub mod extend;
pub mod lattice;
mod shares;
mod tangent;
mod triangle;

pub use isograd::distance::{Band, NO_TRIANGLE};

use cubecl::prelude::*;

use crate::Buffer;
use crate::device::argument;

/// A distance that no mesh has, squared.
const FAR: f64 = 3e38;

/// A triangle mesh on a device.
#[derive(Clone, Debug)]
pub struct Mesh<T> {
    /// `(V, 3)`, in the user's unit.
    pub vertices: Buffer<T>,
    /// `(F, 3)`: each names three vertices, from 0. Not checked: a kernel that reads beyond the vertices gets
    /// anything.
    pub faces: Buffer<u32>,
}

/// [`Mesh`] in kernels.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct MeshArrays<F: Float + CubeElement> {
    pub vertices: Array<F>,
    pub faces: Array<u32>,
}

argument!(Mesh<T> => MeshArraysLaunch<T, R>: |of| of.vertices.arg(), of.faces.arg());

impl<T> Mesh<T> {
    fn check(&self) -> Result<(), Error> {
        for (what, length) in [
            ("the array of vertices", self.vertices.len()),
            ("the array of faces", self.faces.len()),
        ] {
            if !length.is_multiple_of(3) {
                return Err(Error::Triples { what, length });
            }
        }
        if self.faces.is_empty() || self.vertices.is_empty() {
            return Err(Error::Empty);
        }
        Ok(())
    }
}

/// Errors of the distance stage.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// There is no triangle to be near to.
    #[error(
        "the mesh has no triangle, so there is no distance to it; check that the surface crosses the grid"
    )]
    Empty,
    /// The width of the band is not a positive number.
    #[error(
        "the band has a width of {width}; give a positive, finite length in the unit of the points, or use the full field"
    )]
    Band {
        /// Distance from the surface to the end of the band.
        width: f64,
    },
    /// A flat `(N, 3)` array whose length is not 3N.
    #[error("{what} has {length} numbers, which is not three for each")]
    Triples {
        /// Which array.
        what: &'static str,
        /// Its length.
        length: usize,
    },
    /// The device can't, or the arrays do not fit together.
    #[error(transparent)]
    Device(#[from] crate::Error),
}
