//! Side of the surface at the cell centers of a grid.

use crate::data::cells::Cells;
use crate::distance::pseudonormals::Pseudonormals;
use crate::distance::triangle::closest_point;
use crate::distance::{NO_TRIANGLE, corners_agree};
use crate::trilinear::Cube;
use crate::vector::{dot, to_f64};
use crate::{Grid, Mesh, Real};

/// Inside and outside, from the indicator `χ` whose surface `χ = c` the mesh is.
pub(super) struct Sides<'a, T> {
    chi: Cells<'a, T>,
    c: T,
    mesh: &'a Mesh<T>,
    /// The grid of φ, unless `χ` has a value at each of its cells.
    between: Option<Grid<T>>,
    /// Pseudonormals of the mesh, where they are needed.
    pseudonormals: Pseudonormals,
}

impl<'a, T: Real> Sides<'a, T> {
    /// Sides at the cells of `grid`; `pseudonormals` are those of any mesh, whose memory is used again.
    pub(super) fn new(
        mesh: &'a Mesh<T>,
        chi: Cells<'a, T>,
        c: T,
        grid: &Grid<T>,
        mut pseudonormals: Pseudonormals,
    ) -> Self {
        let is_between = chi.grid() != grid || !chi.is_whole();
        if is_between {
            pseudonormals.rebuild(mesh);
        }
        Self {
            chi,
            c,
            mesh,
            between: is_between.then_some(*grid),
            pseudonormals,
        }
    }

    /// The pseudonormals, for the next call.
    pub(super) fn into_pseudonormals(self) -> Pseudonormals {
        self.pseudonormals
    }

    /// Whether the center of the cell at `index` in memory, whose closest face is given, is inside: `χ < c` where `χ` has
    /// a value there. Between values of `χ` all eight around the center decide where they agree, since the surface does
    /// not pass between them; elsewhere the pseudonormal of the closest feature decides, or beyond the band `χ`
    /// interpolated.
    #[inline(always)]
    pub(super) fn is_inside(&self, index: usize, closest: u32) -> bool {
        match &self.between {
            None => self.chi.values()[index] < self.c,
            Some(grid) => {
                let center = grid.center_f64(grid.cell(index));
                corners_agree(self.chi, self.c, center)
                    .unwrap_or_else(|| self.is_behind(center, closest))
            }
        }
    }

    fn is_behind(&self, center: [f64; 3], closest: u32) -> bool {
        if closest == NO_TRIANGLE {
            let grid = self.chi.grid();
            let cube = Cube::new(grid, grid.to_index(center.map(T::of)));
            return cube.value(self.chi.values()) < self.c;
        }
        let found = closest_point(center, self.mesh.corners(closest as usize).map(to_f64));
        let normal = self.pseudonormals.of(self.mesh, closest, found.feature);
        dot(normal, found.offset) < 0.0
    }
}
