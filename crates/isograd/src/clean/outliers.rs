//! Samples that are far from all others.

use super::{Error, Sparse, Statistical, check_length, checked, indices};
use crate::Real;
use crate::neighbors::CellIndex;
use crate::parallel::{self, sum_array};

/// Indices of the samples whose mean distance to their nearest neighbors is at most the mean of all of these plus
/// `ratio` standard deviations.
///
/// PCL's `StatisticalOutlierRemoval`. Open3D's `remove_statistical_outlier` counts the sample itself as a neighbor: there
/// `nb_neighbors` is one more; it also removes a sample on which all its neighbors lie.
///
/// # Errors
/// A point that is not finite or out of range, no neighbors, or a ratio that is not a finite number of 0 or more.
pub fn statistical_outliers<T: Real>(
    points: &[[T; 3]],
    options: Statistical,
) -> Result<Vec<u32>, Error> {
    let Statistical { neighbors, ratio } = options;
    if neighbors == 0 {
        let (name, value, expected) = ("the number of neighbors", 0.0, "at least 1");
        return Err(Error::Option {
            name,
            value,
            expected,
        });
    }
    if !(ratio >= 0.0 && ratio.is_finite()) {
        let (name, expected) = ("the ratio", "a finite number of 0 or more");
        return Err(Error::Option {
            name,
            value: ratio,
            expected,
        });
    }
    let points = checked(points)?;
    let index = CellIndex::new(&points);
    // In an order that does not depend on that of the input, and nor do the sums.
    let mut order = Vec::new();
    index.positions_by_place(&mut order);
    let means = parallel::map_with(Vec::new, order.len(), |found, k| {
        let point = index.point(order[k] as usize);
        // The sample itself, or one at the same place, comes first.
        index.nearest(point, neighbors.saturating_add(1), found);
        let others = found.get(1..).unwrap_or_default();
        let sum: f64 = others.iter().map(|&(_, squared)| squared.sqrt()).sum();
        sum / others.len().max(1) as f64
    });
    let count = means.len() as f64;
    let [sum] = sum_array(means.len(), |i| [means[i]]);
    let average = sum / count.max(1.0);
    let [squares] = sum_array(means.len(), |i| [(means[i] - average).powi(2)]);
    let limit = average + ratio * (squares / (count - 1.0).max(1.0)).sqrt();
    let mut kept = vec![false; points.len()];
    for (&position, mean) in order.iter().zip(means) {
        kept[index.order()[position as usize] as usize] = mean <= limit;
    }
    Ok(indices(&kept))
}

/// Indices of the samples with at least `neighbors` others within `radius`, at the radius itself included.
///
/// Open3D's `remove_radius_outlier` and PCL's `RadiusOutlierRemoval` with the same numbers.
///
/// # Errors
/// A point that is not finite or out of range, or a radius that is not a positive, finite length.
pub fn radius_outliers<T: Real>(points: &[[T; 3]], options: Sparse) -> Result<Vec<u32>, Error> {
    let Sparse { radius, neighbors } = options;
    check_length("the radius", radius)?;
    let points = checked(points)?;
    let index = CellIndex::new(&points);
    let most = neighbors.saturating_add(1);
    let has_enough = |i: usize| index.count_within(points[i], radius, most) > neighbors;
    let kept = parallel::map(points.len(), has_enough);
    Ok(indices(&kept))
}
