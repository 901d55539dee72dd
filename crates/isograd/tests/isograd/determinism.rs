//! Same input, same bits, whatever the number of threads.

use isograd::orient::{Method, ParityOptions};
use isograd::poisson::Smoothing;
use isograd::{Grid, Options, Pipeline, PointCloud, Reconstruction, Reconstructor, Resolution};

use crate::common::TORUS;

fn with_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("a pool of threads")
        .install(work)
}

fn bits<T: Pipeline>(values: impl IntoIterator<Item = T>) -> Vec<u64> {
    values.into_iter().map(|v| v.f64().to_bits()).collect()
}

fn all_bits<T: Pipeline>(r: &Reconstruction<T>) -> Vec<Vec<u64>> {
    vec![
        bits(r.sdf().values().iter().copied()),
        bits(r.indicator().values().iter().copied()),
        bits([r.iso_value()]),
        bits(r.mesh().vertices().iter().flatten().copied()),
        r.mesh()
            .faces()
            .iter()
            .flatten()
            .map(|&v| u64::from(v))
            .collect(),
        r.closest().iter().map(|&f| u64::from(f)).collect(),
        bits(r.normals().iter().flatten().copied()),
        bits(r.confidence().iter().copied()),
        bits(r.areas().iter().copied()),
    ]
}

fn assert_same_bits<T: Pipeline>(options: &Options) {
    let cloud = TORUS.ten_to_one::<T>(12_000, 5);
    let bare = PointCloud::new(cloud.points().to_vec()).expect("finite points");
    let run = |threads| {
        with_threads(threads, || {
            let grid = Grid::fit(&bare, Resolution::Cells(60), T::of(0.1)).expect("fits");
            let mut plan = Reconstructor::new(grid, options.clone()).expect("valid options");
            let first = all_bits(plan.reconstruct(&bare).expect("reconstructs"));
            let second = all_bits(plan.reconstruct(&bare).expect("reconstructs"));
            assert_eq!(
                first, second,
                "a plan that is used again gives the same bits"
            );
            first
        })
    };
    let one = run(1);
    for threads in [2, 5] {
        for (name, (a, b)) in [
            "sdf",
            "indicator",
            "iso value",
            "vertices",
            "faces",
            "closest",
            "normals",
            "confidence",
            "areas",
        ]
        .iter()
        .zip(one.iter().zip(run(threads).iter()))
        {
            assert!(a == b, "{name} differs between 1 and {threads} threads");
        }
    }
}

#[test]
fn one_two_and_five_threads_give_the_same_bits() {
    assert_same_bits::<f32>(&Options::default());
    assert_same_bits::<f64>(&Options::default());
}

#[test]
fn the_papers_choices_give_the_same_bits_too() {
    let paper = Options::default()
        .orient(Method::Parity(ParityOptions::default()))
        .splat(isograd::splat::Weights::Paper)
        .area(false)
        .smoothing(Smoothing::Cells(1.0))
        .band(isograd::distance::Band::Within(0.1));
    assert_same_bits::<f32>(&paper);
}
