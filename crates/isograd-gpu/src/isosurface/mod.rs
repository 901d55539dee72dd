//! The isosurface stage: marching cubes on the lattice of cell centers.
//!
//! # Map
//! That of [`isograd::isosurface`], with its table: the same vertices and faces in the same order.
//! [`forward`] packs the signs into bits, counts the vertices and the triangles of every 32 cells of a row, sums
//! the counts from the beginning, and writes each vertex and each triangle to its place. Work takes a fifth of
//! the memory of a field in `f32`, most of it for a while only. One thing is downloaded: four whole numbers, from
//! which the surface is known to exist and the sizes of its arrays.
//!
//! # Residual
//! The field, the level, the lattice edges, and the signs and counts by which a cell finds the vertices on its
//! edges: a quarter of a byte a cell.
//!
//! # Pullback
//! [`pullback`]: each cell collects what the vertices on its six edges mean for it; the level and the grid get
//! sums over all vertices, as a tree of fixed shape.

mod error;
mod faces;
mod forward;
pub mod iso_value;
pub mod local_level;
mod pullback;
mod signs;
mod sums;
mod total;
mod values;

use cubecl::prelude::Runtime;
use isograd::Grid;
use isograd::isosurface::{Loop, Report, loops_of};

use crate::{Buffer, Device};

pub use error::Error;
pub use forward::forward;
pub use pullback::{Cotangent, pullback};

/// Tables of the stage, uploaded once.
#[derive(Clone)]
pub struct Plan {
    /// For each of the 256 sign patterns, the triangles before it and then, [`LOOPS`] words on, the loops; the loops: a
    /// word with the place of the first triangle and, in a byte each, how many triangles a triangulation has and how many of
    /// these there are; last the triangles: three edges of the cube each, one a byte, from the lowest.
    table: Buffer<u32>,
}

/// Where the table counts loops, and where these are.
const LOOPS: usize = 257;

impl Plan {
    /// A plan for a device.
    pub fn new<R: Runtime>(device: &Device<R>) -> Result<Self, crate::Error> {
        let loops = (0..=255).map(loops_of);
        let count = |of: &Loop| of.triangulations().next().map_or(0, <[_]>::len) as u32;
        let mut counts = vec![0];
        let mut places = vec![2 * LOOPS as u32];
        for loops in loops.clone() {
            counts.push(counts[counts.len() - 1] + loops.iter().map(count).sum::<u32>());
            places.push(places[places.len() - 1] + loops.len() as u32);
        }
        let mut first = places[places.len() - 1];
        let mut packed = Vec::new();
        let mut triangles = Vec::new();
        for of in loops.flatten() {
            let all = of.triangulations().count() as u32;
            packed.push(first | count(of) << 16 | all << 24);
            first += all * count(of);
            let edges = of.triangulations().flatten();
            triangles.extend(edges.map(|&[a, b, c]| u32::from_le_bytes([a, b, c, 0])));
        }
        let table = [counts, places, packed, triangles].concat();
        Ok(Self {
            table: device.upload(&table)?,
        })
    }
}

/// A surface on the device.
#[derive(Clone)]
pub struct Surface<T> {
    /// `(V, 3)` vertices, in the user's unit.
    pub vertices: Buffer<T>,
    /// `(F, 3)` faces, counter-clockwise seen from the side where `χ ≥ c`.
    pub faces: Buffer<u32>,
    /// `(V,)` the lattice edge of each vertex, ascending: `3·cell + axis`, from the cell at that place in memory to
    /// the next one along the axis. [`isograd::LatticeEdge`] of the two.
    pub edges: Buffer<u32>,
    /// Whether it touches the walls of the grid.
    pub report: Report,
}

/// Residual of [`forward`] for [`pullback`].
#[derive(Clone)]
pub struct Residual<T> {
    grid: Grid<T>,
    chi: Buffer<T>,
    level: Buffer<T>,
    signs: signs::Bits,
    /// Per word of the signs, the number of vertices before it.
    before: Buffer<u32>,
    edges: Buffer<u32>,
}
