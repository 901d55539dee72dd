//! Predicted times of the parts of a reconstruction, for the progress bar.

use isograd::Stage;

/// Seconds for a point and for a cell of φ: those of docs/scaling.md, and of runs with `-v` for what depends on the surface,
/// which has its own cells, as many as the samples need. On other machines only the ratios matter once a part is done.
fn rates(stage: Stage) -> [f64; 2] {
    match stage {
        Stage::Normals => [0.5e-6, 0.0],
        Stage::Orient => [6e-6, 0.0],
        Stage::Splat => [0.5e-6, 0.0],
        Stage::Poisson => [1.5e-6, 3e-8],
        Stage::Isosurface => [0.3e-6, 2e-9],
        Stage::Distance => [5e-6, 1.2e-7],
        Stage::Checks => [3e-6, 2e-8],
    }
}

/// Rates of writing all files.
const WRITE: [f64; 2] = [1.5e-6, 5e-8];

/// Predicted seconds of each stage, and of writing, for a number of points and of cells of φ.
pub fn seconds(points: usize, cells: usize) -> Vec<(&'static str, f64)> {
    let seconds = |[point, cell]: [f64; 2]| point * points as f64 + cell * cells as f64;
    let stages = Stage::ALL.into_iter();
    let stages = stages.map(|stage| (stage.name(), seconds(rates(stage))));
    stages.chain([("write", seconds(WRITE))]).collect()
}
