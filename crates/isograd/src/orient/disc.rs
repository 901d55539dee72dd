//! A sample that is drawn on a grid as a disc in its tangent plane: see [`crate::orient::fill`]. Lengths in cells.

/// A position along an axis of so many cells, kept half a cell inside the grid.
#[inline(always)]
pub(super) fn inside(position: f32, cells: f32) -> f32 {
    clamped(position, 0.5, cells - 0.5)
}

/// Radius of the disc of a sample of this reach. Less than 8.
#[inline(always)]
pub(super) fn radius(reach: f32) -> f32 {
    clamped(1.5 * reach, 0.9, 7.5)
}

/// Half the thickness of a disc with this axis: the least that no path through cell faces gets through.
#[inline(always)]
pub(super) fn half(x: f32, y: f32, z: f32) -> f32 {
    0.5 * (x.abs() + y.abs() + z.abs())
}

/// Whether a disc covers a cell whose center is so far from its own, squared, and so high above its plane.
#[inline(always)]
pub(super) fn covers(square: f32, height: f32, half: f32, radius: f32) -> bool {
    height <= half && -height <= half && square - height * height <= radius * radius
}

#[inline(always)]
fn clamped(x: f32, low: f32, high: f32) -> f32 {
    let mut clamped = x;
    if x < low {
        clamped = low;
    }
    if x > high {
        clamped = high;
    }
    clamped
}
