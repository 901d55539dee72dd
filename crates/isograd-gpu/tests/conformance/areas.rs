//! Areas and their pullback beside those of the CPU and the formulas as printed.

use cubecl::prelude::Runtime;
use isograd::neighbors::RadiiCotangent;
use isograd::{Real, splat};
use isograd_element::vector;
use isograd_gpu::splat::area;
use isograd_gpu::{Device, Scalar, neighbors};

use crate::clouds::{Cloud, clouds, downloaded, real, relative};
use crate::devices::{Numbers, tests, tolerance};

tests! {
    in_each_number:
        areas_and_their_pullback_are_those_of_the_cpu,
        the_pullback_is_the_one_printed_where_every_radius_is_another;
    on_each_device: no_points_have_no_areas;
}

fn areas_and_their_pullback_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let mut isolated = 0;
    for cloud in clouds::<T>() {
        let Cloud {
            name,
            near: cpu,
            axes,
            ..
        } = &cloud;
        let n = cloud.points.len();
        // As the pipeline has it: first with the radii of the axes.
        let wide = device.upload(&axes.radius).unwrap();
        let near = neighbors::forward(device, &cloud.upload(device), &wide).unwrap();
        let radii = device.upload(&cpu.radius).unwrap();
        let near = neighbors::with_radii(device, &near, &radii).unwrap();
        let (areas, residual) = area::forward(device, &near, cpu.common_radius).unwrap();
        let mut expected = Vec::new();
        splat::area::forward(cpu, &mut expected);
        let mut worst = 0.0f64;
        for (i, found) in device.download(&areas).unwrap().into_iter().enumerate() {
            if cpu.isolated[i] {
                isolated += 1;
                assert_eq!(Real::f64(found), 0.0, "{name}, point {i}");
            } else {
                worst = worst.max((Real::f64(found) / Real::f64(expected[i]) - 1.0).abs());
            }
        }
        assert!(worst <= tolerance::<T>(), "{name}: {worst:e}");
        let mut numbers = Numbers(5);
        // Each in the unit of its own area, so that large ones do not hide small ones.
        let bar = |i: usize| numbers_over(&mut numbers, Real::f64(cpu.radius[i]));
        let bar: Vec<T> = (0..n).map(bar).collect();
        let (mut pulled, mut radii) = (vec![[real(0.0); 3]; n], RadiiCotangent::default());
        let scratch = &mut Default::default();
        splat::area::pullback(cpu, &expected, &bar, scratch, &mut pulled, &mut radii);
        let found = area::pullback(device, &residual, &device.upload(&bar).unwrap()).unwrap();
        let (found, of_radii) = downloaded(device, found);
        let found_radii = RadiiCotangent::of(cpu, &of_radii);
        println!("{name}, {}: areas within {worst:.1e}", T::NAME);
        cloud.compare_pullbacks((found, found_radii), (pulled, radii), tolerance::<T>());
    }
    assert!(isolated >= 2, "{isolated} isolated points");
}

fn numbers_over<T: Scalar>(numbers: &mut Numbers, radius: f64) -> T {
    real(numbers.signed() / radius)
}

/// Sums over all pairs in double precision.
fn the_pullback_is_the_one_printed_where_every_radius_is_another<R: Runtime, T: Scalar>(
    device: &Device<R>,
) {
    let n = 307;
    let mut numbers = Numbers(19);
    let points: Vec<[T; 3]> = numbers.vectors(n);
    let radii: Vec<T> = (0..n).map(|_| real(0.1 + numbers.unit())).collect();
    let bars: Vec<T> = numbers.list(n);
    let mut expected = vec![[0.0; 3]; n];
    for i in 0..n {
        let square = Real::f64(radii[i]).powi(2);
        let offset = |j: usize| vector::sub(vector::to_f64(points[j]), vector::to_f64(points[i]));
        let rise = |j: usize| (1.0 - vector::norm_squared(offset(j)) / square).max(0.0);
        let crowd: f64 = (0..n).map(|j| rise(j).powi(2)).sum();
        let area = std::f64::consts::PI * square / (3.0 * crowd);
        let factor =
            Real::f64(bars[i]) * area * area * 12.0 / (std::f64::consts::PI * square * square);
        for j in 0..n {
            let bar = vector::scale(offset(j), factor * rise(j));
            expected[j] = vector::add(expected[j], bar);
            expected[i] = vector::sub(expected[i], bar);
        }
    }
    let buffer = device.upload(points.as_flattened()).unwrap();
    let near = neighbors::forward(device, &buffer, &device.upload(&radii).unwrap()).unwrap();
    // No radius counts as grown.
    let (_, residual) = area::forward(device, &near, real(2.0)).unwrap();
    let (found, _) = area::pullback(device, &residual, &device.upload(&bars).unwrap()).unwrap();
    let expected: Vec<T> = expected.as_flattened().iter().map(|&x| real(x)).collect();
    let error = relative(&device.download(&found).unwrap(), &expected);
    println!("{}: pullback within {error:.1e} of all pairs", T::NAME);
    assert!(error <= tolerance::<T>(), "{error:e}");
}

fn no_points_have_no_areas<R: Runtime>(device: &Device<R>) {
    let none = device.upload::<f32>(&[]).unwrap();
    let near = neighbors::forward(device, &none, &none).unwrap();
    assert!(near.is_empty());
    let (areas, residual) = area::forward(device, &near, 1.0).unwrap();
    let (points, radii) = area::pullback(device, &residual, &none).unwrap();
    assert!(areas.is_empty() && points.is_empty() && radii.is_empty());
    let one = device.upload(&[1f32]).unwrap();
    assert!(area::pullback(device, &residual, &one).is_err());
}
