use super::{Random, soup, torus};
use crate::distance::{Distance, Error, Hit, NO_TRIANGLE, Query};
use crate::testing::{assert_same_bits, inner};
use crate::vector::{add, dot, of_f64, scale};
use crate::{Mesh, Real};

/// Cotangents of the points and the vertices.
struct Pulled<T> {
    points: Vec<[T; 3]>,
    vertices: Vec<[T; 3]>,
    guarded: usize,
}

fn pull<T: Distance>(
    query: &Query<T>,
    points: &[[T; 3]],
    distance_bar: &[T],
    point_bar: Option<&[[T; 3]]>,
) -> Pulled<T> {
    let hits = query.query(points, None);
    let (mut p, mut v) = (Vec::new(), Vec::new());
    let guarded = query.pullback(points, &hits, distance_bar, point_bar, &mut p, &mut v);
    Pulled {
        points: p,
        vertices: v,
        guarded: guarded.expect("matching lengths"),
    }
}

fn vectors<T: Real>(n: usize, size: f64, seed: u64) -> Vec<[T; 3]> {
    let mut random = Random::new(seed);
    (0..n)
        .map(|_| of_f64(random.near([0.0; 3], size)))
        .collect()
}

fn numbers<T: Real>(n: usize, seed: u64) -> Vec<T> {
    vectors(n, 1.0, seed)
        .into_iter()
        .map(|[x, _, _]| x)
        .collect()
}

fn moved(at: &[[f64; 3]], direction: &[[f64; 3]], t: f64) -> Vec<[f64; 3]> {
    at.iter()
        .zip(direction)
        .map(|(&p, &d)| add(p, scale(d, t)))
        .collect()
}

/// The vertices that hold the closest point, whichever face they were found on.
pub(super) fn support(mesh: &Mesh<f64>, hit: &Hit<f64>) -> Vec<u32> {
    let face = mesh.faces()[hit.triangle as usize];
    let holds = |k: &usize| hit.barycentric[*k] > 0.0;
    let mut vertices: Vec<u32> = (0..3).filter(holds).map(|k| face[k]).collect();
    vertices.sort_unstable();
    vertices
}

#[test]
fn distance_and_closest_point_get_the_transpose() {
    let (n, step) = (600, 1e-6);
    let mesh = torus::<f64>(30, 12);
    let points = vectors::<f64>(n, 1.1, 1);
    let count = mesh.vertices().len();
    let (point_way, vertex_way) = (vectors(n, 1.0, 2), vectors(count, 1.0, 3));
    let at = |t: f64| {
        let vertices = moved(mesh.vertices(), &vertex_way, t);
        let query = Query::new(Mesh::new(vertices, mesh.faces().to_vec()).expect("finite"));
        query
            .expect("a mesh")
            .query(&moved(&points, &point_way, t), None)
    };
    let (low, middle, high) = (at(-step), at(0.0), at(step));
    let (mut distance_bar, mut point_bar) = (numbers(n, 4), vectors(n, 1.0, 5));
    let mut kept = 0;
    for i in 0..n {
        // Passing to another face or feature within the step has no derivative.
        if [&low, &high]
            .iter()
            .all(|end| support(&mesh, &end[i]) == support(&mesh, &middle[i]))
        {
            kept += 1;
        } else {
            (distance_bar[i], point_bar[i]) = (0.0, [0.0; 3]);
        }
    }
    assert!(kept > n - 10);
    let query = Query::new(mesh.clone()).expect("a mesh");
    let (zeros, ones) = (vec![0.0; n], Some(&point_bar[..]));
    for (distance_bar, point_bar) in [(&distance_bar, None), (&zeros, ones), (&distance_bar, ones)]
    {
        let loss = |hits: &[Hit<f64>]| -> f64 {
            let along = |i: usize| point_bar.map_or(0.0, |bar| dot(bar[i], hits[i].point));
            (0..n)
                .map(|i| distance_bar[i] * hits[i].distance + along(i))
                .sum()
        };
        let bar = pull(&query, &points, distance_bar, point_bar);
        let found = inner(&bar.points, &point_way) + inner(&bar.vertices, &vertex_way);
        let expected = (loss(&high) - loss(&low)) / (2.0 * step);
        // Rounding of sums of 600 terms, 1e-13, divided by the step.
        assert!(
            (found - expected).abs() < 1e-6 * (1.0 + expected.abs()),
            "{found} {expected}"
        );
        assert!(expected.abs() > 0.1 && bar.guarded == 0);
    }
}

#[test]
fn moving_points_and_mesh_together_changes_only_the_closest_points() {
    let query = Query::new(torus::<f64>(30, 12)).expect("a mesh");
    let points = vectors(500, 1.3, 6);
    let point_bar = vectors(500, 1.0, 7);
    let bar = pull(&query, &points, &numbers(500, 8), Some(&point_bar));
    let total = |vectors: &[[f64; 3]]| vectors.iter().fold([0.0; 3], |sum, &v| add(sum, v));
    let (sum, expected) = (
        add(total(&bar.points), total(&bar.vertices)),
        total(&point_bar),
    );
    for a in 0..3 {
        // Rounding of some thousand terms of order 10.
        assert!((sum[a] - expected[a]).abs() < 1e-10);
    }
}

#[test]
fn ugly_meshes_and_points_give_finite_cotangents_and_misses_give_none() {
    fn check<T: Distance>() {
        let mesh = soup::<T>(300, 5);
        let query = Query::new(mesh.clone()).expect("a mesh");
        let mut points = vectors::<T>(400, 1.5, 9);
        // On vertices, where the distance is 0.
        points.extend(&mesh.vertices()[..100]);
        points.push([T::nan(); 3]);
        points.push([T::infinity(), T::zero(), T::zero()]);
        let n = points.len();
        let (mut distance_bar, mut point_bar) = (numbers(n, 10), vectors(n, 1.0, 11));
        // Cotangents of a loss of NaN.
        (distance_bar[n - 1], point_bar[n - 1]) = (T::nan(), [T::nan(); 3]);
        let bar = pull(&query, &points, &distance_bar, Some(&point_bar));
        assert!(
            bar.points
                .iter()
                .chain(&bar.vertices)
                .flatten()
                .all(|x| x.is_finite())
        );
        assert_eq!(bar.points[n - 2..], [[T::zero(); 3]; 2]);
        assert_eq!(bar.vertices.len(), mesh.vertices().len());
    }
    check::<f32>();
    check::<f64>();
}

#[test]
fn a_speck_far_away_is_guarded() {
    let corners = vec![[0.0, -1e-9, -1e-9], [0.0, 1e-9, -1e-9], [0.0, 0.0, 1e-9]];
    let query = Query::new(Mesh::new(corners, vec![[0, 1, 2]]).expect("finite")).expect("a mesh");
    let bar = pull(
        &query,
        &[[3.0, 0.0, 0.0]],
        &[0.5],
        Some(&[[0.2, 0.7, -0.4]]),
    );
    assert_eq!(bar.guarded, 1);
    // The closest point stays with the corners, and the distance is as ever.
    assert_eq!(bar.points, [[0.5, 0.0, 0.0]]);
    let sum = bar.vertices.iter().fold([0.0; 3], |sum, &v| add(sum, v));
    let expected: [f64; 3] = [0.2 - 0.5, 0.7, -0.4];
    assert!(
        (0..3).all(|a| (sum[a] - expected[a]).abs() < 1e-15),
        "{sum:?}"
    );
}

#[test]
fn cotangents_are_added_to_what_is_there() {
    let query = Query::new(torus::<f64>(20, 9)).expect("a mesh");
    let points = vectors(50, 1.0, 12);
    let hits = query.query(&points, None);
    let bar = numbers(50, 13);
    let (mut p, mut v) = (Vec::new(), Vec::new());
    for _ in 0..2 {
        query
            .pullback(&points, &hits, &bar, None, &mut p, &mut v)
            .expect("matching");
    }
    let once = pull(&query, &points, &bar, None);
    let twice = |v: &[[f64; 3]]| v.iter().map(|&v| scale(v, 2.0)).collect::<Vec<_>>();
    assert_eq!((p, v), (twice(&once.points), twice(&once.vertices)));
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let query = Query::new(torus::<f32>(80, 30)).expect("a mesh");
    let points = vectors(9000, 1.1, 3);
    let (distance_bar, point_bar) = (numbers(9000, 4), vectors(9000, 1.0, 5));
    assert_same_bits(|| {
        let bar = pull(&query, &points, &distance_bar, Some(&point_bar));
        (bar.points, bar.vertices)
    });
}

#[test]
fn wrong_lengths_and_foreign_hits_are_refused() {
    let query = Query::new(torus::<f64>(20, 9)).expect("a mesh");
    let points = vectors(5, 1.0, 12);
    let mut hits = query.query(&points, None);
    let (bar, short) = (numbers(5, 1), vectors(4, 1.0, 1));
    let pull = |hits: &[Hit<f64>], bar: &[f64], point_bar: Option<&[[f64; 3]]>| {
        query.pullback(
            &points,
            hits,
            bar,
            point_bar,
            &mut Vec::new(),
            &mut Vec::new(),
        )
    };
    for refused in [
        pull(&hits[..4], &bar, None),
        pull(&hits, &bar[..3], None),
        pull(&hits, &bar, Some(&short)),
    ] {
        assert!(
            matches!(refused, Err(Error::Mismatch { expected: 5, .. })),
            "{refused:?}"
        );
    }
    hits[3].triangle = NO_TRIANGLE - 1;
    assert_eq!(
        pull(&hits, &bar, None),
        Err(Error::Face {
            face: NO_TRIANGLE - 1
        })
    );
}
