//! Gradients of real clouds, clean and degraded (`../shared/data`): finite, in both number types.
//!
//! `cargo test -p isograd-cli --test cli real_gradients -- --nocapture` prints the table.

use isograd::{Cotangent, Grid, Options, Pipeline, PointCloud, Reconstructor, Resolution};
use isograd_io::read_geometry;

use crate::shared_data;

const CELLS: usize = 48;
/// Of all samples, one in this many is used.
const STRIDE: usize = 8;

/// Largest component of the cotangent of any point for `Σ φ²/2h²`, and how many places were guarded.
fn largest<T: Pipeline>(points: &[[f64; 3]]) -> (f64, usize) {
    let points = points
        .iter()
        .step_by(STRIDE)
        .map(|p| p.map(T::of))
        .collect();
    let cloud = PointCloud::new(points).expect("finite points");
    let grid = Grid::fit(&cloud, Resolution::Cells(CELLS), T::of(0.1)).expect("a grid");
    let mut plan = Reconstructor::new(grid, Options::default().checks(false)).expect("options");
    let result = plan.reconstruct(&cloud).expect("reconstructs");
    let h = grid.spacing();
    let bar: Vec<T> = result
        .sdf()
        .values()
        .iter()
        .map(|&phi| phi / (h * h))
        .collect();
    let cotangent = Cotangent {
        sdf: Some(&bar),
        ..Cotangent::default()
    };
    let pulled = result.pullback(&cotangent).expect("a pullback");
    let components = pulled.points.iter().flatten();
    let largest = components.fold(0.0, |m: f64, x| {
        assert!(x.is_finite());
        m.max(x.f64().abs() * h.f64())
    });
    (largest, pulled.guarded)
}

#[test]
fn gradients_of_all_clouds_are_finite() {
    for path in shared_data::clouds() {
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let points = read_geometry(&path).expect("reads").points;
        let (single, double) = (largest::<f32>(&points), largest::<f64>(&points));
        println!("{name}: largest, guarded: {single:?} in f32, {double:?} in f64");
        assert!(double.0 > 0.0);
    }
}
