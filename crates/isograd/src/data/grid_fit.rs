//! The grid fitted to a cloud, and the pullback to its points.

use super::cloud::{PointCloud, bounds};
use super::grid::{Grid, GridCotangent, GridError, Resolution};
use super::outliers::{Outliers, Selection};
use crate::Real;

impl<T: Real> Grid<T> {
    /// The grid around a cloud: its bounding box, widened on every side by `padding` times the longest
    /// side and by at least [`Self::MARGIN_CELLS`] cells, centered. The longest side has as many cells as
    /// asked for; the others are rounded up to a number whose Fourier transform is fast. [Outliers](Outliers) are
    /// ignored: they may lie outside.
    ///
    /// # Errors
    /// As [`Self::new`], and [`GridError::NoExtent`] where all points are equal.
    pub fn fit(
        cloud: &PointCloud<T>,
        resolution: Resolution<T>,
        padding: T,
    ) -> Result<Self, GridError> {
        Self::fit_with(cloud, resolution, padding, Outliers::Ignore)
    }

    /// Like [`Self::fit`], with or without outliers.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub fn fit_with(
        cloud: &PointCloud<T>,
        resolution: Resolution<T>,
        padding: T,
        outliers: Outliers,
    ) -> Result<Self, GridError> {
        let selection = outliers.select_for_box(cloud.points());
        Self::fit_used(cloud, resolution, padding, &selection)
    }

    /// The grid around the samples that are used.
    fn fit_used(
        cloud: &PointCloud<T>,
        resolution: Resolution<T>,
        padding: T,
        selection: &Selection,
    ) -> Result<Self, GridError> {
        if !(padding >= T::zero()) || !padding.is_finite() {
            return Err(GridError::Padding {
                padding: padding.f64(),
            });
        }
        let none = GridError::NoExtent {
            points: cloud.len(),
        };
        let Some((low, high)) = bounds(&selection.points(cloud.points())) else {
            return Err(none);
        };
        let extent: [f64; 3] = std::array::from_fn(|a| high[a].f64() - low[a].f64());
        let longest = extent[0].max(extent[1]).max(extent[2]);
        if !(longest > 0.0) {
            return Err(none);
        }
        let (margin, spacing) = (
            Self::MARGIN_CELLS as f64,
            spacing(longest, resolution, padding)?,
        );
        let pad = (padding.f64() * longest).max(margin * spacing);
        let counts = extent.map(|e| ((e + 2.0 * pad) / spacing * (1.0 - 1e-6)).ceil());
        if counts.iter().any(|&n| n > Self::MAX_CELLS as f64) {
            let shape = counts.map(|n| n as usize);
            return Err(GridError::TooMany {
                shape,
                max: Self::MAX_CELLS,
            });
        }
        let mut shape = counts.map(|n| n as usize);
        for axis in 0..3 {
            if extent[axis] < longest {
                shape[axis] = fast_length(shape[axis]);
            } else if let Resolution::Cells(n) = resolution {
                shape[axis] = n;
            }
        }
        let lower = std::array::from_fn(|a| {
            let center = 0.5 * (low[a].f64() + high[a].f64());
            T::of(center - 0.5 * spacing * shape[a] as f64)
        });
        Self::new(lower, T::of(spacing), shape)
    }

    /// Pulls a cotangent of the grid that [`Self::fit_with`] gives back to the points: to the two that bound the
    /// cloud along each axis, the first of them among equals. Adds into `points_bar` `(N, 3)`, per unit length;
    /// the other arguments are those of the forward map.
    ///
    /// Where the longest side of the box belongs to the first of several equal axes, that one counts.
    ///
    /// # Not differentiable
    /// The numbers of cells are held constant. They step as the sides of the box change, except that of the
    /// longest side where it is given; so do the bounds where another point, or another axis, takes over.
    ///
    /// # Errors
    /// As [`Self::fit`], and another number of cotangents than points; nothing is then written.
    pub fn fit_pullback(
        cloud: &PointCloud<T>,
        resolution: Resolution<T>,
        padding: T,
        outliers: Outliers,
        bar: &GridCotangent<T>,
        points_bar: &mut [[T; 3]],
    ) -> Result<(), GridError> {
        let points = cloud.len();
        if points_bar.len() != points {
            return Err(GridError::Cotangent {
                entries: points_bar.len(),
                points,
            });
        }
        let selection = outliers.select_for_box(cloud.points());
        let shape = Self::fit_used(cloud, resolution, padding, &selection)?.shape();
        let Some(ends) = ends(cloud.points(), selection.left_out()) else {
            return Err(GridError::NoExtent { points });
        };
        let at = |axis: usize, end: usize| cloud.points()[ends[axis][end]][axis].f64();
        let extent = [0, 1, 2].map(|a| at(a, 1) - at(a, 0));
        let longest = (1..3).fold(0, |m, a| if extent[a] > extent[m] { a } else { m });
        // lower = center − shape · spacing / 2
        let spacing_bar = (0..3).fold(bar.spacing.f64(), |sum, a| {
            sum - 0.5 * shape[a] as f64 * bar.lower[a].f64()
        });
        for axis in 0..3 {
            let of_center = 0.5 * bar.lower[axis].f64();
            let of_extent = if axis == longest {
                spacing_bar * growth(resolution, padding)
            } else {
                0.0
            };
            points_bar[ends[axis][0]][axis] += T::of(of_center - of_extent);
            points_bar[ends[axis][1]][axis] += T::of(of_center + of_extent);
        }
        Ok(())
    }
}

/// Cell size of the grid around a box with this longest side.
fn spacing<T: Real>(longest: f64, resolution: Resolution<T>, padding: T) -> Result<f64, GridError> {
    let margin = Grid::<T>::MARGIN_CELLS;
    let spacing = match resolution {
        Resolution::Cells(cells) => {
            let min = 2 * margin + 2;
            if cells < min {
                let axis = 0;
                return Err(GridError::TooFew { axis, cells, min });
            }
            let padded = longest * (1.0 + 2.0 * padding.f64()) / cells as f64;
            padded.max(longest / (cells as f64 - 2.0 * margin as f64))
        }
        Resolution::Spacing(h) => h.f64(),
    };
    if !(spacing > 0.0) || !spacing.is_finite() {
        return Err(GridError::Spacing { spacing });
    }
    Ok(spacing)
}

/// Cell size over the longest side of the box, where it depends on that.
fn growth<T: Real>(resolution: Resolution<T>, padding: T) -> f64 {
    match resolution {
        Resolution::Cells(n) => {
            let margin = 2.0 * Grid::<T>::MARGIN_CELLS as f64;
            ((1.0 + 2.0 * padding.f64()) / n as f64).max(1.0 / (n as f64 - margin))
        }
        Resolution::Spacing(_) => 0.0,
    }
}

/// The first points with the least and with the greatest coordinate, `[axis][end]`, but for those left out.
fn ends<T: Real>(points: &[[T; 3]], left_out: &[u32]) -> Option<[[usize; 2]; 3]> {
    let is_used = |i: &usize| left_out.binary_search(&(*i as u32)).is_err();
    let mut used = (0..points.len()).filter(is_used).peekable();
    let mut ends = [[*used.peek()?; 2]; 3];
    for i in used {
        let p = points[i];
        for (axis, [low, high]) in ends.iter_mut().enumerate() {
            if p[axis] < points[*low][axis] {
                *low = i;
            }
            if p[axis] > points[*high][axis] {
                *high = i;
            }
        }
    }
    Some(ends)
}

/// The least number not below `n` with no prime factor above 7: lengths whose Fourier transform is fast.
pub(crate) fn fast_length(n: usize) -> usize {
    let smooth = |mut m: usize| {
        for p in [2, 3, 5, 7] {
            while m.is_multiple_of(p) {
                m /= p;
            }
        }
        m == 1
    };
    (n.max(1)..).find(|&m| smooth(m)).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(points: &[[f64; 3]]) -> PointCloud<f64> {
        PointCloud::new(points.to_vec()).expect("finite points")
    }

    fn pull(
        cloud: &PointCloud<f64>,
        resolution: Resolution<f64>,
        padding: f64,
        bar: &GridCotangent<f64>,
        points_bar: &mut [[f64; 3]],
    ) -> Result<(), GridError> {
        Grid::fit_pullback(
            cloud,
            resolution,
            padding,
            Outliers::Ignore,
            bar,
            points_bar,
        )
    }

    #[test]
    fn fitted_grid_has_the_resolution_asked_for_and_its_margin() {
        let c = cloud(&[[0.0, 0.0, 0.0], [2.0, 1.0, 0.1]]);
        for (n, padding) in [(32, 0.0), (64, 0.1), (200, 0.3)] {
            let g = Grid::fit(&c, Resolution::Cells(n), padding).expect("fits");
            assert_eq!(g.shape()[0], n);
            for p in c.points() {
                let x = g.to_index(*p);
                for a in 0..3 {
                    assert!(
                        x[a] >= 3.99 && x[a] <= g.shape()[a] as f64 - 3.99,
                        "{x:?} in {g:?}"
                    );
                }
            }
        }
    }

    /// A scalar of the fitted grid.
    fn loss(points: &[[f64; 3]], resolution: Resolution<f64>, bar: &GridCotangent<f64>) -> f64 {
        let grid = Grid::fit(&cloud(points), resolution, 0.07).expect("fits");
        crate::vector::dot(grid.lower(), bar.lower) + grid.spacing() * bar.spacing
    }

    #[test]
    fn pullback_of_the_fit_agrees_with_finite_differences() {
        // The least and the greatest are shared by several points along y; these are moved together below.
        let points = [
            [0.3, 0.0, 0.2],
            [-0.4, 0.9, 0.1],
            [1.7, 0.4, -0.3],
            [0.2, 0.9, 0.45],
            [0.5, 0.3, 0.0],
        ];
        let bar = GridCotangent {
            lower: [0.7, -1.3, 0.4],
            spacing: 2.1,
        };
        // The margin decides in the second, the padding in the first.
        for resolution in [
            Resolution::Cells(200),
            Resolution::Cells(24),
            Resolution::Spacing(0.0517),
        ] {
            let mut found = vec![[0.0; 3]; points.len()];
            pull(&cloud(&points), resolution, 0.07, &bar, &mut found).expect("fits");
            assert_eq!([found[3][1], found[4][0]], [0.0, 0.0]);
            for i in 0..points.len() {
                for a in 0..3 {
                    let slope = |step: f64| {
                        let mut moved = points;
                        moved[i][a] += step;
                        if (i, a) == (1, 1) {
                            moved[3][1] += step;
                        }
                        loss(&moved, resolution, &bar)
                    };
                    if (i, a) == (3, 1) {
                        continue;
                    }
                    // Piecewise linear: rounding alone.
                    let expected = (slope(1e-4) - slope(-1e-4)) / 2e-4;
                    assert!(
                        (found[i][a] - expected).abs() < 1e-10,
                        "{i} {a} {resolution:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_moved_cloud_moves_its_grid_and_a_scaled_one_scales_it() {
        let mut points: Vec<[f64; 3]> = Vec::new();
        for i in 0..50 {
            let t = f64::from(i);
            points.push([(7.0 * t).sin(), 0.3 * (3.0 * t).cos(), 0.1 * t.sin()]);
        }
        let bar = GridCotangent {
            lower: [0.2, 0.5, -0.9],
            spacing: -3.0,
        };
        let (cloud, resolution) = (cloud(&points), Resolution::Cells(64));
        let mut found = vec![[1.0; 3]; 50];
        pull(&cloud, resolution, 0.1, &bar, &mut found).expect("fits");
        let grid = Grid::fit(&cloud, resolution, 0.1).expect("fits");
        for a in 0..3 {
            let sum: f64 = found.iter().map(|p| p[a] - 1.0).sum();
            assert!((sum - bar.lower[a]).abs() < 1e-13);
        }
        let along = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|a| (p[a] - 1.0) * q[a]).sum::<f64>();
        let scaled: f64 = found.iter().zip(&points).map(|(p, q)| along(p, q)).sum();
        let expected = crate::vector::dot(grid.lower(), bar.lower) + grid.spacing() * bar.spacing;
        assert!((scaled - expected).abs() < 1e-12);
    }

    #[test]
    fn cotangents_that_do_not_match_are_refused() {
        let (cloud, bar) = (cloud(&[[0.0; 3], [1.0; 3]]), GridCotangent::default());
        let refused = pull(&cloud, Resolution::Cells(64), 0.1, &bar, &mut [[0.0; 3]]);
        let expected = GridError::Cotangent {
            entries: 1,
            points: 2,
        };
        assert_eq!(refused, Err(expected));
        let none = PointCloud::new(Vec::new()).expect("empty");
        let refused = pull(&none, Resolution::Cells(64), 0.1, &bar, &mut []);
        assert!(matches!(refused, Err(GridError::NoExtent { .. })));
    }

    #[test]
    fn fast_lengths_have_small_factors() {
        assert_eq!(fast_length(121), 125);
        assert_eq!(fast_length(128), 128);
        assert_eq!(fast_length(0), 1);
    }
}
