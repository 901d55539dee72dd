//! Oriented samples in a grid, on the host and on a device.

use cubecl::prelude::Runtime;
use isograd::{Field, Grid};
use isograd_gpu::splat::{SampleCotangent, Samples, Weights};
use isograd_gpu::{Buffer, Device, Scalar};

use crate::devices::Numbers;

pub struct Cloud<T> {
    pub grid: Grid<T>,
    pub points: Vec<[T; 3]>,
    pub normals: Vec<[T; 3]>,
    pub areas: Vec<T>,
}

/// The arrays of a cloud on a device.
pub struct OnDevice<T> {
    pub points: Buffer<T>,
    pub normals: Buffer<T>,
    pub areas: Buffer<T>,
}

impl<T> OnDevice<T> {
    pub fn samples(&self) -> Samples<'_, T> {
        Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }
}

/// Result and residual of the CPU's splat.
pub struct OfCpu<T> {
    pub b: Field<T>,
    pub residual: isograd::splat::Residual,
}

impl<T: Scalar> Cloud<T> {
    /// Samples anywhere at least 2 cells inside, with any vectors and areas; `crowd` more of them in one cell,
    /// among the others.
    pub fn new(shape: [usize; 3], count: usize, crowd: usize) -> Self {
        let lower = [-1.0, 0.5, 2.0].map(T::of);
        let grid = Grid::new(lower, T::of(0.25), shape).expect("valid");
        let mut numbers = Numbers((7 * count + crowd) as u64);
        let mut cloud = Self {
            grid,
            points: Vec::new(),
            normals: Vec::new(),
            areas: Vec::new(),
        };
        for i in 0..count + crowd {
            // Every so often one of the `count`.
            let crowded = i * count / (count + crowd) == (i + 1) * count / (count + crowd);
            let place = std::array::from_fn(|a| {
                let high = shape[a] as f64 - 2.0;
                T::of(match crowded {
                    true => (shape[a] / 2) as f64 + numbers.unit() * 0.999,
                    false => 2.001 + (high - 2.002) * numbers.unit(),
                })
            });
            cloud.points.push(grid.from_index(place));
            let normal = std::array::from_fn(|_| T::of(numbers.signed()));
            cloud.normals.push(normal);
            cloud.areas.push(T::of(numbers.unit()));
        }
        cloud
    }

    pub fn samples(&self) -> isograd::splat::Samples<'_, T> {
        isograd::splat::Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }

    pub fn upload<R: Runtime>(&self, device: &Device<R>) -> OnDevice<T> {
        OnDevice {
            points: device.upload(self.points.as_flattened()).unwrap(),
            normals: device.upload(self.normals.as_flattened()).unwrap(),
            areas: device.upload(&self.areas).unwrap(),
        }
    }

    pub fn splat_on_cpu(&self, weights: Weights) -> OfCpu<T> {
        let mut b = Field::zeros(self.grid);
        let mut residual = isograd::splat::Residual::default();
        let scratch = &mut isograd::splat::Scratch::default();
        isograd::splat::forward(self.samples(), weights, scratch, &mut residual, &mut b)
            .expect("valid samples");
        OfCpu { b, residual }
    }

    /// Cotangents of samples with what other stages have added to them.
    pub fn started_cotangent(&self) -> isograd::splat::SampleCotangent<T> {
        let (mut numbers, count) = (Numbers(99), self.points.len());
        isograd::splat::SampleCotangent {
            points: numbers.vectors(count),
            normals: numbers.vectors(count),
            areas: numbers.list(count),
            grid: isograd::GridCotangent {
                lower: [1.0, 2.0, 3.0],
                spacing: 4.0,
            },
        }
    }

    /// Cotangents found on a device are those found by the CPU, `started` being what both began with. Relative to
    /// the largest of an array; for the grid, to the sum of the magnitudes of its terms.
    pub fn compare<R: Runtime>(
        &self,
        device: &Device<R>,
        found: &SampleCotangent<T>,
        expected: &isograd::splat::SampleCotangent<T>,
        tolerance: f64,
    ) {
        let same = |name: &str, found: &Buffer<T>, expected: &[T]| {
            assert_near(name, &device.download(found).unwrap(), expected, tolerance);
        };
        same("points", &found.points, expected.points.as_flattened());
        same("normals", &found.normals, expected.normals.as_flattened());
        same("areas", &found.areas, &expected.areas);
        let grid = device.download(&found.grid).unwrap();
        let mut sizes = [1.0, 2.0, 3.0, 4.0];
        for (i, bar) in expected.points.iter().enumerate() {
            let x = self.grid.to_index(self.points[i]);
            for a in 0..3 {
                sizes[a] += bar[a].f64().abs();
                sizes[3] += (bar[a] * x[a]).f64().abs();
            }
            let of_area = expected.areas[i] * self.areas[i] / self.grid.spacing();
            sizes[3] += 2.0 * of_area.f64().abs();
        }
        let [x, y, z] = expected.grid.lower;
        let of_cpu = [x, y, z, expected.grid.spacing];
        for a in 0..4 {
            let error = distance(grid[a], of_cpu[a]) / sizes[a];
            report("grid", error);
            assert!(error < tolerance, "grid {a}: {} {}", grid[a], of_cpu[a]);
        }
    }
}

/// Cotangents on a device, as `started` on the host.
pub fn upload_cotangent<R: Runtime, T: Scalar>(
    device: &Device<R>,
    started: &isograd::splat::SampleCotangent<T>,
) -> SampleCotangent<T> {
    let [x, y, z] = started.grid.lower;
    let grid = [x, y, z, started.grid.spacing].map(T::of);
    SampleCotangent {
        points: device.upload(started.points.as_flattened()).unwrap(),
        normals: device.upload(started.normals.as_flattened()).unwrap(),
        areas: device.upload(&started.areas).unwrap(),
        grid: device.upload(&grid).unwrap(),
    }
}

/// Largest difference relative to the largest number that is expected.
pub fn assert_near<T: Scalar>(name: &str, found: &[T], expected: &[T], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{name}");
    let size = expected.iter().fold(0.0, |m: f64, v| m.max(v.f64().abs()));
    let mut largest = 0.0;
    for i in 0..found.len() {
        let error = distance(found[i], expected[i].f64());
        // NaN must not pass.
        assert!(
            error <= tolerance * size,
            "{name}[{i}]: {} {} of {size}",
            found[i],
            expected[i]
        );
        largest = error.max(largest);
    }
    if size > 0.0 {
        report(name, largest / size);
    }
}

/// `|a − b|`.
pub fn distance<T: isograd::Real>(a: T, b: f64) -> f64 {
    (a.f64() - b).abs()
}

/// Seen with `--nocapture`.
pub fn report(name: &str, error: f64) {
    println!("{name}: {error:.1e}");
}
