//! Axes that are far from those their signs were found for.
//!
//! The automatic method finds the sign of the sheet that a sample lies on, and the axis has that side. Beside an edge the two
//! may be perpendicular: D-PCA has taken most neighbors from the other face. Then neighbors decide, as where an axis has turned
//! far between two steps of a [moving body](super::previous).

use super::signs::{Decision, Verdict};
use super::{Orientation, take_verdict};
use crate::element::turned;
use crate::neighbors::Neighborhoods;
use crate::{Real, vector};

/// Whether an axis is far from the one that its sign was found for, by their cosine.
pub(super) fn is_far(cosine: f64) -> bool {
    !(cosine.abs() >= f64::from(turned::FAR))
}

/// Turns the axes `far` in input order, each with the verdict for another axis, to the sides that their neighbors have, which
/// must be in `out`; without such neighbors as the verdict says.
pub(super) fn take_sides_of_neighbors<T: Real>(
    far: &[(usize, Verdict)],
    points: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
    out: &mut Orientation<T>,
) {
    if far.is_empty() {
        return;
    }
    let mut has_sign = vec![true; points.len()];
    far.iter().for_each(|&(i, _)| has_sign[i] = false);
    for &(i, found) in far {
        let side = side_among_neighbors(i, points, neighborhoods, &out.normals, |j| has_sign[j]);
        let verdict = match side == 0.0 {
            true => found,
            false => Verdict {
                flip: side < 0.0,
                confidence: found.confidence.min(side.abs() as f32),
                by: Decision::Neighbors,
            },
        };
        take_verdict(i, verdict, out);
    }
}

/// Evidence for the axis of point `i`, from −1 to 1, from the `normals` of its neighbors that have a sign; 0 without such
/// neighbors.
pub(super) fn side_among_neighbors<T: Real>(
    i: usize,
    points: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
    normals: &[[T; 3]],
    has_sign: impl Fn(usize) -> bool,
) -> f64 {
    let axis = vector::to_f64(normals[i]);
    let radius = neighborhoods.radius[i];
    let blunt = turned::blunt(radius.f64());
    let (mut sum, mut weight) = (0.0, 0.0);
    let index = &neighborhoods.index;
    index.for_each_within(points[i], radius, |j, distance_squared| {
        if has_sign(j) {
            let offset = vector::to_f64(vector::sub(points[j], points[i]));
            let normal = vector::to_f64(normals[j]);
            let near = turned::weight(distance_squared.f64(), blunt);
            let [axis_along, normal_along] = [axis, normal].map(|v| vector::dot(v, offset));
            let parallel = vector::dot(axis, normal);
            sum += near * turned::carried(parallel, axis_along, normal_along, near);
            weight += near;
        }
    });
    if weight > 0.0 { sum / weight } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use crate::orient::Method;
    use crate::orient::shapes::{cuboid, neighborhoods, oriented};
    use crate::vector::{dot, norm};

    /// Axes beside an edge that are those of the other face, tilted to either side of their own.
    #[test]
    fn axes_of_the_other_face_have_its_side() {
        let (points, normals) = cuboid(6000, [1.0; 3], 3);
        let near = neighborhoods(&points);
        let spacing = near.spacing();
        let mut axes = normals.clone();
        let mut others = Vec::new();
        for (i, point) in points.iter().enumerate() {
            let is_beside = |a: &usize| 1.0 - point[*a].abs() < 0.2 * spacing;
            let beside: Vec<usize> = (0..3).filter(is_beside).collect();
            // Its own face and another one.
            let [a, b] = beside[..] else { continue };
            let other = if normals[i][a] == 0.0 { a } else { b };
            let mut axis = normals[i].map(|x| {
                if others.len() % 2 == 0 {
                    0.1 * x
                } else {
                    -0.1 * x
                }
            });
            axis[other] = point[other].signum();
            axes[i] = axis.map(|x| x / norm(axis));
            others.push(i);
        }
        assert!(others.len() > 100);
        let out = oriented(&points, &axes, &near, None, &Method::Auto).expect("axes");
        let wrong = others
            .iter()
            .filter(|&&i| dot(out.normals[i], axes[i]) < 0.0);
        let wrong = wrong.count();
        assert!(50 * wrong <= others.len(), "{wrong} of {}", others.len());
    }
}
