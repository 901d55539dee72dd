//! Cleaning and thinning of a cloud before its reconstruction.
//!
//! # Map
//! Points `(N, 3)` → the indices of those that are kept, ascending. [`clean`] applies the steps of [`Options`] one after the
//! other, in the order of its fields; each step is a function of its own, too. Kept samples are unchanged, so that normals,
//! attributes and cotangents go along by index.
//!
//! Distances are computed in double precision. The set of kept points does not depend on the order of the input, nor on the
//! number of threads; of equal points the one with the lowest index is kept.
//!
//! # Not differentiable
//! Sets are discrete: there is no pullback. The cotangent of a removed sample is zero.

mod outliers;
#[cfg(test)]
mod tests;
mod thin;

use std::cmp::Ordering;

use crate::{Attribute, PointCloud, PointCloudError, Real, Sensors, vector};
pub use outliers::{radius_outliers, statistical_outliers};
pub use thin::{duplicates, poisson_disk, voxel};

/// Outliers by the mean distance to their neighbors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistical {
    /// Number of nearest neighbors, the sample itself not counted.
    pub neighbors: usize,
    /// Standard deviations above the mean at which a sample becomes an outlier.
    pub ratio: f64,
}

/// Outliers by the number of their neighbors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sparse {
    /// Radius of the neighborhood, in the unit of the points.
    pub radius: f64,
    /// Fewest neighbors, the sample itself not counted, of a sample that is kept.
    pub neighbors: usize,
}

/// Steps, in the order in which they are applied; lengths are in the unit of the points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Removes points that are not finite, which are an error otherwise.
    pub drop_not_finite: bool,
    /// Removes all but one of the samples within this distance of each other; 0 for equal ones.
    pub duplicates: Option<f64>,
    /// Removes statistical outliers.
    pub statistical: Option<Statistical>,
    /// Removes samples with few neighbors.
    pub radius: Option<Sparse>,
    /// Keeps one sample in each voxel of this size.
    pub voxel: Option<f64>,
    /// Keeps samples farther apart than this distance, as many as fit in.
    pub poisson_disk: Option<f64>,
}

/// Result of [`clean`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cleaned {
    /// Indices of the samples kept, ascending.
    pub kept: Vec<u32>,
    /// Name of each step that was applied, and the number of samples that it removed.
    pub removed: Vec<(&'static str, usize)>,
}

/// Errors of cleaning.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A coordinate is NaN or infinite.
    #[error("point {index} is not finite: {point:?}; drop such points, or correct it")]
    NotFinite {
        /// Index of the first such point, from 0.
        index: usize,
        /// Its coordinates.
        point: [f64; 3],
    },
    /// A number of the options is out of range.
    #[error("{name} is {value}; give {expected}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Valid values.
        expected: &'static str,
    },
    /// Too many voxels along an axis to be numbered.
    #[error(
        "coordinates reach {largest:e}, which is too far for voxels of {size:e}; use larger voxels, or move the cloud toward the origin"
    )]
    Voxels {
        /// The largest absolute coordinate.
        largest: f64,
        /// Size of a voxel.
        size: f64,
    },
    /// Squares of distances would overflow.
    #[error(
        "coordinates reach {largest:e}, whose squares exceed double precision; use another unit of length"
    )]
    Range {
        /// The largest absolute coordinate.
        largest: f64,
    },
    /// More points than 32-bit indices can name.
    #[error("{points} points are more than 32-bit indices can name; clean the cloud in parts")]
    TooMany {
        /// Number of points.
        points: usize,
    },
}

const POSITIVE: &str = "a positive, finite length in the unit of the points";

/// Applies the steps of `options` to `(N, 3)` points.
///
/// # Errors
/// A point that is not finite, unless such points are dropped, and the errors of the steps.
///
/// ```
/// use isograd::clean::{Options, clean};
///
/// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.1, 0.0]];
/// let options = Options { duplicates: Some(0.0), voxel: Some(0.5), ..Options::default() };
/// let cleaned = clean(&points, &options)?;
/// assert_eq!(cleaned.kept, [0, 1]);
/// assert_eq!(cleaned.removed, [("duplicates", 1), ("voxel", 1)]);
/// # Ok::<(), isograd::clean::Error>(())
/// ```
pub fn clean<T: Real>(points: &[[T; 3]], options: &Options) -> Result<Cleaned, Error> {
    if points.len() >= u32::MAX as usize {
        return Err(Error::TooMany {
            points: points.len(),
        });
    }
    let mut cleaned = Cleaned {
        kept: (0..points.len() as u32).collect(),
        removed: Vec::new(),
    };
    let mut left: Vec<[f64; 3]> = points.iter().map(|&p| vector::to_f64(p)).collect();
    if options.drop_not_finite {
        let is_finite = |&i: &u32| vector::is_finite(left[i as usize]);
        let finite = cleaned.kept.iter().copied().filter(is_finite).collect();
        cleaned.keep("drop_not_finite", finite, &mut left);
    }
    check(&left)?;
    if let Some(distance) = options.duplicates {
        cleaned.keep("duplicates", duplicates(&left, distance)?, &mut left);
    }
    if let Some(options) = options.statistical {
        cleaned.keep(
            "statistical",
            statistical_outliers(&left, options)?,
            &mut left,
        );
    }
    if let Some(options) = options.radius {
        cleaned.keep("radius", radius_outliers(&left, options)?, &mut left);
    }
    if let Some(size) = options.voxel {
        cleaned.keep("voxel", voxel(&left, size)?, &mut left);
    }
    if let Some(distance) = options.poisson_disk {
        cleaned.keep("poisson_disk", poisson_disk(&left, distance)?, &mut left);
    }
    Ok(cleaned)
}

impl Cleaned {
    /// The samples of the cleaned cloud that are kept, with their normals, sensors and attributes.
    ///
    /// # Errors
    /// None for the cloud that was cleaned.
    pub fn apply<T: Real>(&self, cloud: &PointCloud<T>) -> Result<PointCloud<T>, PointCloudError> {
        let mut kept = PointCloud::new(self.rows(cloud.points()))?;
        if let Some(normals) = cloud.normals() {
            kept = kept.with_normals(self.rows(normals))?;
        }
        if let Some(sensors) = cloud.sensors() {
            kept = kept.with_sensors(match sensors {
                Sensors::Each(positions) => Sensors::Each(self.rows(positions)),
                Sensors::Any(positions) => Sensors::Any(positions.clone()),
            })?;
        }
        cloud.attributes().iter().try_fold(kept, |kept, attribute| {
            let rows: Vec<&[T]> = attribute.values.chunks(attribute.components).collect();
            kept.with_attribute(Attribute {
                values: self.rows(&rows).concat(),
                ..attribute.clone()
            })
        })
    }

    fn rows<E: Copy>(&self, all: &[E]) -> Vec<E> {
        let rows = self.kept.iter().filter_map(|&i| all.get(i as usize));
        rows.copied().collect()
    }

    /// Keeps these of the points that are left.
    fn keep(&mut self, step: &'static str, kept: Vec<u32>, left: &mut Vec<[f64; 3]>) {
        self.removed.push((step, left.len() - kept.len()));
        *left = kept.iter().map(|&i| left[i as usize]).collect();
        self.kept = kept.into_iter().map(|i| self.kept[i as usize]).collect();
    }
}

/// Points in double precision, checked: finite, with distances whose squares are, too.
fn checked<T: Real>(points: &[[T; 3]]) -> Result<Vec<[f64; 3]>, Error> {
    if points.len() >= u32::MAX as usize {
        return Err(Error::TooMany {
            points: points.len(),
        });
    }
    let points: Vec<[f64; 3]> = points.iter().map(|&p| vector::to_f64(p)).collect();
    check(&points)?;
    Ok(points)
}

fn check(points: &[[f64; 3]]) -> Result<(), Error> {
    if let Some(index) = points.iter().position(|&p| !vector::is_finite(p)) {
        return Err(Error::NotFinite {
            index,
            point: points[index],
        });
    }
    let largest = largest(points);
    match largest < 1e150 {
        true => Ok(()),
        false => Err(Error::Range { largest }),
    }
}

/// The largest absolute coordinate.
fn largest(points: &[[f64; 3]]) -> f64 {
    points
        .as_flattened()
        .iter()
        .fold(0.0, |m: f64, x| m.max(x.abs()))
}

fn check_length(name: &'static str, value: f64) -> Result<(), Error> {
    match value > 0.0 && value.is_finite() {
        true => Ok(()),
        false => Err(Error::Option {
            name,
            value,
            expected: POSITIVE,
        }),
    }
}

/// Order by coordinates; equal points by index.
fn by_place(points: &[[f64; 3]]) -> impl Fn(&u32, &u32) -> Ordering + Sync + Copy {
    |&a, &b| {
        let places = points[a as usize].partial_cmp(&points[b as usize]);
        places.unwrap_or(Ordering::Equal).then(a.cmp(&b))
    }
}

/// Indices of the entries that are true.
fn indices(kept: &[bool]) -> Vec<u32> {
    (0u32..)
        .zip(kept)
        .filter_map(|(i, &kept)| kept.then_some(i))
        .collect()
}
