//! Sums of whole arrays, beside plain loops in double precision.

use cubecl::prelude::Runtime;
use isograd_gpu::primitives::fill;
use isograd_gpu::primitives::reduce::{sum, sum_columns};
use isograd_gpu::{Device, Scalar};

use crate::devices::{Numbers, refused_lengths, tests, tolerance};
use crate::samples::distance;

tests! {
    on_each_device: rows_that_are_not_whole_are_refused, arrays_are_added_number_by_number;
    in_each_number: sums_are_those_of_a_loop;
}

fn sums_are_those_of_a_loop<R: Runtime, T: Scalar>(device: &Device<R>) {
    let tolerance = tolerance::<T>();
    for (rows, columns) in [
        (0, 1),
        (1, 1),
        (255, 4),
        (2047, 1),
        (2048, 3),
        (2049, 2),
        (1_000_003, 1),
    ] {
        let mut numbers = Numbers(rows as u64 + 1);
        let values: Vec<T> = numbers.list(rows * columns);
        let buffer = device.upload(&values).unwrap();
        let run = || {
            let sums = sum_columns(device, &buffer, columns).unwrap();
            device.download(&sums).unwrap()
        };
        let found = run();
        assert_eq!(found.len(), columns);
        for column in 0..columns {
            let of_column = values.iter().skip(column).step_by(columns).map(|v| v.f64());
            let (expected, size) = of_column.fold((0.0, 0.0), |(s, a), v| (s + v, a + v.abs()));
            let error = distance(found[column], expected);
            // Relative to the sum of the magnitudes.
            assert!(
                error <= tolerance * size,
                "{rows} rows: {error:e} of {size}"
            );
        }
        assert_eq!(found, run());
        if columns == 1 {
            let sum = sum(device, &buffer).unwrap();
            assert_eq!(found, device.download(&sum).unwrap());
        }
    }
}

fn rows_that_are_not_whole_are_refused<R: Runtime>(device: &Device<R>) {
    let values = device.upload(&[1.0f32; 7]).unwrap();
    let refused = sum_columns(device, &values, 2);
    assert_eq!(refused_lengths(refused), Some([7, 6]));
    let other = fill::zeros::<R, f32>(device, 6).unwrap();
    let refused = fill::add(device, &values, &other);
    assert_eq!(refused_lengths(refused), Some([7, 6]));
}

fn arrays_are_added_number_by_number<R: Runtime>(device: &Device<R>) {
    let values: Vec<f32> = (0..1000).map(|i| i as f32).collect();
    let buffer = device.upload(&values).unwrap();
    let out = fill::zeros(device, 1000).unwrap();
    assert_eq!(device.download::<f32>(&out).unwrap(), [0.0; 1000]);
    fill::add(device, &buffer, &out).unwrap();
    fill::add(device, &buffer, &out).unwrap();
    let twice: Vec<f32> = values.iter().map(|v| 2.0 * v).collect();
    assert_eq!(device.download(&out).unwrap(), twice);
}
