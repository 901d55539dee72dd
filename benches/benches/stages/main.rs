//! Criterion benchmarks of every stage, one file each. `cargo xtask bench STAGE` runs those of one stage.

mod common;
mod distance;
mod isosurface;
mod neighbors;
mod normals;
mod orient;
mod pipeline;
mod poisson;
mod splat;

criterion::criterion_main!(
    neighbors::benches,
    normals::benches,
    orient::benches,
    splat::benches,
    poisson::benches,
    isosurface::benches,
    distance::benches,
    pipeline::benches,
);
