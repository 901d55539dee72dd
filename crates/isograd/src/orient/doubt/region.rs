//! Doubtful samples side by side, and where they are.

use std::cmp::Reverse;

use serde::Serialize;

use super::{Doubt, Reason};
use crate::data::bounds;
use crate::neighbors::Neighborhoods;
use crate::union_find;
use crate::{Real, vector};

/// Fewest samples of a region.
const FEWEST: usize = 8;

/// Regions that are listed.
const MOST: usize = 16;

/// A connected region of doubtful samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Region {
    /// Number of its samples.
    pub samples: usize,
    /// Their most frequent reason.
    pub reason: Reason,
    /// Low corner of its bounding box, in the unit of the points.
    pub low: [f64; 3],
    /// High corner of its bounding box, in the unit of the points.
    pub high: [f64; 3],
}

impl Region {
    /// Center of its bounding box.
    pub fn center(&self) -> [f64; 3] {
        vector::scale(vector::add(self.low, self.high), 0.5)
    }
}

/// The largest regions of doubtful samples, at most 16, largest first: those of at least 8 samples, each with another within
/// its neighborhood. `reasons` are those of [`reasons`](super::reasons), for the same points.
pub fn regions<T: Real>(
    points: &[[T; 3]],
    reasons: &[(u32, Reason)],
    neighborhoods: &Neighborhoods<T>,
) -> Vec<Region> {
    let mut root = Vec::new();
    union_find::find(&mut root, reasons.len(), |a| {
        let (i, mut near) = (reasons[a].0 as usize, Vec::new());
        let (center, radius) = (points[i], neighborhoods.radius[i]);
        neighborhoods.index.for_each_within(center, radius, |j, _| {
            let found = reasons.binary_search_by_key(&(j as u32), |r| r.0);
            near.extend(found.ok().map(|b| b as u32));
        });
        near
    });
    let mut members = vec![Vec::new(); reasons.len()];
    for (&root, &reason) in root.iter().zip(reasons) {
        members[root as usize].push(reason);
    }
    members.retain(|members| members.len() >= FEWEST);
    // Equally large ones stay in the order of their first samples.
    members.sort_by_key(|members| Reverse(members.len()));
    members.truncate(MOST);
    members
        .iter()
        .map(|members| region(points, members))
        .collect()
}

fn region<T: Real>(points: &[[T; 3]], members: &[(u32, Reason)]) -> Region {
    let doubt = Doubt::count(members.len(), members);
    let places = members.iter().map(|&(i, _)| points[i as usize]);
    let places: Vec<[f64; 3]> = places.map(vector::to_f64).collect();
    let (low, high) = bounds(&places).unwrap_or_default();
    Region {
        samples: members.len(),
        reason: doubt.main_reason(),
        low,
        high,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::{self, Radius};
    use crate::orient::shapes::sphere;

    #[test]
    fn regions_are_caps_of_a_sphere_with_their_size_place_and_reason() {
        let (points, _) = sphere(8000, [0.0; 3], 1.0, 3);
        let mut neighborhoods = Neighborhoods::default();
        neighbors::forward(&points, Radius::Auto, &mut neighborhoods).unwrap();
        let reason = |x: &[f64; 3]| match x[2] {
            z if z > 0.9 => Some(Reason::Open),
            z if z < -0.95 => Some(Reason::Thin),
            _ => None,
        };
        let indexed = (0..).zip(&points);
        let doubtful: Vec<(u32, Reason)> =
            indexed.filter_map(|(i, x)| Some((i, reason(x)?))).collect();
        // One more, alone.
        let alone = points.iter().position(|x| x[2].abs() < 0.1).unwrap() as u32;
        let place = doubtful.partition_point(|d| d.0 < alone);
        let mut all = doubtful.clone();
        all.insert(place, (alone, Reason::Noisy));
        let found = regions(&points, &all, &neighborhoods);
        let size = |reason| doubtful.iter().filter(|d| d.1 == reason).count();
        assert_eq!(found.len(), 2);
        for (region, reason) in found.iter().zip([Reason::Open, Reason::Thin]) {
            assert_eq!((region.samples, region.reason), (size(reason), reason));
            let [x, y, z] = region.center();
            assert!(
                x.abs() < 0.05 && y.abs() < 0.05 && z.abs() > 0.9,
                "{region:?}"
            );
        }
        assert!(found[0].low[2] > 0.9 && found[1].high[2] < -0.95);
        assert_eq!(regions(&points, &[], &neighborhoods), []);
    }
}
