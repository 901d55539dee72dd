use super::Random;
use crate::distance::triangle::{Feature, Frame, closest_point};
use crate::vector::{add, cross, dot, norm, norm_squared, scale, sub};

const SEEDS: u64 = 4000;

/// A random triangle, and a point near its first corner.
fn triangle_and_point(seed: u64) -> ([[f64; 3]; 3], [f64; 3]) {
    let mut random = Random::new(seed);
    let corners = random.triangle();
    (corners, random.near(corners[0], 0.5))
}

fn distance_squared(frame: &Frame, q: [f64; 3]) -> f64 {
    frame.distances(&q.map(|x| [x]))[0]
}

/// Distance to a segment by ternary search of a convex function: no formula shared with the code.
fn segment_distance(q: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let at = |t: f64| norm_squared(sub(sub(q, a), scale(sub(b, a), t)));
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let (s, t) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if at(s) < at(t) { high = t } else { low = s }
    }
    at(0.5 * (low + high)).min(at(0.0)).min(at(1.0)).sqrt()
}

/// The least distance along segments from the first corner to points of the opposite edge: a convex function
/// of the point of the edge, so searched the same way.
fn searched_distance(q: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let at = |t: f64| segment_distance(q, a, add(b, scale(sub(c, b), t)));
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let (s, t) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if at(s) < at(t) { high = t } else { low = s }
    }
    at(0.5 * (low + high)).min(at(0.0)).min(at(1.0))
}

#[test]
fn closest_point_is_the_minimum_over_the_triangle() {
    for seed in 0..SEEDS / 8 {
        let (corners, q) = triangle_and_point(seed);
        let found = closest_point(q, corners);
        let searched = searched_distance(q, corners);
        // A search on squares finds a distance to the square root of ε, at best, of the size of the problem.
        assert!(
            (found.distance - searched).abs() < 3e-8,
            "seed {seed}: {found:?}, {searched}"
        );
        assert!(
            found.distance <= searched + 1e-14,
            "seed {seed}: {found:?}, {searched}"
        );
    }
}

#[test]
fn weights_make_the_point_and_the_offset_leads_back_to_the_query() {
    let mut kinds = [0; 3];
    for seed in 0..SEEDS {
        let (corners, q) = triangle_and_point(seed);
        let found = closest_point(q, corners);
        assert!(
            found.barycentric.iter().all(|&b| (0.0..=1.0).contains(&b)),
            "seed {seed}"
        );
        assert!(
            (found.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-15,
            "seed {seed}"
        );
        let back = add(found.point, found.offset);
        // A few units in the last place of coordinates up to 3.
        assert!(norm(sub(back, q)) < 1e-14, "seed {seed}: {found:?} {q:?}");
        kinds[match found.feature {
            Feature::Face => 0,
            Feature::Edge(_) => 1,
            Feature::Vertex(_) => 2,
        }] += 1;
    }
    assert!(
        kinds.iter().all(|&k| k > 50),
        "every kind of region is met: {kinds:?}"
    );
}

#[test]
fn offset_obeys_the_first_order_condition_of_its_region() {
    for seed in 0..SEEDS {
        let (corners, q) = triangle_and_point(seed);
        let found = closest_point(q, corners);
        // No corner lies on the side of the closest point that faces the query: the convex projection.
        for v in corners {
            let ahead = dot(found.offset, sub(v, found.point));
            assert!(ahead < 1e-14, "seed {seed}: {ahead:e} {found:?}");
        }
    }
}

#[test]
fn region_of_every_kind_is_named_by_its_corners() {
    let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 3.0, 0.0]];
    let expect = [
        ([1.5, 1.0, 2.0], Feature::Face, 2.0),
        ([2.0, -1.0, 0.0], Feature::Edge(0), 1.0),
        ([3.5, 2.5, 0.0], Feature::Edge(1), 2.0f64.sqrt()),
        ([-3.0, 2.0, 0.0], Feature::Edge(2), 11.0 / 10f64.sqrt()),
        ([-1.0, -1.0, 0.0], Feature::Vertex(0), 2.0f64.sqrt()),
        ([6.0, -1.0, 0.0], Feature::Vertex(1), 5.0f64.sqrt()),
        ([1.0, 5.0, 1.0], Feature::Vertex(2), 5.0f64.sqrt()),
    ];
    for (q, feature, distance) in expect {
        for turn in 0..3 {
            let turned = std::array::from_fn(|k| corners[(k + turn) % 3]);
            let found = closest_point(q, turned);
            let back = |k: usize| (k + turn) % 3;
            let named = match found.feature {
                Feature::Face => Feature::Face,
                Feature::Edge(k) => Feature::Edge(back(k)),
                Feature::Vertex(k) => Feature::Vertex(back(k)),
            };
            assert_eq!(named, feature, "{q:?}");
            assert!((found.distance - distance).abs() < 1e-15, "{q:?} {found:?}");
        }
    }
}

#[test]
fn fast_distance_agrees_with_the_closest_point() {
    for seed in 0..SEEDS {
        let (corners, q) = triangle_and_point(seed);
        let fast = distance_squared(&Frame::new(corners), q).sqrt();
        let exact = closest_point(q, corners).distance;
        // A few units in the last place of the longest way in the problem, up to 7.
        assert!(
            (fast - exact).abs() < 4e-15,
            "seed {seed}: {fast:e} {exact:e}"
        );
    }
}

#[test]
fn triangle_of_two_points_is_the_segment_between_them() {
    for seed in 0..SEEDS {
        let mut random = Random::new(seed);
        let [a, b] = [random.point(), random.point()];
        let t = 0.5 + 0.5 * random.signed();
        let between = add(a, scale(sub(b, a), t));
        let mut corners = [a, b, [a, b, between][seed as usize % 3]];
        corners.rotate_left(random.below(3));
        let q = random.near(a, 30.0);
        let expected = segment_distance(q, a, b);
        let fast = distance_squared(&Frame::new(corners), q).sqrt();
        let exact = closest_point(q, corners).distance;
        // The search is exact to the square root of ε times the length of the segment.
        let limit = 1e-7;
        assert!(
            (fast - expected).abs() < limit,
            "seed {seed}: {fast} {expected}"
        );
        assert!(
            (exact - expected).abs() < limit,
            "seed {seed}: {exact} {expected}"
        );
    }
}

#[test]
fn no_triangle_is_closer_than_its_corners_by_more_than_its_slack() {
    for seed in 0..SEEDS {
        let (corners, q) = triangle_and_point(seed);
        let frame = Frame::new(corners);
        let least = corners
            .map(|v| norm_squared(sub(q, v)))
            .into_iter()
            .fold(f64::MAX, f64::min);
        let squared = distance_squared(&frame, q);
        // Rounding of squares up to 50.
        assert!(
            squared >= least - frame.slack() - 1e-13,
            "seed {seed}: {squared} {least}"
        );
    }
}

#[test]
fn normals_follow_the_right_hand_rule() {
    for seed in 0..SEEDS {
        let mut random = Random::new(seed);
        let [a, b, c] = [random.point(), random.point(), random.point()];
        let n = crate::distance::triangle::unit_normal([a, b, c]).expect("has area");
        let product = cross(sub(b, a), sub(c, a));
        // Random corners in a cube are not slivers: sine of the angles above 1e-4 in all these seeds.
        assert!(
            (dot(n, product) / norm(product) - 1.0).abs() < 1e-9,
            "seed {seed}"
        );
    }
    assert_eq!(crate::distance::triangle::unit_normal([[1.0; 3]; 3]), None);
}
