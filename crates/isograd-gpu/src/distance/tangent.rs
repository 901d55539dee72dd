//! Motion of the closest point of a triangle: the derivative of a value interpolated there, as on the CPU
//! (`isograd::distance::tangent`).
//!
//! With `o` the offset of the query from the closest point, `Σ β_k u_k` has the gradient `G` with respect to the
//! query, along the feature that holds the closest point, and `γ_k o − β_k G` with respect to corner `k`.

use cubecl::prelude::*;

use super::triangle::{Closest, Corners, FACE_ITSELF, first_corner, turned, turned_back};
use crate::vector::Vector3;

/// Gradient of the interpolated value.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Tangent<F: Float> {
    /// `G`.
    pub query: Vector3<F>,
    /// `γ` of the three corners; their sum is 0.
    pub gamma: Vector3<F>,
    /// Whether a bounded gradient was taken where the true one has no useful bound.
    pub guarded: bool,
}

/// Gradient of `Σ β_k u_k`, `β` the weights of the closest point `found`, for corner values that gain `gains` along
/// each edge (ab, bc, ca). A direction in which the feature is thinner than `thinnest` is left out.
#[cube]
pub(super) fn tangent<F: Float>(
    corners: Corners<F>,
    found: Closest<F>,
    gains: Vector3<F>,
    thinnest: F,
) -> Tangent<F> {
    let (zero, one) = (F::new(0.0), F::new(1.0));
    let of_face = found.feature == FACE_ITSELF;
    let of_vertex = found.feature < 3u32;
    // Of a face, its longest edge is the base; else its apex does not count.
    let first = select(of_face, first_corner::<F>(corners), found.feature % 3u32);
    let t = turned::<F>(corners, first);
    // Of the edges from the first on.
    let ahead = turned_back::<F>(gains, (3u32 - first) % 3u32);
    let base = t.ab.norm();
    let has_base = base > thinnest && !of_vertex;
    let length = select(has_base, base, one);
    let unit = t.ab.scale(one / length);
    let slope = select(has_base, ahead.x / length, zero);
    let to_apex = t.ca.scale(F::new(-1.0));
    let foot = unit.dot(to_apex);
    let rest = to_apex.sub(unit.scale(foot));
    // Once more, so that nothing along the base is left in a thin face.
    let across = rest.sub(unit.scale(unit.dot(rest)));
    let rise = across.norm();
    let has_height = of_face && has_base && rise > thinnest;
    let height = select(has_height, rise, one);
    let climb = (-ahead.z - foot * slope) / height;
    let of_apex = select(has_height, climb / height, zero);
    let of_second = select(has_base, (slope - of_apex * foot) / length, zero);
    let gamma = Vector3::<F>::of(-(of_apex + of_second), of_second, of_apex);
    Tangent::<F> {
        query: unit.scale(slope).add(across.scale(of_apex)),
        gamma: turned_back::<F>(gamma, first),
        guarded: (!has_base && !of_vertex && ahead.x != zero)
            || (of_face && !has_height && ahead.z != zero),
    }
}
