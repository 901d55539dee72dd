//! Directions that tell inside from outside at the edges and corners of a mesh: as on the CPU, the pseudonormal of
//! an edge is the sum of the normals of its faces, that of a vertex the sum weighted by the angles of the faces
//! there (J. A. Bærentzen and H. Aanæs, IEEE TVCG 11, 2005). Faces must share their vertices, by index.
//!
//! The sides of all faces are sorted by their two vertices, so that those of one edge follow each other; the
//! corners by their vertex. The sums are cut into pieces, however many faces meet.

use cubecl::prelude::*;

use super::shares::gather_corners;
use super::triangle::{FACE_ITSELF, closest, corners};
use super::{Error, Mesh};
use crate::neighbors::gather;
use crate::primitives::scan::exclusive_sum;
use crate::primitives::segments::{Rows, sum_rows};
use crate::primitives::sort;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

const BLOCK: u32 = 256;

/// Vectors of a face: of its corners, of its edges (from each corner to the next), and its own normal. By the number
/// of the feature.
pub(super) const FEATURES: usize = 7;

/// The pseudonormals of all features of all faces, `(F, 7, 3)`, not of unit length. A face without area adds nothing.
pub(super) fn pseudonormals<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
) -> Result<Buffer<T>, Error> {
    let faces = mesh.faces.len() / 3;
    let normals: Buffer<T> = device.empty(3 * faces)?;
    let weighted: Buffer<T> = device.empty(9 * faces)?;
    let dim = CubeDim::new_1d(BLOCK);
    weigh_normals::launch::<T, R>(
        device.client(),
        device.groups(faces, BLOCK),
        dim,
        mesh.vertices.arg(),
        mesh.faces.arg(),
        normals.arg(),
        weighted.arg(),
    );
    let at_vertices = gather_corners(device, mesh, &weighted)?;
    let sides = Sides::new(device, mesh)?;
    let (by_face, starts) = (Some(&sides.faces), &sides.starts);
    let at_edges = sum_rows(device, &normals, Rows::dense(3), by_face, starts, 3 * faces)?;
    let all = device.empty(3 * FEATURES * faces)?;
    list_features::launch::<T, R>(
        device.client(),
        device.groups(FEATURES * faces, BLOCK),
        dim,
        mesh.faces.arg(),
        normals.arg(),
        at_vertices.arg(),
        at_edges.arg(),
        sides.edges.arg(),
        all.arg(),
    );
    Ok(all)
}

/// The sides of all faces, `3f + k` from corner `k` to the next, in the order of their edges.
struct Sides {
    /// Where the sides of each edge begin; as many edges as there are sides, the last ones without any.
    starts: Buffer<u32>,
    /// The face of each side in that order.
    faces: Buffer<u32>,
    /// The edge of each side, by its number.
    edges: Buffer<u32>,
}

impl Sides {
    fn new<T: Scalar, R: Runtime>(device: &Device<R>, mesh: &Mesh<T>) -> Result<Self, Error> {
        let (count, vertices) = (mesh.faces.len(), mesh.vertices.len() as u32 / 3);
        let (groups, dim) = (device.groups(count, BLOCK), CubeDim::new_1d(BLOCK));
        let (low, high): (Buffer<u32>, Buffer<u32>) = (device.empty(count)?, device.empty(count)?);
        name_sides::launch::<R>(
            device.client(),
            groups.clone(),
            dim,
            mesh.faces.arg(),
            low.arg(),
            high.arg(),
        );
        let by_high = sort::order(device, &high, vertices)?.places;
        let by_both = sort::order(device, &gather(device, &low, &by_high, 1)?, vertices)?.places;
        let places = gather(device, &by_high, &by_both, 1)?;
        let flags: Buffer<u32> = device.empty(count)?;
        flag_edges::launch::<R>(
            device.client(),
            groups.clone(),
            dim,
            low.arg(),
            high.arg(),
            places.arg(),
            flags.arg(),
        );
        let before = exclusive_sum(device, &flags)?;
        let numbers: Buffer<u32> = device.empty(count)?;
        let (faces, edges) = (device.empty(count)?, device.empty(count)?);
        number_sides::launch::<R>(
            device.client(),
            groups,
            dim,
            places.arg(),
            before.arg(),
            numbers.arg(),
            faces.arg(),
            edges.arg(),
        );
        Ok(Self {
            starts: sort::starts(device, &numbers, count as u32)?,
            faces,
            edges,
        })
    }
}

/// The normal of each face, and that times its angles.
#[cube(launch)]
fn weigh_normals<F: Float>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    normals: &mut Array<F>,
    weighted: &mut Array<F>,
) {
    if ABSOLUTE_POS < faces.len() / 3 {
        let zero = Vector3::<F>::zero();
        let t = corners::<F>(vertices, faces, ABSOLUTE_POS as u32, zero);
        let normal = closest::<F>(t, t.a).normal;
        normal.write(normals, ABSOLUTE_POS);
        let at = 3 * ABSOLUTE_POS;
        let (ab, bc, ca) = (t.ab.direction(), t.bc.direction(), t.ca.direction());
        normal.scale(angle::<F>(ab, ca)).write(weighted, at);
        normal.scale(angle::<F>(bc, ab)).write(weighted, at + 1);
        normal.scale(angle::<F>(ca, bc)).write(weighted, at + 2);
    }
}

/// The angle at a corner, in radians, between the unit vectors of the edge that leaves it and of the one that comes
/// to it. In single precision: only signs depend on it, and those of an angle-weighted sum not on its last digits.
#[cube]
fn angle<F: Float>(out: Vector3<F>, back: Vector3<F>) -> F {
    let across = f32::cast_from(out.cross(back).norm());
    let along = f32::cast_from(-out.dot(back));
    F::cast_from(across.atan2(along))
}

/// The two vertices of each side.
#[cube(launch)]
fn name_sides(faces: &Array<u32>, low: &mut Array<u32>, high: &mut Array<u32>) {
    if ABSOLUTE_POS < faces.len() {
        let first = ABSOLUTE_POS / 3 * 3;
        let a = faces[ABSOLUTE_POS];
        let b = faces[first + (ABSOLUTE_POS - first + 1) % 3];
        low[ABSOLUTE_POS] = min(a, b);
        high[ABSOLUTE_POS] = max(a, b);
    }
}

/// 1 where a side has another edge than the one before it.
#[cube(launch)]
fn flag_edges(low: &Array<u32>, high: &Array<u32>, places: &Array<u32>, flags: &mut Array<u32>) {
    if ABSOLUTE_POS < flags.len() {
        let own = places[ABSOLUTE_POS] as usize;
        let other = places[ABSOLUTE_POS - min(ABSOLUTE_POS, 1)] as usize;
        let same = low[own] == low[other] && high[own] == high[other];
        flags[ABSOLUTE_POS] = select(same, 0u32, 1u32);
    }
}

/// Edges in the order of their sides.
#[cube(launch)]
fn number_sides(
    places: &Array<u32>,
    before: &Array<u32>,
    numbers: &mut Array<u32>,
    faces: &mut Array<u32>,
    edges: &mut Array<u32>,
) {
    if ABSOLUTE_POS < places.len() {
        let side = places[ABSOLUTE_POS];
        let edge = before[ABSOLUTE_POS + 1];
        numbers[ABSOLUTE_POS] = edge;
        faces[ABSOLUTE_POS] = side / 3u32;
        edges[side as usize] = edge;
    }
}

/// What is known of each feature of each face, side by side.
#[cube(launch)]
fn list_features<F: Float>(
    faces: &Array<u32>,
    normals: &Array<F>,
    at_vertices: &Array<F>,
    at_edges: &Array<F>,
    edges: &Array<u32>,
    all: &mut Array<F>,
) {
    if ABSOLUTE_POS < all.len() / 3 {
        let face = ABSOLUTE_POS / FEATURES;
        let feature = (ABSOLUTE_POS % FEATURES) as u32;
        let corner = 3 * face + (feature % 3u32) as usize;
        if feature == FACE_ITSELF {
            Vector3::<F>::at(normals, face).write(all, ABSOLUTE_POS);
        } else if feature < 3u32 {
            Vector3::<F>::at(at_vertices, faces[corner] as usize).write(all, ABSOLUTE_POS);
        } else {
            Vector3::<F>::at(at_edges, edges[corner] as usize).write(all, ABSOLUTE_POS);
        }
    }
}
