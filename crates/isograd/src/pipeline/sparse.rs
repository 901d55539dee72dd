//! A sparse solve: the indicator in blocks of cells near the samples and the surface.

use std::sync::Arc;

use super::memory::check_blocks;
use super::{Error, Reconstruction, Reconstructor};
use crate::data::blocks::{BlockField, Blocks, Marks};
use crate::data::cells::{Cells, CellsMut};
use crate::isosurface;
use crate::poisson::pyramid::{Octaves, Pyramid};
use crate::{Field, Grid, Real, poisson, splat};

/// Cells around a sample that are in the blocks. The surface seldom is farther from all samples: then blocks are added.
const REACH: isize = 5;

/// Times that blocks are added where the surface leaves them.
const ROUNDS: usize = 12;

/// How the Poisson equation is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solve {
    /// Dense up to 2²⁵ cells of the surface's grid, sparse beyond; a [screened](crate::poisson::screened) equation is
    /// always dense.
    #[default]
    Auto,
    /// At every cell: time and memory grow with the volume.
    Dense,
    /// At the cells near the samples and the surface, with a coarse grid for the rest: time and memory grow with the
    /// surface. The indicator there is the dense one to 1e-4 of its jump. The cells of the surface may become smaller
    /// by a tenth, for a number of them that can be halved.
    Sparse,
}

impl Solve {
    /// Name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Dense => "dense",
            Self::Sparse => "sparse",
        }
    }
}

/// The indicator of a sparse solve.
#[derive(Clone)]
pub(super) struct Sparse<T> {
    count: usize,
    closed: bool,
    octaves: Octaves,
    pub(super) chi: BlockField<T>,
}

/// A field over the surface's grid: dense or in blocks.
pub(super) enum Bars<T> {
    Dense(Field<T>),
    Blocks(BlockField<T>),
}

impl<T: Real> Bars<T> {
    pub(super) fn cells(&self) -> Cells<'_, T> {
        match self {
            Self::Dense(field) => field.into(),
            Self::Blocks(field) => field.into(),
        }
    }

    pub(super) fn cells_mut(&mut self) -> CellsMut<'_, T> {
        match self {
            Self::Dense(field) => {
                let (grid, values) = field.split_mut();
                CellsMut::Dense(grid, values)
            }
            Self::Blocks(field) => CellsMut::Blocks(field),
        }
    }
}

impl<T: Real> Sparse<T> {
    /// Zeros near the samples.
    fn new(points: &[[T; 3]], grid: Grid<T>, count: usize, closed: bool) -> Result<Self, Error> {
        let blocks = splat::blocks_near(points, &grid, REACH);
        check_blocks(&grid, count, &blocks)?;
        Ok(Self::with_blocks(grid, blocks, count, closed))
    }

    fn with_blocks(grid: Grid<T>, blocks: Blocks, count: usize, closed: bool) -> Self {
        let blocks = Arc::new(blocks);
        Self {
            count,
            closed,
            octaves: Octaves::new(blocks.clone(), count),
            chi: BlockField::zeros(grid, blocks),
        }
    }

    /// Zeros in its blocks.
    pub(super) fn zeros(&self) -> BlockField<T> {
        BlockField::zeros(self.chi.grid, self.chi.blocks.clone())
    }

    pub(super) fn grid(&self) -> &Grid<T> {
        &self.chi.grid
    }

    /// Number of halvings from the coarsest cells to those of the surface.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Whether the walls are closed.
    pub(super) fn is_closed(&self) -> bool {
        self.closed
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.chi.values[..]) + self.chi.blocks.bytes()
    }

    /// The pullback of the solve, which is symmetric.
    pub(super) fn solve(
        &self,
        values: &mut Vec<T>,
        smoothing: f64,
    ) -> Result<Vec<T>, poisson::Error> {
        let shape = self.chi.grid.shape();
        let mut pyramid = Pyramid::new(shape, self.count, self.closed, smoothing);
        pyramid.solve(&self.octaves, values)?;
        Ok(pyramid.into_coarsest())
    }

    /// The grid of the coarsest cells.
    fn coarse_grid(&self) -> Result<Grid<T>, Error> {
        let cells = 1usize << self.count;
        let grid = self.grid();
        let spacing = grid.spacing() * T::of_usize(cells);
        Ok(Grid::new(
            grid.lower(),
            spacing,
            grid.shape().map(|n| n / cells),
        )?)
    }

    /// More blocks: those at `open` ends of the surface `χ = level`, and those where the `coarse` indicator, right where
    /// samples are far, passes the level.
    fn grow(&mut self, open: &[[usize; 3]], coarse: &Field<T>, level: T) {
        let mut marks = Marks::new(self.grid().shape());
        marks.add(&self.chi.blocks);
        marks.add_blocks(open);
        let size = 1isize << self.count;
        let shape = coarse.grid().shape();
        let inside = |cell: [usize; 3]| coarse.at(cell) < level;
        for index in 0..coarse.grid().cells() {
            let cell = coarse.grid().cell(index);
            let crossed = (0..3).any(|a| {
                let mut next = cell;
                next[a] += 1;
                next[a] < shape[a] && inside(next) != inside(cell)
            });
            if crossed {
                let low = cell.map(|c| (c as isize - 1) * size);
                marks.mark(low, low.map(|c| c + 4 * size - 1));
            }
        }
        *self = Self::with_blocks(self.chi.grid, marks.build(), self.count, self.closed);
    }
}

impl<T: Real> Reconstruction<T> {
    /// Whether χ is 0 at the walls of the grid.
    pub(super) fn has_closed_walls(&self) -> bool {
        let sparse = self.sparse.as_ref();
        sparse.map_or(self.poisson.is_closed(), Sparse::is_closed)
    }

    /// The indicator on the grid of the surface.
    pub(super) fn chi(&self) -> Cells<'_, T> {
        match &self.sparse {
            Some(sparse) => (&sparse.chi).into(),
            None => (&self.indicator).into(),
        }
    }
}

impl<T: Real> Reconstructor<T> {
    /// Splats into blocks near the samples of `grid`.
    pub(super) fn splat_in_blocks(
        &mut self,
        grid: Grid<T>,
        count: usize,
        closed: bool,
    ) -> Result<(), Error> {
        let points = self.result.splat_samples().points;
        self.result.sparse = Some(Sparse::new(points, grid, count, closed)?);
        self.fill_blocks()
    }

    fn fill_blocks(&mut self) -> Result<(), Error> {
        let Reconstruction {
            options,
            points,
            orientation,
            areas,
            sparse,
            residuals,
            ..
        } = &mut self.result;
        let Some(sparse) = sparse else { return Ok(()) };
        let samples = (residuals.thickened).samples(points, &orientation.normals, areas);
        let (scratch, residual) = (&mut self.scratch.splat, &mut residuals.splat);
        splat::forward_in_blocks(samples, options.splat, scratch, residual, &mut sparse.chi)?;
        Ok(())
    }

    /// The indicator and its level, in blocks that contain the surface.
    pub(super) fn solve_in_blocks(&mut self, smoothing: f64) -> Result<(), Error> {
        for round in 0..=ROUNDS {
            let Some(sparse) = &mut self.result.sparse else {
                return Ok(());
            };
            let mut values = std::mem::take(&mut sparse.chi.values);
            let coarse = sparse.solve(&mut values, smoothing)?;
            sparse.chi.values = values;
            let coarse = Field::new(sparse.coarse_grid()?, coarse);
            self.level()?;
            let level = self.result.iso_value;
            let Some(sparse) = &mut self.result.sparse else {
                return Ok(());
            };
            self.result.report.surface_cells = sparse.chi.blocks.nodes();
            let open = isosurface::blocks::open_ends(&sparse.chi, level);
            if let Ok(coarse) = coarse {
                if round < ROUNDS && !open.is_empty() {
                    sparse.grow(&open, &coarse, level);
                    check_blocks(sparse.grid(), sparse.count, &sparse.chi.blocks)?;
                }
                self.result.indicator = coarse;
            }
            if open.is_empty() || round == ROUNDS {
                break;
            }
            self.fill_blocks()?;
        }
        Ok(())
    }
}
