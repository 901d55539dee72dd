//! Clusters of samples, each with its own grid.

use super::fill::Lattice;
use super::graph::Graph;
use super::signs::Place;
use crate::gather::Buckets;
use crate::{union_find, vector};

/// Cells of the two grids over the median reach of the samples, and what their evidence weighs.
const SCALES: [(f64, f32); 2] = [(0.8, 1.0), (1.6, 0.5)];

/// Most cells of a grid: for each sample, and in all; and what even a few samples may have.
const CELLS_PER_SAMPLE: usize = 64;
const FEWEST_CELLS: usize = 1 << 15;
const MOST_CELLS: usize = 1 << 24;

/// Discs grow with the cell, from this many median reaches on.
const FINE: f64 = 1.1;

/// Two neighbors belong together where they are at most this many reaches apart.
const LINK: f32 = 8.0;

/// Number of neighbors that are linked.
const LINKED: usize = 8;

/// A cluster of fewer samples has no grid.
const SMALLEST: u32 = 8;

/// With more separate parts than this, all share one grid.
const MOST: usize = 256;

/// By how much of its longest side a box grows before it is compared with others.
const NEAR: f64 = 0.1;

/// Marks a point without a cluster.
const NONE: u32 = u32::MAX;

/// Clusters of samples with disjoint bounding boxes, so that a distant one does not coarsen the grid of another.
/// Parts whose boxes overlap, such as a body inside the cavity of another, form one cluster.
#[derive(Clone, Debug, Default)]
pub struct Clusters {
    parent: Vec<u32>,
    size: Vec<u32>,
    /// The part of each point, or [`NONE`].
    part: Vec<u32>,
    /// The points of each cluster.
    members: Buckets,
    /// One box for each cluster.
    pub bounds: Vec<Bounds>,
}

/// A box, in user coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its low corner.
    pub low: [f64; 3],
    /// Its high corner.
    pub high: [f64; 3],
}

/// One of the grids that the samples of a cluster are drawn on.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// The grid.
    pub lattice: Lattice,
    /// Weight of its evidence.
    pub weight: f32,
    /// How wide a disc is there whose sample reaches one spacing, in user units.
    pub growth: f64,
}

impl Bounds {
    fn of(point: [f64; 3]) -> Self {
        Self {
            low: point,
            high: point,
        }
    }

    fn extend(&mut self, other: Self) {
        for a in 0..3 {
            self.low[a] = self.low[a].min(other.low[a]);
            self.high[a] = self.high[a].max(other.high[a]);
        }
    }

    fn longest(&self) -> f64 {
        (0..3)
            .map(|a| self.high[a] - self.low[a])
            .fold(0.0, f64::max)
    }

    fn is_near(&self, other: &Self) -> bool {
        let gap = NEAR * self.longest().max(other.longest());
        (0..3).all(|a| self.low[a] - gap <= other.high[a] && other.low[a] - gap <= self.high[a])
    }
}

impl Clusters {
    /// The points of a cluster, in order.
    ///
    /// # Panics
    /// There is no such cluster.
    pub fn members(&self, cluster: usize) -> &[u32] {
        self.members.of(cluster)
    }

    /// The grids of a cluster, finest first. `reaches` is scratch.
    ///
    /// # Panics
    /// There is no such cluster.
    pub fn scales(
        &self,
        cluster: usize,
        graph: &Graph,
        place: &impl Place,
        reaches: &mut Vec<f32>,
    ) -> [Scale; 2] {
        let (bounds, members) = (self.bounds[cluster], self.members(cluster));
        let reach = place.spacing() * median_reach(graph, members, reaches);
        let budget = (CELLS_PER_SAMPLE * members.len()).clamp(FEWEST_CELLS, MOST_CELLS);
        SCALES.map(|(scale, weight)| Scale {
            lattice: Lattice::new(bounds.low, bounds.high, scale * reach, budget),
            weight,
            growth: place.spacing() * (scale / FINE).max(1.0),
        })
    }

    /// Finds the parts of a graph; `point` returns the position of a point in user units.
    pub fn find(&mut self, graph: &Graph, point: impl Fn(usize) -> [f64; 3]) {
        self.link(graph);
        let mut parts: Vec<Bounds> = Vec::new();
        self.part.clear();
        self.part.reserve(self.parent.len());
        for p in 0..self.parent.len() {
            let root = self.parent[p] as usize;
            // A root comes before all others of its part.
            if root != p {
                self.part.push(self.part[root]);
            } else if self.size[p] < SMALLEST {
                self.part.push(NONE);
            } else {
                self.part.push(parts.len() as u32);
                parts.push(Bounds::of(point(p)));
            }
            if let Some(bounds) = parts.get_mut(self.part[p] as usize) {
                bounds.extend(Bounds::of(point(p)));
            }
        }
        let cluster = merge(&mut parts);
        self.bounds = parts;
        let cluster_of = |p: usize| cluster.get(self.part[p] as usize).copied();
        let points = self.part.len();
        self.members.fill(self.bounds.len(), points, cluster_of);
    }

    fn link(&mut self, graph: &Graph) {
        let n = graph.near.len();
        union_find::find(&mut self.parent, n, |p| {
            let near = graph.near[p].iter().zip(&graph.offset[p]).take(LINKED);
            let linked = near.filter(move |&(&q, &d)| {
                let limit = LINK * graph.reach[p].max(graph.reach[q as usize]);
                vector::norm(d) <= limit
            });
            linked.map(|(&q, _)| q)
        });
        self.size.clear();
        self.size.resize(n, 0);
        for &root in &self.parent {
            self.size[root as usize] += 1;
        }
    }
}

/// The median reach of the members that have any, in spacings of the cloud.
fn median_reach(graph: &Graph, members: &[u32], reaches: &mut Vec<f32>) -> f64 {
    let reach = members.iter().map(|&p| graph.reach[p as usize]);
    reaches.clear();
    reaches.extend(reach.filter(|&r| r > 0.0));
    if reaches.is_empty() {
        return 1.0;
    }
    let middle = reaches.len() / 2;
    f64::from(*reaches.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Merges boxes that are near each other, until none are, and returns the place of each former box.
fn merge(boxes: &mut Vec<Bounds>) -> Vec<u32> {
    if boxes.len() > MOST {
        let parts = boxes.len();
        let others = boxes.split_off(1);
        others.into_iter().for_each(|other| boxes[0].extend(other));
        return vec![0; parts];
    }
    let mut owner: Vec<usize> = (0..boxes.len()).collect();
    let mut changed = true;
    while changed {
        changed = false;
        for a in 0..boxes.len() {
            for b in a + 1..boxes.len() {
                let apart = owner[a] == a && owner[b] == b;
                if apart && boxes[a].is_near(&boxes[b]) {
                    let other = boxes[b];
                    boxes[a].extend(other);
                    owner.iter_mut().filter(|o| **o == b).for_each(|o| *o = a);
                    changed = true;
                }
            }
        }
    }
    let kept: Vec<usize> = (0..boxes.len()).filter(|&k| owner[k] == k).collect();
    let place = |o: &usize| kept.partition_point(|k| k < o) as u32;
    let places = owner.iter().map(place).collect();
    *boxes = kept.iter().map(|&k| boxes[k]).collect();
    places
}

#[cfg(test)]
mod tests {
    use super::{Bounds, merge};

    #[test]
    fn boxes_that_come_near_by_merging_are_merged_too() {
        let cube = |x: f64| Bounds {
            low: [x, 0.0, 0.0],
            high: [x + 1.0, 1.0, 1.0],
        };
        // The second is near the fourth only once that has reached the first.
        let mut boxes = vec![cube(0.0), cube(9.0), cube(1.05), cube(2.1), cube(3.4)];
        assert_eq!(merge(&mut boxes), [0, 1, 0, 0, 0]);
        assert_eq!(boxes[0].high, [4.4, 1.0, 1.0]);
        assert_eq!(boxes[1], cube(9.0));
    }

    #[test]
    fn many_parts_share_one_box() {
        let far = |k: i32| Bounds::of([f64::from(k) * 100.0; 3]);
        let mut boxes: Vec<Bounds> = (0..300).map(far).collect();
        assert!(merge(&mut boxes).iter().all(|&cluster| cluster == 0));
        assert_eq!(boxes.len(), 1);
        assert_eq!(boxes[0].high, [29_900.0; 3]);
    }
}
