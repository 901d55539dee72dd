//! The pullback of a query: cotangents of distances, closest points and values there → points, vertices and their values.

use super::interpolate::{Bars, Cotangent, VertexValues};
use super::query::{Hit, Query};
use super::tangent::tangent;
use super::triangle::closest_point;
use super::{Distance, Error, NO_TRIANGLE};
use crate::gather::{Buckets, add_to, bounded};
use crate::parallel::{self, CHUNK};
use crate::vector::{add, dot, norm, scale, sub, to_f64};
use crate::{Mesh, Real};

impl<T: Distance> Query<T> {
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
pub fn pull_hits<T: Distance>(
    mesh: &Mesh<T>,
    points: &[[T; 3]],
    hits: &[Hit<T>],
    distance_bar: &[T],
    point_bar: Option<&[[T; 3]]>,
    points_bar: &mut Vec<[T; 3]>,
    vertices_bar: &mut Vec<[T; 3]>,
) -> Result<usize, Error> {
    let of = VertexValues {
        mesh,
        values: &[],
        components: 0,
    };
    let bars = Bars {
        distance: Some(distance_bar),
        point: point_bar,
        values: None,
    };
    let mut out = Cotangent {
        points: std::mem::take(points_bar),
        vertices: std::mem::take(vertices_bar),
        values: Vec::new(),
    };
    let done = of.pullback(points, hits, bars, &mut out);
    (*points_bar, *vertices_bar) = (out.points, out.vertices);
    done
}

impl<T: Distance> VertexValues<'_, T> {
    /// Pulls cotangents of `hits`, the result of a query at `(M, 3)` points, and of the values [there](Self::at) back,
    /// adding to `out`, whose lists are first extended with zeros. Held constant and guarded is what [`pull_hits`] says;
    /// the number of guarded hits is returned. The bits are the same for any number of threads.
    ///
    /// # Errors
    /// [`Error::Mismatch`] and [`Error::Face`]; nothing is then written.
    pub fn pullback(
        &self,
        points: &[[T; 3]],
        hits: &[Hit<T>],
        bars: Bars<'_, T>,
        out: &mut Cotangent<T>,
    ) -> Result<usize, Error> {
        T::pull_hits(self, points, hits, bars, out)
    }
}

impl<T: Real> VertexValues<'_, T> {
    /// [`pullback`](Self::pullback).
    pub(super) fn pull(
        &self,
        points: &[[T; 3]],
        hits: &[Hit<T>],
        bars: Bars<'_, T>,
        out: &mut Cotangent<T>,
    ) -> Result<usize, Error> {
        check(points.len(), "the list of hits", hits.len())?;
        bars.check(points.len(), self.components)?;
        let corners = self.corners(hits)?;
        // In a band, few of many points have a face.
        let found: Vec<u32> = (0..hits.len() as u32)
            .filter(|&i| hits[i as usize].triangle != NO_TRIANGLE)
            .collect();
        let corners: Vec<[u32; 3]> = found.iter().map(|&i| corners[i as usize]).collect();
        let share = |k: usize| {
            let i = found[k] as usize;
            self.share(points[i], &hits[i], corners[k], bars.of(i, self.components))
        };
        let shares: Vec<Share> = parallel::map(found.len(), share);
        let guarded = parallel::count(shares.len(), |k| shares[k].guarded);

        let vertices = self.mesh.vertices().len();
        let mut hits_of = Buckets::default();
        hits_of.fill(vertices, corners.len(), |k| corners[k]);
        out.points.resize(points.len(), [T::zero(); 3]);
        out.vertices.resize(vertices, [T::zero(); 3]);
        out.values.resize(self.values.len(), T::zero());
        let at_vertex = |vertex| {
            let mut sum = [0.0; 3];
            hits_of.for_each_corner(&corners, vertex, |k, corner| {
                sum = add(sum, shares[k].corners[corner]);
            });
            sum
        };
        let bounded = add_to_some(&mut out.points, &found, |k| shares[k].point)
            + add_to(&mut out.vertices, at_vertex);
        let Some(values) = bars.values else {
            return Ok(guarded + bounded);
        };
        parallel::for_each(&mut out.values, |place, sum| {
            let (vertex, c) = (place / self.components, place % self.components);
            let mut total = sum.f64();
            hits_of.for_each_corner(&corners, vertex, |k, corner| {
                let i = found[k] as usize;
                let bar = values[i * self.components + c].f64();
                total += hits[i].barycentric[corner].f64() * bar;
            });
            *sum = T::of(total);
        });
        Ok(guarded + bounded)
    }

    /// Cotangents from one hit: of its distance with `β` held constant, of `Σ β_k y_k` and of `Σ β_k u_k` with the terms
    /// of `β`.
    fn share(&self, point: [T; 3], hit: &Hit<T>, face: [u32; 3], bar: Bar<'_, T>) -> Share {
        let mut share = Share::default();
        let beta = hit.barycentric.map(T::f64);
        if bar.distance != 0.0 {
            share.point = scale(to_f64(hit.gradient), bar.distance);
            share.corners = beta.map(|beta| scale(share.point, -beta));
        }
        if bar.point == [0.0; 3] && bar.values.iter().all(|bar| *bar == T::zero()) {
            return share;
        }
        let corners = face.map(|v| to_f64(self.mesh.vertices()[v as usize]));
        let rise = |k: usize| {
            let of_value = |c: usize| self.value(face[k], c) - self.value(face[0], c);
            let of_values = bar.values.iter().enumerate();
            let of_values: f64 = of_values.map(|(c, bar)| bar.f64() * of_value(c)).sum();
            dot(bar.point, sub(corners[k], corners[0])) + of_values
        };
        let closest = closest_point(to_f64(point), corners);
        let thinnest = T::epsilon().f64().sqrt() * norm(closest.offset);
        let through_beta = tangent(&closest, corners, [0.0, rise(1), rise(2)], thinnest);
        share.guarded = through_beta.guarded;
        share.point = add(share.point, through_beta.query);
        for k in 0..3 {
            let own = scale(bar.point, closest.barycentric[k]);
            let own = add(through_beta.corners[k], own);
            share.corners[k] = add(share.corners[k], own);
        }
        share
    }
}

/// Cotangents of one hit.
struct Bar<'a, T> {
    distance: f64,
    point: [f64; 3],
    /// None if they are zero.
    values: &'a [T],
}

impl<'a, T: Real> Bars<'a, T> {
    fn of(&self, hit: usize, components: usize) -> Bar<'a, T> {
        Bar {
            distance: self.distance.map_or(0.0, |bars| bars[hit].f64()),
            point: self.point.map_or([0.0; 3], |bars| to_f64(bars[hit])),
            values: (self.values).map_or(&[], |bars| &bars[hit * components..][..components]),
        }
    }

    fn check(&self, hits: usize, components: usize) -> Result<(), Error> {
        let lists = [
            (
                "the cotangent of the distances",
                self.distance.map(<[_]>::len),
                hits,
            ),
            (
                "the cotangent of the closest points",
                self.point.map(<[_]>::len),
                hits,
            ),
            (
                "the cotangent of the values",
                self.values.map(<[_]>::len),
                hits * components,
            ),
        ];
        lists.into_iter().try_for_each(|(what, length, expected)| {
            check(expected, what, length.unwrap_or(expected))
        })
    }
}

/// Adds `term(k)` to entry `places[k]`, where the places are ascending. Returns the number of values out of range, which
/// are left out.
fn add_to_some<T: Real>(
    out: &mut [[T; 3]],
    places: &[u32],
    term: impl Fn(usize) -> [f64; 3] + Sync,
) -> usize {
    let add_to_chunk = |chunk: usize, out: &mut [[T; 3]]| {
        let (start, mut guarded) = (chunk * CHUNK, 0);
        let first = places.partition_point(|&i| (i as usize) < start);
        for (k, &i) in places.iter().enumerate().skip(first) {
            let Some(out) = out.get_mut(i as usize - start) else {
                break;
            };
            *out = add(*out, term(k).map(|x| bounded(x, &mut guarded)));
        }
        guarded
    };
    let guarded = parallel::map_each(out.chunks_mut(CHUNK), add_to_chunk);
    guarded.into_iter().sum()
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

/// Cotangents from one hit.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    point: [f64; 3],
    corners: [[f64; 3]; 3],
    guarded: bool,
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
