//! Distance at any point, with and without a sign.

use cubecl::prelude::*;
use isograd::Grid;

use super::pseudonormals::{FEATURES, pseudonormals};
pub use super::query_pullback::{Cotangents, pullback};
use super::shares::gradient;
use super::tree::Tree;
use super::triangle::{closest, combine, corners};
use super::{Error, Mesh, search};
use crate::grid::{self, Lattice, check_field, place};
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

const BLOCK: u32 = 64;

/// Added to the number of a feature where the side is known without it.
const OUTSIDE: u32 = 8;
const INSIDE: u32 = 16;

/// What a mesh says about points.
#[derive(Clone, Debug)]
pub struct Hits<T> {
    /// `(N,)` distances, in the user's unit.
    pub distances: Buffer<T>,
    /// `(N, 3)` their gradients with respect to the points, of unit length: away from the closest point, or toward it
    /// where the distance is negative. At distance 0 the normal of the closest face. Zero only where that has
    /// no area.
    pub gradients: Buffer<T>,
    /// `(N, 3)` closest points of the mesh.
    pub points: Buffer<T>,
    /// `(N,)` faces that they lie on.
    pub triangles: Buffer<u32>,
    /// `(N, 3)` weights of the corners of that face at the closest point: not negative, their sum is 1.
    pub barycentric: Buffer<T>,
}

/// What the mesh says about each of the `(N, 3)` points, in their order, with distances without a sign. The points
/// must be finite.
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
        gradients: device.empty(3 * count)?,
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
        hits.gradients.arg(),
        hits.points.arg(),
        hits.barycentric.arg(),
    );
    Ok(hits)
}

/// The same with the sign of each side: negative inside, with the gradients turned toward the mesh there.
///
/// `field` is one that is negative inside, such as the distance on the lattice: where its eight values round a point
/// agree, they give the sign. Elsewhere, and without it, the pseudonormal of the closest feature does, which is right
/// for a closed mesh. Of an open mesh it tells the two sides near the surface and means nothing near its border.
///
/// # Errors
/// Those of [`forward`], and a field that does not fit its grid.
pub fn signed<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    points: &Buffer<T>,
    field: Option<(&Buffer<T>, &Grid<T>)>,
) -> Result<Hits<T>, Error> {
    let hits = forward(device, mesh, points)?;
    if let Some((values, grid)) = field {
        check_field("the field of signs", values, grid)?;
    }
    let count = hits.triangles.len();
    if count == 0 {
        return Ok(hits);
    }
    let (groups, dim) = (device.groups(count, BLOCK), CubeDim::new_1d(BLOCK));
    let features: Buffer<u32> = device.empty(count)?;
    find_features::launch::<T, R>(
        device.client(),
        groups.clone(),
        dim,
        mesh.vertices.arg(),
        mesh.faces.arg(),
        points.arg(),
        hits.triangles.arg(),
        features.arg(),
    );
    if let Some((values, grid)) = field {
        ask_field::launch::<T, R>(
            device.client(),
            groups.clone(),
            dim,
            points.arg(),
            values.arg(),
            features.arg(),
            grid::arg(grid),
        );
    }
    take_sides::launch::<T, R>(
        device.client(),
        groups,
        dim,
        features.arg(),
        hits.triangles.arg(),
        pseudonormals(device, mesh)?.arg(),
        hits.distances.arg(),
        hits.gradients.arg(),
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
    gradients: &mut Array<F>,
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
        gradient::<F>(found.offset, found.normal, false).write(gradients, ABSOLUTE_POS);
        combine::<F>(t, found.weights).write(on_mesh, ABSOLUTE_POS);
        found.weights.write(barycentric, ABSOLUTE_POS);
    }
}

/// The feature of the face that each closest point lies on.
#[cube(launch)]
fn find_features<F: Float>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    points: &Array<F>,
    triangles: &Array<u32>,
    features: &mut Array<u32>,
) {
    if ABSOLUTE_POS < features.len() {
        let zero = Vector3::<F>::zero();
        let t = corners::<F>(vertices, faces, triangles[ABSOLUTE_POS], zero);
        let found = closest::<F>(t, Vector3::<F>::at(points, ABSOLUTE_POS));
        features[ABSOLUTE_POS] = found.feature;
    }
}

/// Adds [`OUTSIDE`] or [`INSIDE`] to the feature of each point round which the field is of one sign.
#[cube(launch)]
fn ask_field<F: Float + CubeElement>(
    points: &Array<F>,
    field: &Array<F>,
    features: &mut Array<u32>,
    grid: Lattice<F>,
) {
    if ABSOLUTE_POS < features.len() {
        let p = place::<F>(points, ABSOLUTE_POS, &grid);
        let half = F::new(0.5);
        let (x, y, z) = (p.x - half, p.y - half, p.z - half);
        let within = is_between::<F>(x, grid.nx)
            && is_between::<F>(y, grid.ny)
            && is_between::<F>(z, grid.nz);
        if within {
            let (i, j, k) = (u32::cast_from(x), u32::cast_from(y), u32::cast_from(z));
            let mut inside = 0u32;
            for corner in 0u32..8u32 {
                let row = (i + (corner & 1u32)) * grid.ny + j + ((corner >> 1u32) & 1u32);
                let value = field[(row * grid.nz + k + (corner >> 2u32)) as usize];
                inside += select(value < F::new(0.0), 1u32, 0u32);
            }
            if inside == 0u32 {
                features[ABSOLUTE_POS] += OUTSIDE;
            }
            if inside == 8u32 {
                features[ABSOLUTE_POS] += INSIDE;
            }
        }
    }
}

/// Whether there are cell centers on both sides of `x`, counted from the first.
#[cube]
fn is_between<F: Float>(x: F, cells: u32) -> bool {
    x >= F::new(0.0) && x < F::cast_from(cells - 1u32)
}

/// Turns distances and gradients where the point is inside. At distance 0 the gradient is the normal of the face, or
/// where that has no area, that of the feature.
#[cube(launch)]
fn take_sides<F: Float>(
    features: &Array<u32>,
    triangles: &Array<u32>,
    normals: &Array<F>,
    distances: &mut Array<F>,
    gradients: &mut Array<F>,
) {
    if ABSOLUTE_POS < features.len() {
        let known = features[ABSOLUTE_POS] / OUTSIDE;
        let feature = (features[ABSOLUTE_POS] % OUTSIDE) as usize;
        let row = triangles[ABSOLUTE_POS] as usize * FEATURES + feature;
        let normal = Vector3::<F>::at(normals, row);
        let away = Vector3::<F>::at(gradients, ABSOLUTE_POS);
        let (zero, distance) = (F::new(0.0), distances[ABSOLUTE_POS]);
        let behind = normal.dot(away) < zero;
        let inside = (known == 0u32 && behind) || known == INSIDE / OUTSIDE;
        let turn = inside && distance > zero;
        distances[ABSOLUTE_POS] = select(turn, -distance, distance);
        let sign = select(turn, F::new(-1.0), F::new(1.0));
        let nowhere = away.dot(away) == zero;
        let gradient = normal.direction().choose(nowhere, away.scale(sign));
        gradient.write(gradients, ABSOLUTE_POS);
    }
}
