//! The iso-value: the mean of the indicator at the samples.
//!
//! # Map
//! `c = Σ a_i χ(x_i) / Σ a_i`, with `χ` trilinear between cell centers (quadratic B-splines where it is refined) and
//! `a_i` the area that sample `i` stands for. The paper takes the value "near the input point samples", after Kazhdan, Bolitho and
//! Hoppe, *Poisson surface reconstruction* (SGP 2006), §4.4; the weights make it the mean over the
//! surface for any density of the samples. Sums are in double precision, in one fixed order.
//!
//! # Residual
//! `Σ a_i`, `c`, and `χ` and `∇χ` at every sample, without the field itself.
//!
//! # Pullback
//! With `w_i` the trilinear weights at `x_i` and `s_i = c̄ a_i / Σ a`: `χ̄ += s_i w_i`, `x̄_i += s_i ∇χ(x_i)`,
//! `ā_i += c̄ (χ(x_i) − c) / Σ a`: [`pullback`]. Further cotangents of `χ(x_i)` are added to `s_i`.
//!
//! # Not differentiable
//! `∇χ` jumps where a sample crosses a plane through cell centers; the gradient on its side is used.

use super::{Interpolation, spline};
use crate::data::cells::{Cells, CellsMut};
use crate::splat::{SampleCotangent, Samples, SortedSamples};
use crate::trilinear::{self, Cube};
use crate::{Field, Grid, Real, parallel, vector};

/// Values that the pullback needs besides the inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual<T> {
    /// `Σ a_i`.
    pub area: f64,
    /// `c`, before rounding to the type of the field.
    pub value: f64,
    /// `(N,)` the indicator at the samples, in input order.
    pub at_samples: Vec<AtSample<T>>,
    /// How `χ(x_i)` was read.
    pub(crate) interpolation: Interpolation,
}

/// The indicator at a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AtSample<T> {
    /// `χ(x_i)`.
    pub value: T,
    /// `∇χ(x_i)`, per cell.
    pub gradient: [T; 3],
}

/// Errors of the iso-value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The areas do not match the points.
    #[error("{areas} areas for {points} points; give one area per point")]
    Count {
        /// Number of points.
        points: usize,
        /// Number of areas.
        areas: usize,
    },
    /// The areas do not add up to a positive number.
    #[error(
        "the areas of {points} samples add up to {area}; at least one must be positive, and all finite"
    )]
    Area {
        /// Number of points.
        points: usize,
        /// Sum of the areas.
        area: f64,
    },
    /// The indicator at the samples is not finite.
    #[error(
        "the indicator is not finite at the samples; use f64, or a unit in which the cell size is closer to 1"
    )]
    NotFinite,
}

/// The iso-value `c` of `chi` for `(N, 3)` samples `points` in the user's unit and their `(N,)` areas.
///
/// # Errors
/// As [`Error`] lists; `residual` is then not to be used.
pub fn forward<T: Real>(
    chi: &Field<T>,
    points: &[[T; 3]],
    areas: &[T],
    residual: &mut Residual<T>,
) -> Result<T, Error> {
    forward_on(chi.into(), points, areas, Interpolation::Linear, residual)
}

/// Like [`forward`], for a field that is dense or in blocks, read by `interpolation`.
pub(crate) fn forward_on<T: Real>(
    chi: Cells<'_, T>,
    points: &[[T; 3]],
    areas: &[T],
    interpolation: Interpolation,
    residual: &mut Residual<T>,
) -> Result<T, Error> {
    residual.interpolation = interpolation;
    if points.len() != areas.len() {
        return Err(Error::Count {
            points: points.len(),
            areas: areas.len(),
        });
    }
    let grid = chi.grid();
    parallel::fill(&mut residual.at_samples, points.len(), |i| {
        let point = points[i];
        if interpolation == Interpolation::Spline {
            return spline::at_sample(chi, point);
        }
        let (value, gradient) = Cube::new(grid, grid.to_index(point)).value_and_gradient_of(chi);
        AtSample { value, gradient }
    });
    let [sum, area] = parallel::sum_array(points.len(), |i| {
        let a = areas[i].f64();
        [a * residual.at_samples[i].value.f64(), a]
    });
    if !(area > 0.0) || !area.is_finite() {
        return Err(Error::Area {
            points: points.len(),
            area,
        });
    }
    (residual.area, residual.value) = (area, sum / area);
    let c = T::of(residual.value);
    if !c.is_finite() {
        return Err(Error::NotFinite);
    }
    Ok(c)
}

/// Adds to `chi_bar` `(nx, ny, nz)` on `grid`, and to `out`, the cotangents of the indicator, the samples and the
/// grid from the cotangent `bar` of the iso-value and the cotangents `values_bar` `(N,)` of `χ(x_i)` (empty for
/// none). All other arguments are those of [`forward`].
pub fn pullback<T: Real>(
    grid: &Grid<T>,
    sorted: SortedSamples<'_, T>,
    residual: &Residual<T>,
    bar: T,
    values_bar: &[T],
    chi_bar: &mut [T],
    out: &mut SampleCotangent<T>,
) {
    let chi_bar = CellsMut::Dense(grid, chi_bar);
    pullback_on(sorted, residual, bar, values_bar, chi_bar, out);
}

/// Like [`pullback`], for fields that are dense or in blocks.
pub(crate) fn pullback_on<T: Real>(
    sorted: SortedSamples<'_, T>,
    residual: &Residual<T>,
    bar: T,
    values_bar: &[T],
    chi_bar: CellsMut<'_, T>,
    out: &mut SampleCotangent<T>,
) {
    let grid = &chi_bar.cells().grid().clone();
    let samples = sorted.samples;
    let Samples { areas, .. } = samples;
    let share = bar.f64() / residual.area;
    // Cotangent of the value at a sample, and that of its point.
    let value_bar = |i: usize| {
        let given = values_bar.get(i).copied().unwrap_or(T::zero());
        T::of(share * areas[i].f64()) + given
    };
    let point_bar = |i: usize| {
        let slope = value_bar(i) / grid.spacing();
        vector::scale(residual.at_samples[i].gradient, slope)
    };
    // The mean does not depend on the unit of the areas.
    parallel::for_each(&mut out.areas, |i, area| {
        *area += T::of(share * (residual.at_samples[i].value.f64() - residual.value));
    });
    out.add(grid, samples, false, |i| (point_bar(i), T::zero()));
    match (residual.interpolation, chi_bar) {
        (Interpolation::Spline, CellsMut::Dense(grid, chi_bar)) => {
            spline::spread(grid, sorted, value_bar, chi_bar);
        }
        (_, chi_bar) => trilinear::spread_on(chi_bar, sorted, value_bar),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `χ = 2x − y + 3z`, which interpolation gives back exactly.
    fn linear() -> Field<f64> {
        let grid = Grid::new([1e3, 0.0, -2.0], 0.5, [12, 9, 10]).expect("valid");
        let chi = |i| {
            let [x, y, z] = grid.center(grid.cell(i));
            2.0 * x - y + 3.0 * z
        };
        Field::new(grid, (0..grid.cells()).map(chi).collect()).expect("sizes match")
    }

    #[test]
    fn value_is_the_weighted_mean_at_the_samples() {
        let points = [[1001.0, 1.0, 0.0], [1003.3, 2.2, 1.7], [1002.0, 3.0, 2.0]];
        let areas = [1.0, 0.5, 2.5];
        let mut residual = Residual::default();
        let c = forward(&linear(), &points, &areas, &mut residual).expect("valid");
        let at = |p: [f64; 3]| 2.0 * p[0] - p[1] + 3.0 * p[2];
        let expected = (at(points[0]) + 0.5 * at(points[1]) + 2.5 * at(points[2])) / 4.0;
        // Rounding of numbers near 2000.
        assert!((c - expected).abs() < 1e-11, "{c} {expected}");
        assert_eq!((residual.area, residual.value), (4.0, c));
    }

    #[test]
    fn sample_counted_twice_is_a_sample_of_twice_the_area() {
        let (p, q) = ([1001.0, 1.0, 0.0], [1003.3, 2.2, 1.7]);
        let level = |points: &[[f64; 3]], areas: &[f64]| {
            forward(&linear(), points, areas, &mut Residual::default()).expect("valid")
        };
        let twice = level(&[p, q, q], &[1.0; 3]);
        let once = level(&[p, q], &[1.0, 2.0]);
        assert!((twice - once).abs() < 1e-11);
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let points: Vec<[f64; 3]> = (0..20_000)
            .map(|i| {
                let t = |a: f64| (f64::from(i) * a).fract();
                [
                    1000.5 + 5.0 * t(0.618),
                    0.5 + 3.0 * t(0.414),
                    2.0 * t(0.732),
                ]
            })
            .collect();
        let areas: Vec<f64> = points.iter().map(|p| p[1]).collect();
        crate::testing::assert_same_bits(|| {
            let mut residual = Residual::default();
            let c = forward(&linear(), &points, &areas, &mut residual).expect("valid");
            (c, residual)
        });
    }

    #[test]
    fn bad_input_is_refused_with_a_reason() {
        let refused = |field: &Field<f64>, points: &[[f64; 3]], areas: &[f64]| {
            forward(field, points, areas, &mut Residual::default())
                .expect_err("refused")
                .to_string()
        };
        let p = [1001.0, 1.0, 0.0];
        assert!(refused(&linear(), &[p], &[]).contains("0 areas"));
        assert!(refused(&linear(), &[], &[]).contains("0 samples"));
        assert!(refused(&linear(), &[p, p], &[1.0, -1.0]).contains("add up to 0"));
        assert!(refused(&linear(), &[p], &[f64::NAN]).contains("NaN"));
        let mut broken = linear();
        broken.values_mut().fill(f64::INFINITY);
        assert!(refused(&broken, &[p], &[1.0]).contains("not finite"));
    }
}
