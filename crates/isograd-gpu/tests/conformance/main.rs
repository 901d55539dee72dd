//! Every kernel beside the CPU's stage or a plain loop, on each device that is here.

mod areas;
mod clouds;
mod devices;
mod distance;
mod host;
mod iso_value;
mod isosurface;
mod local_level;
mod normals;
mod orient;
mod orient_known;
mod pipeline;
mod poisson;
mod primitives;
mod radii;
mod reduce;
mod refine;
mod samples;
mod splat;

#[test]
#[cfg(not(feature = "cuda"))]
fn these_tests_run_on_cuda_too() {
    println!("SKIPPED on CUDA: built without the feature `cuda`");
}
