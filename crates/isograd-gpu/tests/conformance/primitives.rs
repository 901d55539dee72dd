//! Sums and orders, beside plain loops.

use cubecl::prelude::Runtime;
use isograd_gpu::Device;
use isograd_gpu::primitives::scan::exclusive_sum;
use isograd_gpu::primitives::sort::{order, starts};

use crate::devices::{Numbers, tests};

tests! {
    on_each_device: exclusive_sums_are_those_of_a_loop, orders_are_stable;
}

fn exclusive_sums_are_those_of_a_loop<R: Runtime>(device: &Device<R>) {
    for count in [0, 1, 255, 256, 257, 65_535, 65_536, 1_000_003] {
        let mut numbers = Numbers(count as u64);
        let values: Vec<u32> = (0..count).map(|_| numbers.bits() % 5).collect();
        let mut expected = vec![0];
        for v in &values {
            expected.push(expected[expected.len() - 1] + v);
        }
        let buffer = device.upload(&values).unwrap();
        let sums = exclusive_sum(device, &buffer).unwrap();
        assert_eq!(device.download(&sums).unwrap(), expected, "{count} values");
    }
}

fn orders_are_stable<R: Runtime>(device: &Device<R>) {
    for (count, limit) in [(0, 7), (1, 1), (300, 1), (1000, 17), (70_001, 1 << 20)] {
        let mut numbers = Numbers(count as u64);
        let keys: Vec<u32> = (0..count).map(|_| numbers.bits() % limit).collect();
        let mut places: Vec<u32> = (0..count as u32).collect();
        places.sort_by_key(|&p| keys[p as usize]);
        let sorted: Vec<u32> = places.iter().map(|&p| keys[p as usize]).collect();
        let expected: Vec<u32> = (0..=limit)
            .map(|key| sorted.partition_point(|&k| k < key) as u32)
            .collect();
        let found = order(device, &device.upload(&keys).unwrap(), limit).unwrap();
        let from = starts(device, &found.keys, limit).unwrap();
        assert_eq!(device.download(&found.places).unwrap(), places);
        assert_eq!(device.download(&found.keys).unwrap(), sorted);
        assert_eq!(device.download(&from).unwrap(), expected);
    }
}
