//! Values at the vertices of a mesh, interpolated at closest points.
//!
//! # Map
//! `u = Σ β_k u_k` over the corners of the face of a hit, `β` the barycentric coordinates of the closest point.
//!
//! # Residual
//! The hits.
//!
//! # Pullback
//! To the values, `ū_k += β_k ū`; to the query and the corners through `β`, with `G`, `γ` and `o` as in
//! [`extend`](super::extend).
//!
//! # Not differentiable
//! Where the closest point passes to another face; a direction in which a face is much thinner than the distance is
//! left out, as in [`pull_hits`](super::pull_hits).

use rayon::prelude::*;

use super::query::Hit;
use super::query_pullback::{by_vertex, check, corners_of, gather};
use super::tangent::{Tangent, tangent};
use super::triangle::closest_point;
use super::{Error, NO_TRIANGLE};
use crate::gather::{Buckets, add_to};
use crate::vector::{norm, to_f64};
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

impl<T: Real> VertexValues<'_, T> {
    /// `(M, components)` values at the closest points of `hits`, row by row; zeros for a hit without a face.
    ///
    /// # Errors
    /// [`Error::Mismatch`] and [`Error::Face`].
    pub fn at(&self, hits: &[Hit<T>]) -> Result<Vec<T>, Error> {
        let corners = self.corners(hits)?;
        let mut out = vec![T::zero(); hits.len() * self.components];
        if self.components == 0 {
            return Ok(out);
        }
        let rows = out.par_chunks_exact_mut(self.components).zip(hits);
        rows.zip(&corners).for_each(|((row, hit), corners)| {
            if hit.triangle == NO_TRIANGLE {
                return;
            }
            for (c, value) in row.iter_mut().enumerate() {
                let corner = |k: usize| hit.barycentric[k].f64() * self.value(corners[k], c);
                *value = T::of(corner(0) + corner(1) + corner(2));
            }
        });
        Ok(out)
    }

    /// Pulls the cotangents `values_bar` `(M, components)` of [`Self::at`] back, adding to `out`, whose lists are first
    /// extended with zeros. Returns the number of guarded hits. The bits are the same for any number of threads.
    ///
    /// # Errors
    /// [`Error::Mismatch`] and [`Error::Face`]; nothing is then written.
    pub fn pullback(
        &self,
        points: &[[T; 3]],
        hits: &[Hit<T>],
        values_bar: &[T],
        out: &mut Cotangent<T>,
    ) -> Result<usize, Error> {
        check(points.len(), "the list of hits", hits.len())?;
        let length = hits.len() * self.components;
        check(length, "the cotangent of the values", values_bar.len())?;
        let row = |i: usize| &values_bar[i * self.components..][..self.components];
        let corners = self.corners(hits)?;
        let shares: Vec<Tangent> = (0..hits.len())
            .into_par_iter()
            .map(|i| match hits[i].triangle {
                NO_TRIANGLE => Tangent::default(),
                _ => self.share(points[i], corners[i], row(i)),
            })
            .collect();
        let guarded = shares.par_iter().filter(|share| share.guarded).count();

        let hits_of = by_vertex(self.mesh, &corners);
        out.points.resize(points.len(), [T::zero(); 3]);
        out.vertices
            .resize(self.mesh.vertices().len(), [T::zero(); 3]);
        out.values.resize(self.values.len(), T::zero());
        let at_vertex = |vertex| gather(&hits_of, &corners, vertex, |hit| &shares[hit].corners);
        let bounded =
            add_to(&mut out.points, |i| shares[i].query) + add_to(&mut out.vertices, at_vertex);
        self.add_to_values(&corners, &hits_of, hits, values_bar, &mut out.values);
        Ok(guarded + bounded)
    }

    /// Adds `β_k ū` to the cotangents of the values at the corners of each hit.
    fn add_to_values(
        &self,
        corners: &[[u32; 3]],
        hits_of: &Buckets,
        hits: &[Hit<T>],
        values_bar: &[T],
        out: &mut [T],
    ) {
        if self.components == 0 {
            return;
        }
        let rows = out.par_chunks_exact_mut(self.components).enumerate();
        rows.for_each(|(vertex, sums)| {
            for (c, sum) in sums.iter_mut().enumerate() {
                let mut total = sum.f64();
                hits_of.for_each_corner(corners, vertex, |hit, corner| {
                    let bar = values_bar[hit * self.components + c].f64();
                    total += hits[hit].barycentric[corner].f64() * bar;
                });
                *sum = T::of(total);
            }
        });
    }

    /// Cotangents through `β` of one hit.
    fn share(&self, point: [T; 3], face: [u32; 3], bar: &[T]) -> Tangent {
        let corners = face.map(|v| to_f64(self.mesh.vertices()[v as usize]));
        let rise = |k: usize| -> f64 {
            let terms = bar.iter().enumerate();
            terms
                .map(|(c, u)| u.f64() * (self.value(face[k], c) - self.value(face[0], c)))
                .sum()
        };
        let closest = closest_point(to_f64(point), corners);
        let thinnest = T::epsilon().f64().sqrt() * norm(closest.offset);
        tangent(&closest, corners, [0.0, rise(1), rise(2)], thinnest)
    }

    fn value(&self, vertex: u32, component: usize) -> f64 {
        self.values[vertex as usize * self.components + component].f64()
    }

    /// [`corners_of`] the hits, with as many values as vertices.
    fn corners(&self, hits: &[Hit<T>]) -> Result<Vec<[u32; 3]>, Error> {
        let length = self.mesh.vertices().len() * self.components;
        check(length, "the list of values", self.values.len())?;
        corners_of(self.mesh, hits)
    }
}
