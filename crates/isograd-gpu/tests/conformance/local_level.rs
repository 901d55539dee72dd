//! The local iso-value and its pullback, beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::isosurface::iso_value as mean;
use isograd::isosurface::local_level as cpu;
use isograd::splat::{SortedSamples, Weights};
use isograd::{Field, Grid};
use isograd_gpu::isosurface::iso_value;
use isograd_gpu::isosurface::local_level::{Options, Residual, forward, pullback};
use isograd_gpu::splat::{self, SampleCotangent};
use isograd_gpu::{Buffer, Device, Scalar};

use crate::devices::{Numbers, tests, tolerance};
use crate::samples::{Cloud, OnDevice, assert_near, distance, report, upload_cotangent};

tests! {
    in_each_number:
        values_are_those_of_the_cpu, pullbacks_are_those_of_the_cpu,
        where_nothing_is_followed_nothing_changes;
}

/// Samples of a torus, and an indicator that is a little off on it.
struct Setting<T> {
    cloud: Cloud<T>,
    chi: Field<T>,
    options: Options,
}

/// Results of a run on the CPU.
struct OfCpu<T> {
    chi: Field<T>,
    order: isograd::splat::Residual,
    residual: cpu::Residual<T>,
}

/// Results of a run on a device.
struct OfDevice<T> {
    samples: OnDevice<T>,
    splat: splat::Residual<T>,
    chi: Buffer<T>,
    residual: Residual<T>,
}

impl<T: Scalar> Setting<T> {
    /// `crowd` more samples of less area are in one cell. Every fourth normal is turned anywhere: the indicator is as
    /// flat along it as it is on thin parts.
    fn new(count: usize, crowd: usize, options: Options) -> Self {
        let lower = [-1.41, -1.36, -0.81].map(T::of);
        let grid = Grid::new(lower, T::of(0.1), [29, 27, 17]).expect("a grid");
        let mut numbers = Numbers((count + crowd) as u64);
        let samples: Vec<_> = (0..count).map(|_| on_torus(&mut numbers)).collect();
        let first = grid.to_index(samples[0].0.map(T::of));
        let middle = first.map(|x| x.f64().floor() + 0.5);
        let mut cloud = Cloud {
            grid,
            points: Vec::new(),
            normals: Vec::new(),
            areas: Vec::new(),
        };
        for i in 0..count + crowd {
            let (point, normal) = samples[if i < count { i } else { 0 }];
            let place = match i < count {
                true => point.map(T::of),
                // Anywhere in the cell of the first sample, on all sides of its center.
                false => grid.from_index(middle.map(|x| T::of(x + 0.49 * numbers.signed()))),
            };
            let normal = match i % 4 {
                0 => [0; 3].map(|_| numbers.signed()),
                _ => normal,
            };
            let size = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            cloud.points.push(place);
            cloud.normals.push(normal.map(|x| T::of(x / size)));
            let area = if i < count { 7.0 } else { 0.02 } / count as f64;
            cloud.areas.push(T::of(area * (0.5 + numbers.unit())));
        }
        Self {
            chi: indicator(grid),
            cloud,
            options,
        }
    }

    /// With samples moved by up to a cell along each axis.
    fn scattered(mut self) -> Self {
        let mut numbers = Numbers(5);
        for x in self.cloud.points.as_flattened_mut() {
            *x = T::of(x.f64() + 0.1 * numbers.signed());
        }
        self
    }

    /// This setting in double precision.
    fn exactly(&self) -> Setting<f64> {
        let vectors = |of: &[[T; 3]]| of.iter().map(|v| v.map(|x| x.f64())).collect();
        let numbers = |of: &[T]| of.iter().map(|x| x.f64()).collect();
        let (lower, shape) = (self.cloud.grid.lower(), self.cloud.grid.shape());
        let spacing = self.cloud.grid.spacing().f64();
        let grid = Grid::new(lower.map(|x| x.f64()), spacing, shape).expect("a grid");
        Setting {
            cloud: Cloud {
                grid,
                points: vectors(&self.cloud.points),
                normals: vectors(&self.cloud.normals),
                areas: numbers(&self.cloud.areas),
            },
            chi: Field::new(grid, numbers(self.chi.values())).expect("sizes match"),
            options: self.options,
        }
    }

    fn mean(&self) -> mean::Residual<T> {
        let mut residual = mean::Residual::default();
        let Cloud { points, areas, .. } = &self.cloud;
        mean::forward(&self.chi, points, areas, &mut residual).expect("a value");
        residual
    }

    fn run_on_cpu(&self) -> OfCpu<T> {
        let (mut chi, mut residual) = (self.chi.clone(), cpu::Residual::default());
        let order = self.cloud.splat_on_cpu(Weights::BSpline).residual;
        let sorted = SortedSamples {
            samples: self.cloud.samples(),
            order: &order,
        };
        let (mean, scratch) = (self.mean(), &mut cpu::Scratch::default());
        cpu::forward(
            &mut chi,
            sorted,
            self.options,
            &mean,
            scratch,
            &mut residual,
        );
        OfCpu {
            chi,
            order,
            residual,
        }
    }

    fn run<R: Runtime>(&self, device: &Device<R>) -> OfDevice<T> {
        let on_device = self.cloud.upload(device);
        let samples = on_device.samples();
        let grid = &self.cloud.grid;
        let (_, splat) = splat::forward(device, samples, grid, Weights::BSpline).unwrap();
        let chi = device.upload(self.chi.values()).unwrap();
        let (points, areas) = (samples.points, samples.areas);
        let (_, mean) = iso_value::forward(device, &chi, grid, points, areas).unwrap();
        let (chi, residual) = forward(device, &chi, samples, self.options, &mean, &splat).unwrap();
        OfDevice {
            samples: on_device,
            splat,
            chi,
            residual,
        }
    }

    /// The part of the indicator that the stage removes.
    fn taken(&self, chi: &[T]) -> Vec<T> {
        let both = self.chi.values().iter().zip(chi);
        both.map(|(&before, &after)| before - after).collect()
    }
}

/// A point of the torus of radii 0.7 and 0.25, and its normal.
fn on_torus(numbers: &mut Numbers) -> ([f64; 3], [f64; 3]) {
    let [u, v] = [0; 2].map(|_| std::f64::consts::TAU * numbers.unit());
    let to_axis = 0.7 + 0.25 * v.cos();
    (
        [to_axis * u.cos(), to_axis * u.sin(), 0.25 * v.sin()],
        [v.cos() * u.cos(), v.cos() * u.sin(), v.sin()],
    )
}

/// A step through that torus, and a wave.
fn indicator<T: Scalar>(grid: Grid<T>) -> Field<T> {
    let value = |cell: usize| {
        let [x, y, z] = grid.center_f64(grid.cell(cell));
        let distance = (x.hypot(y) - 0.7).hypot(z) - 0.25;
        T::of(0.5 * (7.0 * distance).tanh() + 0.04 * (5.0 * x - 3.0 * y).sin() * (4.0 * z).cos())
    };
    let values = (0..grid.cells()).map(value).collect();
    Field::new(grid, values).expect("sizes match")
}

/// Samples, and samples in one place: enough for sums of 64 and of 4096.
const COUNTS: [(usize, usize); 2] = [(1201, 0), (701, 9001)];

const CHOICES: [(bool, bool); 3] = [(true, false), (true, true), (false, false)];

/// Runs `check` on all settings that samples are followed in.
fn for_each_setting<T: Scalar>(mut check: impl FnMut(Setting<T>)) {
    for (count, crowd) in COUNTS {
        for (area, thin) in CHOICES {
            let options = Options {
                area,
                smoothing: 0.5,
                thin,
            };
            println!("{} {count} {crowd} {options:?}", T::NAME);
            check(Setting::new(count, crowd, options));
            if crowd == 0 {
                check(Setting::new(count, crowd, options).scattered());
            }
        }
    }
}

fn values_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    let (mut passes, mut coarse) = (0, 0);
    for_each_setting::<T>(|setting| {
        let expected = setting.run_on_cpu();
        let found = setting.run(device);
        let gains: Vec<f64> = found.residual.gains().collect();
        let of_cpu: Vec<f64> = expected.residual.gains().collect();
        println!("{gains:?}");
        assert_eq!(gains.len(), of_cpu.len());
        for (gain, expected) in gains.iter().zip(&of_cpu) {
            assert!((gain - expected).abs() < tolerance, "{gain} {expected}");
        }
        let [gain, of_cpu] = [
            found.residual.coarse_gain(),
            expected.residual.coarse_gain(),
        ];
        assert!((gain - of_cpu).abs() < tolerance, "{gain} {of_cpu}");
        coarse += usize::from(gain > 0.0);
        passes = gains.len().max(passes);
        let chi = device.download(&found.chi).unwrap();
        // Not the field: that is larger than what is taken off it.
        let of_cpu = setting.taken(expected.chi.values());
        assert_near("taken", &setting.taken(&chi), &of_cpu, tolerance);
        let again = device.download(&setting.run(device).chi).unwrap();
        assert!(chi == again, "other bits the second time");
    });
    assert_eq!(passes, 3);
    assert!(coarse > 0, "no samples that are followed in common");
}

fn pullbacks_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for_each_setting::<T>(|setting| {
        // In double precision: of thousands of samples in a cell, the CPU's sums in single precision are further off.
        let expected = setting.exactly().pull_on_cpu().rounded();
        let found = setting.pull(device);
        found.compare(device, &setting, &expected, tolerance);
        let again = setting.pull(device);
        let bits = |of: &Pulled<T>| {
            let buffers = [&of.chi_bar, &of.values, &of.out.points, &of.out.areas];
            buffers.map(|b| device.download(b).unwrap())
        };
        assert!(bits(&found) == bits(&again), "other bits the second time");
    });
}

/// Cotangents on a device.
struct Pulled<T> {
    chi_bar: Buffer<T>,
    /// `χ` as it was.
    chi: Buffer<T>,
    values: Buffer<T>,
    level: Buffer<T>,
    smoothing: f64,
    out: SampleCotangent<T>,
}

/// Cotangents on the CPU.
struct PulledOnCpu<T> {
    chi_bar: Vec<T>,
    found: cpu::Cotangent<T>,
    out: isograd::splat::SampleCotangent<T>,
}

impl<T: Scalar> Setting<T> {
    /// Cotangents of the indicator that came out.
    fn weights(&self) -> Vec<T> {
        let mut numbers = Numbers(8);
        let cells = self.cloud.grid.cells();
        numbers.list(cells)
    }

    /// Cotangents that other stages have added, smaller than those of this one.
    fn started(&self) -> isograd::splat::SampleCotangent<T> {
        let mut out = self.cloud.started_cotangent();
        let vectors = [&mut out.points, &mut out.normals].map(|v| v.as_flattened_mut());
        for x in vectors.into_iter().flatten().chain(&mut out.areas) {
            *x *= T::of(1e-3);
        }
        out
    }

    fn pull_on_cpu(&self) -> PulledOnCpu<T> {
        let run = self.run_on_cpu();
        let (mut chi_bar, mut found) = (self.weights(), cpu::Cotangent::default());
        let mut out = self.started();
        let sorted = SortedSamples {
            samples: self.cloud.samples(),
            order: &run.order,
        };
        cpu::pullback(
            &run.chi,
            sorted,
            &run.residual,
            &mut chi_bar,
            &mut cpu::PullbackScratch::default(),
            &mut found,
            &mut out,
        );
        PulledOnCpu {
            chi_bar,
            found,
            out,
        }
    }

    fn pull<R: Runtime>(&self, device: &Device<R>) -> Pulled<T> {
        let run = self.run(device);
        let chi_bar = device.upload(&self.weights()).unwrap();
        let out = upload_cotangent(device, &self.started());
        let found = pullback(
            device,
            &run.residual,
            &run.splat,
            run.samples.samples(),
            &run.chi,
            &chi_bar,
            &out,
        )
        .unwrap();
        Pulled {
            chi_bar,
            chi: found.chi,
            values: found.values,
            level: found.level,
            smoothing: found.smoothing,
            out,
        }
    }
}

impl PulledOnCpu<f64> {
    fn rounded<T: Scalar>(self) -> PulledOnCpu<T> {
        let vectors = |of: &[[f64; 3]]| of.iter().map(|v| v.map(T::of)).collect();
        let numbers = |of: &[f64]| of.iter().map(|&x| T::of(x)).collect();
        PulledOnCpu {
            chi_bar: numbers(&self.chi_bar),
            found: cpu::Cotangent {
                values: numbers(&self.found.values),
                level: self.found.level,
                smoothing: self.found.smoothing,
            },
            out: isograd::splat::SampleCotangent {
                points: vectors(&self.out.points),
                normals: vectors(&self.out.normals),
                areas: numbers(&self.out.areas),
                grid: self.out.grid,
            },
        }
    }
}

impl<T: Scalar> Pulled<T> {
    fn compare<R: Runtime>(
        &self,
        device: &Device<R>,
        setting: &Setting<T>,
        expected: &PulledOnCpu<T>,
        tolerance: f64,
    ) {
        let same = |name: &str, found: &Buffer<T>, expected: &[T]| {
            assert_near(name, &device.download(found).unwrap(), expected, tolerance);
        };
        same("chi", &self.chi, setting.chi.values());
        same("chi_bar", &self.chi_bar, &expected.chi_bar);
        same("values", &self.values, &expected.found.values);
        setting
            .cloud
            .compare(device, &self.out, &expected.out, tolerance);
        // Relative to the sum of the magnitudes of its terms.
        let size = expected
            .found
            .values
            .iter()
            .map(|v| v.f64().abs())
            .sum::<f64>();
        let level = device.download(&self.level).unwrap()[0];
        let error = distance(level, expected.found.level) / size;
        report("level", error);
        assert!(error < tolerance, "{level} {}", expected.found.level);
        let of_cpu = expected.found.smoothing;
        let error = (self.smoothing - of_cpu).abs();
        // That of its terms: they are about r̄ r, and r is some hundredths.
        report("smoothing", error / (0.01 * size));
        assert!(error < tolerance * 0.01 * size && of_cpu != 0.0);
    }
}

/// Samples whose normals point to where `χ` falls, one sample, which nothing foretells, and no samples.
fn where_nothing_is_followed_nothing_changes<R: Runtime, T: Scalar>(device: &Device<R>) {
    let options = Options {
        area: true,
        smoothing: 0.5,
        thin: false,
    };
    let mut inside_out = Setting::<T>::new(300, 0, options);
    let Cloud {
        points, normals, ..
    } = &mut inside_out.cloud;
    for (point, normal) in points.iter().zip(normals) {
        let [x, y, z] = point.map(|x| x.f64());
        let far = 0.7 / x.hypot(y) - 1.0;
        *normal = [far * x, far * y, -z].map(|x| T::of(4.0 * x));
    }
    let mut none = Setting::<T>::new(1, 0, options);
    none.cloud.points.clear();
    none.cloud.normals.clear();
    none.cloud.areas.clear();
    for setting in [inside_out, Setting::new(1, 0, options), none] {
        let run = setting.run(device);
        assert_eq!(run.residual.gains().count(), 0);
        assert_eq!(device.download(&run.chi).unwrap(), setting.chi.values());
        let found = setting.pull(device);
        assert_eq!(device.download(&found.chi_bar).unwrap(), setting.weights());
        assert_eq!(device.download(&found.chi).unwrap(), setting.chi.values());
        let zero = |of: &Buffer<T>| device.download(of).unwrap().iter().all(|x| x.f64() == 0.0);
        assert!(zero(&found.values) && zero(&found.level) && found.smoothing == 0.0);
        let started = setting.started();
        let points = device.download(&found.out.points).unwrap();
        assert_eq!(points, started.points.as_flattened());
    }
}
