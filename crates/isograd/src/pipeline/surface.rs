//! Resolution of the surface: the grid of the indicator, which may be finer than the grid of φ.

use super::{Error, Solve};
use crate::{Grid, GridError, Real};

/// Cells of the surface's grid per sample spacing with [`SurfaceResolution::Auto`]. Mean distance from the surface to the
/// true mesh with 0.8, 1.2 and 1.6 of them, in cells of φ (128 on the longest side): an airliner 0.0060, 0.0046, 0.0045; a
/// tray of plates 0.0041, 0.0049, 0.0068; a machined part 0.012, 0.020, 0.033.
const CELLS_PER_SPACING: f64 = 1.2;

/// Automatic ratios of the cell sizes. Few, so that the ratio seldom changes as the points move. Mean distance
/// from the surface to the true mesh with 2, 3 and 4, in cells of φ (64 on the longest side): an airliner 0.0112, 0.0056,
/// 0.0040; a flying wing 0.0237, 0.0128, 0.0081; an aorta 0.0077, 0.0046, 0.0037.
const AUTO_FACTORS: [f64; 5] = [1.25, 1.5, 2.0, 3.0, 4.0];

/// Automatic ratio up to which the solve may be sparse.
const SPARSE_FACTOR: f64 = 2.0;

/// Largest number of cells of a dense solve that is chosen automatically: 2²⁵, 0.6 GB in `f32`.
const MAX_DENSE_CELLS: usize = 1 << 25;

/// Cells of the coarsest grid of a sparse solve, approximately.
const COARSE_CELLS: usize = 1 << 22;

/// Largest ratio of the two cell sizes.
const MAX_FACTOR: f64 = 64.0;

/// How much larger than asked for a refinement may be, for lengths that a Fourier transform is quick for.
const SLACK: f64 = 1.1;

/// How fine the surface is. Splat, Poisson, iso-value and isosurface run on a grid of their own, which fills the box of
/// the grid of φ with cubic cells that are smaller by a ratio of whole numbers; φ is the exact distance to that surface.
/// Time and memory grow with the number of these cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SurfaceResolution {
    /// Cells of about the distance between samples, as far as that is affordable: as fine as the grid of φ or up to twice
    /// as fine, and up to four times where these are at most 2²⁵ cells. The ratio of the cell sizes is a step function of
    /// the points, and the pullback holds it constant: prefer [`Self::Spacing`] or [`Self::Factor`] for a time series.
    #[default]
    Auto,
    /// The grid of φ itself.
    Grid,
    /// Cells of at most this size, in the cloud's unit, at least 1/64 of those of φ.
    Spacing(f64),
    /// Cells smaller by at least this factor, 1 or more.
    Factor(f64),
}

impl SurfaceResolution {
    /// Whether the spacing or the factor is in its range.
    pub(super) fn is_valid(self) -> bool {
        match self {
            Self::Grid | Self::Auto => true,
            Self::Spacing(spacing) => spacing > 0.0 && spacing.is_finite(),
            Self::Factor(factor) => (1.0..=MAX_FACTOR).contains(&factor),
        }
    }

    /// Like [`Self::grid`], and the number of octaves of the sparse solve, 0 for a dense one. A sparse one may have smaller
    /// cells.
    ///
    /// # Errors
    /// As [`Self::grid`].
    pub(super) fn grid_and_octaves<T: Real>(
        self,
        grid: &Grid<T>,
        sample_spacing: f64,
        solve: Solve,
    ) -> Result<(Grid<T>, usize), Error> {
        let fine = self.grid(grid, sample_spacing, solve)?;
        if solve == Solve::Dense || solve == Solve::Auto && fine.cells() <= MAX_DENSE_CELLS {
            return Ok((dense(fine)?, 0));
        }
        let parts = grid.shape().into_iter().fold(0, gcd);
        let count = fine.shape()[0] / (grid.shape()[0] / parts);
        let wanted = (1..8)
            .find(|octaves| fine.cells() >> (3 * octaves) <= COARSE_CELLS)
            .unwrap_or(8);
        let rounded = |octaves: usize| count.next_multiple_of(1 << octaves);
        let thinnest = grid.shape().into_iter().min().unwrap_or(0) / parts;
        let fits = |&octaves: &usize| {
            let is_close = rounded(octaves) as f64 <= SLACK * count as f64;
            is_close && (thinnest * rounded(octaves)) >> octaves >= Grid::<T>::MIN_CELLS
        };
        match (1..=wanted).rev().find(fits) {
            None if solve == Solve::Auto => Ok((dense(fine)?, 0)),
            octaves => {
                let octaves = octaves.unwrap_or(1);
                let scaled = grid.shape().map(|n| n / parts * rounded(octaves));
                Ok((with_shape(grid, scaled)?, octaves))
            }
        }
    }

    /// Grid of the surface in the box of `grid`, for samples that are `sample_spacing` apart.
    ///
    /// # Errors
    /// [`Error::Surface`] for cells more than 64 times as fine, [`Error::Grid`] for too many or too small cells.
    pub(super) fn grid<T: Real>(
        self,
        grid: &Grid<T>,
        sample_spacing: f64,
        solve: Solve,
    ) -> Result<Grid<T>, Error> {
        let spacing = grid.spacing().f64();
        let factor = match self {
            Self::Grid => 1.0,
            Self::Auto => {
                let wanted = CELLS_PER_SPACING * spacing / sample_spacing;
                return Ok(automatic(grid, wanted, solve));
            }
            Self::Spacing(length) => spacing / length,
            Self::Factor(factor) => factor,
        };
        match factor {
            _ if factor > MAX_FACTOR => Err(Error::Surface(self)),
            _ if factor > 1.0 => Ok(refine(grid, factor)?),
            _ => Ok(*grid),
        }
    }
}

/// The coarsest automatic grid with at least the wanted ratio of cell sizes, or else the finest affordable one.
fn automatic<T: Real>(grid: &Grid<T>, wanted: f64, solve: Solve) -> Grid<T> {
    let mut finest = *grid;
    for factor in AUTO_FACTORS {
        if !(wanted > grid.spacing().f64() / finest.spacing().f64()) {
            break;
        }
        let may_be_sparse = solve != Solve::Dense && factor <= SPARSE_FACTOR;
        match refine(grid, factor) {
            Ok(fine) if may_be_sparse || fine.cells() <= MAX_DENSE_CELLS => finest = fine,
            _ => break,
        }
    }
    finest
}

/// The grid of the same box whose cells are smaller by a factor of at least `factor` that gives each axis a whole number of
/// them: preferably, within [`SLACK`], numbers without prime factors above 7.
fn refine<T: Real>(grid: &Grid<T>, factor: f64) -> Result<Grid<T>, GridError> {
    let shape = grid.shape();
    let parts = shape.into_iter().fold(0, gcd);
    let scaled = |count: usize| shape.map(|n| n / parts * count);
    // A factor that is a ratio of whole numbers up to rounding is that ratio.
    let least = (factor * parts as f64 * (1.0 - 1e-9)).ceil().max(1.0) as usize;
    let most = (SLACK * factor * parts as f64) as usize;
    let count = (least..=most)
        .find(|&count| scaled(count).into_iter().all(is_smooth))
        .unwrap_or(least);
    with_shape(grid, scaled(count))
}

/// A grid that is small enough to have a value at each cell.
fn dense<T: Real>(grid: Grid<T>) -> Result<Grid<T>, GridError> {
    Grid::new(grid.lower(), grid.spacing(), grid.shape())
}

/// The grid of the same box with `shape` cells, which must be cubes.
pub(super) fn with_shape<T: Real>(grid: &Grid<T>, shape: [usize; 3]) -> Result<Grid<T>, GridError> {
    if shape == grid.shape() {
        return Ok(*grid);
    }
    let spacing = grid.spacing().f64() * grid.shape()[0] as f64 / shape[0] as f64;
    Grid::in_blocks(grid.lower(), T::of(spacing), shape)
}

/// The greatest common divisor.
fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Whether a number has no prime factor above 7.
fn is_smooth(mut number: usize) -> bool {
    for prime in [2, 3, 5, 7] {
        while number.is_multiple_of(prime) {
            number /= prime;
        }
    }
    number == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(shape: [usize; 3]) -> Grid<f64> {
        Grid::new([0.1, -0.2, 0.3], 0.05, shape).expect("valid")
    }

    #[test]
    fn a_refined_grid_fills_the_same_box_with_cubes_at_least_as_fine() {
        for shape in [[128, 64, 32], [338, 120, 151], [60, 48, 36], [97, 97, 97]] {
            let coarse = grid(shape);
            for factor in [1.0, 1.2, 1.5, 2.0, 3.0] {
                let fine = SurfaceResolution::Factor(factor)
                    .grid(&coarse, f64::NAN, Solve::Dense)
                    .expect("fits");
                let ratio = coarse.spacing() / fine.spacing();
                assert!(ratio >= factor * (1.0 - 1e-9), "{shape:?} {factor} {ratio}");
                assert_eq!(fine.lower(), coarse.lower());
                for (a, b) in fine.upper().into_iter().zip(coarse.upper()) {
                    assert!((a - b).abs() < 1e-12, "{shape:?} {factor}");
                }
            }
        }
    }

    #[test]
    fn lengths_suit_a_fourier_transform_where_the_box_allows() {
        let fine = SurfaceResolution::Factor(1.3).grid(&grid([128; 3]), f64::NAN, Solve::Dense);
        assert_eq!(fine.expect("fits").shape(), [168; 3]);
        let fine =
            SurfaceResolution::Factor(2.0).grid(&grid([338, 120, 151]), f64::NAN, Solve::Dense);
        assert_eq!(fine.expect("fits").shape(), [676, 240, 302]);
    }

    #[test]
    fn automatic_cells_follow_the_samples_as_far_as_is_affordable() {
        let cells = |shape, sample_spacing: f64, solve| {
            let fine = SurfaceResolution::Auto.grid(&grid(shape), 0.05 * sample_spacing, solve);
            fine.expect("fits").shape()
        };
        let cube = [40; 3];
        for (sample_spacing, expected) in [
            (1.3, 40),
            (0.97, 50),
            (0.9, 60),
            (0.7, 80),
            (0.5, 120),
            (0.35, 160),
            (1e-9, 160),
        ] {
            assert_eq!(cells(cube, sample_spacing, Solve::Dense), [expected; 3]);
        }
        assert_eq!(cells(cube, f64::NAN, Solve::Dense), cube);
        // At most 2²⁵ cells, or twice as fine by a sparse solve.
        for (shape, dense, sparse) in [
            ([100; 3], [300; 3], [300; 3]),
            ([150; 3], [300; 3], [300; 3]),
            ([200; 3], [300; 3], [400; 3]),
            ([338, 120, 151], [338, 120, 151], [676, 240, 302]),
        ] {
            assert_eq!(cells(shape, 0.1, Solve::Dense), dense);
            assert_eq!(cells(shape, 0.1, Solve::Auto), sparse);
        }
    }

    #[test]
    fn cells_of_a_sparse_solve_can_be_halved_and_hardly_shrink() {
        let of = |shape, factor, solve| {
            let surface = SurfaceResolution::Factor(factor);
            let found = surface.grid_and_octaves(&grid(shape), f64::NAN, solve);
            let (fine, octaves) = found.expect("fits");
            assert!(fine.shape().iter().all(|n| n % (1 << octaves) == 0));
            (fine.shape(), octaves)
        };
        assert_eq!(of([128; 3], 2.0, Solve::Auto), ([256; 3], 0));
        assert_eq!(of([128; 3], 4.0, Solve::Auto), ([512; 3], 2));
        assert_eq!(of([128; 3], 4.0, Solve::Dense), ([512; 3], 0));
        assert_eq!(of([128; 3], 1.0, Solve::Sparse), ([128; 3], 1));
        assert_eq!(of([125; 3], 3.0, Solve::Auto), ([376; 3], 2));
        assert_eq!(of([338, 120, 151], 3.0, Solve::Auto), ([1014, 360, 453], 0));
        assert_eq!(of([338, 120, 151], 4.0, Solve::Auto), ([1352, 480, 604], 2));
    }

    #[test]
    fn more_cells_than_can_be_indexed_are_an_error() {
        let fine = SurfaceResolution::Spacing(1e-3).grid(&grid([600; 3]), f64::NAN, Solve::Dense);
        assert!(matches!(fine, Err(Error::Grid(_))));
        let fine = SurfaceResolution::Spacing(1e-300).grid(&grid([8; 3]), f64::NAN, Solve::Dense);
        assert!(matches!(fine, Err(Error::Surface(_))));
    }
}
