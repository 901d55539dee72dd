//! Axes and their pullback beside those of the CPU and the formulas as printed.

use cubecl::prelude::Runtime;
use isograd::Real;
use isograd::neighbors::RadiiCotangent;
use isograd::normals::radii_pullback;
use isograd_element::vector;
use isograd_gpu::{Device, Scalar, neighbors, normals};

use crate::clouds::{Cloud, clouds, downloaded, real, relative};
use crate::devices::{Numbers, tests, tolerance};

tests! {
    in_each_number:
        neighbors_are_those_of_a_plain_loop, axes_and_planes_are_those_of_the_cpu,
        the_pullback_is_that_of_the_cpu,
        the_pullback_is_the_one_printed_where_every_radius_is_another,
        lines_and_heaps_are_guarded_and_finite;
    on_each_device: two_runs_give_the_same_bits, lengths_that_do_not_fit_are_refused;
}

/// Radii of all sizes; sizes round those of leaves and of full trees.
fn neighbors_are_those_of_a_plain_loop<R: Runtime, T: Scalar>(device: &Device<R>) {
    for n in [0, 1, 2, 7, 8, 9, 31, 32, 33, 128, 129, 512, 513, 2053] {
        let mut numbers = Numbers(n as u64);
        let points: Vec<[T; 3]> = numbers.vectors(n);
        let radii: Vec<T> = (0..n)
            .map(|_| real(10f64.powf(1.5 * numbers.signed() - 1.0)))
            .collect();
        let buffer = device.upload(points.as_flattened()).unwrap();
        let near = neighbors::forward(device, &buffer, &device.upload(&radii).unwrap()).unwrap();
        let (_, residual) = normals::forward(device, &near).unwrap();
        let found = device.download(&residual.count).unwrap();
        let within = |i: usize, factor: f64| {
            let limit = Real::f64(radii[i]).powi(2) * factor;
            let square = |p: &[T; 3]| {
                let d = vector::sub(vector::to_f64(*p), vector::to_f64(points[i]));
                vector::norm_squared(d)
            };
            points.iter().filter(|&p| square(p) <= limit).count() as u32
        };
        for i in 0..n {
            // Rounding decides about a point on the radius.
            let bounds = within(i, 1.0 - 1e-6)..=within(i, 1.0 + 1e-6);
            assert!(
                bounds.contains(&found[i]),
                "{n} points, {i}: {} {bounds:?}",
                found[i]
            );
        }
    }
}

fn axes_and_planes_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    for cloud in clouds::<T>() {
        let Cloud { name, axes, .. } = &cloud;
        let radii = device.upload(&axes.radius).unwrap();
        let near = neighbors::forward(device, &cloud.upload(device), &radii).unwrap();
        let (normals, residual) = normals::forward(device, &near).unwrap();
        assert_eq!(
            device.download(&residual.count).unwrap(),
            axes.count,
            "{name}"
        );
        let normals = device.download(&normals).unwrap();
        let planes = residual.planes(device).unwrap();
        let guarded = planes.iter().filter(|plane| plane.guarded).count();
        assert_eq!(residual.guarded(device).unwrap(), guarded, "{name}");
        let mut worst = [0.0f64; 4];
        for (i, n) in normals.as_chunks::<3>().0.iter().enumerate() {
            let (n, cpu) = (vector::to_f64(*n), vector::to_f64(axes.normals[i]));
            let (found, expected) = (&planes[i], &axes.planes[i]);
            let radius = Real::f64(axes.radius[i]);
            let distance = |a: [T; 3], b: [T; 3]| {
                vector::norm(vector::sub(vector::to_f64(a), vector::to_f64(b)))
            };
            let [l1, l2, l3] = vector::to_f64(expected.eigenvalues).map(|x| x / (radius * radius));
            let sign = vector::dot(n, cpu).signum();
            // Rounding turns an axis by itself over the gap.
            let axis = vector::norm(vector::sub(n, vector::scale(cpu, sign))) * (l2 - l1);
            let errors = [
                axis,
                distance(found.centroid, expected.centroid) / radius,
                (Real::f64(found.weight) / Real::f64(expected.weight) - 1.0).abs(),
                distance(found.eigenvalues, expected.eigenvalues) / (radius * radius),
            ];
            for (worst, error) in worst.iter_mut().zip(errors) {
                assert!(
                    error <= 0.1 * tolerance::<T>(),
                    "{name}, point {i}: {errors:?}"
                );
                *worst = worst.max(error);
            }
            assert!(
                (vector::norm(n) - 1.0).abs() < 0.1 * tolerance::<T>(),
                "{n:?}"
            );
            let largest = n
                .into_iter()
                .fold(0.0, |m: f64, x| if x.abs() > m.abs() { x } else { m });
            assert!(largest > 0.0, "{name}, point {i}: {n:?}");
            if (l2 - l1 - 1e-3 * l3).abs() > tolerance::<T>() {
                assert_eq!(found.guarded, expected.guarded, "{name}, point {i}");
            }
        }
        println!("{name}, {}: axis, m, W, λ within {worst:?}", T::NAME);
    }
}

fn the_pullback_is_that_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    for cloud in clouds::<T>() {
        let Cloud { axes, .. } = &cloud;
        let n = cloud.points.len();
        let radii = device.upload(&axes.radius).unwrap();
        let near = neighbors::forward(device, &cloud.upload(device), &radii).unwrap();
        let (normals, residual) = normals::forward(device, &near).unwrap();
        let normals = device.download(&normals).unwrap();
        let mut numbers = Numbers(3);
        let (mut bar, mut cpu_bar) = (vec![[real(0.0); 3]; n], vec![[real(0.0); 3]; n]);
        for i in 0..n {
            let [l1, l2, l3] = vector::to_f64(axes.planes[i].eigenvalues);
            // Else rounding alone turns the axis, and the derivative with it.
            if l2 - l1 > 0.01 * l3 {
                let of_gpu = vector::to_f64(normals.as_chunks::<3>().0[i]);
                let sign = vector::dot(of_gpu, vector::to_f64(axes.normals[i])).signum();
                let drawn = [0; 3].map(|_| numbers.signed());
                bar[i] = drawn.map(real);
                cpu_bar[i] = drawn.map(|x| real(sign * x));
            }
        }
        let (mut expected, mut radii) = (vec![[real(0.0); 3]; n], RadiiCotangent::default());
        isograd::normals::pullback(
            &cloud.near,
            axes,
            &cpu_bar,
            &mut Default::default(),
            &mut expected,
            &mut radii,
        );
        let bar = device.upload(bar.as_flattened()).unwrap();
        let found = normals::pullback(device, &residual, &bar).unwrap();
        let (mut found, of_radii) = downloaded(device, found);
        let (near, mut found_radii) = (&cloud.near, RadiiCotangent::default());
        let widened = [&axes.radius[..], &near.radius];
        radii_pullback(near, widened, &of_radii, &mut found, &mut found_radii);
        cloud.compare_pullbacks((found, found_radii), (expected, radii), tolerance::<T>());
    }
}

/// Sums over all pairs in double precision, from the planes of the device.
fn the_pullback_is_the_one_printed_where_every_radius_is_another<R: Runtime, T: Scalar>(
    device: &Device<R>,
) {
    let n = 251;
    let mut numbers = Numbers(17);
    let points: Vec<[T; 3]> = (0..n)
        .map(|_| [1.0, 1.0, 0.1].map(|size| real(size * numbers.signed())))
        .collect();
    let radii: Vec<T> = (0..n).map(|_| real(0.3 + 0.7 * numbers.unit())).collect();
    let bars: Vec<[T; 3]> = numbers.vectors(n);
    let buffer = device.upload(points.as_flattened()).unwrap();
    let near = neighbors::forward(device, &buffer, &device.upload(&radii).unwrap()).unwrap();
    let (normals, residual) = normals::forward(device, &near).unwrap();
    let normals = device.download(&normals).unwrap();
    let planes = residual.planes(device).unwrap();
    let mut expected = vec![[0.0; 3]; n];
    for i in 0..n {
        let normal = vector::to_f64(normals.as_chunks::<3>().0[i]);
        let (plane, bar) = (&planes[i], vector::to_f64(bars[i]));
        let [first, others @ ..] = vector::to_f64(plane.eigenvalues);
        let mut g = [0.0; 3];
        for (value, v) in others.into_iter().zip(plane.tangents) {
            let v = vector::to_f64(v);
            g = vector::add(g, vector::scale(v, vector::dot(v, bar) / (first - value)));
        }
        let (radius, weight) = (Real::f64(radii[i]), Real::f64(plane.weight));
        for j in 0..n {
            let d = vector::sub(vector::to_f64(points[j]), vector::to_f64(points[i]));
            let r = vector::norm(d);
            if j == i || r > radius {
                continue;
            }
            let t = (5.0 * (1.0 - r / radius)).min(1.0);
            let inverse = 1.0 / (r + 0.2 * radius);
            let w = t * t * (3.0 - 2.0 * t) * inverse;
            let fall = w * inverse + 30.0 / radius * t * (1.0 - t) * inverse;
            let e = vector::sub(d, vector::to_f64(plane.centroid));
            let (ge, ne) = (vector::dot(g, e), vector::dot(normal, e));
            for a in 0..3 {
                let bar =
                    w / weight * (g[a] * ne + normal[a] * ge) - fall / weight * ge * ne * d[a] / r;
                expected[j][a] += bar;
                expected[i][a] -= bar;
            }
        }
    }
    let bars = device.upload(bars.as_flattened()).unwrap();
    let (found, _) = normals::pullback(device, &residual, &bars).unwrap();
    let expected: Vec<T> = expected.as_flattened().iter().map(|&x| real(x)).collect();
    let error = relative(&device.download(&found).unwrap(), &expected);
    println!("{}: pullback within {error:.1e} of all pairs", T::NAME);
    assert!(error <= tolerance::<T>(), "{error:e}");
}

/// A name, and its points by number.
type Heap = (&'static str, fn(usize) -> [f64; 3]);

fn lines_and_heaps_are_guarded_and_finite<R: Runtime, T: Scalar>(device: &Device<R>) {
    let clouds: [Heap; 4] = [
        ("line", |i| [i as f64, 2.0 * i as f64, 0.0]),
        ("all in one place", |_| [3.0, -1.0, 2.0]),
        ("far from each other", |i| [1e3 * i as f64, 0.0, -1e4]),
        ("as good as one place", |i| {
            [1e-18 * i as f64, 0.0, 1e-19 * (i % 3) as f64]
        }),
    ];
    let n = 101;
    for (name, point) in clouds {
        let points: Vec<T> = (0..n).flat_map(point).map(real).collect();
        let radii = device.upload(&vec![real::<T>(5.0); n]).unwrap();
        let near = neighbors::forward(device, &device.upload(&points).unwrap(), &radii).unwrap();
        let (normals, residual) = normals::forward(device, &near).unwrap();
        for axis in device.download(&normals).unwrap().as_chunks::<3>().0 {
            let length = vector::norm(vector::to_f64(*axis));
            assert!((length - 1.0).abs() < tolerance::<T>(), "{name}: {axis:?}");
        }
        if name != "as good as one place" {
            assert_eq!(residual.guarded(device).unwrap(), n, "{name}");
        }
        let bars = device.upload(&vec![real::<T>(1.0); 3 * n]).unwrap();
        let (found, _) = normals::pullback(device, &residual, &bars).unwrap();
        for x in device.download(&found).unwrap() {
            assert!(Real::f64(x).is_finite(), "{name}: {x}");
        }
    }
}

fn two_runs_give_the_same_bits<R: Runtime>(device: &Device<R>) {
    let cloud = &clouds::<f32>()[0];
    let run = || {
        let radii = device.upload(&cloud.axes.radius).unwrap();
        let near = neighbors::forward(device, &cloud.upload(device), &radii).unwrap();
        let (normals, residual) = normals::forward(device, &near).unwrap();
        let (points_bar, _) = normals::pullback(device, &residual, &normals).unwrap();
        [normals, points_bar].map(|buffer| {
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
    assert!(neighbors::forward(device, &radii, &points).is_err());
    assert!(neighbors::with_radii(device, &near, &points).is_err());
    let (_, residual) = normals::forward(device, &near).unwrap();
    assert!(normals::pullback(device, &residual, &radii).is_err());
    assert!(normals::pullback(device, &residual, &points).is_ok());
}
