//! The distance at points.

use cubecl::prelude::Runtime;
use isograd::distance::triangle::closest_point;
use isograd::{Mesh, Real};
use isograd_gpu::distance::{Error, query};
use isograd_gpu::{Device, Scalar};

use super::{meshes, upload};
use crate::devices::{Numbers, in_each_number, on_each_device, tolerance};

#[test]
fn hits_are_those_of_all_triangles_tried() {
    on_each_device!(check_hits);
}

fn check_hits<R: Runtime>(device: &Device<R>) {
    in_each_number!(device, check_hits_in);
}

fn check_hits_in<R: Runtime, T: Scalar>(device: &Device<R>) {
    for (mesh, count, size) in [
        (meshes::soup::<T>(300, 21), 701, 1.5),
        (meshes::torus(60, 21), 257, 4.0),
        // Near the center of it.
        (meshes::sphere(50, 51), 20, 1e-3),
        (meshes::copies(1), 100, 1.0),
        (meshes::line(), 100, 1.0),
        (meshes::point(5), 3, 1.0),
    ] {
        let mut numbers = Numbers(9);
        let points: Vec<T> = (0..3 * count)
            .map(|_| T::of(size * numbers.signed()))
            .collect();
        let on_device = device.upload(&points).unwrap();
        let hits = query::forward(device, &upload(device, &mesh), &on_device).unwrap();
        let distances = device.download(&hits.distances).unwrap();
        let on_mesh = device.download(&hits.points).unwrap();
        let triangles = device.download(&hits.triangles).unwrap();
        let barycentric = device.download(&hits.barycentric).unwrap();
        for (i, q) in points.chunks(3).enumerate() {
            let q = [q[0], q[1], q[2]].map(T::f64);
            let at = |values: &[T]| [0, 1, 2].map(|a| values[3 * i + a].f64());
            let found = Found {
                distance: distances[i].f64(),
                point: at(&on_mesh),
                triangle: triangles[i] as usize,
                barycentric: at(&barycentric),
            };
            check_hit(&mesh, q, &found, 0.1 * tolerance::<T>());
        }
    }
}

struct Found {
    distance: f64,
    point: [f64; 3],
    triangle: usize,
    barycentric: [f64; 3],
}

/// The distance is the least, the point that far and on the mesh where the weights say.
fn check_hit<T: Real>(mesh: &Mesh<T>, q: [f64; 3], found: &Found, tolerance: f64) {
    let corners = |face| mesh.corners(face).map(|p| p.map(T::f64));
    let distance = |face| closest_point(q, corners(face)).distance;
    let least = (0..mesh.faces().len())
        .map(distance)
        .fold(f64::INFINITY, f64::min);
    let named = corners(found.triangle);
    let by_weights: [f64; 3] =
        std::array::from_fn(|a| (0..3).map(|k| found.barycentric[k] * named[k][a]).sum());
    let apart =
        |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    assert!((found.distance - least).abs() <= tolerance);
    assert!((distance(found.triangle) - least).abs() <= tolerance);
    assert!((apart(q, found.point) - least).abs() <= tolerance);
    assert!(apart(by_weights, found.point) <= tolerance);
    let sum: f64 = found.barycentric.iter().sum();
    assert!((sum - 1.0).abs() <= tolerance && found.barycentric.iter().all(|&b| b >= 0.0));
}

#[test]
fn no_points_have_no_hits() {
    on_each_device!(check_no_points);
}

fn check_no_points<R: Runtime>(device: &Device<R>) {
    let mesh = upload(device, &meshes::line::<f32>());
    let none = query::forward(device, &mesh, &device.upload(&[]).unwrap()).unwrap();
    assert!(none.distances.is_empty() && none.barycentric.is_empty());
    let ragged = device.upload(&[0.0f32; 4]).unwrap();
    let error = query::forward(device, &mesh, &ragged).unwrap_err();
    assert!(matches!(error, Error::Triples { length: 4, .. }), "{error}");
}

#[test]
fn cotangents_of_points_are_those_of_the_cpu() {
    on_each_device!(check_pullback);
}

/// With the device's own faces; `isograd`'s query has signs, which the cotangents are given here as well.
fn check_pullback<R: Runtime>(device: &Device<R>) {
    let mesh = meshes::torus::<f32>(60, 21);
    let mut numbers = Numbers(3);
    let points: Vec<[f32; 3]> = (0..5000)
        .map(|_| [(); 3].map(|()| 1.2 * numbers.signed() as f32))
        .collect();
    let on_cpu = isograd::distance::Query::new(mesh.clone()).unwrap();
    let mut hits = on_cpu.query(&points, None);
    // Close to an edge the direction to it is no better than ε over the distance.
    let mut weigh = |hit: &isograd::distance::Hit<f32>| {
        let far = hit.distance.abs() > 0.02;
        if far { numbers.signed() as f32 } else { 0.0 }
    };
    let bar: Vec<f32> = hits.iter().map(&mut weigh).collect();
    let on_device = upload(device, &mesh);
    let places = device.upload(points.as_flattened()).unwrap();
    let found = query::forward(device, &on_device, &places).unwrap();
    let signed: Vec<f32> = bar
        .iter()
        .zip(&hits)
        .map(|(b, hit)| b * hit.distance.signum())
        .collect();
    let signed = device.upload(&signed).unwrap();
    let bars = query::pullback(device, &on_device, &places, &found, &signed, None).unwrap();
    let triangles = device.download(&found.triangles).unwrap();
    for ((hit, &face), &q) in hits.iter_mut().zip(&triangles).zip(&points) {
        let corners = mesh.corners(face as usize).map(|p| p.map(f64::from));
        let on_face = closest_point(q.map(f64::from), corners);
        let sign = f64::from(hit.distance.signum());
        hit.triangle = face;
        hit.gradient = on_face.offset.map(|x| (sign * x / on_face.distance) as f32);
        hit.barycentric = on_face.barycentric.map(|b| b as f32);
    }
    let (mut points_bar, mut vertices_bar) = (Vec::new(), Vec::new());
    on_cpu
        .pullback(
            &points,
            &hits,
            &bar,
            None,
            &mut points_bar,
            &mut vertices_bar,
        )
        .unwrap();
    for (found, expected) in [(bars.points, points_bar), (bars.vertices, vertices_bar)] {
        let found = device.download(&found).unwrap();
        assert_eq!(found.len(), 3 * expected.len());
        let largest = expected
            .as_flattened()
            .iter()
            .fold(0.0f32, |m, x| m.max(x.abs()));
        assert!(largest > 0.5);
        for (a, b) in found.iter().zip(expected.as_flattened()) {
            assert!((a - b).abs() <= 1e-4 * largest, "{a} for {b}");
        }
    }
}
