//! A plan that is used again takes no memory of the size of a field.

mod common;

use common::TORUS;
use isograd::{Grid, Options, Reconstructor, Resolution};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

#[test]
fn second_reconstruct_allocates_no_field_sized_memory() {
    let cloud = TORUS.uniform::<f32>(20_000, 7);
    let grid = Grid::fit(&cloud, Resolution::Cells(200), 0.1).expect("fits");
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
