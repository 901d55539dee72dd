//! Values at the vertices of a mesh, interpolated at closest points.
//!
//! # Map
//! `u = Σ β_k u_k` over the corners of the face of a hit, `β` the barycentric coordinates of the closest point.
//!
//! # Residual
//! The hits.
//!
//! # Pullback
//! [`VertexValues::pullback`], together with that of the distances and the closest points: to the values, `ū_k += β_k ū`; to
//! the query and the corners through `β`, with `G`, `γ` and `o` as in [`extend`](super::extend).
//!
//! # Not differentiable
//! Where the closest point passes to another face; a direction in which a face is much thinner than the distance is
//! left out, as in [`pull_hits`](super::pull_hits).

use super::query::Hit;
use super::query_pullback::{check, corners_of};
use super::{Distance, Error, NO_TRIANGLE};
use crate::parallel::{self, CHUNK};
use crate::{Mesh, Real};

/// Values at the vertices of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct VertexValues<'a, T> {
    /// The mesh.
    pub mesh: &'a Mesh<T>,
    /// `(V, components)`, row by row.
    pub values: &'a [T],
    /// Components per value.
    pub components: usize,
}

/// Cotangents of hits and of the values at them; zeros where there are none.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bars<'a, T> {
    /// `(M,)` of the signed distances.
    pub distance: Option<&'a [T]>,
    /// `(M, 3)` of the closest points.
    pub point: Option<&'a [[T; 3]]>,
    /// `(M, components)` of the values, row by row.
    pub values: Option<&'a [T]>,
}

/// Cotangents of the inputs of an interpolation, which the pullback adds to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cotangent<T> {
    /// `(M, 3)` of the query points.
    pub points: Vec<[T; 3]>,
    /// `(V, 3)` of the vertices.
    pub vertices: Vec<[T; 3]>,
    /// `(V, components)` of the values at the vertices, row by row.
    pub values: Vec<T>,
}

impl<T: Distance> VertexValues<'_, T> {
    /// `(M, components)` values at the closest points of `hits`, row by row; zeros for a hit without a face.
    ///
    /// # Errors
    /// [`Error::Mismatch`] and [`Error::Face`].
    pub fn at(&self, hits: &[Hit<T>]) -> Result<Vec<T>, Error> {
        T::values(self, hits)
    }
}

impl<T: Real> VertexValues<'_, T> {
    /// [`at`](Self::at).
    pub(super) fn at_hits(&self, hits: &[Hit<T>]) -> Result<Vec<T>, Error> {
        let corners = self.corners(hits)?;
        let mut out = vec![T::zero(); hits.len() * self.components];
        if self.components == 0 {
            return Ok(out);
        }
        let of_hits = hits.chunks(CHUNK).zip(corners.chunks(CHUNK));
        let chunks = out.chunks_mut(CHUNK * self.components).zip(of_hits);
        parallel::each(chunks, |_, (rows, (hits, corners))| {
            let rows = rows.chunks_exact_mut(self.components).zip(hits);
            for ((row, hit), corners) in rows.zip(corners) {
                if hit.triangle == NO_TRIANGLE {
                    continue;
                }
                for (c, value) in row.iter_mut().enumerate() {
                    let corner = |k: usize| hit.barycentric[k].f64() * self.value(corners[k], c);
                    *value = T::of(corner(0) + corner(1) + corner(2));
                }
            }
        });
        Ok(out)
    }

    pub(super) fn value(&self, vertex: u32, component: usize) -> f64 {
        self.values[vertex as usize * self.components + component].f64()
    }

    /// [`corners_of`] the hits, with as many values as vertices.
    pub(super) fn corners(&self, hits: &[Hit<T>]) -> Result<Vec<[u32; 3]>, Error> {
        let length = self.mesh.vertices().len() * self.components;
        check(length, "the list of values", self.values.len())?;
        corners_of(self.mesh, hits)
    }
}
