//! Refined normals and their pullback beside those of the CPU.

use cubecl::prelude::Runtime;
use isograd::neighbors::RadiiCotangent;
use isograd::orient::Method;
use isograd::refine;
use isograd_element::vector;
use isograd_gpu::{Buffer, Device, Scalar, neighbors, refine as on_device};

use crate::clouds::{Cloud, clouds, on_cpu, real, relative};
use crate::devices::{Numbers, tests, tolerance};

tests! {
    in_each_number: normals_and_pullback_are_those_of_the_cpu, heaps_are_finite;
    on_each_device: two_runs_give_the_same_bits, lengths_that_do_not_fit_are_refused;
}

/// Outward unit normals of a cloud.
fn outward<T: Scalar>(cloud: &Cloud<T>) -> Vec<[T; 3]> {
    let plan = on_cpu(&cloud.points, Method::Auto).expect(cloud.name);
    plan.orientation().normals.clone()
}

fn vectors<R: Runtime, T: Scalar>(device: &Device<R>, buffer: &Buffer<T>) -> Vec<[T; 3]> {
    device.download(buffer).unwrap().as_chunks().0.to_vec()
}

fn normals_and_pullback_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for cloud in clouds::<T>() {
        let (near, _) = cloud.upload_sorted(device);
        let before = outward(&cloud);
        let uploaded = device.upload(before.as_flattened()).unwrap();
        let (found, residual) = on_device::forward(device, &near, &uploaded).unwrap();
        let mut expected = before.clone();
        refine::forward(&cloud.near, &mut Default::default(), &mut expected);
        let found = vectors(device, &found);
        let error = relative(found.as_flattened(), expected.as_flattened());

        let mut bars: Vec<[T; 3]> = Numbers(3).vectors(before.len());
        let uploaded = device.upload(bars.as_flattened()).unwrap();
        let [points, normals, radii] = on_device::pullback(device, &residual, &uploaded).unwrap();
        let (mut points_bar, mut radii_bar) = (
            vec![[real(0.0); 3]; before.len()],
            RadiiCotangent::default(),
        );
        refine::pullback(
            &cloud.near,
            &before,
            &mut bars,
            &mut Default::default(),
            &mut points_bar,
            &mut radii_bar,
        );
        let of_normals = relative(
            vectors(device, &normals).as_flattened(),
            bars.as_flattened(),
        );
        println!(
            "{}, {}: normals within {error:.1e}, their cotangents {of_normals:.1e}",
            cloud.name,
            T::NAME
        );
        assert!(
            error.max(of_normals) <= tolerance,
            "{error:e} {of_normals:e}"
        );
        let radii = RadiiCotangent::of(&cloud.near, &device.download(&radii).unwrap());
        let found = (vectors(device, &points), radii);
        cloud.compare_pullbacks(found, (points_bar, radii_bar), tolerance);
    }
}

/// A name, and its points by number.
type Heap = (&'static str, fn(usize) -> [f64; 3]);

fn heaps_are_finite<R: Runtime, T: Scalar>(device: &Device<R>) {
    let heaps: [Heap; 3] = [
        ("line", |i| [i as f64, 2.0 * i as f64, 0.0]),
        ("all in one place", |_| [3.0, -1.0, 2.0]),
        ("far from each other", |i| [1e3 * i as f64, 0.0, -1e4]),
    ];
    let n = 101;
    for (name, point) in heaps {
        let points: Vec<T> = (0..n).flat_map(point).map(real).collect();
        let radii = device.upload(&vec![real::<T>(5.0); n]).unwrap();
        let near = neighbors::forward(device, &device.upload(&points).unwrap(), &radii).unwrap();
        let up = [0.0, 0.0, 1.0].map(real::<T>);
        let normals = device.upload(vec![up; n].as_flattened()).unwrap();
        let (found, residual) = on_device::forward(device, &near, &normals).unwrap();
        let bars = device.upload(&vec![real::<T>(1.0); 3 * n]).unwrap();
        let [points, before, _] = on_device::pullback(device, &residual, &bars).unwrap();
        for vector in [found, points, before]
            .iter()
            .flat_map(|of| vectors(device, of))
        {
            assert!(vector::is_finite(vector), "{name}: {vector:?}");
        }
    }
}

fn two_runs_give_the_same_bits<R: Runtime>(device: &Device<R>) {
    let cloud = &clouds::<f32>()[0];
    let run = || {
        let (near, axes) = cloud.upload_sorted(device);
        let (normals, residual) = on_device::forward(device, &near, &axes).unwrap();
        let [points, before, radii] = on_device::pullback(device, &residual, &normals).unwrap();
        [normals, points, before, radii].map(|buffer| {
            let values = device.download(&buffer).unwrap();
            values.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        })
    };
    assert_eq!(run(), run());
}

fn lengths_that_do_not_fit_are_refused<R: Runtime>(device: &Device<R>) {
    let (points, radii) = (
        device.upload(&[0f32; 12]).unwrap(),
        device.upload(&[1f32; 4]).unwrap(),
    );
    let near = neighbors::forward(device, &points, &radii).unwrap();
    assert!(on_device::forward(device, &near, &radii).is_err());
    let (_, residual) = on_device::forward(device, &near, &points).unwrap();
    assert!(on_device::pullback(device, &residual, &radii).is_err());
    assert!(on_device::pullback(device, &residual, &points).is_ok());
}
