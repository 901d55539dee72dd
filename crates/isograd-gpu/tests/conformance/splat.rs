//! The splat and its pullback, beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::Field;
use isograd_gpu::splat::{Refused, SampleCotangent, Weights, forward, pullback};
use isograd_gpu::{Device, Scalar};

use crate::devices::{Numbers, refused_lengths, tests, tolerance};
use crate::samples::{Cloud, assert_near, upload_cotangent};

tests! {
    on_each_device:
        samples_exactly_two_cells_from_the_walls_are_taken,
        bad_samples_are_left_out_and_told_of,
        grids_may_have_more_cells_than_one_row_of_groups,
        arrays_that_do_not_match_are_refused;
    in_each_number: right_hand_sides_are_those_of_the_cpu, pullbacks_are_those_of_the_cpu;
}

const BOTH: [Weights; 2] = [Weights::BSpline, Weights::Paper];

/// Cells, samples, and samples in one cell: of the latter, enough for runs of runs.
const CLOUDS: [([usize; 3], usize, usize); 6] = [
    ([2, 4, 9], 0, 0),
    ([5, 5, 5], 1, 0),
    ([21, 9, 12], 500, 0),
    ([17, 13, 31], 5003, 0),
    ([11, 9, 13], 700, 700),
    ([11, 9, 13], 100, 9001),
];

fn right_hand_sides_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for (shape, count, crowd) in CLOUDS {
        let cloud = Cloud::<T>::new(shape, count, crowd);
        let on_device = cloud.upload(device);
        for weights in BOTH {
            let expected = cloud.splat_on_cpu(weights).b;
            let run = || {
                let (b, residual) =
                    forward(device, on_device.samples(), &cloud.grid, weights).unwrap();
                assert_eq!(residual.refused(device).unwrap(), None);
                device.download(&b).unwrap()
            };
            let b = run();
            assert_near("b", &b, expected.values(), tolerance);
            assert!(b == run(), "other bits the second time");
        }
    }
}

fn pullbacks_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for (shape, count, crowd) in CLOUDS {
        let cloud = Cloud::<T>::new(shape, count, crowd);
        let on_device = cloud.upload(device);
        let b_bar =
            Field::new(cloud.grid, Numbers(3).list(cloud.grid.cells())).expect("sizes match");
        for weights in BOTH {
            let mut expected = cloud.started_cotangent();
            let run = || {
                let out = upload_cotangent(device, &cloud.started_cotangent());
                let (_, residual) =
                    forward(device, on_device.samples(), &cloud.grid, weights).unwrap();
                let b_bar = device.upload(b_bar.values()).unwrap();
                pullback(device, &residual, on_device.samples(), &b_bar, &out).unwrap();
                out
            };
            let found = run();
            isograd::splat::pullback(
                cloud.samples(),
                &cloud.splat_on_cpu(weights).residual,
                &b_bar,
                &mut isograd::splat::PullbackScratch::default(),
                &mut expected,
            );
            cloud.compare(device, &found, &expected, tolerance);
            assert_same_bits(device, &found, &run());
        }
    }
}

fn assert_same_bits<R: Runtime, T: Scalar>(
    device: &Device<R>,
    a: &SampleCotangent<T>,
    b: &SampleCotangent<T>,
) {
    let all = |c: &SampleCotangent<T>| {
        [&c.points, &c.normals, &c.areas, &c.grid].map(|v| device.download(v).unwrap())
    };
    assert!(all(a) == all(b), "other bits the second time");
}

fn samples_exactly_two_cells_from_the_walls_are_taken<R: Runtime>(device: &Device<R>) {
    let mut cloud = Cloud::<f32>::new([9, 7, 8], 2, 0);
    cloud.points = [[2.0; 3], [7.0, 5.0, 6.0]]
        .map(|x| cloud.grid.from_index(x))
        .to_vec();
    let on_device = cloud.upload(device);
    for weights in BOTH {
        let (b, residual) = forward(device, on_device.samples(), &cloud.grid, weights).unwrap();
        assert_eq!(residual.refused(device).unwrap(), None);
        let b = device.download(&b).unwrap();
        assert_near("b", &b, cloud.splat_on_cpu(weights).b.values(), 1e-4);
    }
}

fn bad_samples_are_left_out_and_told_of<R: Runtime>(device: &Device<R>) {
    let good = Cloud::<f32>::new([21, 9, 12], 300, 0);
    let mut cloud = Cloud::<f32>::new([21, 9, 12], 300, 0);
    let outside = [
        [1.99, 4.0, 4.0],
        [4.0, 7.01, 4.0],
        [4.0, 4.0, 1e30],
        [f32::NAN, 4.0, 4.0],
    ];
    let mut add = |x: [f32; 3], normal: f32, area: f32| {
        // After the 150th of the good ones.
        cloud.points.insert(150, cloud.grid.from_index(x));
        cloud.normals.insert(150, [0.0, normal, 0.0]);
        cloud.areas.insert(150, area);
    };
    outside.into_iter().for_each(|x| add(x, 1.0, 1.0));
    add([4.0; 3], f32::NAN, 1.0);
    add([4.0; 3], f32::NEG_INFINITY, 1.0);
    add([4.0; 3], 1.0, f32::INFINITY);
    let on_device = cloud.upload(device);
    for weights in BOTH {
        let (b, residual) = forward(device, on_device.samples(), &cloud.grid, weights).unwrap();
        let refused = Refused {
            count: 7,
            first: 150,
        };
        assert_eq!(residual.refused(device).unwrap(), Some(refused));
        let b_of_good = good.splat_on_cpu(weights).b;
        assert_near("b", &device.download(&b).unwrap(), b_of_good.values(), 1e-4);
        let out = SampleCotangent::zeros(device, 307).unwrap();
        pullback(device, &residual, on_device.samples(), &b, &out).unwrap();
        let bars = device.download(&out.points).unwrap();
        assert!(bars[3 * 150..3 * 157].iter().all(|&v| v == 0.0));
        let mut others = bars[..3 * 150].iter().chain(&bars[3 * 157..]);
        assert!(others.all(|v| v.is_finite()));
        assert!(bars[0] != 0.0);
        let grid = device.download(&out.grid).unwrap();
        assert!(grid.iter().all(|v| v.is_finite()), "{grid:?}");
    }
}

fn grids_may_have_more_cells_than_one_row_of_groups<R: Runtime>(device: &Device<R>) {
    // 65,792 bricks of 256 cells.
    let cloud = Cloud::<f32>::new([257, 256, 256], 3000, 0);
    let on_device = cloud.upload(device);
    let (b, _) = forward(device, on_device.samples(), &cloud.grid, Weights::BSpline).unwrap();
    let expected = cloud.splat_on_cpu(Weights::BSpline).b;
    assert_near("b", &device.download(&b).unwrap(), expected.values(), 1e-4);
}

fn arrays_that_do_not_match_are_refused<R: Runtime>(device: &Device<R>) {
    let cloud = Cloud::<f32>::new([9, 9, 9], 10, 0);
    let mut on_device = cloud.upload(device);
    let good = on_device.samples();
    let (b, residual) = forward(device, good, &cloud.grid, Weights::BSpline).unwrap();
    let out = SampleCotangent::zeros(device, 9).unwrap();
    let refused = pullback(device, &residual, good, &b, &out);
    assert_eq!(refused_lengths(refused), Some([27, 30]));
    on_device.normals = device.upload(&[0.0; 29]).unwrap();
    let refused = forward(device, on_device.samples(), &cloud.grid, Weights::BSpline);
    assert_eq!(refused_lengths(refused), Some([29, 30]));
}
