//! Cotangents of the vertices to cotangents of the indicator, the level and the grid.

use crate::data::cells::{Cells, CellsMut};
use crate::data::{Field, Grid, GridCotangent, LatticeEdge, Mesh};
use crate::element::crossing::{bounded, crossing};
use crate::{Real, parallel, vector};

/// Planes across x that one task owns.
const SLAB: usize = 8;

/// Share of the range of `χ` that the difference along an edge counts as, where it is less: a vertex moves
/// by no more than a million cells while the whole of `χ` passes.
pub const SMALLEST_DIFFERENCE: f64 = 1e-6;

/// Cotangents of the level and the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LevelCotangent {
    /// Cotangent of the level `c`.
    pub level: f64,
    /// Cotangent of the grid.
    pub grid: GridCotangent<f64>,
    /// Vertices on edges along which `χ` hardly changes: their derivative was bounded.
    pub guarded: usize,
}

/// Pulls the cotangents `vertices_bar` `(V, 3)` of the vertices back: adds that of the indicator to `chi_bar`
/// `(nx, ny, nz)`, and returns those of the level and the grid. `chi`, `level` and `mesh` are those
/// of [`forward`](super::forward).
pub fn pullback<T: Real>(
    chi: &Field<T>,
    level: T,
    mesh: &Mesh<T>,
    vertices_bar: &[[T; 3]],
    chi_bar: &mut [T],
) -> LevelCotangent {
    let chi_bar = CellsMut::Dense(chi.grid(), chi_bar);
    pullback_on(chi.into(), level, mesh, vertices_bar, chi_bar)
}

/// Like [`pullback`], for fields that are dense or in blocks.
pub(crate) fn pullback_on<T: Real>(
    chi: Cells<'_, T>,
    level: T,
    mesh: &Mesh<T>,
    vertices_bar: &[[T; 3]],
    chi_bar: CellsMut<'_, T>,
) -> LevelCotangent {
    let vertices = Vertices {
        chi,
        level,
        edges: mesh.edges(),
        bars: vertices_bar,
        smallest: T::of(SMALLEST_DIFFERENCE) * range(chi.values()),
    };
    match chi_bar {
        CellsMut::Dense(grid, chi_bar) => {
            let plane = grid.strides()[0];
            parallel::each(chi_bar.chunks_mut(SLAB * plane), |task, slab| {
                vertices.add(task * SLAB * plane, plane, slab);
            });
        }
        CellsMut::Blocks(chi_bar) => {
            chi_bar.add_at_ends(mesh.edges(), |vertex| vertices.parts(vertex));
        }
    }
    LevelCotangent::sum(chi.grid(), mesh, vertices_bar, |vertex| {
        let EdgeVertex { pull, guarded, .. } = vertices.edge_vertex(vertex);
        (pull.f64(), guarded)
    })
}

impl LevelCotangent {
    /// The sum over the vertices of `mesh`, with their cotangents `vertices_bar` `(V, 3)`; `pull(vertex)` has the part of the
    /// level, and whether it was bounded.
    pub(super) fn sum<T: Real>(
        grid: &Grid<T>,
        mesh: &Mesh<T>,
        vertices_bar: &[[T; 3]],
        pull: impl Fn(usize) -> (f64, bool) + Sync,
    ) -> Self {
        let [level, x, y, z, spacing, guarded] =
            parallel::sum_array(mesh.vertices().len(), |vertex| {
                let (pull, guarded) = pull(vertex);
                let place = vector::to_f64(grid.to_index(mesh.vertices()[vertex]));
                let mut part = GridCotangent::default();
                part.add_place(place, vector::to_f64(vertices_bar[vertex]));
                let [x, y, z] = part.lower;
                [pull, x, y, z, part.spacing, f64::from(u8::from(guarded))]
            });
        Self {
            level,
            grid: GridCotangent {
                lower: [x, y, z],
                spacing,
            },
            guarded: guarded as usize,
        }
    }
}

/// Greatest value less least value.
pub(super) fn range<T: Real>(values: &[T]) -> T {
    let [low, high] = parallel::range(values);
    high - low
}

struct Vertices<'a, T> {
    chi: Cells<'a, T>,
    level: T,
    edges: &'a [LatticeEdge],
    bars: &'a [[T; 3]],
    /// Lower bound of differences along an edge.
    smallest: T,
}

/// A vertex on its lattice edge.
struct EdgeVertex<T> {
    /// The two cells, by their places in a dense field.
    cells: [usize; 2],
    eta: T,
    /// `s/(χ_q − χ_p)`, in which `s = ȳ·(q − p)`.
    pull: T,
    guarded: bool,
}

impl<T: Real> Vertices<'_, T> {
    #[inline(always)]
    fn edge_vertex(&self, vertex: usize) -> EdgeVertex<T> {
        let grid = self.chi.grid();
        let (p, axis) = (self.edges[vertex].cell(), self.edges[vertex].axis());
        let q = p + grid.strides()[axis];
        let [low, high] = self.chi.ends(self.edges[vertex]);
        let difference = high - low;
        let guarded = difference.abs() < self.smallest;
        let s = self.bars[vertex][axis] * grid.spacing();
        EdgeVertex {
            cells: [p, q],
            eta: crossing(low, high, self.level),
            pull: s / bounded(difference, self.smallest),
            guarded: guarded && s != T::zero(),
        }
    }

    /// Cotangents of the indicator at both cells of a vertex.
    #[inline(always)]
    fn parts(&self, vertex: usize) -> [T; 2] {
        let EdgeVertex { eta, pull, .. } = self.edge_vertex(vertex);
        [pull * (eta - T::one()), -pull * eta]
    }

    /// Adds to the cells of `slab`, the first of which is cell `first`. Vertices are stored in the order of
    /// their edges, and an edge reaches at most one plane ahead.
    fn add(&self, first: usize, plane: usize, slab: &mut [T]) {
        let near = |cell: usize| self.edges.partition_point(|edge| edge.cell() < cell);
        for vertex in near(first.saturating_sub(plane))..near(first + slab.len()) {
            let cells = self.edge_vertex(vertex).cells;
            for (cell, part) in cells.into_iter().zip(self.parts(vertex)) {
                if let Some(value) = cell.checked_sub(first).and_then(|at| slab.get_mut(at)) {
                    *value += part;
                }
            }
        }
    }
}
