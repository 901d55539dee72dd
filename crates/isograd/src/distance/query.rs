//! Distance at any point.

use pulp::{Arch, Simd, WithSimd};
use rayon::slice::ParallelSliceMut;

use super::bvh::{
    Bvh, LANES, NOWHERE, NearestTriangles, Points, Stack, Triangles, corners, morton_code,
};
use super::lattice::NO_TRIANGLE;
use super::pseudonormals::Pseudonormals;
use super::triangle::{Closest, closest_point};
use super::{Distance, Error};
use crate::data::cells::Cells;
use crate::vector::{dot, normalized, of_f64, scale, to_f64};
use crate::{Field, Mesh, Real, parallel};

/// Packets of points per task: a fixed number, so that the result does not depend on the threads.
pub(super) const PACKETS_PER_TASK: usize = 16;

/// Points, neighbors in space, after which frames of a large mesh are freed.
pub(super) const PART: usize = 1 << 20;

/// Share by which a limit of a search exceeds the distance meant, so that rounding changes nothing.
const MARGIN: f64 = 1.001;

/// Signed distance to a mesh at any point. The distance is defined for any mesh; the sign needs a closed mesh whose
/// faces share their vertices, or a field with the same inside.
#[derive(Clone, Debug)]
pub struct Query<T> {
    mesh: Mesh<T>,
    bvh: Bvh,
    pseudonormals: Pseudonormals,
}

/// Result of a query at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<T> {
    /// Signed distance, in the user's unit, negative inside.
    pub distance: T,
    /// Gradient of the distance with respect to the point, of unit length: away from the closest point outside, toward
    /// it inside. At distance 0 it is the normal of the closest face; zero only where that face has no area.
    pub gradient: [T; 3],
    /// The closest point of the mesh.
    pub point: [T; 3],
    /// The face of the closest point; [`NO_TRIANGLE`] where the query point is NaN or out of range.
    pub triangle: u32,
    /// Weights of the corners of that face at the closest point.
    pub barycentric: [T; 3],
}

impl<T: Real> Query<T> {
    /// Builds the tree and the pseudonormals of a mesh.
    ///
    /// # Errors
    /// [`Error::Empty`] and [`Error::Range`].
    pub fn new(mesh: Mesh<T>) -> Result<Self, Error> {
        let mut bvh = Bvh::default();
        bvh.rebuild(&mesh)?;
        let pseudonormals = Pseudonormals::new(&mesh);
        Ok(Self {
            mesh,
            bvh,
            pseudonormals,
        })
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh<T> {
        &self.mesh
    }

    /// [`query`](Self::query).
    pub(super) fn hits(&self, points: &[[T; 3]], signs: Option<&Field<T>>) -> Vec<Hit<T>> {
        let surface = Surface {
            mesh: &self.mesh,
            bvh: &self.bvh,
            pseudonormals: &self.pseudonormals,
        };
        surface.hits(points, f64::INFINITY, &|point| {
            signs.and_then(|field| corners_agree(field.into(), T::zero(), point))
        })
    }
}

impl<T: Distance> Query<T> {
    /// Distance, gradient and closest point at `(N, 3)` points, in their order.
    ///
    /// `signs` is a field that is negative inside, such as the distance on the lattice: where its eight values
    /// around a point agree, they give the sign. Elsewhere, and without it, the pseudonormal of the closest
    /// feature does, which is right for a closed mesh. For an open mesh it distinguishes the two sides near the surface;
    /// near the border it is meaningless.
    ///
    /// A point that is not finite, or whose squared distance overflows, gets NaN and no triangle.
    pub fn query(&self, points: &[[T; 3]], signs: Option<&Field<T>>) -> Vec<Hit<T>> {
        T::hits(self, points, signs)
    }
}

/// Distance, gradient and closest point of `mesh` at any points, like [`Query::query`]. `is_inside` says on which side a
/// point is, where it can. Outside, a point farther than `within` has that distance and [no face](Hit::beyond).
///
/// # Errors
/// [`Error::Empty`] and [`Error::Range`].
pub(crate) fn hits_within<T: Real>(
    mesh: &Mesh<T>,
    points: &[[T; 3]],
    within: f64,
    is_inside: &(dyn Fn([f64; 3]) -> Option<bool> + Sync),
) -> Result<Vec<Hit<T>>, Error> {
    if points.is_empty() {
        return Ok(Vec::new());
    }
    let mut bvh = Bvh::default();
    bvh.rebuild(mesh)?;
    let surface = Surface {
        mesh,
        bvh: &bvh,
        pseudonormals: &Pseudonormals::new(mesh),
    };
    Ok(surface.hits(points, within, is_inside))
}

impl<T: Real> Hit<T> {
    /// The hit of a point that is farther than `distance` from the surface, outside: no face, no gradient, and the point
    /// itself in place of the closest one.
    pub fn beyond(point: [T; 3], distance: f64) -> Self {
        Self {
            distance: T::of(distance),
            gradient: [T::zero(); 3],
            point,
            triangle: NO_TRIANGLE,
            barycentric: [T::zero(); 3],
        }
    }
}

/// Place in the tree of the triangle closest to each point, of those that are nearer than the square root of `limit(i)`.
/// The points are taken in packets of neighbors along a Morton curve.
pub(super) fn nearest_triangles<T: Real>(
    mesh: &Mesh<T>,
    bvh: &Bvh,
    points: &[[T; 3]],
    limit: &(dyn Fn(usize) -> f64 + Sync),
) -> Vec<u32> {
    let is_near = |i: usize| {
        let limit = limit(i);
        limit == f64::INFINITY || bvh.has_box_within(to_f64(points[i]), limit)
    };
    let order = morton_order(bvh, points, &is_near);
    let arch = Arch::new();
    let mut sorted = vec![NOWHERE; order.len()];
    for (found, order) in sorted.chunks_mut(PART).zip(order.chunks(PART)) {
        let triangles = Triangles::new(mesh, bvh);
        let tasks = found.chunks_mut(PACKETS_PER_TASK * LANES);
        let tasks = tasks.zip(order.chunks(PACKETS_PER_TASK * LANES));
        parallel::each(tasks, |_, (found, order)| {
            arch.dispatch(Packets {
                triangles: &triangles,
                points,
                order,
                limit,
                found,
            });
        });
    }
    let mut nearest = vec![NOWHERE; points.len()];
    for (&(_, index), place) in order.iter().zip(sorted) {
        nearest[index as usize] = place;
    }
    nearest
}

/// Morton codes and indices of those points that are wanted, sorted: neighbors in space are neighbors in the list.
pub(super) fn morton_order<T: Real>(
    bvh: &Bvh,
    points: &[[T; 3]],
    is_wanted: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<(u64, u32)> {
    let mut order = parallel::flat_map(points.len(), |i| {
        let code = || morton_code(bvh.to_morton(to_f64(points[i])));
        is_wanted(i).then(|| (code(), i as u32))
    });
    order.par_sort_unstable();
    order
}

/// A mesh with its tree and its pseudonormals.
pub(super) struct Surface<'a, T> {
    pub mesh: &'a Mesh<T>,
    pub bvh: &'a Bvh,
    pub pseudonormals: &'a Pseudonormals,
}

impl<T: Real> Surface<'_, T> {
    /// [`hits_within`].
    fn hits(
        &self,
        points: &[[T; 3]],
        within: f64,
        is_inside: &(dyn Fn([f64; 3]) -> Option<bool> + Sync),
    ) -> Vec<Hit<T>> {
        let sides = parallel::map(points.len(), |i| is_inside(to_f64(points[i])));
        let limit = |i: usize| match sides[i] {
            Some(false) => (MARGIN * within).powi(2),
            _ => f64::INFINITY,
        };
        let nearest = nearest_triangles(self.mesh, self.bvh, points, &limit);
        let mut hits = Vec::new();
        parallel::fill_large(&mut hits, points.len(), &|i| {
            if nearest[i] == NOWHERE && limit(i) < f64::INFINITY {
                return Hit::beyond(points[i], within);
            }
            let hit = self.hit(points[i], nearest[i], sides[i]);
            match hit.distance.f64() > within {
                true => Hit::beyond(points[i], within),
                false => hit,
            }
        });
        hits
    }

    /// Result of a query whose closest triangle is at `place` of the tree.
    pub(super) fn hit(&self, point: [T; 3], place: u32, is_inside: Option<bool>) -> Hit<T> {
        if place == NOWHERE {
            return Hit {
                distance: T::nan(),
                gradient: [T::nan(); 3],
                point: [T::nan(); 3],
                triangle: NO_TRIANGLE,
                barycentric: [T::nan(); 3],
            };
        }
        let face = self.bvh.face(place);
        let found = closest_point(to_f64(point), corners(self.mesh, face));
        let inside = is_inside.unwrap_or_else(|| self.is_inside(face, &found));
        let sign = if inside { -1.0 } else { 1.0 };
        Hit {
            distance: T::of(sign * found.distance),
            gradient: of_f64(self.gradient(face, &found, sign)),
            point: of_f64(found.point),
            triangle: face,
            barycentric: of_f64(found.barycentric),
        }
    }

    fn is_inside(&self, face: u32, found: &Closest) -> bool {
        let normal = self.pseudonormals.of(self.mesh, face, found.feature);
        dot(normal, found.offset) < 0.0
    }

    fn gradient(&self, face: u32, found: &Closest, sign: f64) -> [f64; 3] {
        match normalized(found.offset) {
            Some(away) => scale(away, sign),
            None => {
                let of_face = super::triangle::unit_normal(corners(self.mesh, face));
                let pseudonormal =
                    || normalized(self.pseudonormals.of(self.mesh, face, found.feature));
                of_face.or_else(pseudonormal).unwrap_or([0.0; 3])
            }
        }
    }
}

/// Whether a point is below the level `c` of a field, where the eight values around it are there and agree.
pub(crate) fn corners_agree<T: Real>(field: Cells<'_, T>, c: T, point: [f64; 3]) -> Option<bool> {
    let grid = field.grid();
    let (lower, spacing) = (to_f64(grid.lower()), grid.spacing().f64());
    let mut cell = [0; 3];
    for a in 0..3 {
        let from_center = (point[a] - lower[a]) / spacing - 0.5;
        if !(from_center >= 0.0) {
            return None;
        }
        cell[a] = from_center as usize;
        if cell[a] + 1 >= grid.shape()[a] {
            return None;
        }
    }
    cell_agrees(field, c, cell)
}

/// Whether the values at the eight centers from `cell` on are below the level `c`, where they are there and agree.
pub(crate) fn cell_agrees<T: Real>(field: Cells<'_, T>, c: T, cell: [usize; 3]) -> Option<bool> {
    let mut below = field.corners(cell).map(|value| value.map(|x| x < c));
    let first = below.next()??;
    below.all(|side| side == Some(first)).then_some(first)
}

/// Infinity for NaN, since comparisons with NaN all fail and would admit it to absent boxes.
#[inline(always)]
pub(super) fn far_if_nan(x: f64) -> f64 {
    if x.is_nan() { f64::INFINITY } else { x }
}

/// Points as the tree takes them.
#[inline(always)]
pub(super) fn packet<T: Real>(points: &[[T; 3]; LANES]) -> Points {
    let mut packet: Points = [[0.0; LANES]; 3];
    for (l, point) in points.iter().enumerate() {
        for a in 0..3 {
            packet[a][l] = far_if_nan(point[a].f64());
        }
    }
    packet
}

/// Finds the closest triangles of some packets of points.
struct Packets<'a, T> {
    triangles: &'a Triangles<'a, T>,
    points: &'a [[T; 3]],
    /// Morton code and index of each point.
    order: &'a [(u64, u32)],
    /// Squared distance of a point beyond which nothing is looked for.
    limit: &'a (dyn Fn(usize) -> f64 + Sync),
    found: &'a mut [u32],
}

impl<T: Real> WithSimd for Packets<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut stack = Stack::new();
        for (order, found) in self.order.chunks(LANES).zip(self.found.chunks_mut(LANES)) {
            // The last packet repeats its last point.
            let index: [usize; LANES] =
                std::array::from_fn(|l| order[l.min(order.len() - 1)].1 as usize);
            let packet = packet(&index.map(|i| self.points[i]));
            let mut nearest = NearestTriangles {
                squared: index.map(self.limit),
                ..NearestTriangles::NOTHING
            };
            self.triangles.nearest(&packet, &mut nearest, &mut stack);
            found.copy_from_slice(&nearest.triangle[..found.len()]);
        }
    }
}
