//! Cotangents of the vertices to cotangents of the indicator, the level and the grid.

use super::edge::{Edge, Pull};
use crate::gather::Buckets;
use crate::isosurface::pullback::{LevelCotangent, SMALLEST_DIFFERENCE, range};
use crate::{Field, Grid, Mesh, Real, parallel};

/// Planes across x that one task owns.
const SLAB: usize = 8;

/// Adds the cotangent of the indicator `chi` to `chi_bar` `(nx, ny, nz)`, and returns those of the level and the grid of
/// `chi`, from the cotangents `vertices_bar` `(V, 3)` of the vertices of `mesh`, which lie on the lattice of `refined`.
pub(crate) fn pullback<T: Real>(
    chi: &Field<T>,
    level: T,
    refined: &Grid<T>,
    mesh: &Mesh<T>,
    vertices_bar: &[[T; 3]],
    chi_bar: &mut [T],
) -> LevelCotangent {
    let smallest = SMALLEST_DIFFERENCE * range(chi.values()).f64();
    let vertices = Vertices {
        chi,
        level: level.f64(),
        refined,
        mesh,
        bars: vertices_bar,
        smallest,
    };
    let pulls = parallel::map(vertices_bar.len(), |vertex| vertices.pull(vertex));
    let plane = chi.grid().strides()[0];
    let slabs = chi.grid().shape()[0].div_ceil(SLAB);
    let mut near = Buckets::default();
    near.fill(slabs, vertices_bar.len(), |vertex| {
        let [low, high] = vertices.planes(vertex).map(|plane| (plane / SLAB) as u32);
        low..=high
    });
    parallel::each(chi_bar.chunks_mut(SLAB * plane), |slab, out| {
        let first = slab * SLAB * plane;
        let mut add = |cell: usize, part: f64| {
            if let Some(value) = cell.checked_sub(first).and_then(|at| out.get_mut(at)) {
                *value += T::of(part);
            }
        };
        for &vertex in near.of(slab) {
            let vertex = vertex as usize;
            let edge = vertices.edge(vertex);
            for (fraction, pull) in pulls[vertex].parts.into_iter().filter(|part| part.1 != 0.0) {
                let at = edge.at(fraction);
                edge.for_each_cell(&at, |cell, weight| add(cell, pull * weight));
            }
        }
    });
    let of_level = |vertex: usize| {
        let [(_, first), (_, second)] = pulls[vertex].parts;
        (-first - second, pulls[vertex].is_guarded)
    };
    LevelCotangent::sum(chi.grid(), mesh, vertices_bar, of_level)
}

struct Vertices<'a, T> {
    chi: &'a Field<T>,
    level: f64,
    refined: &'a Grid<T>,
    mesh: &'a Mesh<T>,
    bars: &'a [[T; 3]],
    /// Lower bound of slopes along an edge.
    smallest: f64,
}

impl<T: Real> Vertices<'_, T> {
    /// The first and the last plane across x with a cell that has a weight at a vertex.
    fn planes(&self, vertex: usize) -> [usize; 2] {
        let half = self.refined.cell(self.mesh.edges()[vertex].cell())[0];
        let last = self.chi.grid().shape()[0] - 1;
        // One before that of the cell in which the edge starts, and two after it.
        [(half / 2).saturating_sub(1), (half / 2 + 2).min(last)]
    }

    /// The edge of a vertex.
    #[inline(always)]
    fn edge(&self, vertex: usize) -> Edge {
        Edge::new(self.chi.grid(), self.refined, self.mesh.edges()[vertex])
    }

    /// Cotangents of the spline on the edge of a vertex.
    #[inline(always)]
    fn pull(&self, vertex: usize) -> Pull {
        let edge = self.edge(vertex);
        let axis = self.mesh.edges()[vertex].axis();
        let bar = (self.bars[vertex][axis] * self.chi.grid().spacing()).f64();
        let line = edge.line(self.chi);
        let crossing = edge.crossing(&line, self.level);
        edge.pull(&line, &crossing, bar, self.smallest)
    }
}
