//! Coordinates that single precision does not hold.

use isograd::Grid;
use isograd_io::Dtype;

use crate::args::{self, Precision};

/// Rounding of the coordinates to single precision, in cells, above which the computation uses double precision.
const TOLERATED_ROUNDING: f64 = 1e-2;

/// Rounding of the coordinates of a file, in cells, that can be seen in the surface.
const VISIBLE_ROUNDING: f64 = 0.1;

/// The note if single precision was requested, or is that of the file, and can't represent coordinates on a grid; then double is
/// to be used.
pub fn rounding(
    args: &args::Reconstruct,
    stored: Option<Dtype>,
    grid: &Grid<f64>,
) -> Option<String> {
    let corners = grid.lower().into_iter().chain(grid.upper());
    let largest = corners.fold(0.0f64, |m, x| m.max(x.abs()));
    let cells = largest * f64::from(f32::EPSILON) / grid.spacing();
    if stored == Some(Dtype::F32) && cells > VISIBLE_ROUNDING {
        return Some(format!(
            "coordinates reach {largest:.3e} with cells of {:.3e}, and the file has them in f32, rounded to {cells:.1e} cells: digits are missing in the file itself; export it in double precision, or relative to a place near the points (computed in f64)",
            grid.spacing()
        ));
    }
    (args.precision == Precision::F32 && cells > TOLERATED_ROUNDING).then(|| {
        format!(
            "coordinates reach {largest:.3e} with cells of {:.3e}, which f32 rounds to {cells:.1e} cells; computed in f64",
            grid.spacing()
        )
    })
}
