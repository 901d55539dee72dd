//! Samples with sheets on both sides, as in a stack of plates.
//!
//! A sheet close to a sample is the other side of a thin body, or of a narrow gap. With another sheet on the other side,
//! not much farther away, both are at hand, and that the body is the thinner of the two is no more than a guess: it holds
//! for fins, and not for plates thicker than the gaps between them.

use super::evidence;
use super::graph::{Graph, SecondSheet};
use super::signs::Place;
use crate::vector;

/// A third sheet is looked for this far from a sample, in distances of the second sheet: from beyond the own sheet, up to
/// where plates are mostly so thick that the fill resolves them.
const NEAR: f64 = 0.5;
const FAR: f64 = 5.0;

/// Least cosine between the axes of two sheets that face each other: 45°.
const PARALLEL: f32 = 0.7;

/// Samples around any place.
pub(super) trait Surroundings: Place {
    /// Visits the samples within a radius of a place, in the unit of the user.
    fn for_each_within(&self, center: [f64; 3], radius: f64, visit: impl FnMut(usize));
}

/// Whether a sample lies between its [second sheet](Graph::second_sheet), if that matters, and a third one.
pub(super) fn is_between(
    graph: &Graph,
    place: &impl Surroundings,
    p: usize,
    second: SecondSheet,
) -> bool {
    if !evidence::differs(second.evidence, 0.0) {
        return false;
    }
    let away = vector::scale(graph.axis[p], second.evidence.signum());
    let distance = f64::from(second.distance) * place.spacing();
    let (here, away) = (place.user(p), vector::to_f64(away));
    let center = vector::scale(away, 0.5 * (NEAR + FAR) * distance);
    let mut found = false;
    place.for_each_within(
        vector::add(here, center),
        0.5 * (FAR - NEAR) * distance,
        |q| {
            let height = vector::dot(away, vector::sub(place.user(q), here));
            let cosine = vector::dot(graph.axis[p], graph.axis[q]);
            found |= height > NEAR * distance && cosine.abs() > PARALLEL;
        },
    );
    found
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{Sampled, graph, join, plate};
    use super::*;

    impl Surroundings for Vec<[f64; 3]> {
        fn for_each_within(&self, center: [f64; 3], radius: f64, mut visit: impl FnMut(usize)) {
            let is_near = |x: &[f64; 3]| vector::norm(vector::sub(*x, center)) <= radius;
            let near = (0..).zip(self).filter(|(_, x)| is_near(x));
            near.for_each(|(q, _)| visit(q));
        }
    }

    /// Shares of the samples that lie between two sheets: of those on the lowest and highest face, and on all others, away
    /// from edges.
    fn between(sampled: &Sampled) -> [f64; 2] {
        let (graph, place) = (graph(sampled), &sampled.0);
        let heights = || place.iter().map(|x| x[2]);
        let ends = [
            heights().fold(f64::MAX, f64::min),
            heights().fold(f64::MIN, f64::max),
        ];
        let mut counts = [[0; 2]; 2];
        for p in 0..place.len() {
            let [x, y, z] = place[p];
            if x.abs().max(y.abs()) < 9.0 {
                let is_between = is_between(&graph, place, p, graph.second_sheet(p));
                counts[usize::from(!ends.contains(&z))][usize::from(is_between)] += 1;
            }
        }
        counts.map(|[no, yes]| f64::from(yes) / f64::from(no + yes).max(1.0))
    }

    #[test]
    fn one_thin_plate_has_no_third_sheet() {
        for thickness in [0.3, 1.0] {
            assert_eq!(
                between(&plate([24.0, thickness], 0.0, 3).0),
                [0.0; 2],
                "{thickness}"
            );
        }
    }

    #[test]
    fn inner_faces_of_stacks_are_between_sheets_whether_body_or_gap_is_thinner() {
        for (thickness, gap) in [(2.0, 0.8), (0.8, 2.0)] {
            let at = |k: u32| {
                let height = f64::from(k) * (thickness + gap);
                plate([24.0, thickness], height, 3 + u64::from(k)).0
            };
            let stack = join(join(at(0), at(1)), join(at(2), at(3)));
            let [outer, inner] = between(&stack);
            assert!(
                outer == 0.0 && inner > 0.9,
                "{thickness} {gap}: {outer} {inner}"
            );
        }
    }
}
