//! Cotangents of φ at the cells to cotangents of the vertices and the grid.
//!
//! The cells are sorted by their closest face, and each face gathers from its cells; then each vertex adds up
//! its faces, in their order.

use super::NO_TRIANGLE;
use crate::data::GridCotangent;
use crate::distance::triangle::Frame;
use crate::gather::Buckets;
use crate::vector::{add, normalized, scale, to_f64};
use crate::{Field, Mesh, Real, parallel, vector};

/// Faces in one task.
const TASK: usize = 512;

/// Scratch buffers: at most an index per cell, and the cotangents of the corners of each face.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    /// Cells whose cotangent is not zero, by closest face.
    cells: Buckets,
    corners: Vec<[[T; 3]; 3]>,
}

/// Pulls the cotangent `phi_bar` `(nx, ny, nz)` of the distances back: adds that of the vertices to `vertices_bar`
/// `(V, 3)`, and returns that of the grid through its cell centers. `mesh`, `phi` and `closest` are those of
/// [`forward`](super::forward). Cells outside the band contribute nothing: `φ` is constant there.
pub fn pullback<T: Real>(
    mesh: &Mesh<T>,
    phi: &Field<T>,
    closest: &[u32],
    phi_bar: &[T],
    scratch: &mut PullbackScratch<T>,
    vertices_bar: &mut [[T; 3]],
) -> GridCotangent<f64> {
    let faces = mesh.faces();
    let PullbackScratch { cells, corners } = scratch;
    cells.fill(faces.len(), closest.len(), |cell| {
        let face = closest[cell];
        (face != NO_TRIANGLE && phi_bar[cell] != T::zero()).then_some(face)
    });
    corners.resize(faces.len(), [[T::zero(); 3]; 3]);
    let cells = &*cells;
    let parts = parallel::map_each(corners.chunks_mut(TASK), |task, corners| {
        let mut grid_bar = GridCotangent::default();
        for (face, corners) in (task * TASK..).zip(corners) {
            let bars = pull_face(mesh, face, phi, phi_bar, cells.of(face), &mut grid_bar);
            *corners = bars.map(vector::of_f64);
        }
        grid_bar
    });
    for (face, corners) in faces.iter().zip(&*corners) {
        for (&vertex, &bar) in face.iter().zip(corners) {
            let sum = &mut vertices_bar[vertex as usize];
            *sum = add(*sum, bar);
        }
    }
    parts
        .into_iter()
        .fold(GridCotangent::default(), |sum, part| GridCotangent {
            lower: add(sum.lower, part.lower),
            spacing: sum.spacing + part.spacing,
        })
}

/// `−Σ β_k φ̄ ∇φ` for the corners of a face, over its cells; adds `Σ φ̄ ∇φ` at the cells to `grid_bar`.
fn pull_face<T: Real>(
    mesh: &Mesh<T>,
    face: usize,
    phi: &Field<T>,
    phi_bar: &[T],
    cells: &[u32],
    grid_bar: &mut GridCotangent<f64>,
) -> [[f64; 3]; 3] {
    let mut bars = [[0.0; 3]; 3];
    if cells.is_empty() {
        return bars;
    }
    let (grid, values) = (phi.grid(), phi.values());
    let corners = mesh.corners(face).map(to_f64);
    let frame = Frame::new(corners);
    for &cell in cells {
        let cell = cell as usize;
        let place = grid.cell(cell);
        let found = frame.closest(grid.center_f64(place), corners);
        let sign = if values[cell] < T::zero() { -1.0 } else { 1.0 };
        let gradient = match normalized(found.offset) {
            Some(away) => scale(away, sign),
            None => frame.unit_normal().unwrap_or([0.0; 3]),
        };
        let pull = scale(gradient, phi_bar[cell].f64());
        for (bar, weight) in bars.iter_mut().zip(found.barycentric) {
            *bar = add(*bar, scale(pull, -weight));
        }
        grid_bar.add_place(place.map(|i| i as f64 + 0.5), pull);
    }
    bars
}
