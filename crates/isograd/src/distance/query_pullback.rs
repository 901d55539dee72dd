//! The pullback of a query: cotangents of distances and closest points → points and vertices.

use rayon::prelude::*;

use super::query::{Hit, Query};
use super::tangent::tangent;
use super::triangle::closest_point;
use super::{Error, NO_TRIANGLE};
use crate::gather::{Buckets, add_to};
use crate::vector::{add, dot, norm, scale, sub, to_f64};
use crate::{Mesh, Real};

impl<T: Real> Query<T> {
    /// [`pull_hits`] of the result `hits` of [`Self::query`].
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
        pull_hits(
            self.mesh(),
            points,
            hits,
            distance_bar,
            point_bar,
            points_bar,
            vertices_bar,
        )
    }
}

/// Pulls cotangents of `hits` on `mesh`, the result of a [query](Query::query) at `(N, 3)` points, back to the points
/// and to the vertices of the mesh. `distance_bar` `(N,)` is that of the signed distances, `point_bar` `(N, 3)` that of
/// the closest points. Returns the number of guarded hits. Of each hit it reads gradient, face and weights.
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
pub fn pull_hits<T: Real>(
    mesh: &Mesh<T>,
    points: &[[T; 3]],
    hits: &[Hit<T>],
    distance_bar: &[T],
    point_bar: Option<&[[T; 3]]>,
    points_bar: &mut Vec<[T; 3]>,
    vertices_bar: &mut Vec<[T; 3]>,
) -> Result<usize, Error> {
    let (n, distances) = (points.len(), distance_bar.len());
    let point_bars = point_bar.map_or(n, <[_]>::len);
    check(n, "the list of hits", hits.len())?;
    check(n, "the cotangent of the distances", distances)?;
    check(n, "the cotangent of the closest points", point_bars)?;
    let corners = corners_of(mesh, hits)?;
    let shares: Vec<Share> = (0..n)
        .into_par_iter()
        .map(|i| {
            let point_bar = point_bar.map_or([0.0; 3], |bar| to_f64(bar[i]));
            Share::new(mesh, points[i], &hits[i], distance_bar[i].f64(), point_bar)
        })
        .collect();
    let guarded = shares.par_iter().filter(|share| share.guarded).count();

    let hits_of = by_vertex(mesh, &corners);
    points_bar.resize(n, [T::zero(); 3]);
    vertices_bar.resize(mesh.vertices().len(), [T::zero(); 3]);
    let at_vertex = |vertex| gather(&hits_of, &corners, vertex, |hit| &shares[hit].corners);
    Ok(guarded + add_to(points_bar, |i| shares[i].point) + add_to(vertices_bar, at_vertex))
}

/// The vertices of the face of each hit; one past the last for a hit without a triangle.
pub(super) fn corners_of<T: Real>(mesh: &Mesh<T>, hits: &[Hit<T>]) -> Result<Vec<[u32; 3]>, Error> {
    let of_hit = |hit: &Hit<T>| match hit.triangle {
        NO_TRIANGLE => Ok([mesh.vertices().len() as u32; 3]),
        face => {
            let corners = mesh.faces().get(face as usize).copied();
            corners.ok_or(Error::Face { face })
        }
    };
    hits.iter().map(of_hit).collect()
}

/// Hits by vertex, from the result of [`corners_of`]. One bucket more than vertices, for hits without a triangle.
pub(super) fn by_vertex<T: Real>(mesh: &Mesh<T>, corners: &[[u32; 3]]) -> Buckets {
    let mut hits_of = Buckets::default();
    hits_of.fill(mesh.vertices().len() + 1, corners.len(), |hit| corners[hit]);
    hits_of
}

/// Cotangent of a vertex: the sum of those of the corners of its hits.
pub(super) fn gather<'a>(
    hits_of: &Buckets,
    corners: &[[u32; 3]],
    vertex: usize,
    bars_of: impl Fn(usize) -> &'a [[f64; 3]; 3],
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    hits_of.for_each_corner(corners, vertex, |hit, corner| {
        sum = add(sum, bars_of(hit)[corner]);
    });
    sum
}

/// Cotangents from one hit.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    point: [f64; 3],
    corners: [[f64; 3]; 3],
    guarded: bool,
}

impl Share {
    fn new<T: Real>(
        mesh: &Mesh<T>,
        point: [T; 3],
        hit: &Hit<T>,
        distance_bar: f64,
        point_bar: [f64; 3],
    ) -> Self {
        let mut share = Self::default();
        if hit.triangle == NO_TRIANGLE {
            return share;
        }
        let beta = hit.barycentric.map(T::f64);
        if distance_bar != 0.0 {
            share.point = scale(to_f64(hit.gradient), distance_bar);
            share.corners = beta.map(|beta| scale(share.point, -beta));
        }
        if point_bar != [0.0; 3] {
            let corners = mesh.corners(hit.triangle as usize).map(to_f64);
            let thinnest = T::epsilon().f64().sqrt();
            share.add_closest_point(to_f64(point), corners, thinnest, point_bar);
        }
        share
    }

    /// Pullback of the closest point `Σ β_k y_k`: `β_k` times the cotangent for each corner, plus the terms of `β`.
    /// `thinnest` is in distances.
    fn add_closest_point(
        &mut self,
        point: [f64; 3],
        corners: [[f64; 3]; 3],
        thinnest: f64,
        bar: [f64; 3],
    ) {
        let closest = closest_point(point, corners);
        let from_first = |k: usize| dot(bar, sub(corners[k], corners[0]));
        let rises = [0.0, from_first(1), from_first(2)];
        let through_beta = tangent(&closest, corners, rises, thinnest * norm(closest.offset));
        self.guarded = through_beta.guarded;
        self.point = add(self.point, through_beta.query);
        for k in 0..3 {
            let own = add(through_beta.corners[k], scale(bar, closest.barycentric[k]));
            self.corners[k] = add(self.corners[k], own);
        }
    }
}

pub(super) fn check(expected: usize, what: &'static str, length: usize) -> Result<(), Error> {
    if length == expected {
        return Ok(());
    }
    Err(Error::Mismatch {
        what,
        length,
        expected,
    })
}
