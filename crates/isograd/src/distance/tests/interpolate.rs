use super::query_pullback::support;
use super::{Random, soup, torus};
use crate::Mesh;
use crate::distance::interpolate::{Bars, Cotangent, VertexValues};
use crate::distance::{Error, Hit, Query};
use crate::testing::{assert_same_bits, inner};
use crate::vector::{add, of_f64, scale};

fn vectors(n: usize, size: f64, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random::new(seed);
    (0..n)
        .map(|_| of_f64(random.near([0.0; 3], size)))
        .collect()
}

fn hits(mesh: &Mesh<f64>, points: &[[f64; 3]]) -> Vec<Hit<f64>> {
    let query = Query::new(mesh.clone()).expect("a mesh");
    query.query(points, None)
}

fn moved(at: &[[f64; 3]], way: &[[f64; 3]], t: f64) -> Vec<[f64; 3]> {
    let pairs = at.iter().zip(way);
    pairs.map(|(&p, &d)| add(p, scale(d, t))).collect()
}

fn of_values<'a>(values: &'a [[f64; 3]]) -> Bars<'a, f64> {
    Bars {
        values: Some(values.as_flattened()),
        ..Bars::default()
    }
}

fn at(mesh: &Mesh<f64>, values: &[[f64; 3]], points: &[[f64; 3]]) -> Vec<f64> {
    let of = VertexValues {
        mesh,
        values: values.as_flattened(),
        components: 3,
    };
    of.at(&hits(mesh, points)).expect("matching lengths")
}

/// The corners of a mesh are values too: interpolated, they are the closest points.
#[test]
fn interpolated_vertices_are_the_closest_points() {
    let mesh = torus::<f64>(30, 12);
    let points = vectors(500, 1.3, 1);
    let found = at(&mesh, mesh.vertices(), &points);
    let expected = hits(&mesh, &points);
    for (found, hit) in found.as_chunks::<3>().0.iter().zip(&expected) {
        for a in 0..3 {
            // Rounding of coordinates of order 1.
            assert!((found[a] - hit.point[a]).abs() < 1e-14);
        }
    }
}

#[test]
fn points_vertices_and_values_get_the_transpose() {
    let (n, step) = (600, 1e-6);
    let mesh = torus::<f64>(30, 12);
    let (points, count) = (vectors(n, 1.1, 1), mesh.vertices().len());
    let values = vectors(count, 1.0, 2);
    let (point_way, vertex_way, value_way) = (
        vectors(n, 1.0, 3),
        vectors(count, 1.0, 4),
        vectors(count, 1.0, 5),
    );
    let moved_mesh = |t: f64| {
        let vertices = moved(mesh.vertices(), &vertex_way, t);
        Mesh::new(vertices, mesh.faces().to_vec()).expect("finite")
    };
    let moved_hits = |t: f64| hits(&moved_mesh(t), &moved(&points, &point_way, t));
    let (low, middle, high) = (moved_hits(-step), moved_hits(0.0), moved_hits(step));
    let mut bar = vectors(n, 1.0, 6);
    let mut kept = 0;
    for i in 0..n {
        // Passing to another face or feature within the step has no derivative.
        let feature = |hit: &Hit<f64>| support(&mesh, hit);
        match feature(&low[i]) == feature(&middle[i]) && feature(&high[i]) == feature(&middle[i]) {
            true => kept += 1,
            false => bar[i] = [0.0; 3],
        }
    }
    assert!(kept > n - 20, "{kept}");
    let loss = |t: f64, hits: &[Hit<f64>]| -> f64 {
        let (mesh, values) = (moved_mesh(t), moved(&values, &value_way, t));
        let of = VertexValues {
            mesh: &mesh,
            values: values.as_flattened(),
            components: 3,
        };
        let found = of.at(hits).expect("matching lengths");
        found
            .iter()
            .zip(bar.as_flattened())
            .map(|(u, b)| u * b)
            .sum()
    };
    let of = VertexValues {
        mesh: &mesh,
        values: values.as_flattened(),
        components: 3,
    };
    let mut out = Cotangent::default();
    let guarded = of.pullback(&points, &middle, of_values(&bar), &mut out);
    assert_eq!(guarded, Ok(0));
    let values_bar = out.values.as_chunks::<3>().0;
    let found = inner(&out.points, &point_way)
        + inner(&out.vertices, &vertex_way)
        + inner(values_bar, &value_way);
    let expected = (loss(step, &high) - loss(-step, &low)) / (2.0 * step);
    // Rounding of sums of 1800 terms, 1e-13, divided by the step.
    assert!(
        (found - expected).abs() < 1e-6 * (1.0 + expected.abs()),
        "{found} {expected}"
    );
    assert!(expected.abs() > 0.1);
}

#[test]
fn ugly_meshes_give_finite_cotangents_and_misses_give_none() {
    let mesh = soup::<f64>(300, 5);
    let mut points = vectors(400, 1.5, 9);
    points.extend(&mesh.vertices()[..100]);
    points.push([f64::NAN; 3]);
    let values = vectors(mesh.vertices().len(), 1.0, 10);
    let of = VertexValues {
        mesh: &mesh,
        values: values.as_flattened(),
        components: 3,
    };
    let hits = hits(&mesh, &points);
    let found = of.at(&hits).expect("matching lengths");
    assert!(found.iter().all(|u| u.abs() <= 1.0 + 1e-12));
    assert_eq!(found[found.len() - 3..], [0.0; 3]);
    let bar = vectors(points.len(), 1.0, 11);
    let pull = || {
        let mut out = Cotangent::default();
        let guarded = of.pullback(&points, &hits, of_values(&bar), &mut out);
        guarded.map(|_| out)
    };
    let out = pull().expect("matching lengths");
    let all = out.points.as_flattened().iter();
    let mut all = all.chain(out.vertices.as_flattened()).chain(&out.values);
    assert!(all.all(|x| x.is_finite()));
    assert_eq!(out.points.last(), Some(&[0.0; 3]));
    assert_same_bits(pull);
}

#[test]
fn lengths_that_do_not_match_are_errors() {
    let mesh = torus::<f64>(8, 6);
    let hits = hits(&mesh, &vectors(5, 1.0, 1));
    let of = VertexValues {
        mesh: &mesh,
        values: &[0.0; 7],
        components: 1,
    };
    assert!(matches!(of.at(&hits), Err(Error::Mismatch { .. })));
    let values = vec![0.0; mesh.vertices().len()];
    let of = VertexValues {
        values: &values,
        ..of
    };
    let mut out = Cotangent::default();
    let short = Bars {
        values: Some(&[1.0; 4]),
        ..Bars::default()
    };
    let short = of.pullback(&[[0.0; 3]; 5], &hits, short, &mut out);
    assert!(matches!(short, Err(Error::Mismatch { .. })));
    assert_eq!(out, Cotangent::default());
    let mut wrong = hits;
    wrong[0].triangle = 10_000;
    assert_eq!(of.at(&wrong), Err(Error::Face { face: 10_000 }));
}
