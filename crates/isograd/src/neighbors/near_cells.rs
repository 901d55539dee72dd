//! Radius queries at places that come one after another: what is near to one is near to the next.

use super::cell_index::{CellIndex, Place, box_distance_squared};
use crate::Real;

/// Boxes whose cells are kept: places may lie on the sides of a body in turn.
const BOXES: usize = 4;

/// Side of a box over the radius.
const SIDE: f64 = 0.5;

/// Cells of an index near to the last places asked for. For one index: another needs another one of these.
#[derive(Debug, Default)]
pub(crate) struct NearCells<T> {
    boxes: [NearBox<T>; BOXES],
    /// The box to be replaced next.
    next: usize,
}

/// The cells within a radius of a box.
#[derive(Debug, Default)]
struct NearBox<T> {
    /// Low and high corner.
    corners: [[T; 3]; 2],
    radius: T,
    cells: Vec<Place>,
}

impl<T: Real> NearCells<T> {
    /// Calls `visit(sorted position, distance²)` for the points that [`CellIndex::for_each_within`] finds, in its order.
    pub(crate) fn for_each_within(
        &mut self,
        index: &CellIndex<T>,
        query: [T; 3],
        radius: T,
        mut visit: impl FnMut(usize, T),
    ) {
        if !(radius >= T::zero()) {
            return;
        }
        let limit = radius * radius;
        for &cell in self.cells(index, query, radius) {
            if index.nodes[cell.node].distance_squared(query) <= limit {
                index.scan(cell, query, limit, &mut visit);
            }
        }
    }

    /// All cells within the radius of a place, and some more.
    fn cells(&mut self, index: &CellIndex<T>, query: [T; 3], radius: T) -> &[Place] {
        let known = |near: &NearBox<T>| near.radius == radius && near.contains(query);
        let place = self.boxes.iter().position(known).unwrap_or_else(|| {
            let place = self.next;
            self.boxes[place].fill(index, query, radius);
            self.next = (place + 1) % BOXES;
            place
        });
        &self.boxes[place].cells
    }
}

impl<T: Real> NearBox<T> {
    fn contains(&self, query: [T; 3]) -> bool {
        let [low, high] = self.corners;
        !self.cells.is_empty() && (0..3).all(|a| low[a] <= query[a] && query[a] <= high[a])
    }

    /// The box around a place.
    fn fill(&mut self, index: &CellIndex<T>, query: [T; 3], radius: T) {
        let half = T::of(0.5 * SIDE) * radius;
        let corners = [query.map(|x| x - half), query.map(|x| x + half)];
        let limit = radius * radius;
        self.cells.clear();
        index.walk(
            &mut |node| box_distance_squared(node.corners(), corners) <= limit,
            &mut |cell| self.cells.push(cell),
        );
        (self.corners, self.radius) = (corners, radius);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::tests::{Random, queries, ugly_clouds};

    /// Places along a path, as vertices of a surface come, from each sample to the next, and far ones between.
    fn path<T: Real>(points: &[[T; 3]]) -> Vec<[T; 3]> {
        let mut random = Random::new(7);
        let mut places = queries(points);
        for pair in points.windows(2).take(200) {
            for step in 0..4 {
                let share = T::of(f64::from(step) / 4.0);
                places.push([0, 1, 2].map(|a| pair[0][a] + share * (pair[1][a] - pair[0][a])));
            }
            if random.uniform() < 0.1 {
                places.push(random.point(2.0).map(T::of));
            }
        }
        places
    }

    fn agrees_with_single_queries<T: Real>() {
        for (name, points) in ugly_clouds::<T>() {
            let (index, mut near) = (CellIndex::new(&points), NearCells::default());
            for (k, query) in path(&points).into_iter().enumerate() {
                // Two radii by turns, and others now and then.
                let radius = [0.25, 0.1, 0.25, 0.1, 0.25, [-1.0, 0.0, 1.0, 1e7][k % 4]][k % 6];
                let (mut found, mut expected) = (Vec::new(), Vec::new());
                near.for_each_within(&index, query, T::of(radius), |position, d2| {
                    found.push((index.order()[position] as usize, d2));
                });
                index.for_each_within(query, T::of(radius), |i, d2| expected.push((i, d2)));
                assert_eq!(found, expected, "{name}, radius {radius}, at {query:?}");
            }
        }
    }

    #[test]
    fn the_same_points_in_the_same_order_as_single_queries_in_f32_and_f64() {
        agrees_with_single_queries::<f32>();
        agrees_with_single_queries::<f64>();
    }
}
