//! The sign of the distance at points, its gradient, and the pullback of closest points, beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::distance::triangle::closest_point;
use isograd::distance::{Hit, Query};
use isograd::{Field, Mesh};
use isograd_gpu::distance::query::{self, Hits};
use isograd_gpu::{Device, Scalar};

use super::{grid, meshes, upload};
use crate::devices::{Numbers, in_both_numbers, in_each_number, on_each_device};
use crate::samples::assert_near;

/// Closer than this, nothing is asked of the sign; and closer than the second, nothing of the direction.
const NEAR: [f64; 2] = [1e-5, 0.02];

fn scattered<T: Scalar>(count: usize, size: f64, seed: u64) -> Vec<[T; 3]> {
    let mut numbers = Numbers(seed);
    let mut point = |_| [(); 3].map(|()| T::of(size * numbers.signed()));
    (0..count).map(&mut point).collect()
}

/// What the device says about points, twice.
fn ask<R: Runtime, T: Scalar>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    points: &[[T; 3]],
    field: Option<&Field<T>>,
) -> (Hits<T>, Vec<T>, Vec<T>) {
    let places = device.upload(points.as_flattened()).unwrap();
    let on_device = upload(device, mesh);
    let values = field.map(|field| device.upload(field.values()).unwrap());
    let given = values.as_ref().zip(field.map(Field::grid));
    let run = || {
        let hits = query::signed(device, &on_device, &places, given).unwrap();
        let distances = device.download(&hits.distances).unwrap();
        let gradients = device.download(&hits.gradients).unwrap();
        (hits, distances, gradients)
    };
    let (hits, distances, gradients) = run();
    let (_, again, turned) = run();
    assert!(
        (&distances, &gradients) == (&again, &turned),
        "other bits the second time"
    );
    (hits, distances, gradients)
}

/// The hits of the CPU on the faces that the device found: of two faces nearly in one plane, and as far to the last digits
/// of `f32`, it may be the other one.
fn on_own_faces<R: Runtime, T: Scalar>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    points: &[[T; 3]],
    found: &Hits<T>,
    tolerance: f64,
) -> Vec<Hit<T>> {
    let mut hits = Query::new(mesh.clone()).unwrap().query(points, None);
    let triangles = device.download(&found.triangles).unwrap();
    for ((hit, &face), q) in hits.iter_mut().zip(&triangles).zip(points) {
        let corners = mesh.corners(face as usize).map(|p| p.map(T::f64));
        let own = closest_point(q.map(T::f64), corners);
        assert!((own.distance - hit.distance.f64().abs()).abs() <= 0.1 * tolerance);
        let sign = if hit.distance.f64() < 0.0 { -1.0 } else { 1.0 };
        hit.triangle = face;
        hit.gradient = own.offset.map(|x| T::of(sign * x / own.distance));
        hit.barycentric = own.barycentric.map(T::of);
    }
    hits
}

#[test]
fn signs_and_gradients_are_those_of_the_cpu() {
    on_each_device!(check_sides);
}

fn check_sides<R: Runtime>(device: &Device<R>) {
    in_both_numbers!(device, check_sides_in);
}

fn check_sides_in<R: Runtime, T: Scalar>(device: &Device<R>, tolerance: f64) {
    for (mesh, count, [width, height]) in [
        (meshes::torus::<T>(60, 21), 2001, [1.2, 1.2]),
        (meshes::spike(9), 1501, [0.36, 0.9]),
        (meshes::spike(3), 500, [0.36, 0.9]),
        // Many faces at each tip, and those thin.
        (meshes::spike(2000), 300, [0.36, 0.9]),
    ] {
        let mut points = scattered::<T>(count, 1.0, 31);
        for point in &mut points {
            let sides = [width, width, height];
            *point = std::array::from_fn(|a| T::of(sides[a] * point[a].f64()));
        }
        let (hits, distances, gradients) = ask(device, &mesh, &points, None);
        let expected = on_own_faces(device, &mesh, &points, &hits, tolerance);
        let (mut inside, mut found, mut wanted) = (0, Vec::new(), Vec::new());
        for (i, hit) in expected.iter().enumerate() {
            let (d, e) = (distances[i].f64(), hit.distance.f64());
            assert!((d.abs() - e.abs()).abs() <= 0.1 * tolerance, "{d} for {e}");
            if e.abs() > NEAR[0] {
                assert_eq!(d < 0.0, e < 0.0, "{:?}: {d} for {e}", points[i]);
                inside += usize::from(d < 0.0);
            }
            if e.abs() > NEAR[1] {
                found.extend(&gradients[3 * i..3 * i + 3]);
                wanted.extend(hit.gradient);
            }
        }
        assert!(inside > count / 60, "only {inside} of {count} are inside");
        assert_near("gradients", &found, &wanted, tolerance);
    }
}

#[test]
fn a_field_of_one_sign_decides_and_pseudonormals_elsewhere() {
    on_each_device!(check_field);
}

/// The field is that of another body than the mesh.
fn check_field<R: Runtime>(device: &Device<R>) {
    let mesh = meshes::torus::<f32>(40, 15);
    let grid = grid::<f32>([-0.8, -0.75, -0.7], 0.1, [15, 14, 13]);
    let ball = |at| {
        let [x, y, z] = grid.center(grid.cell(at));
        x.hypot(y).hypot(z) - 0.55
    };
    let field = Field::new(grid, (0..grid.cells()).map(ball).collect()).unwrap();
    let points = scattered::<f32>(3000, 1.1, 12);
    let query = Query::new(mesh.clone()).unwrap();
    let (expected, without) = (
        query.query(&points, Some(&field)),
        query.query(&points, None),
    );
    let (_, distances, _) = ask(device, &mesh, &points, Some(&field));
    let mut decided = 0;
    for (i, hit) in expected.iter().enumerate() {
        if f64::from(hit.distance.abs()) > NEAR[0] {
            assert_eq!(distances[i] < 0.0, hit.distance < 0.0, "{:?}", points[i]);
            decided += usize::from(hit.distance != without[i].distance);
        }
    }
    assert!(decided > 100, "the field made no difference");
}

#[test]
fn cotangents_of_closest_points_are_those_of_the_cpu() {
    on_each_device!(check_closest);
}

fn check_closest<R: Runtime>(device: &Device<R>) {
    in_both_numbers!(device, check_closest_in);
}

fn check_closest_in<R: Runtime, T: Scalar>(device: &Device<R>, tolerance: f64) {
    for (mesh, count, size) in [
        (meshes::torus::<T>(60, 21), 3001, 1.2),
        (meshes::spike(9), 1501, 1.5),
    ] {
        let points = scattered::<T>(count, size, 44);
        let on_cpu = Query::new(mesh.clone()).unwrap();
        let (hits, ..) = ask(device, &mesh, &points, None);
        let expected = on_own_faces(device, &mesh, &points, &hits, tolerance);
        let mut numbers = Numbers(6);
        // Close to an edge the direction to it is no better than ε over the distance.
        let mut bar = |hit: &Hit<T>| match hit.distance.f64().abs() > NEAR[1] {
            true => [(); 4].map(|()| T::of(numbers.signed())),
            false => [T::of(0.0); 4],
        };
        let bars: Vec<[T; 4]> = expected.iter().map(&mut bar).collect();
        let distance_bar: Vec<T> = bars.iter().map(|b| b[0]).collect();
        let point_bar: Vec<[T; 3]> = bars.iter().map(|b| [b[1], b[2], b[3]]).collect();
        let (mut points_bar, mut vertices_bar) = (Vec::new(), Vec::new());
        let closest = Some(&point_bar[..]);
        let to = (&mut points_bar, &mut vertices_bar);
        on_cpu
            .pullback(&points, &expected, &distance_bar, closest, to.0, to.1)
            .unwrap();
        let places = device.upload(points.as_flattened()).unwrap();
        let distance_bar = device.upload(&distance_bar).unwrap();
        let point_bar = device.upload(point_bar.as_flattened()).unwrap();
        let mesh = upload(device, &mesh);
        let run = || {
            let bars = (&distance_bar, Some(&point_bar));
            let found = query::pullback(device, &mesh, &places, &hits, bars.0, bars.1).unwrap();
            (
                device.download(&found.points).unwrap(),
                device.download(&found.vertices).unwrap(),
            )
        };
        let found = run();
        assert_near("points", &found.0, points_bar.as_flattened(), tolerance);
        assert_near("vertices", &found.1, vertices_bar.as_flattened(), tolerance);
        assert!(found == run(), "other bits the second time");
    }
}

#[test]
fn points_on_the_mesh_and_meshes_without_area_give_finite_numbers() {
    on_each_device!(check_degenerate);
}

fn check_degenerate<R: Runtime>(device: &Device<R>) {
    in_each_number!(device, check_degenerate_in);
}

fn check_degenerate_in<R: Runtime, T: Scalar>(device: &Device<R>) {
    let soup = meshes::soup::<T>(200, 3);
    for (mesh, has_area) in [
        (meshes::spike::<T>(9), true),
        (meshes::line(), false),
        (meshes::point(70), false),
        (meshes::copies(300), true),
        (soup, false),
    ] {
        let mut points = mesh.vertices().to_vec();
        points.extend(scattered::<T>(50, 1.0, 7));
        let (hits, distances, gradients) = ask(device, &mesh, &points, None);
        for (d, g) in distances.iter().zip(gradients.chunks(3)) {
            let length = g.iter().map(|x| x.f64().powi(2)).sum::<f64>().sqrt();
            let zero = length == 0.0 && d.f64() == 0.0 && !has_area;
            assert!(
                d.f64().is_finite() && ((length - 1.0).abs() < 1e-5 || zero),
                "{d}: {g:?}"
            );
        }
        let n = points.len();
        let places = device.upload(points.as_flattened()).unwrap();
        let ones = device.upload(&vec![T::of(1.0); 3 * n]).unwrap();
        let one = device.upload(&vec![T::of(1.0); n]).unwrap();
        let mesh = upload(device, &mesh);
        let bars = query::pullback(device, &mesh, &places, &hits, &one, Some(&ones)).unwrap();
        for found in [bars.points, bars.vertices] {
            let found = device.download(&found).unwrap();
            assert!(found.iter().all(|x| x.f64().is_finite()));
        }
    }
}

#[test]
fn no_points_have_no_sides_and_give_nothing() {
    on_each_device!(check_none);
}

fn check_none<R: Runtime>(device: &Device<R>) {
    let mesh = meshes::spike::<f32>(5);
    let (hits, distances, _) = ask(device, &mesh, &[], None);
    assert!(distances.is_empty() && hits.gradients.is_empty());
    let none = device.upload(&[]).unwrap();
    let mesh = upload(device, &mesh);
    let bars = query::pullback(device, &mesh, &none, &hits, &none, Some(&none)).unwrap();
    let vertices = device.download(&bars.vertices).unwrap();
    assert_eq!(vertices, vec![0.0; 21]);
}
