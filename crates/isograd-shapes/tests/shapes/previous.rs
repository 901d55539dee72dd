//! Orientation of a moving body from step to step.

use isograd::neighbors::Radius;
use isograd::orient::{Method, MethodUsed};
use isograd::{Orienter, PointCloud};
use isograd_element::vector::dot;
use isograd_shapes::Sampling;

use super::shape;

/// Samples of the fish.
const SAMPLES: usize = 12_000;

/// Steps of one beat of the tail.
const STEPS: usize = 20;

#[test]
fn the_fish_keeps_its_signs_through_a_beat_of_its_tail() {
    let mut fish = shape("fish");
    fish.set("amplitude", 0.12).expect("in range");
    let period = fish.get("period").expect("a parameter");
    let samples = fish.sample::<f64>(SAMPLES, &Sampling::default(), 3);
    let samples = samples.expect("samples");
    let mut plan = Orienter::<f64>::new(Radius::Auto, Method::Previous);
    let mut first = Vec::new();
    for step in 0..=STEPS {
        let time = period * step as f64 / STEPS as f64;
        fish.set("time", time).expect("in range");
        let points = fish.points_at(&samples.coordinates).expect("points");
        let truth = fish.normals_at(&samples.coordinates).expect("normals");
        let cloud = PointCloud::new(points).expect("finite");
        let found = plan.orient(&cloud).expect("normals");
        let cosines = found.normals.iter().zip(&truth).map(|(&n, &t)| dot(n, t));
        let is_right: Vec<bool> = cosines.map(|cosine| cosine > -0.5).collect();
        if step == 0 {
            first = is_right.clone();
            let wrong = first.iter().filter(|right| !**right).count();
            // The rim of the tail is less than a spacing thick.
            assert!(wrong * 100 <= SAMPLES, "{wrong}");
        }
        let broken = is_right
            .iter()
            .zip(&first)
            .filter(|&(&now, &then)| then && !now);
        let broken = broken.count();
        assert!(broken * 1000 <= SAMPLES, "step {step}: {broken}");
        let follows = matches!(found.method, MethodUsed::Previous { .. });
        assert_eq!(follows, step > 0, "step {step}");
    }
}
