use super::{Random, soup, sphere, torus};
use crate::distance::lattice::{Band, forward};
use crate::distance::samples::{Counts, Samples, count, nearest_faces};
use crate::distance::{Distance, Query, Scratch};
use crate::vector::{dot, normalized, of_f64, scale, sub};
use crate::{Field, Grid, Mesh};

/// Counts from two full lists of hits.
fn plain<T: Distance>(mesh: &Mesh<T>, samples: Samples<'_, T>) -> Counts {
    let query = Query::new(mesh.clone()).expect("a mesh");
    let pairs = samples.points.iter().zip(samples.normals);
    let below: Vec<[T; 3]> = pairs
        .map(|(&x, &n)| sub(x, scale(n, samples.depth)))
        .collect();
    let (at, below) = (query.query(samples.points, None), query.query(&below, None));
    let mut counts = Counts::default();
    for ((at, below), &n) in at.iter().zip(&below).zip(samples.normals) {
        let is_against = |gradient| dot(gradient, n) < T::of(-0.5);
        let turned = is_against(at.gradient) && at.distance.abs() <= samples.within;
        counts.turned += usize::from(turned);
        counts.thin += usize::from(is_against(below.gradient) && !turned);
        counts.missed += usize::from(!(at.distance.abs() <= samples.within));
        counts.far += usize::from(!(at.distance.abs() <= samples.far));
    }
    counts
}

fn assert_counts<T: Distance>(mesh: &Mesh<T>, number: usize, seed: u64) {
    let mut random = Random::new(seed);
    let mut points: Vec<[T; 3]> = (0..number).map(|_| of_f64(random.point())).collect();
    points[0] = [T::nan(); 3];
    let normals: Vec<[T; 3]> = (0..number)
        .map(|_| of_f64(normalized(random.point()).unwrap_or([1.0, 0.0, 0.0])))
        .collect();
    for size in [0.02, 0.3] {
        let samples = Samples {
            points: &points,
            normals: &normals,
            within: T::of(size),
            far: T::of(2.5 * size),
            depth: T::of(2.0 * size),
        };
        let expected = plain(mesh, samples);
        assert!(expected.missed > 0 && (number < 100 || expected.thin * expected.turned > 0));
        assert_eq!(count(mesh, None, samples), Ok(expected), "seed {seed}");
        let grid = Grid::new([T::of(-1.5); 3], T::of(0.4), [8; 3]).expect("valid");
        let (mut scratch, mut closest) = (Scratch::default(), Vec::new());
        let (chi, mut phi) = (Field::zeros(grid), Field::zeros(grid));
        let c = T::zero();
        forward(
            mesh,
            &chi,
            c,
            Band::Full,
            &mut scratch,
            &mut phi,
            &mut closest,
        )
        .expect("a mesh");
        let built = count(mesh, Some(&scratch), samples);
        assert_eq!(built, Ok(expected), "seed {seed}");
    }
    let hits = Query::new(mesh.clone())
        .expect("a mesh")
        .query(&points, None);
    let expected: Vec<u32> = hits.iter().map(|hit| hit.triangle).collect();
    assert_eq!(nearest_faces(mesh, None, &points), Ok(expected));
}

#[test]
fn samples_are_counted_as_by_queries_of_all() {
    for (number, seed) in [(1, 1), (7, 2), (1000, 3)] {
        assert_counts(&torus::<f64>(40, 15), number, seed);
        assert_counts(&sphere::<f32>(12, 0.8), number, seed + 10);
        assert_counts(&soup::<f64>(300, seed), number, seed + 20);
    }
}
