//! Cotangents of the corners of closest faces, and their sums at the vertices.

use cubecl::prelude::*;

use super::Mesh;
use super::triangle::Closest;
use crate::device::{Argument, launch};
use crate::primitives::segments::{Pieces, Rows, sum_rows};
use crate::primitives::sort;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Numbers that a face has: the cotangents of its three corners, and one for the caller.
pub(super) const FACE: usize = 10;

/// Queries in the order of their closest faces.
pub(super) struct ByFace {
    order: Buffer<u32>,
    pub pieces: Pieces,
}

/// [`ByFace`] in kernels, with a unit for each piece.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct ByFaceArrays {
    pub order: Array<u32>,
    /// `(P, 3)` face, first place in the order, and one past the last.
    pub table: Array<u32>,
}

impl<R: Runtime> Argument<R> for ByFace {
    type Parameter = ByFaceArraysLaunch<R>;

    fn argument(&self, _: &Device<R>) -> Self::Parameter {
        ByFaceArraysLaunch::new(self.order.arg(), self.pieces.table.arg())
    }
}

/// The queries in the order of their closest faces, without those whose cotangent is zero where `bar` is given, and
/// the pieces that they are summed in.
pub(super) fn by_face<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    closest: &Buffer<u32>,
    bar: Option<&Buffer<T>>,
) -> Result<ByFace, Error> {
    let (count, faces) = (closest.len(), mesh.faces.len() as u32 / 3);
    let keys = device.empty(count)?;
    launch!(device, count => key_queries<T>(
        closest, bar.unwrap_or(&device.empty(0)?), keys, faces, bar.is_none(),
    ));
    let order = sort::order(device, &keys, faces + 1)?;
    let starts = sort::starts(device, &order.keys, faces)?;
    let pieces = Pieces::new(device, &starts, count)?;
    let order = order.places;
    Ok(ByFace { order, pieces })
}

/// The corners of the faces, by vertex.
pub(super) struct Corners {
    places: Buffer<u32>,
    starts: Buffer<u32>,
}

impl Corners {
    pub fn of<T: Scalar, R: Runtime>(device: &Device<R>, mesh: &Mesh<T>) -> Result<Self, Error> {
        let vertices = mesh.vertices.len() as u32 / 3;
        let corners = sort::order(device, &mesh.faces, vertices)?;
        let starts = sort::starts(device, &corners.keys, vertices)?;
        let places = corners.places;
        Ok(Self { places, starts })
    }

    /// The sum over the corners at each vertex, `(V, width)`; `of_faces` begins the row of each face with its three
    /// corners.
    pub fn sum<T: Scalar, R: Runtime>(
        &self,
        device: &Device<R>,
        of_faces: &Buffer<T>,
        width: usize,
    ) -> Result<Buffer<T>, Error> {
        let count = self.places.len();
        let rows = Rows {
            width,
            group: 3,
            pitch: of_faces.len() / (count / 3),
        };
        let places = Some(&self.places);
        sum_rows(device, of_faces, rows, places, &self.starts, count)
    }
}

/// The closest face of each query whose cotangent counts; else one past the last.
#[cube(launch)]
fn key_queries<F: Float>(
    found: &Array<u32>,
    phi_bar: &Array<F>,
    keys: &mut Array<u32>,
    faces: u32,
    #[comptime] all: bool,
) {
    if ABSOLUTE_POS < keys.len() {
        let mut key = min(found[ABSOLUTE_POS], faces);
        if comptime!(!all) {
            key = select(phi_bar[ABSOLUTE_POS] == F::new(0.0), faces, key);
        }
        keys[ABSOLUTE_POS] = key;
    }
}

/// Adds what one query gives the corners of its face, `−β_k φ̄ ∇φ`, and returns `φ̄ ∇φ`.
#[cube]
pub(super) fn add_share<F: Float>(
    sum: &mut Array<F>,
    found: Closest<F>,
    inside: bool,
    bar: F,
) -> Vector3<F> {
    let slope = gradient::<F>(found.offset, found.normal, inside);
    let pull = slope.scale(bar);
    pull.scale(-found.weights.x).add_to(sum, 0usize);
    pull.scale(-found.weights.y).add_to(sum, 3usize);
    pull.scale(-found.weights.z).add_to(sum, 6usize);
    pull
}

/// `∇φ`: away from the closest point outside, toward it inside, and the normal of the face at distance 0.
#[cube]
pub(super) fn gradient<F: Float>(
    offset: Vector3<F>,
    normal: Vector3<F>,
    inside: bool,
) -> Vector3<F> {
    let away = offset.direction();
    let sign = select(inside, F::new(-1.0), F::new(1.0));
    let on_mesh = away.dot(away) == F::new(0.0);
    normal.choose(on_mesh, away.scale(sign))
}
