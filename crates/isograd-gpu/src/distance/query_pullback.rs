//! The pullback of a query: cotangents of distances and closest points → points and vertices.

use cubecl::prelude::*;

use super::query::Hits;
use super::shares::{by_face, gather_corners};
use super::tangent::{gains, tangent};
use super::triangle::{closest, corners};
use super::{Error, Mesh};
use crate::device::check_length;
use crate::primitives::segments::{Rows, sum_rows_in};
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

const BLOCK: u32 = 64;

/// Numbers that a hit gives: to the three corners of its face.
const CORNERS: usize = 9;

/// What cotangents of distances and closest points mean for the points and the mesh.
#[derive(Clone, Debug)]
pub struct Cotangents<T> {
    /// `(N, 3)`, of the points.
    pub points: Buffer<T>,
    /// `(V, 3)`, of the vertices.
    pub vertices: Buffer<T>,
}

/// Pulls the `(N,)` cotangents of the distances, and the `(N, 3)` ones of the closest points if there are any, back to
/// the `(N, 3)` points and to the vertices; `hits` are those of [`forward`](super::query::forward) or
/// [`signed`](super::query::signed).
///
/// The sign and the closest face are held constant. Where a face is much thinner than the distance, its closest
/// point turns without bound as a corner moves: a direction in which it is thinner than `√ε` distances (`ε` of the
/// number type) is left out of the cotangent of the closest point.
///
/// # Errors
/// Those of the forward map, and arrays that do not fit together.
pub fn pullback<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    points: &Buffer<T>,
    hits: &Hits<T>,
    distance_bar: &Buffer<T>,
    point_bar: Option<&Buffer<T>>,
) -> Result<Cotangents<T>, Error> {
    mesh.check()?;
    let count = hits.triangles.len();
    check_length("the array of points", points, 3 * count)?;
    check_length("the cotangent of the distances", distance_bar, count)?;
    let points_bar: Buffer<T> = device.empty(3 * count)?;
    let shares: Buffer<T> = device.empty(CORNERS * count)?;
    let (groups, dim) = (device.groups(count, BLOCK), CubeDim::new_1d(BLOCK));
    pull_distances::launch::<T, R>(
        device.client(),
        groups.clone(),
        dim,
        hits.triangles.arg(),
        hits.gradients.arg(),
        hits.barycentric.arg(),
        distance_bar.arg(),
        points_bar.arg(),
        shares.arg(),
    );
    if let Some(point_bar) = point_bar {
        check_length("the cotangent of the closest points", point_bar, 3 * count)?;
        pull_closest_points::launch::<T, R>(
            device.client(),
            groups,
            dim,
            mesh.vertices.arg(),
            mesh.faces.arg(),
            points.arg(),
            hits.triangles.arg(),
            point_bar.arg(),
            points_bar.arg(),
            shares.arg(),
            T::of(<T as isograd::Real>::f64(<T as Float>::EPSILON).sqrt()),
        );
    }
    // A hit whose distance does not count may still have a closest point that does.
    let counts = point_bar.is_none().then_some(distance_bar);
    let (order, pieces) = by_face(device, mesh, &hits.triangles, counts)?;
    let (rows, places) = (Rows::dense(CORNERS), Some(&order));
    let of_faces = sum_rows_in(device, &shares, rows, places, pieces, count)?;
    Ok(Cotangents {
        points: points_bar,
        vertices: gather_corners(device, mesh, &of_faces)?,
    })
}

/// `d̄ ∇d` for each point, and `−β_k d̄ ∇d` for the corners of its face.
#[cube(launch)]
fn pull_distances<F: Float>(
    triangles: &Array<u32>,
    gradients: &Array<F>,
    barycentric: &Array<F>,
    bar: &Array<F>,
    points_bar: &mut Array<F>,
    shares: &mut Array<F>,
) {
    if ABSOLUTE_POS < triangles.len() {
        let pull = Vector3::<F>::at(gradients, ABSOLUTE_POS).scale(bar[ABSOLUTE_POS]);
        let weights = Vector3::<F>::at(barycentric, ABSOLUTE_POS);
        let at = 3 * ABSOLUTE_POS;
        pull.write(points_bar, ABSOLUTE_POS);
        pull.scale(-weights.x).write(shares, at);
        pull.scale(-weights.y).write(shares, at + 1);
        pull.scale(-weights.z).write(shares, at + 2);
    }
}

/// The closest point is `Σ β_k y_k`: `β_k` times the cotangent for each corner, and what moves `β`.
#[cube(launch)]
fn pull_closest_points<F: Float + CubeElement>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    points: &Array<F>,
    triangles: &Array<u32>,
    bar: &Array<F>,
    points_bar: &mut Array<F>,
    shares: &mut Array<F>,
    thinness: F,
) {
    let i = ABSOLUTE_POS;
    if i < triangles.len() {
        let t = corners::<F>(vertices, faces, triangles[i], Vector3::<F>::zero());
        let found = closest::<F>(t, Vector3::<F>::at(points, i));
        let own = Vector3::<F>::at(bar, i);
        let thinnest = thinness * found.offset.norm();
        let moved = tangent::<F>(t, found, gains::<F>(t, own), thinnest);
        let (g, w) = (moved.gamma, found.weights);
        let still = own.sub(moved.query);
        Vector3::<F>::at(points_bar, i)
            .add(moved.query)
            .write(points_bar, i);
        add_to_corner::<F>(shares, 3 * i, found.offset.scale(g.x), still.scale(w.x));
        add_to_corner::<F>(shares, 3 * i + 1, found.offset.scale(g.y), still.scale(w.y));
        add_to_corner::<F>(shares, 3 * i + 2, found.offset.scale(g.z), still.scale(w.z));
    }
}

#[cube]
fn add_to_corner<F: Float>(shares: &mut Array<F>, row: usize, a: Vector3<F>, b: Vector3<F>) {
    let before = Vector3::<F>::load(shares, 3 * row);
    before.add(a.add(b)).write(shares, row);
}
