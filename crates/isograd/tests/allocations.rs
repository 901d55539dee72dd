//! A plan that is used again takes no memory of the size of a field, nor does its pullback.

#[path = "isograd/common.rs"]
mod common;

use common::TORUS;
use isograd::{CloudCotangent, Cotangent, Grid, Options, Reconstructor, Resolution};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// One test, for memory is counted for the whole program.
#[test]
fn second_calls_allocate_no_field_sized_memory() {
    second_reconstruct();
    second_pullback();
}

fn second_reconstruct() {
    let cloud = TORUS.uniform::<f32>(20_000, 7);
    // Faces, of which the checks note a few numbers, are as many on any grid of φ.
    let grid = Grid::fit(&cloud, Resolution::Cells(256), 0.1).expect("fits");
    let field_bytes = grid.cells() * size_of::<f32>();
    let mut plan = Reconstructor::new(grid, Options::default()).expect("valid options");
    plan.reconstruct(&cloud).expect("reconstructs");

    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    plan.reconstruct(&cloud).expect("reconstructs");
    let grown = MEMORY.peak_usage() - before;
    println!("second call: {grown} bytes above the first's end; a field has {field_bytes}");
    assert!(
        grown < field_bytes / 4,
        "{grown} bytes, a field has {field_bytes}"
    );
    // A thread that had no work in the first call makes its own line buffers in the second.
    let kept = MEMORY.current_usage().saturating_sub(before);
    assert!(
        kept < field_bytes / 16,
        "the second call keeps {kept} bytes"
    );
}

fn second_pullback() {
    let cloud = TORUS.uniform::<f32>(20_000, 7);
    let grid = Grid::new([-1.2, -1.2, -0.6], 0.009375, [256, 256, 128]).expect("a grid");
    let field_bytes = grid.cells() * size_of::<f32>();
    let mut plan = Reconstructor::new(grid, Options::default()).expect("valid options");
    let result = plan.reconstruct(&cloud).expect("reconstructs");
    let bar = vec![1.0; grid.cells()];
    let cotangent = Cotangent {
        sdf: Some(&bar),
        ..Cotangent::default()
    };
    let mut out = CloudCotangent::default();
    let mut grown = [0; 2];
    for grown in &mut grown {
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        result
            .pullback_into(&cotangent, &mut out)
            .expect("a pullback");
        *grown = MEMORY.peak_usage() - before;
    }
    let fields = grown.map(|bytes| bytes as f64 / field_bytes as f64);
    println!("first and second call: {fields:?} fields");
    // χ̄ and an index for each cell, six numbers for each cell in a block near the samples, and what belongs
    // to samples and faces: as many on any grid of φ.
    assert!(fields[0] < 4.0 && fields[1] < 0.25, "{fields:?}");
}
