//! The pullback of a query: cotangents of distances and closest points → points and vertices.

use rayon::prelude::*;

use super::query::{Hit, Query};
use super::tangent::tangent;
use super::triangle::closest_point;
use super::{Error, NO_TRIANGLE};
use crate::Real;
use crate::gather::{Buckets, add_to};
use crate::vector::{add, dot, norm, scale, sub, to_f64};

impl<T: Real> Query<T> {
    /// Pulls cotangents of the result `hits` of [`Self::query`] at `(N, 3)` points back to the points and to the
    /// vertices of the mesh. `distance_bar` `(N,)` is that of the signed distances, `point_bar` `(N, 3)` that of the
    /// closest points. Returns the number of guarded hits.
    ///
    /// Adds into `points_bar` `(N, 3)` and `vertices_bar` `(V, 3)`, in the order of the points and the vertices;
    /// both are first extended to that length with zeros and may be empty. Sums run in
    /// double precision in a fixed order: the same bits for any number of threads.
    ///
    /// A hit without a triangle contributes nothing, whatever its cotangents are. The sign and the closest face are held
    /// constant: on the medial axis, and on the mesh at its edges and corners, the result is the derivative on
    /// one side. Where a face is much thinner than the distance, its closest point turns without bound as a corner
    /// moves: a direction in which it is thinner than `√ε` distances (`ε` of the number type) is left out of the
    /// cotangent of the closest point, and the hit counts as guarded.
    ///
    /// # Errors
    /// [`Error::Mismatch`] and [`Error::Face`]; nothing is then written.
    pub fn pullback(
        &self,
        points: &[[T; 3]],
        hits: &[Hit<T>],
        distance_bar: &[T],
        point_bar: Option<&[[T; 3]]>,
        points_bar: &mut Vec<[T; 3]>,
        vertices_bar: &mut Vec<[T; 3]>,
    ) -> Result<usize, Error> {
        let point_bars = point_bar.map_or(points.len(), <[_]>::len);
        check(points.len(), "the list of hits", hits.len())?;
        check(
            points.len(),
            "the cotangent of the distances",
            distance_bar.len(),
        )?;
        check(
            points.len(),
            "the cotangent of the closest points",
            point_bars,
        )?;
        let faces = self.faces_of(hits)?;
        let shares: Vec<Share> = (0..points.len())
            .into_par_iter()
            .map(|i| {
                let point_bar = point_bar.map_or([0.0; 3], |bar| to_f64(bar[i]));
                self.share(points[i], &hits[i], distance_bar[i].f64(), point_bar)
            })
            .collect();
        let guarded = shares.par_iter().filter(|share| share.guarded).count();

        let vertices = self.mesh().vertices().len();
        points_bar.resize(points.len(), [T::zero(); 3]);
        vertices_bar.resize(vertices, [T::zero(); 3]);
        let mut hits_of = Buckets::default();
        // One bucket more, for hits without a triangle.
        hits_of.fill(vertices + 1, faces.len(), |hit| faces[hit]);
        let at_point = |i: usize| shares[i].point;
        let at_vertex = |vertex: usize| {
            let mut sum = [0.0; 3];
            hits_of.for_each_corner(&faces, vertex, |hit, corner| {
                sum = add(sum, shares[hit].corners[corner]);
            });
            sum
        };
        Ok(guarded + add_to(points_bar, at_point) + add_to(vertices_bar, at_vertex))
    }

    /// The vertices of the face of each hit; one past the last for a hit without a triangle.
    fn faces_of(&self, hits: &[Hit<T>]) -> Result<Vec<[u32; 3]>, Error> {
        let (faces, vertices) = (self.mesh().faces(), self.mesh().vertices().len() as u32);
        let of_hit = |hit: &Hit<T>| match hit.triangle {
            NO_TRIANGLE => Ok([vertices; 3]),
            face => faces
                .get(face as usize)
                .copied()
                .ok_or(Error::Face { face }),
        };
        hits.iter().map(of_hit).collect()
    }

    fn share(&self, point: [T; 3], hit: &Hit<T>, distance: f64, point_bar: [f64; 3]) -> Share {
        let mut share = Share::default();
        if hit.triangle == NO_TRIANGLE {
            return share;
        }
        let beta = hit.barycentric.map(T::f64);
        if distance != 0.0 {
            share.point = scale(to_f64(hit.gradient), distance);
            share.corners = beta.map(|beta| scale(share.point, -beta));
        }
        if point_bar != [0.0; 3] {
            self.add_closest_point(point, hit, point_bar, &mut share);
        }
        share
    }

    /// Pullback of the closest point `Σ β_k y_k`: `β_k` times the cotangent for each corner, plus the terms of `β`.
    fn add_closest_point(&self, point: [T; 3], hit: &Hit<T>, bar: [f64; 3], share: &mut Share) {
        let corners = self.mesh().corners(hit.triangle as usize).map(to_f64);
        let closest = closest_point(to_f64(point), corners);
        let from_first = |k: usize| dot(bar, sub(corners[k], corners[0]));
        let thinnest = T::epsilon().f64().sqrt() * norm(closest.offset);
        let through_beta = tangent(
            &closest,
            corners,
            [0.0, from_first(1), from_first(2)],
            thinnest,
        );
        share.guarded = through_beta.guarded;
        share.point = add(share.point, through_beta.query);
        for k in 0..3 {
            let own = add(through_beta.corners[k], scale(bar, closest.barycentric[k]));
            share.corners[k] = add(share.corners[k], own);
        }
    }
}

/// Cotangents from one hit.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    point: [f64; 3],
    corners: [[f64; 3]; 3],
    guarded: bool,
}

fn check(expected: usize, what: &'static str, length: usize) -> Result<(), Error> {
    if length == expected {
        return Ok(());
    }
    Err(Error::Mismatch {
        what,
        length,
        expected,
    })
}
