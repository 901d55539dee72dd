//! Nodes of the tree: the boxes of their children.

use super::{LANES, Points, WIDTH};
use crate::vector::{add, norm, scale, sub};

/// Boxes of the children of a node, `[axis][child]`. An absent child has an inverted infinite box,
/// infinitely far from everything.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    low: [[f64; WIDTH]; 3],
    high: [[f64; WIDTH]; 3],
}

/// Box of query points, `low..=high`, and a point of the mesh near it.
pub(in crate::distance) struct Region {
    /// Squared distances from `y` to the low and high faces of the box, per axis.
    to_faces: [[f64; 2]; 3],
    low: [f64; 3],
    high: [f64; 3],
    /// Slack, plus a bound of rounding in a difference of squares.
    margin: f64,
    /// Squared distance from the center beyond which sets are ignored.
    reach: f64,
}

impl Region {
    /// `reach` is a distance from the center of the box, infinite for no limit. Triangles may be closer than the set
    /// that represents them by `slack`, squared. `rounding` is the error of the coordinates.
    pub(in crate::distance) fn new(
        [low, high]: [[f64; 3]; 2],
        y: [f64; 3],
        reach: f64,
        slack: f64,
        rounding: f64,
    ) -> Self {
        let to_faces = std::array::from_fn(|a| {
            let (to_low, to_high) = (low[a] - y[a], high[a] - y[a]);
            [to_low * to_low, to_high * to_high]
        });
        let center = scale(add(low, high), 0.5);
        let radius = norm(sub(center, y)) + norm(sub(high, low));
        Self {
            to_faces,
            low,
            high,
            // Squares carry a few ε of themselves, coordinates theirs.
            margin: slack + radius * (1e-13 * radius + rounding),
            reach: reach * reach,
        }
    }
}

impl Node {
    pub(super) fn new(child: impl Fn(usize) -> [[f64; 3]; 2]) -> Self {
        let mut node = Self {
            low: [[0.0; WIDTH]; 3],
            high: [[0.0; WIDTH]; 3],
        };
        for slot in 0..WIDTH {
            let [low, high] = child(slot);
            for a in 0..3 {
                node.low[a][slot] = low[a];
                node.high[a][slot] = high[a];
            }
        }
        node
    }

    pub(super) fn bounds(&self) -> [[f64; 3]; 2] {
        [
            self.low
                .map(|lows| lows.into_iter().fold(f64::INFINITY, lesser)),
            self.high
                .map(|highs| highs.into_iter().fold(f64::NEG_INFINITY, greater)),
        ]
    }

    /// Squared distances from the points to one child.
    #[inline(always)]
    pub(super) fn distances(&self, slot: usize, points: &Points) -> [f64; LANES] {
        let mut squared = [0.0; LANES];
        for a in 0..3 {
            let (low, high) = (self.low[a][slot], self.high[a][slot]);
            for l in 0..LANES {
                let d = interval_distance(low, high, points[a][l]);
                squared[l] += d * d;
            }
        }
        squared
    }

    /// Squared distances from a point to the children.
    #[inline(always)]
    pub(super) fn distances_from(&self, q: [f64; 3]) -> [f64; WIDTH] {
        let mut squared = [0.0; WIDTH];
        for a in 0..3 {
            for s in 0..WIDTH {
                let d = interval_distance(self.low[a][s], self.high[a][s], q[a]);
                squared[s] += d * d;
            }
        }
        squared
    }

    /// Which children may hold a closest point of the region.
    #[inline(always)]
    pub(super) fn undominated(&self, region: &Region) -> [bool; WIDTH] {
        let mut excess = [region.margin; WIDTH];
        let mut squared = [0.0; WIDTH];
        for a in 0..3 {
            let center = 0.5 * (region.low[a] + region.high[a]);
            for s in 0..WIDTH {
                let (low, high) = (self.low[a][s], self.high[a][s]);
                let from_low = interval_distance(low, high, region.low[a]);
                let from_high = interval_distance(low, high, region.high[a]);
                let at_low = region.to_faces[a][0] - from_low * from_low;
                let at_high = region.to_faces[a][1] - from_high * from_high;
                excess[s] += if at_low > at_high { at_low } else { at_high };
                let d = interval_distance(low, high, center);
                squared[s] += d * d;
            }
        }
        let mut kept = [false; WIDTH];
        for s in 0..WIDTH {
            kept[s] = (excess[s] >= 0.0) & (squared[s] <= region.reach);
        }
        kept
    }
}

/// Distance from `x` to `low..=high` on a line.
#[inline(always)]
fn interval_distance(low: f64, high: f64, x: f64) -> f64 {
    let (below, above) = (low - x, x - high);
    let d = if below > above { below } else { above };
    if d > 0.0 { d } else { 0.0 }
}

/// Empty box.
pub(super) const EMPTY_BOX: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

/// Bounding box of a box and a point. NaN coordinates are ignored.
#[inline(always)]
pub(super) fn including(bounds: [[f64; 3]; 2], p: [f64; 3]) -> [[f64; 3]; 2] {
    joined(bounds, [p, p])
}

/// Bounding box of two boxes.
#[inline(always)]
pub(super) fn joined([mut low, mut high]: [[f64; 3]; 2], other: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    for a in 0..3 {
        low[a] = lesser(other[0][a], low[a]);
        high[a] = greater(other[1][a], high[a]);
    }
    [low, high]
}

/// The lesser; the second where one is NaN.
#[inline(always)]
fn lesser(x: f64, y: f64) -> f64 {
    if x < y { x } else { y }
}

#[inline(always)]
fn greater(x: f64, y: f64) -> f64 {
    if x > y { x } else { y }
}
