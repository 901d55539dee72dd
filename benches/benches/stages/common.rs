//! Settings of all benchmarks, whose names are `stage/type/size/threads`.

use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, Throughput};
use isograd::Real;
use isograd_benches::{THREADS, pool};

/// A group with few samples, since the largest sizes take a second or more per call.
pub fn group<'a>(criterion: &'a mut Criterion, stage: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(stage);
    group
        .sample_size(10)
        .sampling_mode(SamplingMode::Flat)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2));
    group
}

/// Measures `call` on each number of threads. The first call, which allocates, is not counted.
pub fn for_threads<T: Real>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    size: usize,
    unit: &str,
    mut call: impl FnMut() + Send,
) {
    group.throughput(Throughput::Elements(size as u64));
    for threads in THREADS {
        let pool = pool(threads);
        let name = format!("{}/{size} {unit}/{threads} threads", T::NAME);
        group.bench_function(name, |bencher| {
            bencher.iter(|| pool.install(&mut call));
        });
    }
}
