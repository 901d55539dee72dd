//! The pullback of the integrals of a mesh: area and enclosed volume → vertices.

use super::measure::center;
use crate::data::Mesh;
use crate::gather::{Buckets, add_to};
use crate::vector::{add, cross, normalized, scale, sub, to_f64};
use crate::{Real, parallel};

/// Adds `area_bar ∂A/∂y + volume_bar ∂V/∂y` to the cotangent `(V, 3)` of the vertices, with the
/// [area](super::Measures::area) `A` and the signed [volume](super::Measures::volume) `V` of the mesh. Returns
/// the number of faces without area, if `area_bar` is not 0.
///
/// With `n` the unit normal of a face `(a, b, c)`, `ā += A̅ (b − c) × n / 2` and `ā += V̅ b × c / 6`, and so on round
/// the face. Positive where faces are counter-clockwise seen from outside. The unit of the
/// cotangent of a vertex is length for the area, length² for the volume, times those of the arguments.
///
/// `vertices_bar` is first extended to its length with zeros and may be empty. Sums run
/// in double precision and in a fixed order: the same bits for any number of threads.
///
/// # Not differentiable
/// A face without area: its area grows in whichever direction a corner leaves the line. It is left out of the area
/// and counted. For an open mesh, the apex of its volume is held constant.
pub fn pullback<T: Real>(
    mesh: &Mesh<T>,
    area_bar: f64,
    volume_bar: f64,
    vertices_bar: &mut Vec<[T; 3]>,
) -> usize {
    vertices_bar.resize(mesh.vertices().len(), [T::zero(); 3]);
    let origin = center(mesh.vertices());
    let corners = |face: usize| mesh.corners(face).map(|p| sub(to_f64(p), origin));
    let mut faces_of = Buckets::default();
    faces_of.fill_with_faces(mesh);
    let out_of_range = add_to(vertices_bar, |vertex| {
        let mut sum = [0.0; 3];
        faces_of.for_each_corner(mesh.faces(), vertex, |face, corner| {
            sum = add(sum, at_corner(corners(face), corner, area_bar, volume_bar));
        });
        sum
    });
    if area_bar == 0.0 {
        return out_of_range;
    }
    let [flat] = parallel::sum_array(mesh.faces().len(), |face| {
        let flat = normalized(twice_normal(corners(face))).is_none();
        [f64::from(u8::from(flat))]
    });
    out_of_range + flat as usize
}

/// Cotangent of corner `k` of a face.
fn at_corner(corners: [[f64; 3]; 3], k: usize, area_bar: f64, volume_bar: f64) -> [f64; 3] {
    let (b, c) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
    let of_volume = scale(cross(b, c), volume_bar / 6.0);
    match normalized(twice_normal(corners)) {
        Some(n) => add(of_volume, scale(cross(sub(b, c), n), area_bar / 2.0)),
        None => of_volume,
    }
}

/// The normal of a face, as long as twice its area.
fn twice_normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    cross(sub(b, a), sub(c, a))
}
