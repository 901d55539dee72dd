//! Rules for the choice of radii, shared with neighbor searches on other devices.

use super::radius::{Error, Radius};
use crate::{Real, vector};

/// Fewest points that can bound a volume.
pub const FEWEST_POINTS: usize = 4;

/// Fewest samples in a neighborhood, its center included: a plane through fewer is mostly chance.
pub const FEWEST_NEIGHBORS: usize = 8;

/// By how much a grown radius passes the neighbor that it has to reach, so that this one gets some of
/// a weight that falls to 0 at the radius.
pub const GROWTH_MARGIN: f64 = 1.05;

/// Samples that the automatic radius holds at the median, the center included.
pub const AUTO_NEIGHBORS: usize = 24;

/// By how much the automatic radius passes the median: else one sample would lie exactly on the radius of
/// another, and the least motion would change their neighborhoods.
pub const AUTO_MARGIN: f64 = 1.001;

/// The automatic radius, where `median` is that over all points of the distance to the 24th sample. Points on which 24
/// samples lie do not count; where there are only such, there is no median, and the samples are spread evenly over the extent
/// instead. `bounds` are the low and the high corner of the box round all `points`.
pub fn automatic<T: Real>(median: Option<T>, points: usize, bounds: [[T; 3]; 2]) -> T {
    let [low, high] = bounds;
    match median {
        Some(median) => median * T::of(AUTO_MARGIN),
        None => vector::norm(vector::sub(high, low)) / T::of_usize(points).sqrt(),
    }
}

/// Typical distance between neighboring samples; see [`Neighborhoods::spacing`](super::Neighborhoods::spacing).
pub fn spacing<T: Real>(automatic: T, points: usize) -> T {
    automatic * T::of((std::f64::consts::PI / AUTO_NEIGHBORS.min(points) as f64).sqrt())
}

/// The radius of every point that has enough neighbors within it.
///
/// # Errors
/// [`Error::Radius`].
pub fn common<T: Real>(rule: Radius, automatic: T) -> Result<T, Error> {
    match rule {
        Radius::Auto => Ok(automatic.max(smallest())),
        Radius::Fixed(radius) => {
            let rounded = T::of(radius);
            if rounded >= smallest() && (rounded * rounded).is_finite() {
                Ok(rounded)
            } else {
                Err(Error::Radius { radius })
            }
        }
    }
}

/// The least radius whose square, and one over it, the number type can hold.
fn smallest<T: Real>() -> T {
    T::of(8.0) * T::min_positive_value().sqrt()
}

/// Whether squares of distances within the box round all `points`, from its low to its high corner, are numbers.
///
/// # Errors
/// [`Error::AllEqual`], [`Error::Extent`].
pub fn check_extent<T: Real>(points: usize, bounds: [[T; 3]; 2]) -> Result<(), Error> {
    let [low, high] = bounds;
    let extent = (0..3)
        .map(|a| high[a].f64() - low[a].f64())
        .fold(0.0, f64::max);
    if extent == 0.0 {
        return Err(Error::AllEqual { points });
    }
    // A millionth of the extent must still have a square, and a hundred extents too.
    let square_root = |x: T| x.f64().sqrt();
    if extent < 1e6 * square_root(T::min_positive_value())
        || extent > 1e-2 * square_root(T::max_value())
    {
        return Err(Error::Extent {
            extent,
            type_name: T::NAME,
        });
    }
    Ok(())
}
