//! Signs by parity and by given normals, and given normals themselves, beside those of the CPU.

use cubecl::prelude::Runtime;
use isograd::Real;
use isograd::orient::{self as cpu, Orientation, ParityOptions};
use isograd_element::vector;
use isograd_gpu::orient::{self, Error, Method, given};
use isograd_gpu::{Device, Scalar, neighbors};

use crate::clouds::{Cloud, clouds, real, relative};
use crate::devices::{Numbers, tests, tolerance};

tests! {
    in_each_number:
        parities_are_those_of_the_cpu, given_sides_are_those_of_the_cpu,
        given_normals_and_their_pullback_are_those_of_the_cpu;
    on_each_device:
        rays_through_the_center_of_a_sphere_are_not_much_work,
        options_and_clouds_that_the_cpu_refuses_are_refused,
        given_normals_without_a_direction_are_refused_by_number;
}

/// Orientation of a cloud's axes by the CPU.
fn expected<T: Scalar>(
    cloud: &Cloud<T>,
    known: Option<&[[T; 3]]>,
    method: cpu::Method,
) -> Result<Orientation<T>, cpu::Error> {
    let mut found = Orientation::default();
    let scratch = &mut Default::default();
    let Cloud {
        points, axes, near, ..
    } = cloud;
    cpu::forward(points, axes, near, known, &method, scratch, &mut found)?;
    Ok(found)
}

/// In single precision, rounding decides about probes that a sample is just in reach of: the CPU places them in
/// double.
fn parities_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let fine = ParityOptions {
        gamma: 1.0,
        tolerance: 3,
        step: 0.3,
    };
    let (mut points, mut turned, mut open) = (0, 0, 0);
    for cloud in clouds::<T>() {
        let (near, axes) = cloud.upload_sorted(device);
        let (name, n) = (cloud.name, cloud.points.len());
        for options in [ParityOptions::default(), fine] {
            let expected = expected(&cloud, None, cpu::Method::Parity(options)).unwrap();
            let method = Method::Parity(options);
            let found = orient::forward(device, &near, &axes, &method).unwrap();
            let cpu::MethodUsed::Parity { detection_radius } = expected.method else {
                panic!("{:?}", expected.method);
            };
            let ratio = found.detection_radius.unwrap() / detection_radius;
            assert!((ratio - 1.0).abs() < 0.1 * tolerance::<T>(), "{ratio}");
            let normals = device.download(&found.normals).unwrap();
            let confidence = device.download(&found.confidence).unwrap();
            let differs = |&i: &usize| {
                normals.as_chunks::<3>().0[i] != expected.normals[i]
                    || confidence[i] != expected.confidence[i]
            };
            let others = (0..n).filter(differs).count();
            println!("{name}, {}, {options:?}: {others} of {n} differ", T::NAME);
            let most = if T::NAME == "f32" { n.div_ceil(500) } else { 0 };
            assert!(others <= most, "{name}: {others} of {n} differ");
            points += n;
            turned += expected.flipped;
            let confidence = expected.confidence.iter();
            open += confidence.filter(|c| Real::f64(**c) == 0.0).count();
        }
    }
    assert!(
        4 * turned > points && 100 * open > points,
        "{turned} {open}"
    );
}

/// From the center all samples are about equally far: a search for the nearest would look at all of them from
/// every ray.
fn rays_through_the_center_of_a_sphere_are_not_much_work<R: Runtime>(device: &Device<R>) {
    let mut numbers = Numbers(31);
    let n = 6_000;
    let points: Vec<[f32; 3]> = (0..n)
        .map(|_| {
            let z = numbers.signed();
            let (sine, cosine) = (std::f64::consts::TAU * numbers.unit()).sin_cos();
            let r = (1.0 - z * z).sqrt();
            [r * cosine, r * sine, z].map(|x| x as f32)
        })
        .collect();
    let axis = |p: &[f32; 3]| if p[0] > 0.0 { *p } else { p.map(|x| -x) };
    let axes: Vec<[f32; 3]> = points.iter().map(axis).collect();
    let radii = device.upload(&vec![0.1f32; n]).unwrap();
    let buffer = device.upload(points.as_flattened()).unwrap();
    let near = neighbors::forward(device, &buffer, &radii).unwrap();
    let axes = device.upload(axes.as_flattened()).unwrap();
    let run = || {
        let method = Method::Parity(ParityOptions::default());
        let found = orient::forward(device, &near, &axes, &method).unwrap();
        let confidence = device.download(&found.confidence).unwrap();
        assert!(confidence.iter().all(|&c| c == 1.0));
        device.download(&found.normals).unwrap()
    };
    let normals = run();
    assert_eq!(normals, points.as_flattened());
    assert_eq!(normals, run());
}

fn options_and_clouds_that_the_cpu_refuses_are_refused<R: Runtime>(device: &Device<R>) {
    let cloud = &clouds::<f32>()[2];
    let refusal = |cloud: &Cloud<f32>, options| {
        let expected = expected(cloud, None, cpu::Method::Parity(options)).unwrap_err();
        let (near, axes) = cloud.upload_sorted(device);
        match orient::forward(device, &near, &axes, &Method::Parity(options)) {
            // NaN is not equal to itself.
            Err(Error::Cloud(found)) => assert_eq!(found.to_string(), expected.to_string()),
            other => panic!("{other:?}, not {expected}"),
        }
    };
    let options = |gamma, step| ParityOptions {
        gamma,
        tolerance: 2,
        step,
    };
    for (gamma, step) in [
        (0.5, 1.0),
        (f64::NAN, 1.0),
        (2.5, 0.0),
        (2.5, f64::INFINITY),
    ] {
        refusal(cloud, options(gamma, step));
    }
    let twice = Cloud::of("all twice", cloud.points.repeat(2));
    refusal(&twice, options(2.5, 1.0));
    let (near, axes) = cloud.upload_sorted(device);
    let few = device.upload(&[1f32; 9]).unwrap();
    let parity = Method::Parity(ParityOptions::default());
    assert!(orient::forward(device, &near, &few, &parity).is_err());
    assert!(orient::forward(device, &near, &axes, &Method::Signs(few.clone())).is_err());
}

/// Vectors of lengths from 10⁻⁵ to 10⁵.
fn vectors<T: Scalar>(n: usize) -> Vec<[T; 3]> {
    let mut numbers = Numbers(41);
    let mut vector = |_| {
        let length = 10f64.powf(5.0 * numbers.signed());
        [0; 3].map(|_| real(length * numbers.signed()))
    };
    (0..n).map(&mut vector).collect()
}

fn given_sides_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let cloud = &clouds::<T>()[1];
    let vectors = vectors::<T>(cloud.points.len());
    let expected = expected(cloud, Some(&vectors), cpu::Method::Signs).unwrap();
    let (near, axes) = cloud.upload_sorted(device);
    let given = device.upload(vectors.as_flattened()).unwrap();
    let found = orient::forward(device, &near, &axes, &Method::Signs(given)).unwrap();
    let normals = device.download(&found.normals).unwrap();
    let confidence = device.download(&found.confidence).unwrap();
    for i in 0..vectors.len() {
        let error = (Real::f64(confidence[i]) - Real::f64(expected.confidence[i])).abs();
        assert!(error < 0.01 * tolerance::<T>(), "point {i}: {error:e}");
        // At a right angle rounding decides.
        if Real::f64(confidence[i]) > 0.01 * tolerance::<T>() {
            assert_eq!(
                normals.as_chunks::<3>().0[i],
                expected.normals[i],
                "point {i}"
            );
        }
    }
    assert!(expected.flipped > vectors.len() / 4);
}

fn given_normals_and_their_pullback_are_those_of_the_cpu<R: Runtime, T: Scalar>(
    device: &Device<R>,
) {
    let vectors = vectors::<T>(1003);
    let given = device.upload(vectors.as_flattened()).unwrap();
    let normals = given::forward(device, &given).unwrap();
    let units = vectors.iter().map(|&v| vector::normalized(v).unwrap());
    let expected: Vec<[T; 3]> = units.collect();
    let error = relative(&device.download(&normals).unwrap(), expected.as_flattened());
    assert!(error < 0.01 * tolerance::<T>(), "{error:e}");
    let mut numbers = Numbers(43);
    // In the unit of each vector, so that short ones do not hide the others.
    let bar = |&v: &[T; 3]| {
        let length = vector::norm(vector::to_f64(v));
        [0; 3].map(|_| real(length * numbers.signed()))
    };
    let bars: Vec<[T; 3]> = vectors.iter().map(bar).collect();
    let mut expected = bars.clone();
    cpu::given_pullback(&vectors, &mut expected);
    let bars = device.upload(bars.as_flattened()).unwrap();
    let found = given::pullback(device, &given, &bars).unwrap();
    let error = relative(&device.download(&found).unwrap(), expected.as_flattened());
    println!("{}: pullback within {error:.1e}", T::NAME);
    assert!(error < 0.1 * tolerance::<T>(), "{error:e}");
    let none = device.upload::<T>(&[]).unwrap();
    assert!(given::forward(device, &none).unwrap().is_empty());
    assert!(given::pullback(device, &none, &none).unwrap().is_empty());
    assert!(given::pullback(device, &given, &none).is_err());
}

fn given_normals_without_a_direction_are_refused_by_number<R: Runtime>(device: &Device<R>) {
    for bad in [[0.0; 3], [f32::NAN, 1.0, 0.0], [1.0, 0.0, f32::INFINITY]] {
        for index in [0, 517, 1002] {
            let mut vectors = vectors::<f32>(1003);
            vectors[index] = bad;
            vectors[1002] = [0.0; 3];
            let buffer = device.upload(vectors.as_flattened()).unwrap();
            let expected = cpu::Error::NoDirection {
                index,
                kind: "the normal",
            };
            match given::forward(device, &buffer) {
                Err(Error::Cloud(found)) => assert_eq!(found, expected),
                other => panic!("{bad:?} at {index}: {other:?}"),
            }
        }
    }
}
