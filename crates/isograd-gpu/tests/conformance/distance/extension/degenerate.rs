//! Next to nothing, and what can't be.

use super::*;
use isograd::distance::NO_TRIANGLE;

tests! {
    in_each_number:
        few_samples_or_equal_ones_give_their_mean, no_cells_and_no_vertices_give_nothing;
    on_each_device: bad_input_is_refused_as_on_the_cpu, what_does_not_fit_is_not_pulled_back;
}

/// Samples on a device without neighborhoods of the CPU, and the torus.
fn of_samples<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &[[f64; 3]],
    radius: f64,
    values: &[f64],
) -> OnDevice<T> {
    let scene = Scene::<T>::even();
    let attribute = Attribute {
        name: "any".into(),
        components: values.len() / points.len(),
        values: values.iter().map(|&v| T::of(v)).collect(),
    };
    let points: Vec<T> = points.as_flattened().iter().map(|&x| T::of(x)).collect();
    let count = points.len() / 3;
    let points = device.upload(&points).unwrap();
    let ones = device.upload(&vec![T::of(1.0); count]).unwrap();
    OnDevice {
        near: isograd_gpu::neighbors::forward(device, &points, &ones).unwrap(),
        radius: T::of(radius),
        areas: ones,
        ..scene.upload(device, &attribute)
    }
}

/// `ū` of 1 at all vertices and cells.
fn pull_ones<R: Runtime, T: Scalar>(
    device: &Device<R>,
    scene: &OnDevice<T>,
    (extension, residual): &(extend::Extension<T>, extend::Residual<T>),
) -> extend::Cotangent<T> {
    let ones = |buffer: &Buffer<T>| device.upload(&vec![T::of(1.0); buffer.len()]).unwrap();
    let (vertices, values) = (ones(&extension.vertices), ones(&extension.values));
    let given = [Some(&vertices), Some(&values)];
    scene
        .pullback(device, (extension, residual), given)
        .unwrap()
}

fn all<R: Runtime, T: Scalar>(device: &Device<R>, buffer: &Buffer<T>) -> Vec<f64> {
    let numbers = device.download(buffer).unwrap();
    numbers.into_iter().map(|x| Real::f64(x)).collect()
}

/// One sample, two, and equal ones that differ in what they say.
fn few_samples_or_equal_ones_give_their_mean<R: Runtime, T: Scalar>(device: &Device<R>) {
    let one = [[0.5, 0.1, 0.2]];
    for (points, values) in [
        (one.to_vec(), vec![7.0]),
        (one.repeat(70), (0..70).map(f64::from).collect()),
        (one.repeat(5), vec![1.0, 2.0, 3.0, 4.0, 10.0]),
    ] {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        for radius in [1e-3, 100.0] {
            let scene = of_samples::<R, T>(device, &points, radius, &values);
            let made = scene.extend(device, 3.0).unwrap();
            for value in [&made.0.vertices, &made.0.values]
                .map(|of| all(device, of))
                .concat()
            {
                assert!((value - mean).abs() < 1e-4 * mean, "{value} {mean}");
            }
            let found = pull_ones(device, &scene, &made);
            let total: f64 = all(device, &found.attribute).iter().sum();
            let expected = (made.0.vertices.len() + made.0.values.len()) as f64;
            assert!((total / expected - 1.0).abs() < 1e-4, "{total} {expected}");
            for bars in [&found.points, &found.areas, &found.vertices, &found.grid] {
                assert!(all(device, bars).iter().all(|x| x.is_finite()));
            }
        }
    }
    let two = [[0.5, 0.1, 0.2], [-0.4, 0.0, 0.1]];
    let scene = of_samples::<R, T>(device, &two, 0.3, &[1.0, 3.0]);
    let made = scene.extend(device, 3.0).unwrap();
    let values = all(device, &made.0.vertices);
    // A line through two samples is carried on a little.
    assert!(values.iter().all(|v| (-3.0..=7.0).contains(v)));
    let found = pull_ones(device, &scene, &made);
    let total: f64 = all(device, &found.attribute).iter().sum();
    let expected = (made.0.vertices.len() + made.0.values.len()) as f64;
    assert!((total / expected - 1.0).abs() < 1e-4, "{total} {expected}");
}

fn no_cells_and_no_vertices_give_nothing<R: Runtime, T: Scalar>(device: &Device<R>) {
    let scene = Scene::<T>::even();
    let attribute = scene.attribute(2);
    let on_device = OnDevice {
        closest: device
            .upload(&vec![NO_TRIANGLE; scene.closest.len()])
            .unwrap(),
        ..scene.upload(device, &attribute)
    };
    let made = on_device.extend(device, 3.0).unwrap();
    assert!(made.0.cells.is_empty() && made.0.values.is_empty());
    let (expected, _) = scene.on_cpu(&attribute, 3.0).unwrap();
    let vertices = device.download(&made.0.vertices).unwrap();
    let tolerance = crate::devices::tolerance::<T>();
    assert_near("vertices", &vertices, &expected.vertices, tolerance);
    let found = pull_ones(device, &on_device, &made);
    assert_eq!(all(device, &found.grid), [0.0; 4]);
    assert!(all(device, &found.attribute).iter().any(|x| *x != 0.0));

    let nothing = OnDevice {
        mesh: distance::Mesh {
            vertices: device.upload::<T>(&[]).unwrap(),
            faces: device.upload::<u32>(&[]).unwrap(),
        },
        ..on_device
    };
    let made = nothing.extend(device, 3.0).unwrap();
    assert!(made.0.vertices.is_empty() && made.0.cells.is_empty());
    let found = pull_ones(device, &nothing, &made);
    for (bars, count) in [
        (&found.attribute, 2 * scene.points.len()),
        (&found.points, 3 * scene.points.len()),
        (&found.areas, scene.points.len()),
        (&found.vertices, 0),
        (&found.grid, 4),
    ] {
        assert_eq!(all(device, bars), vec![0.0; count]);
    }
    assert_eq!(device.download(&found.guarded).unwrap(), [0]);
}

fn bad_input_is_refused_as_on_the_cpu<R: Runtime>(device: &Device<R>) {
    let good = Scene::<f32>::even();
    let attribute = good.attribute(2);
    let both = |scene: &Scene<f32>, attribute: &Attribute<f32>, band: f64| {
        let expected = scene.on_cpu(attribute, band).unwrap_err();
        match scene.upload(device, attribute).extend(device, band) {
            Err(extend::Error::Refused(found)) => {
                // One of two that are not a number equals the other.
                assert_eq!(found.to_string(), expected.to_string());
                println!("{found}");
            }
            other => panic!("{:?}", other.map(|_| ())),
        }
    };
    for band in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        both(&good, &attribute, band);
    }
    let mut bad = attribute.clone();
    bad.values.pop();
    both(&good, &bad, 3.0);
    bad.values.clear();
    bad.components = 0;
    both(&good, &bad, 3.0);
    for value in [f32::NAN, f32::INFINITY] {
        let mut bad = attribute.clone();
        bad.values[41] = value;
        bad.values[50] = value;
        both(&good, &bad, 3.0);
    }
    for area in [-1.0, f32::NAN, f32::INFINITY] {
        let mut broken = Scene::<f32>::even();
        broken.areas[3] = area;
        both(&broken, &attribute, 3.0);
    }
    let mut broken = Scene::<f32>::even();
    let face = broken.closest.iter().position(|&face| face != NO_TRIANGLE);
    broken.closest[face.unwrap()] = 9_999_999;
    both(&broken, &attribute, 50.0);
    broken.closest.pop();
    both(&broken, &attribute, 3.0);
}

fn what_does_not_fit_is_not_pulled_back<R: Runtime>(device: &Device<R>) {
    let scene = Scene::<f32>::even();
    let on_device = scene.upload(device, &scene.attribute(2));
    let (extension, residual) = on_device.extend(device, 3.0).unwrap();
    let refused = |extension: &extend::Extension<f32>, bar: Option<&Buffer<f32>>| match on_device
        .pullback(device, (extension, &residual), [bar, None])
    {
        Err(extend::Error::Refused(error)) => error,
        other => panic!("{:?}", other.map(|_| ())),
    };
    let short = device.upload(&[1.0f32]).unwrap();
    let error = refused(&extension, Some(&short));
    assert!(
        matches!(error, cpu::Error::Mismatch { length: 1, .. }),
        "{error}"
    );
    let mut cells = device.download(&extension.cells).unwrap();
    let last = cells.len() - 1;
    cells[last] = 123_456_789;
    let beyond = extend::Extension {
        cells: device.upload(&cells).unwrap(),
        ..extension.clone()
    };
    let error = refused(&beyond, None);
    let (cell, all) = (cells[last], scene.grid().cells());
    assert_eq!(error, cpu::Error::Cell { cell, cells: all });
    let far = scene.closest.iter().position(|&face| face == NO_TRIANGLE);
    cells[last] = far.unwrap() as u32;
    let astray = extend::Extension {
        cells: device.upload(&cells).unwrap(),
        ..extension
    };
    let error = refused(&astray, None);
    assert_eq!(error, cpu::Error::Face { face: NO_TRIANGLE });
}
