//! Nothing depends on the order of the points.

use super::tests::{Random, torus, ugly_clouds};
use super::{CellIndex, Neighborhoods, Radius, forward};
use crate::vector;

/// Points of a random order.
fn shuffled<E: Copy>(points: &[E], random: &mut Random) -> Vec<E> {
    let mut points = points.to_vec();
    for i in (1..points.len()).rev() {
        points.swap(i, (random.uniform() * (i + 1) as f64) as usize);
    }
    points
}

fn clouds() -> Vec<(&'static str, Vec<[f64; 3]>)> {
    let mut clouds = ugly_clouds();
    for n in [1025, 5000] {
        clouds.push(("a torus", torus(n, 2).into_iter().map(|s| s.0).collect()));
    }
    clouds
}

fn automatic_radius(points: &[[f64; 3]]) -> f64 {
    let mut found = Neighborhoods::default();
    forward(points, Radius::Auto, &mut found).expect("a cloud");
    found.common_radius
}

#[test]
fn the_automatic_radius_is_that_of_the_points_in_any_order() {
    let random = &mut Random::new(41);
    for (name, points) in clouds() {
        let radius = automatic_radius(&points);
        for _ in 0..3 {
            let other = automatic_radius(&shuffled(&points, random));
            assert_eq!(radius, other, "{name}, {} points", points.len());
        }
    }
}

#[test]
fn the_automatic_radius_changes_by_no_more_than_the_points_move() {
    let random = &mut Random::new(42);
    for n in [1000, 1025, 3000] {
        let points: Vec<[f64; 3]> = torus(n, 3).into_iter().map(|s| s.0).collect();
        let radius = automatic_radius(&points);
        for step in [1e-9, 1e-6, 1e-3] {
            let mut most = 0.0f64;
            let move_one = |&point: &[f64; 3]| {
                let by = random.point(step);
                most = most.max(vector::norm(by));
                vector::add(point, by)
            };
            let moved: Vec<[f64; 3]> = points.iter().map(move_one).collect();
            let change = (automatic_radius(&moved) - radius).abs();
            // Both ends of a distance move, and the radius is 1.001 of one.
            let bound = 2.002 * most + 1e-15;
            assert!(change <= bound, "{n} points moved by {most}: {change}");
        }
    }
}

#[test]
fn the_order_by_place_and_the_nearest_are_those_of_the_points_in_any_order() {
    let random = &mut Random::new(43);
    for (name, points) in clouds() {
        let other = shuffled(&points, random);
        let by_place = |points: &[[f64; 3]]| {
            let (index, mut positions) = (CellIndex::new(points), Vec::new());
            index.positions_by_place(&mut positions);
            let point = |&position: &u32| index.point(position as usize);
            positions.iter().map(point).collect::<Vec<_>>()
        };
        assert!(by_place(&points) == by_place(&other), "{name}");
        let nearest = |points: &[[f64; 3]], query| {
            let mut found = Vec::new();
            CellIndex::new(points).nearest(query, 17, &mut found);
            let place = |&(i, _): &(u32, f64)| points[i as usize];
            found.iter().map(place).collect::<Vec<_>>()
        };
        for &query in points.iter().step_by(50) {
            assert!(nearest(&points, query) == nearest(&other, query), "{name}");
        }
    }
}
