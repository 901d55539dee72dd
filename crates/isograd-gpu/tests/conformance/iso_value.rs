//! The iso-value and its pullback, beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::Field;
use isograd::isosurface::iso_value as cpu;
use isograd_gpu::isosurface::iso_value::{forward, pullback};
use isograd_gpu::splat::{self, SampleCotangent, Weights};
use isograd_gpu::{Device, Scalar};

use crate::devices::{Numbers, refused_lengths, tests, tolerance};
use crate::samples::{Cloud, OnDevice, assert_near, distance, report, upload_cotangent};

tests! {
    on_each_device: there_is_no_value_without_area;
    in_each_number: values_are_those_of_the_cpu, pullbacks_are_those_of_the_cpu;
}

/// Cells, samples, and samples in one cell.
const CLOUDS: [([usize; 3], usize, usize); 4] = [
    ([5, 5, 5], 1, 0),
    ([21, 9, 12], 500, 0),
    ([17, 13, 31], 5003, 0),
    ([11, 9, 13], 100, 9001),
];

fn noise<T: Scalar>(cloud: &Cloud<T>, seed: u64) -> Field<T> {
    Field::new(cloud.grid, Numbers(seed).list(cloud.grid.cells())).expect("sizes match")
}

fn values_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for (shape, count, crowd) in CLOUDS {
        let mut cloud = Cloud::<T>::new(shape, count, crowd);
        // Beyond the outermost cell centers and the walls, where the field goes on as a constant.
        for (i, x) in [[0.3, 2.0, 2.0], [-7.0, 99.0, 0.5], [4.9, 1e4, -1e4]]
            .iter()
            .enumerate()
        {
            cloud.points.push(cloud.grid.from_index(x.map(T::of)));
            cloud.normals.push([T::of(1.0); 3]);
            cloud.areas.push(T::of(i as f64 + 0.5));
        }
        let chi = noise(&cloud, 5);
        let mut expected = cpu::Residual::default();
        let c = cpu::forward(&chi, &cloud.points, &cloud.areas, &mut expected).expect("a value");
        let chi = device.upload(chi.values()).unwrap();
        let OnDevice { points, areas, .. } = cloud.upload(device);
        let run = || {
            let (c, residual) = forward(device, &chi, &cloud.grid, &points, &areas).unwrap();
            [c, residual.at_samples].map(|numbers| device.download(&numbers).unwrap())
        };
        let [found, at_samples] = run();
        // Relative to the field, which is between −1 and 1.
        let error = distance(found[0], c.f64());
        assert!(error < tolerance, "{} {c}", found[0]);
        report("c", error);
        let of_cpu = expected.at_samples.iter().flat_map(|at| {
            let [x, y, z] = at.gradient;
            [at.value, x, y, z]
        });
        let of_cpu: Vec<T> = of_cpu.collect();
        assert_near("at samples", &at_samples, &of_cpu, tolerance);
        assert!([found, at_samples] == run(), "other bits the second time");
    }
}

fn pullbacks_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for (shape, count, crowd) in CLOUDS {
        let cloud = Cloud::<T>::new(shape, count, crowd);
        let given: Vec<T> = Numbers(17).list(cloud.areas.len());
        for values_bar in [&given[..], &[]] {
            // As large as the other cotangents, which would hide it if its shares were 1/N.
            let bar = T::of(-1.7 * cloud.areas.len() as f64);
            let (mut chi_bar, mut out) = (noise(&cloud, 8), cloud.started_cotangent());
            pull_on_cpu(&cloud, bar, values_bar, &mut chi_bar, &mut out);
            let (found_chi, found) = pull_on_device(device, &cloud, bar, values_bar);
            assert_near("chi", &found_chi, chi_bar.values(), tolerance);
            cloud.compare(device, &found, &out, tolerance);
            let (again, _) = pull_on_device(device, &cloud, bar, values_bar);
            assert!(found_chi == again, "other bits the second time");
        }
    }
}

fn pull_on_cpu<T: Scalar>(
    cloud: &Cloud<T>,
    bar: T,
    values_bar: &[T],
    chi_bar: &mut Field<T>,
    out: &mut isograd::splat::SampleCotangent<T>,
) {
    let order = cloud.splat_on_cpu(Weights::BSpline).residual;
    let mut residual = cpu::Residual::default();
    let chi = noise(cloud, 5);
    cpu::forward(&chi, &cloud.points, &cloud.areas, &mut residual).expect("a value");
    let samples = isograd::splat::SortedSamples {
        samples: cloud.samples(),
        order: &order,
    };
    let (grid, chi_bar) = (&cloud.grid, chi_bar.values_mut());
    cpu::pullback(grid, samples, &residual, bar, values_bar, chi_bar, out);
}

fn pull_on_device<R: Runtime, T: Scalar>(
    device: &Device<R>,
    cloud: &Cloud<T>,
    bar: T,
    values_bar: &[T],
) -> (Vec<T>, SampleCotangent<T>) {
    let on_device = cloud.upload(device);
    let samples = on_device.samples();
    let (_, splat) = splat::forward(device, samples, &cloud.grid, Weights::BSpline).unwrap();
    let chi = device.upload(noise(cloud, 5).values()).unwrap();
    let (points, areas) = (samples.points, samples.areas);
    let (_, residual) = forward(device, &chi, &cloud.grid, points, areas).unwrap();
    let chi_bar = device.upload(noise(cloud, 8).values()).unwrap();
    let out = upload_cotangent(device, &cloud.started_cotangent());
    let bar = device.upload(&[bar]).unwrap();
    let given = device.upload(values_bar).unwrap();
    let given = (!values_bar.is_empty()).then_some(&given);
    pullback(
        device, &residual, &splat, samples, &bar, given, &chi_bar, &out,
    )
    .unwrap();
    (device.download(&chi_bar).unwrap(), out)
}

fn there_is_no_value_without_area<R: Runtime>(device: &Device<R>) {
    let mut cloud = Cloud::<f32>::new([9, 8, 7], 4, 0);
    let chi = device.upload(noise(&cloud, 1).values()).unwrap();
    let mut value = |points: usize, areas: &[f32]| {
        cloud.points.truncate(points);
        cloud.areas = areas.to_vec();
        let OnDevice { points, areas, .. } = cloud.upload(device);
        let found = forward(device, &chi, &cloud.grid, &points, &areas);
        found.map(|(c, _)| device.download(&c).unwrap()[0])
    };
    assert!(value(4, &[1.0, 0.0, 2.0, 0.5]).unwrap().is_finite());
    assert!(!value(4, &[1.0, -2.0, 0.0, 0.5]).unwrap().is_finite());
    assert!(!value(4, &[0.0; 4]).unwrap().is_finite());
    assert_eq!(refused_lengths(value(4, &[1.0; 3])), Some([12, 9]));
    assert!(!value(0, &[]).unwrap().is_finite());
}
