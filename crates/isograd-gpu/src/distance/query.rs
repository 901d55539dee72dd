//! Distance at any point.

use cubecl::prelude::*;

use super::tree::Tree;
use super::triangle::{closest, combine, corners};
use super::vector::{load, norm, zero};
use super::{Error, Mesh, search};
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
        let t = corners::<F>(vertices, faces, triangles[ABSOLUTE_POS], zero::<F>());
        let found = closest::<F>(t, load::<F>(points, ABSOLUTE_POS as u32));
        distances[ABSOLUTE_POS] = norm::<F>(found.offset);
        let place = combine::<F>(t, found.weights);
        let at = ABSOLUTE_POS * 3;
        on_mesh[at] = place.x;
        on_mesh[at + 1] = place.y;
        on_mesh[at + 2] = place.z;
        barycentric[at] = found.weights.x;
        barycentric[at + 1] = found.weights.y;
        barycentric[at + 2] = found.weights.z;
    }
}
