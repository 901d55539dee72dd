//! Exact signed distance of a body, in the cells where it is needed.

use isograd::{Field, Grid, Mesh, isosurface};
use isograd_shapes::Shape;
use rayon::prelude::*;

use crate::output::Outcome;

/// Cells along each side of a block.
const BLOCK: usize = 4;

/// Exact signed distance at every cell with `|φ| < band`, and its sign at all others.
///
/// A distance is 1-Lipschitz, so its value at the center of a block bounds it over the block. Only blocks that can reach
/// the band are evaluated cell by cell, which makes bodies affordable whose distance needs a search.
pub struct Exact {
    field: Field<f64>,
    near: Vec<usize>,
}

impl Exact {
    /// Distance to `shape`, for the cells within `band` cells of its surface.
    pub fn new(shape: &Shape, grid: Grid<f64>, band: f64) -> Outcome<Self> {
        let origin = [0.0; 3];
        if shape.distance(origin).is_none() {
            return Err(format!("{}: its exact distance is not known", shape.name()).into());
        }
        // Checked above: whether a distance is known depends on the shape, not on the point.
        let distance = |x: [f64; 3]| shape.distance(x).unwrap_or(f64::NAN);
        let reach = band * grid.spacing();
        let [_, ny, nz] = grid.shape();
        let mut field = Field::zeros(grid);
        field
            .values_mut()
            .par_chunks_mut(BLOCK * ny * nz)
            .enumerate()
            .for_each(|(slab, values)| fill(&grid, slab * BLOCK, values, reach, &distance));
        let near = (0..grid.cells())
            .filter(|&cell| field.values()[cell].abs() < reach)
            .collect();
        Ok(Self { field, near })
    }

    /// Indices of the cells in the band.
    pub fn near(&self) -> &[usize] {
        &self.near
    }

    /// Distance at a cell of the band.
    pub fn at(&self, cell: usize) -> f64 {
        self.field.values()[cell]
    }

    /// Marching cubes of the exact distance: the error that remains if φ is exact at every cell center.
    pub fn mesh(&self) -> Outcome<Mesh<f64>> {
        let mut mesh = Mesh::default();
        isosurface::forward(
            &self.field,
            0.0,
            &mut isosurface::Scratch::default(),
            &mut mesh,
        )?;
        Ok(mesh)
    }
}

/// Fills the planes of one slab, block by block.
fn fill(
    grid: &Grid<f64>,
    first: usize,
    values: &mut [f64],
    reach: f64,
    distance: &(impl Fn([f64; 3]) -> f64 + Sync),
) {
    let [_, ny, nz] = grid.shape();
    let planes = values.len() / (ny * nz);
    let half = 0.5 * BLOCK as f64;
    let radius = half * grid.spacing() * 3f64.sqrt();
    for j in (0..ny).step_by(BLOCK) {
        for k in (0..nz).step_by(BLOCK) {
            let center = grid.from_index([first, j, k].map(|o| o as f64 + half));
            let at_center = distance(center);
            // Outside the band, only the sign is used.
            let searched = at_center.abs() < reach + radius;
            for i in 0..planes {
                for j in j..(j + BLOCK).min(ny) {
                    for k in k..(k + BLOCK).min(nz) {
                        let cell = [first + i, j, k];
                        values[(i * ny + j) * nz + k] = if searched {
                            distance(grid.center(cell))
                        } else {
                            at_center
                        };
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skipped_blocks_hold_no_cell_of_the_band() {
        for name in ["torus", "nacelle"] {
            let shape = isograd_shapes::by_name(name).expect("a shape");
            let grid = Grid::new([-1.03, -1.1, -0.7], 0.071, [31, 30, 21]).expect("a grid");
            let exact = Exact::new(&shape, grid, 3.0).expect("a known distance");
            let reach = 3.0 * grid.spacing();
            let mut near = Vec::new();
            for cell in 0..grid.cells() {
                let truth = shape.distance(grid.center(grid.cell(cell))).expect("known");
                if truth.abs() < reach {
                    near.push(cell);
                    assert_eq!(exact.at(cell), truth, "{name}, cell {cell}");
                } else {
                    assert_eq!(exact.at(cell) < 0.0, truth < 0.0, "{name}, cell {cell}");
                }
            }
            assert_eq!(exact.near(), near, "{name}");
        }
    }

    #[test]
    fn a_shape_without_a_distance_is_an_error() {
        let shape = isograd_shapes::by_name("airliner").expect("a shape");
        let grid = Grid::new([0.0; 3], 0.1, [8; 3]).expect("a grid");
        assert!(Exact::new(&shape, grid, 3.0).is_err());
    }
}
