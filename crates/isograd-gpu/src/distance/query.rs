//! Distance at any point.

use cubecl::prelude::*;

use super::shares::{FACE, add_share, by_face, gather_corners, gradient};
use super::tree::Tree;
use super::triangle::{closest, combine, corners};
use super::{Error, Mesh, search};
use crate::device::check_length;
use crate::primitives::segments::{NO_SEGMENT, join_pieces};
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

const BLOCK: u32 = 64;

/// What a mesh says about points.
#[derive(Clone, Debug)]
pub struct Hits<T> {
    /// `(N,)` distances, in the user's unit, without a sign.
    pub distances: Buffer<T>,
    /// `(N, 3)` closest points of the mesh.
    pub points: Buffer<T>,
    /// `(N,)` faces that they lie on.
    pub triangles: Buffer<u32>,
    /// `(N, 3)` weights of the corners of that face at the closest point: not negative, their sum is 1.
    pub barycentric: Buffer<T>,
}

/// What cotangents of the distances mean for the points and the mesh.
#[derive(Clone, Debug)]
pub struct Cotangents<T> {
    /// `(N, 3)`, of the points.
    pub points: Buffer<T>,
    /// `(V, 3)`, of the vertices.
    pub vertices: Buffer<T>,
}

/// What the mesh says about each of the `(N, 3)` points, in their order. The points must be finite.
///
/// # Errors
/// [`Error::Empty`], [`Error::Triples`], and those of the device.
pub fn forward<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    points: &Buffer<T>,
) -> Result<Hits<T>, Error> {
    device.check_number::<T>()?;
    mesh.check()?;
    if !points.len().is_multiple_of(3) {
        return Err(Error::Triples {
            what: "the array of points",
            length: points.len(),
        });
    }
    let count = points.len() / 3;
    let mut hits = Hits {
        distances: device.empty(count)?,
        points: device.empty(3 * count)?,
        triangles: device.empty(count)?,
        barycentric: device.empty(3 * count)?,
    };
    if count == 0 {
        return Ok(hits);
    }
    let tree = Tree::new(device, mesh, [T::of(0.0); 3])?;
    hits.triangles = search::points(device, &tree, points)?;
    measure_points::launch::<T, R>(
        device.client(),
        device.groups(count, BLOCK),
        CubeDim::new_1d(BLOCK),
        mesh.vertices.arg(),
        mesh.faces.arg(),
        points.arg(),
        hits.triangles.arg(),
        hits.distances.arg(),
        hits.points.arg(),
        hits.barycentric.arg(),
    );
    Ok(hits)
}

/// Pulls the `(N,)` cotangents of the distances back to the `(N, 3)` points and to the vertices; `hits` are those
/// of [`forward`]. For a signed distance, give the cotangents times the sign. At distance 0 the slope is the
/// normal of the face.
///
/// # Errors
/// Those of [`forward`], and arrays that do not fit together.
pub fn pullback<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    points: &Buffer<T>,
    hits: &Hits<T>,
    distance_bar: &Buffer<T>,
) -> Result<Cotangents<T>, Error> {
    mesh.check()?;
    let count = hits.triangles.len();
    check_length("the array of points", points, 3 * count)?;
    check_length("the cotangent of the distances", distance_bar, count)?;
    let points_bar = device.empty(3 * count)?;
    pull_to_points::launch::<T, R>(
        device.client(),
        device.groups(count, BLOCK),
        CubeDim::new_1d(BLOCK),
        mesh.vertices.arg(),
        mesh.faces.arg(),
        points.arg(),
        hits.triangles.arg(),
        distance_bar.arg(),
        points_bar.arg(),
    );
    let (order, pieces) = by_face(device, mesh, &hits.triangles, distance_bar)?;
    let sums = device.empty(pieces.most() * FACE)?;
    pull_to_faces::launch::<T, R>(
        device.client(),
        device.groups(pieces.most(), BLOCK),
        CubeDim::new_1d(BLOCK),
        mesh.vertices.arg(),
        mesh.faces.arg(),
        points.arg(),
        distance_bar.arg(),
        order.arg(),
        pieces.table.arg(),
        sums.arg(),
        pieces.most() as u32,
    );
    let of_faces = join_pieces(device, sums, FACE, pieces, count)?;
    Ok(Cotangents {
        points: points_bar,
        vertices: gather_corners(device, mesh, &of_faces)?,
    })
}

#[cube(launch)]
fn measure_points<F: Float>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    points: &Array<F>,
    triangles: &Array<u32>,
    distances: &mut Array<F>,
    on_mesh: &mut Array<F>,
    barycentric: &mut Array<F>,
) {
    if ABSOLUTE_POS < triangles.len() {
        let t = corners::<F>(
            vertices,
            faces,
            triangles[ABSOLUTE_POS],
            Vector3::<F>::zero(),
        );
        let found = closest::<F>(t, Vector3::<F>::at(points, ABSOLUTE_POS));
        distances[ABSOLUTE_POS] = found.offset.norm();
        combine::<F>(t, found.weights).write(on_mesh, ABSOLUTE_POS);
        found.weights.write(barycentric, ABSOLUTE_POS);
    }
}

#[cube(launch)]
fn pull_to_points<F: Float>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    points: &Array<F>,
    triangles: &Array<u32>,
    bar: &Array<F>,
    points_bar: &mut Array<F>,
) {
    if ABSOLUTE_POS < triangles.len() {
        let t = corners::<F>(
            vertices,
            faces,
            triangles[ABSOLUTE_POS],
            Vector3::<F>::zero(),
        );
        let found = closest::<F>(t, Vector3::<F>::at(points, ABSOLUTE_POS));
        let slope = gradient::<F>(found.offset, found.normal, false);
        slope
            .scale(bar[ABSOLUTE_POS])
            .write(points_bar, ABSOLUTE_POS);
    }
}

/// `−Σ β_k d̄ ∇d` for the corners of a face, over a piece of its points.
#[cube(launch)]
fn pull_to_faces<F: Float>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    points: &Array<F>,
    bar: &Array<F>,
    order: &Array<u32>,
    table: &Array<u32>,
    sums: &mut Array<F>,
    most: u32,
) {
    if ABSOLUTE_POS < most as usize {
        let face = table[ABSOLUTE_POS * 3];
        if face != NO_SEGMENT {
            let t = corners::<F>(vertices, faces, face, Vector3::<F>::zero());
            let mut sum = Array::<F>::new(FACE);
            for number in 0..FACE {
                sum[number] = F::new(0.0);
            }
            for element in table[ABSOLUTE_POS * 3 + 1]..table[ABSOLUTE_POS * 3 + 2] {
                let point = order[element as usize];
                let found = closest::<F>(t, Vector3::<F>::at(points, point as usize));
                add_share::<F>(&mut sum, found, false, bar[point as usize]);
            }
            for number in 0..FACE {
                sums[ABSOLUTE_POS * FACE + number] = sum[number];
            }
        }
    }
}
