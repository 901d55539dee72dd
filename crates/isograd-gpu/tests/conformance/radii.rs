//! Radii, counts, isolated samples and wider radii beside those of the CPU.

use cubecl::prelude::Runtime;
use isograd::Real;
use isograd::neighbors::{self as cpu, Radius};
use isograd_gpu::neighbors::radius::{self, Error};
use isograd_gpu::splat::area;
use isograd_gpu::{Device, Scalar, neighbors, normals};

use crate::clouds::{Cloud, clouds, real};
use crate::devices::{Numbers, tests};

tests! {
    in_each_number: radii_are_those_of_the_cpu, wider_radii_are_those_of_the_cpu;
    on_each_device:
        bad_clouds_are_refused_in_the_words_of_the_cpu,
        heaps_take_no_quadratic_time_and_two_runs_give_the_same_bits;
}

/// Both sides of a plate that is one and a half spacings thick; with noise, of which one in ten has much, and far
/// from the origin.
fn plate<T: Scalar>(n: usize, noise: f64) -> Vec<[T; 3]> {
    let mut numbers = Numbers(23);
    let gap = 1.5 * (2.0 / n as f64).sqrt();
    let mut sample = |k: usize| {
        let height = gap * (k % 2) as f64;
        let reach = if k.is_multiple_of(10) { 5.0 } else { 1.0 };
        let noise = reach * noise * numbers.signed();
        [numbers.unit() + 3.0, numbers.unit(), height + noise].map(real)
    };
    (0..n).map(&mut sample).collect()
}

/// How far numbers with the same neighbors may be from each other, of their own size.
fn rounding<T: Scalar>() -> f64 {
    if T::NAME == "f32" { 1e-5 } else { 1e-12 }
}

/// Even and uneven clouds, and heaps of equal points.
fn radii_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let even = clouds::<T>().into_iter();
    let mut all: Vec<_> = even.map(|cloud| (cloud.name, cloud.points)).collect();
    all.push(("plate", plate(9_001, 0.002)));
    all.push(("four points", plate(4, 0.1)));
    all.push(("1025 points", plate(1025, 0.01)));
    let lattice = (0..2048).map(|i| [i & 15, (i >> 4) & 15, i >> 8].map(|x| real(x as f64 - 7.0)));
    all.push(("a lattice", lattice.collect()));
    all.push(("heaps of 40", plate(30, 0.1).repeat(40)));
    let mut isolated = 0;
    for (name, points) in all {
        let buffer = device.upload(points.as_flattened()).unwrap();
        let mut worst = 0.0f64;
        let rules = [Radius::Auto, Radius::Fixed(0.05), Radius::Fixed(1e-9)];
        // The smaller ones do for the others.
        let tried = if points.len() > 1024 { 1 } else { 3 };
        for rule in &rules[..tried] {
            let rule = *rule;
            let mut expected = cpu::Neighborhoods::default();
            cpu::forward(&points, rule, &mut expected).unwrap();
            let found = radius::forward(device, &buffer, rule).unwrap();
            let mut compare = |what: &str, found: T, expected: T| {
                let error = (Real::f64(found) / Real::f64(expected) - 1.0).abs();
                assert!(
                    error <= rounding::<T>(),
                    "{name}, {rule:?}, {what}: {found} {expected}"
                );
                worst = worst.max(error);
            };
            compare("common", found.common, expected.common_radius);
            compare("spacing", found.spacing, expected.spacing());
            let each = device.download(&found.each).unwrap();
            for (i, radius) in each.into_iter().enumerate() {
                compare(&format!("point {i}"), radius, expected.radius[i]);
            }
            let near = &found.neighborhoods;
            let (_, axes) = normals::forward(device, near).unwrap();
            let counts = device.download(&axes.count).unwrap();
            let (areas, _) = area::forward(device, near, found.common).unwrap();
            let areas = device.download(&areas).unwrap();
            for i in 0..points.len() {
                assert_eq!(counts[i], expected.count[i], "{name}, {rule:?}, point {i}");
                let is_isolated = Real::f64(areas[i]) == 0.0;
                assert_eq!(
                    is_isolated, expected.isolated[i],
                    "{name}, {rule:?}, point {i}"
                );
                isolated += usize::from(is_isolated);
            }
        }
        println!("{name}, {}: radii within {worst:.1e}", T::NAME);
    }
    assert!(isolated >= 2, "{isolated} isolated points");
}

/// Where the roughness is within rounding of a limit, one of the two may take a radius that the other leaves.
fn wider_radii_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let mut all = clouds::<T>();
    for (name, noise) in [("plate", 0.0), ("plate with noise", 0.004)] {
        all.push(Cloud::of(name, plate(3_001, noise)));
    }
    let (mut points, mut wider) = (0, 0);
    for cloud in all {
        let Cloud {
            name, axes, near, ..
        } = &cloud;
        let n = cloud.points.len();
        let radii = device.upload(&near.radius).unwrap();
        let sorted = neighbors::forward(device, &cloud.upload(device), &radii).unwrap();
        let (_, residual) = normals::forward(device, &sorted).unwrap();
        let widened = normals::widen(device, &residual).unwrap();
        let found = device.download(&widened).unwrap();
        let off = |i: &usize| {
            (Real::f64(found[*i]) / Real::f64(axes.radius[*i]) - 1.0).abs() > rounding::<T>()
        };
        let others = (0..n).filter(off).count();
        let widened = (0..n).filter(|&i| axes.radius[i] > near.radius[i]).count();
        println!(
            "{name}, {}: {widened} of {n} wider, {others} differ",
            T::NAME
        );
        let most = if T::NAME == "f32" { n.div_ceil(500) } else { 0 };
        assert!(others <= most, "{name}: {others} of {n} differ");
        points += n;
        wider += widened;
    }
    assert!(10 * wider > points, "{wider} of {points} wider");
}

fn bad_clouds_are_refused_in_the_words_of_the_cpu<R: Runtime>(device: &Device<R>) {
    let refusal = |points: &[[f32; 3]], rule| {
        let expected = cpu::forward(points, rule, &mut Default::default()).unwrap_err();
        let buffer = device.upload(points.as_flattened()).unwrap();
        match radius::forward(device, &buffer, rule) {
            Err(Error::Cloud(found)) => assert_eq!(found.to_string(), expected.to_string()),
            other => panic!("{other:?}, not {expected}"),
        }
    };
    let good = plate::<f32>(701, 0.1);
    for few in 0..4 {
        refusal(&good[..few], Radius::Auto);
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for (index, axis) in [(0, 0), (700, 2)] {
            let mut points = good.clone();
            points[index][axis] = bad;
            points[700][0] = f32::NAN;
            refusal(&points, Radius::Auto);
        }
    }
    refusal(&[[1.5; 3]; 99], Radius::Auto);
    refusal(
        &[[1e30, 0.0, 0.0], [0.0; 3], [1.0; 3], [2.0; 3]],
        Radius::Auto,
    );
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-20, 1e20] {
        refusal(&good, Radius::Fixed(radius));
    }
    let halves = device.upload(&[0f32; 100]).unwrap();
    let refused = radius::forward(device, &halves, Radius::Auto).err();
    assert!(matches!(
        refused,
        Some(Error::Device(isograd_gpu::Error::Length { .. }))
    ));
}

/// A walk over all equal points from each of them would take hours.
fn heaps_take_no_quadratic_time_and_two_runs_give_the_same_bits<R: Runtime>(device: &Device<R>) {
    let mut points = vec![[0.5f32; 3]; 40_000];
    points[7] = [1e6; 3];
    points[8] = [1e6, 0.0, 3.0];
    let buffer = device.upload(points.as_flattened()).unwrap();
    let run = || {
        let found = radius::forward(device, &buffer, Radius::Auto).unwrap();
        let each = device.download(&found.each).unwrap();
        (found.common, each)
    };
    let (common, each) = run();
    assert_eq!((common, each.clone()), run());
    // The mean over the two points that are not in the heap.
    assert!(common > 1.3e6 && each.iter().all(|&radius| radius >= common && radius < 2e6));
}
