//! The whole, forward and back, beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::isosurface::Level;
use isograd::neighbors::Radius;
use isograd::orient::{Method, ParityOptions};
use isograd::poisson::Smoothing;
use isograd::{Cotangent, Grid, PointCloud, Real, Reconstructor, Resolution};
use isograd_gpu::pipeline::{self, Error, Held};
use isograd_gpu::{Device, Scalar, orient};
use isograd_shapes::Sampling;

use crate::clouds::{real, relative};
use crate::devices::{Numbers, in_each_number, on_each_device};

#[test]
fn phi_and_its_gradient_are_those_of_the_cpu() {
    in_each_number!(compare);
}

fn cloud<T: Scalar>(name: &str, count: usize) -> PointCloud<T> {
    let shape = isograd_shapes::by_name(name).unwrap();
    let samples = shape.sample::<T>(count, &Sampling::default(), 3).unwrap();
    PointCloud::new(samples.cloud.points().to_vec()).unwrap()
}

fn compare<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = if T::NAME == "f32" { 2e-4 } else { 1e-9 };
    for (name, count, cells) in [("torus", 4000, 40), ("fish", 3000, 48)] {
        let cloud = cloud::<T>(name, count);
        let grid = Grid::fit(&cloud, Resolution::Cells(cells), real(0.1)).unwrap();
        let options = isograd::Options {
            level: Level::Mean,
            smoothing: Smoothing::Cells(1.0),
            ..isograd::Options::default()
        };
        let mut plan = Reconstructor::new(grid, options).unwrap();
        let expected = plan.reconstruct(&cloud).unwrap();
        let bar = weights::<T>(expected.sdf().values(), Real::f64(grid.spacing()));
        let cotangent = Cotangent {
            sdf: Some(&bar),
            ..Cotangent::default()
        };
        let expected_bar = expected.pullback(&cloud, &cotangent).unwrap();

        let plan = pipeline::Reconstructor::new(device.clone(), grid, Default::default()).unwrap();
        let held = Held::find(device, &cloud, Radius::Auto, &Method::Auto).unwrap();
        let points = device.upload(cloud.points().as_flattened()).unwrap();
        let result = plan.reconstruct(&points, &held).unwrap();
        let found = device.download(&result.sdf).unwrap();
        let difference = relative(&found, expected.sdf().values());
        assert!(
            difference < tolerance,
            "{name} {}: φ {difference:e}",
            T::NAME
        );

        let bars = plan
            .pullback(&result, &device.upload(&bar).unwrap())
            .unwrap();
        let found_bar = device.download(&bars.points).unwrap();
        let difference = relative(&found_bar, expected_bar.points.as_flattened());
        assert!(
            difference < 5.0 * tolerance,
            "{name} {}: x̄ {difference:e}",
            T::NAME
        );
        let grid_bar = device.download(&bars.grid).unwrap();
        let expected_grid = expected_bar.grid;
        let [x, y, z] = expected_grid.lower;
        let difference = relative(&grid_bar, &[x, y, z, expected_grid.spacing]);
        assert!(
            difference < 5.0 * tolerance,
            "{name} {}: grid {difference:e}",
            T::NAME
        );

        // The next step of a body that has not moved: the same bits, sides told by the normals before.
        let held = held.facing(result.normals.clone()).unwrap();
        let again = plan.reconstruct(&points, &held).unwrap();
        assert_eq!(device.download(&again.sdf).unwrap(), found);
        let bars = plan
            .pullback(&again, &device.upload(&bar).unwrap())
            .unwrap();
        assert_eq!(device.download(&bars.points).unwrap(), found_bar);
    }
}

/// Cotangents of φ near the surface, where the closest triangle does not jump.
fn weights<T: Scalar>(phi: &[T], spacing: f64) -> Vec<T> {
    let mut numbers = Numbers(11);
    phi.iter()
        .map(|&phi| {
            let weight = numbers.signed();
            let near = Real::f64(phi).abs() < 1.5 * spacing;
            real(if near { weight } else { 0.0 })
        })
        .collect()
}

#[test]
fn points_outside_the_grid_are_named() {
    fn check<R: Runtime>(device: &Device<R>) {
        let cloud = cloud::<f32>("torus", 500);
        let grid = Grid::new([0.0; 3], 0.1, [12, 12, 12]).unwrap();
        let plan = pipeline::Reconstructor::new(device.clone(), grid, Default::default()).unwrap();
        let held = Held::find(device, &cloud, Radius::Auto, &Method::Auto).unwrap();
        let points = device.upload(cloud.points().as_flattened()).unwrap();
        match plan.reconstruct(&points, &held) {
            Err(Error::Outside { count, first }) => assert!(count > 100 && first < 500),
            other => panic!("{:?}", other.err()),
        }
    }
    on_each_device!(check);
}

#[test]
fn what_the_device_finds_and_holds_is_what_the_cpu_finds() {
    in_each_number!(compare_held);
}

/// Points go to the device, and nothing else does.
fn compare_held<R: Runtime, T: Scalar>(device: &Device<R>) {
    let (tight, loose) = if T::NAME == "f32" {
        (1e-5, 2e-4)
    } else {
        (1e-12, 1e-9)
    };
    let shape = isograd_shapes::by_name("torus").unwrap();
    let cloud = shape
        .sample::<T>(4000, &Sampling::default(), 3)
        .unwrap()
        .cloud;
    let grid = Grid::fit(&cloud, Resolution::Cells(40), real(0.1)).unwrap();
    let plan = pipeline::Reconstructor::new(device.clone(), grid, Default::default()).unwrap();
    let points = device.upload(cloud.points().as_flattened()).unwrap();
    let normals = device
        .upload(cloud.normals().unwrap().as_flattened())
        .unwrap();
    let parity = ParityOptions::default();
    let methods = [
        (Method::Signs, orient::Method::Signs(&normals)),
        (Method::Parity(parity), orient::Method::Parity(parity)),
    ];
    for (on_cpu, on_device) in methods {
        for radius in [Radius::Auto, Radius::Fixed(0.08)] {
            let expected = Held::find(device, &cloud, radius, &on_cpu).unwrap();
            let found = Held::find_on_device(device, &points, radius, &on_device).unwrap();
            let common = Real::f64(found.common_radius) / Real::f64(expected.common_radius);
            assert!((common - 1.0).abs() < tight, "{common}");
            for (found, expected) in [
                (&found.radii, &expected.radii),
                (&found.area_radii, &expected.area_radii),
                (&found.outward, &expected.outward),
                (&found.confidence, &expected.confidence),
            ] {
                let [found, expected] = [found, expected].map(|b| device.download(b).unwrap());
                let difference = relative(&found, &expected);
                assert!(difference < loose, "{on_cpu:?}, {radius:?}: {difference:e}");
            }
            if radius != Radius::Auto {
                continue;
            }
            let [found, expected] = [&found, &expected].map(|held| {
                let result = plan.reconstruct(&points, held).unwrap();
                device.download(&result.sdf).unwrap()
            });
            let difference = relative(&found, &expected);
            println!("{on_cpu:?}, {radius:?}, {}: φ {difference:.1e}", T::NAME);
            assert!(
                difference < loose,
                "{on_cpu:?}, {radius:?}: φ {difference:e}"
            );
        }
    }
    let none = device.upload::<T>(&[]).unwrap();
    let method = orient::Method::Parity(parity);
    assert!(matches!(
        Held::find_on_device(device, &none, Radius::Auto, &method),
        Err(Error::Neighbors(_))
    ));
    let short = orient::Method::Signs(&none);
    assert!(matches!(
        Held::find_on_device(device, &points, Radius::Auto, &short),
        Err(Error::Device(_))
    ));
}
