//! Derivative of a value interpolated at the closest point of a triangle.
//!
//! Let `y_0` be a corner of the feature (face, edge or vertex) that holds the closest point `p` of `q`, `E` the
//! columns `y_k − y_0` for its other corners, `o = q − p`, and `δ_k = u_k − u_0` the differences of a linear
//! function. Then `Σ β_k u_k` has the gradient `G = E γ`, `γ = (EᵀE)⁻¹ δ`, with respect to `q`, and
//! `ȳ_k = γ_k o − β_k G`, `ȳ_0 = −(Σ_k γ_k o + β_0 G)` with respect to the corners.

use super::triangle::{Closest, Feature};
use crate::vector::{add, dot, norm, scale, sub};

/// Gradient of the interpolated value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tangent {
    /// With respect to the query.
    pub query: [f64; 3],
    /// With respect to the corners.
    pub corners: [[f64; 3]; 3],
    /// Whether a direction without a useful bound was left out.
    pub guarded: bool,
}

/// Gradient of `Σ β_k u_k` for the corner values `values`.
///
/// A direction in which the feature is thinner than `thinnest` is left out: `G` is divided by the thickness, `γ` by
/// its square.
pub(super) fn tangent(
    closest: &Closest,
    corners: [[f64; 3]; 3],
    values: [f64; 3],
    thinnest: f64,
) -> Tangent {
    let mut tangent = Tangent::default();
    let gamma = match closest.feature {
        Feature::Vertex(_) => return tangent,
        Feature::Edge(k) => of_edge(corners, values, k, thinnest, &mut tangent),
        Feature::Face => of_face(corners, values, thinnest, &mut tangent),
    };
    for k in 0..3 {
        tangent.corners[k] = sub(
            scale(closest.offset, gamma[k]),
            scale(tangent.query, closest.barycentric[k]),
        );
    }
    tangent
}

/// Writes `G` of the edge from corner `k` to the next, and returns `γ` of all three corners; their sum is 0.
fn of_edge(
    corners: [[f64; 3]; 3],
    values: [f64; 3],
    k: usize,
    thinnest: f64,
    tangent: &mut Tangent,
) -> [f64; 3] {
    let next = (k + 1) % 3;
    let along = sub(corners[next], corners[k]);
    let length = norm(along);
    let rise = values[next] - values[k];
    let mut gamma = [0.0; 3];
    if !(length > thinnest) {
        tangent.guarded = rise != 0.0;
        return gamma;
    }
    // The unit vector first: the square of a length may leave the range of numbers where the length does not.
    let unit = scale(along, 1.0 / length);
    tangent.query = scale(unit, rise / length);
    gamma[next] = rise / length / length;
    gamma[k] = -gamma[next];
    gamma
}

/// Like [`of_edge`] for the face, in the orthonormal frame of its longest edge, which is accurate for slivers too.
fn of_face(
    corners: [[f64; 3]; 3],
    values: [f64; 3],
    thinnest: f64,
    tangent: &mut Tangent,
) -> [f64; 3] {
    let side = |k: usize| sub(corners[(k + 1) % 3], corners[k]);
    let lengths = [0, 1, 2].map(|k| norm(side(k)));
    let first = (1..3).fold(0, |m, k| if lengths[k] > lengths[m] { k } else { m });
    let (second, apex) = ((first + 1) % 3, (first + 2) % 3);
    let base = lengths[first];
    let unit = scale(side(first), 1.0 / base);
    let to_apex = sub(corners[apex], corners[first]);
    let foot = dot(unit, to_apex);
    let across = sub(to_apex, scale(unit, foot));
    // Once more, so that nothing along the base is left in a thin face.
    let across = sub(across, scale(unit, dot(unit, across)));
    let height = norm(across);
    if !(height > thinnest) {
        let gamma = of_edge(corners, values, first, thinnest, tangent);
        tangent.guarded |= values[apex] != values[first];
        return gamma;
    }
    let slope = (values[second] - values[first]) / base;
    let rise = (values[apex] - values[first] - foot * slope) / height;
    tangent.query = add(scale(unit, slope), scale(across, rise / height));
    let mut gamma = [0.0; 3];
    gamma[apex] = rise / height;
    gamma[second] = (slope - gamma[apex] * foot) / base;
    gamma[first] = -(gamma[apex] + gamma[second]);
    gamma
}
