//! Constants of radii and areas, shared with the GPU.

/// Samples that have to be well within the radius of a vertex, so that a plane of values fits them.
pub const ENOUGH: usize = 6;

/// A radius reaches this many times beyond the last of them.
pub const REACH: f64 = 1.5;

/// A radius that has grown holds no more samples than this, so that the time does not grow with the square
/// of a hole.
pub const MOST: usize = 64;

/// Factor by which it exceeds the distance to the last of these, so that the weights are not all 0 where all are
/// equally far.
pub const MARGIN: f64 = 1.05;

/// `a₀` over the mean area.
pub const SMALLEST_AREA: f64 = 1e-6;
