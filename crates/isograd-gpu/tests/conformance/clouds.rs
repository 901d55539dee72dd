//! Clouds that stages of points are tried on, and what the CPU finds in them.

use isograd::neighbors::{self, RadiiCotangent, Radius};
use isograd::orient::Method;
use isograd::poisson::Walls;
use isograd::{Options, Orienter, PointCloud, Real, SurfaceResolution, normals};
use isograd_gpu::neighbors::Neighborhoods;
use isograd_gpu::{Buffer, Device, Scalar};
use isograd_shapes::{Layout, Sampling};

use crate::devices::Numbers;
use cubecl::prelude::Runtime;

/// A cloud, and its neighborhoods and axes on the CPU.
pub struct Cloud<T> {
    pub name: &'static str,
    pub points: Vec<[T; 3]>,
    pub near: neighbors::Neighborhoods<T>,
    pub axes: normals::Residual<T>,
}

impl<T: Scalar> Cloud<T> {
    fn new(name: &'static str, points: Vec<[f64; 3]>) -> Self {
        Self::of(name, points.iter().map(|p| p.map(real)).collect())
    }

    pub fn of(name: &'static str, points: Vec<[T; 3]>) -> Self {
        let plan = on_cpu(&points, Method::Signs).expect(name);
        Self {
            name,
            near: plan.neighborhoods().clone(),
            axes: plan.axes().clone(),
            points,
        }
    }

    /// The points on the device.
    pub fn upload<R: Runtime>(&self, device: &Device<R>) -> Buffer<T> {
        device.upload(self.points.as_flattened()).unwrap()
    }

    /// The points on the device, sorted, with the CPU's radii and axes.
    pub fn upload_sorted<R: Runtime>(&self, device: &Device<R>) -> (Neighborhoods<T>, Buffer<T>) {
        let radii = device.upload(&self.near.radius).unwrap();
        let near = isograd_gpu::neighbors::forward(device, &self.upload(device), &radii).unwrap();
        let axes = device.upload(self.axes.normals.as_flattened()).unwrap();
        (near, axes)
    }
}

impl<T: Scalar> Cloud<T> {
    /// Compares cotangents of points, at fixed radii and with what the radii mean for them, with those of the CPU.
    pub fn compare_pullbacks(
        &self,
        (mut found, radii): (Vec<[T; 3]>, RadiiCotangent),
        (mut expected, expected_radii): (Vec<[T; 3]>, RadiiCotangent),
        tolerance: f64,
    ) {
        let fixed = relative(found.as_flattened(), expected.as_flattened());
        neighbors::pullback(&self.near, &radii, &mut found);
        neighbors::pullback(&self.near, &expected_radii, &mut expected);
        let error = relative(found.as_flattened(), expected.as_flattened());
        let (name, number) = (self.name, T::NAME);
        println!("{name}, {number}: pullback within {fixed:.1e}, with radii {error:.1e}");
        assert!(fixed.max(error) <= tolerance, "{name}: {fixed:e} {error:e}");
    }
}

/// The neighborhoods of points on the CPU, and with [`Method::Signs`] their axes.
pub fn on_cpu<T: Scalar>(points: &[[T; 3]], method: Method) -> Result<Orienter<T>, isograd::Error> {
    let up = [T::zero(), T::zero(), T::one()];
    let cloud =
        PointCloud::new(points.to_vec()).and_then(|c| c.with_normals(vec![up; points.len()]));
    let mut plan = Orienter::new(Radius::Auto, method).with_checks(false);
    plan.orient(&cloud.unwrap())?;
    Ok(plan)
}

/// Even samples of a shape, with their normals.
pub fn sampled<T: Scalar>(shape: &str, count: usize) -> PointCloud<T> {
    let shape = isograd_shapes::by_name(shape).unwrap();
    let samples = shape.sample::<T>(count, &Sampling::default(), 3);
    samples.unwrap().cloud
}

/// Even samples of a shape, without normals.
pub fn bare<T: Scalar>(shape: &str, count: usize) -> PointCloud<T> {
    PointCloud::new(sampled::<T>(shape, count).points().to_vec()).unwrap()
}

/// Options with the surface and the walls of devices.
pub fn on_grid() -> Options {
    Options::default()
        .surface(SurfaceResolution::Grid)
        .walls(Walls::Free)
}

/// Cotangents of points and of their radii, in the host's memory.
pub fn downloaded<R: Runtime, T: Scalar>(
    device: &Device<R>,
    (points, radii): (Buffer<T>, Buffer<T>),
) -> (Vec<[T; 3]>, Vec<T>) {
    let [points, radii] = [&points, &radii].map(|bar| device.download(bar).unwrap());
    (points.as_chunks().0.to_vec(), radii)
}

/// The nearest number of type `T`.
pub fn real<T: Scalar>(x: f64) -> T {
    <T as Real>::of(x)
}

/// Samples of surfaces with and without noise, and clouds that break careless indices.
pub fn clouds<T: Scalar>() -> Vec<Cloud<T>> {
    let sampling = Sampling {
        layout: Layout::Random,
        ..Sampling::default()
    };
    let sample = |name: &str, n: usize| {
        let shape = isograd_shapes::by_name(name).unwrap();
        let samples = shape.sample::<f64>(n, &sampling, 5).unwrap();
        samples.cloud.points().to_vec()
    };
    let mut numbers = Numbers(7);
    let mut noisy = sample("torus", 1201);
    for x in noisy.as_flattened_mut() {
        *x += 0.02 * numbers.signed();
    }
    let mut make = |n: usize, f: &dyn Fn(usize, [f64; 3]) -> [f64; 3]| -> Vec<[f64; 3]> {
        (0..n)
            .map(|i| f(i, [0; 3].map(|_| numbers.unit())))
            .collect()
    };
    let mut doubled = make(701, &|_, p| p);
    for i in (0..700).step_by(7) {
        doubled[i] = doubled[i + 1];
    }
    doubled.push([30.0, -20.0, 10.0]);
    let dense_spot = |i: usize, p: [f64; 3]| match i % 10 {
        0 => p,
        _ => p.map(|x| 1e-6 * x),
    };
    vec![
        Cloud::new("torus", sample("torus", 3001)),
        Cloud::new("fish", sample("fish", 2503)),
        Cloud::new("torus with noise", noisy),
        Cloud::new("duplicates and an isolated point", doubled),
        Cloud::new("nine tenths in one place", make(600, &dense_spot)),
        Cloud::new(
            "two clusters far apart",
            make(400, &|i, p| p.map(|x| x + 1e3 * (i % 2) as f64)),
        ),
        Cloud::new(
            "one outlier",
            make(400, &|i, p| if i == 17 { [1e9, -1e9, 1e9] } else { p }),
        ),
    ]
}

/// The largest difference, relative to `scale`.
pub fn difference<T: Scalar>(found: &[T], expected: &[f64], scale: f64) -> f64 {
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().zip(expected);
    pairs.fold(0.0, |m: f64, (a, b)| {
        // A maximum would skip NaN.
        let error = (a.f64() - b).abs() / scale;
        if error <= m { m } else { error }
    })
}

pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// The largest difference, over the largest number that is expected.
pub fn relative<T: Scalar>(found: &[T], expected: &[T]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let (mut difference, mut size) = (0.0f64, f64::MIN_POSITIVE);
    for (found, expected) in found.iter().zip(expected) {
        let (found, expected) = (Real::f64(*found), Real::f64(*expected));
        assert!(found.is_finite(), "{found}, not {expected}");
        difference = difference.max((found - expected).abs());
        size = size.max(expected.abs());
    }
    assert!(size > f64::MIN_POSITIVE, "nothing is expected");
    difference / size
}
