//! Rules for the choice of radii, shared with neighbor searches on other devices.

use rayon::slice::ParallelSliceMut;

use super::radius::{Error, Radius};
use crate::{Real, vector};

/// Fewest points that can bound a volume.
pub const FEWEST_POINTS: usize = 4;

/// Fewest samples in a neighborhood, its center included: a plane through fewer is mostly chance.
pub const FEWEST_NEIGHBORS: usize = 8;

/// By how much a radius passes the 8th sample at least, so that this one gets some of a weight that falls to 0 at
/// the radius.
pub const GROWTH_MARGIN: f64 = 1.05;

/// Samples that the automatic radius holds in the middle, the center included, unless they lie along lines.
pub const AUTO_NEIGHBORS: usize = 24;

/// By how much the automatic radius passes the mean: else samples of a lattice would lie exactly on the radius of
/// others, and rounding would tell their neighborhoods apart.
pub const AUTO_MARGIN: f64 = 1.001;

/// Distance to the 24th sample from which one lies apart, in automatic radii.
const APART: f64 = 2.0;

/// Share of its radius over which the weight of a neighbor in a normal falls to 0.
const RIM: f64 = 0.2;

/// Steepness of a weight that falls at the radius itself.
const CUT: f64 = 1e30;

/// One over the share of the radius over which the weights of normals fall to 0.
pub fn steepness(radius: Radius) -> f64 {
    match radius {
        Radius::Auto | Radius::Fixed(_) => 1.0 / RIM,
        Radius::Cut(_) => CUT,
    }
}

/// The automatic radius, where `mean` is that of the distance to the 24th sample over the middle half of all points:
/// see [`middle_half`]. Where there is none, the samples are spread evenly over the extent instead. `bounds` are the low and the
/// high corner of the box around all `points`.
pub fn automatic<T: Real>(mean: Option<T>, points: usize, bounds: [[T; 3]; 2]) -> T {
    let [low, high] = bounds;
    match mean {
        Some(mean) => mean * T::of(AUTO_MARGIN),
        None => vector::norm(vector::sub(high, low)) / T::of_usize(points).sqrt(),
    }
}

/// The least and the largest of the middle half of the positive ones among these squares, and the mean of the roots
/// between them; nothing where none is positive. Zeros are of points on which 24 samples lie.
pub fn middle_half<T: Real>(squares: &[T], scratch: &mut Vec<T>) -> Option<([T; 2], T)> {
    scratch.clear();
    scratch.reserve_exact(squares.len());
    scratch.extend(squares.iter().filter(|&&square| square > T::zero()));
    let (n, quarter) = (scratch.len(), scratch.len() / 4);
    if n == 0 {
        return None;
    }
    let order = |a: &T, b: &T| a.f64().total_cmp(&b.f64());
    let (_, &mut least, above) = scratch.select_nth_unstable_by(quarter, order);
    let largest = match n - 1 - 2 * quarter {
        0 => least,
        last => *above.select_nth_unstable_by(last - 1, order).1,
    };
    let middle = &mut scratch[quarter..n - quarter];
    // In an order that does not depend on that of the points.
    middle.par_sort_unstable_by(order);
    let sum: f64 = middle.iter().map(|square| square.f64().sqrt()).sum();
    Some(([least, largest], T::of(sum / middle.len() as f64)))
}

/// Whether a sample lies apart, whose 24th nearest is at the root of `square`: see [`strays`](super::Neighborhoods::strays).
pub fn is_apart<T: Real>(square: T, automatic: T) -> bool {
    let least = T::of(APART) * automatic;
    square > least * least
}

/// Typical distance between neighboring samples, where the automatic radius holds so many `neighbors`; see
/// [`Neighborhoods::spacing`](super::Neighborhoods::spacing).
pub fn spacing<T: Real>(automatic: T, neighbors: usize, points: usize) -> T {
    automatic * T::of((std::f64::consts::PI / neighbors.min(points) as f64).sqrt())
}

/// The radius of every point that has enough neighbors within it.
///
/// # Errors
/// [`Error::Radius`].
pub fn common<T: Real>(rule: Radius, automatic: T) -> Result<T, Error> {
    match rule {
        Radius::Auto => Ok(automatic.max(smallest())),
        Radius::Fixed(radius) | Radius::Cut(radius) => {
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

/// Whether squares of distances within the box around all `points`, from its low to its high corner, are numbers.
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
