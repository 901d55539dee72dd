//! Distance at every cell center.
//!
//! The grid is cut into blocks of a fixed size, each solved on its own and in one order: so the result has the
//! same bits for any number of threads.

mod block;
mod cull;
mod facet;
mod kernels;
mod of_mesh;
mod packet;
mod pullback;
mod sides;
mod site_list;
mod sites;
mod spread;
mod task;
mod workspace;

use pulp::Arch;

use super::Error;
use super::bvh::{Bvh, Triangles};
use super::pseudonormals::Pseudonormals;
use crate::data::cells::Cells;
use crate::parallel::{self, Pool};
use crate::{Field, Grid, Mesh, Real};
use block::{BLOCK, Block};
pub(super) use of_mesh::fill as fill_from_mesh;
pub use of_mesh::{Sign, forward_of_mesh};
pub use pullback::{PullbackScratch, pullback};
use sides::Sides;
use sites::Sites;
use task::{NEAR, Output, Task};
use workspace::Workspace;

/// Region in which the distance is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Band {
    /// At every cell.
    #[default]
    Full,
    /// Up to this distance from the surface, in the cloud's unit. Elsewhere `φ` is plus or minus this distance, with
    /// the correct sign, and there is no closest triangle ([`NO_TRIANGLE`]).
    Within(f64),
}

impl Band {
    /// Its width; infinite for the full field.
    fn width(self) -> Result<f64, Error> {
        match self {
            Self::Full => Ok(f64::INFINITY),
            Self::Within(width) if width > 0.0 && width.is_finite() => Ok(width),
            Self::Within(width) => Err(Error::Band { width }),
        }
    }
}

/// Entry of `closest` beyond the band.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Blocks per wave, after which the results are written to the field: enough for any number of threads, few enough
/// that their memory stays small compared with the field.
const BLOCKS_PER_WAVE: usize = 512;

/// Scratch buffers reused between calls.
#[derive(Clone, Debug, Default)]
pub struct Scratch<T> {
    /// Tree of the last mesh.
    pub(super) bvh: Bvh,
    sites: Sites,
    pseudonormals: Pseudonormals,
    distance: Vec<T>,
    closest: Vec<u32>,
    workspaces: Pool<Workspace>,
}

impl<T: Real> Scratch<T> {
    /// Builds the tree of a mesh, and what culling needs on a grid.
    fn prepare(&mut self, mesh: &Mesh<T>, grid: &Grid<T>) -> Result<(), Error> {
        self.bvh.rebuild(mesh)?;
        let magnitude = magnitude(grid).max(self.bvh.magnitude());
        let spacing = grid.spacing().f64();
        self.sites.rebuild(mesh, &self.bvh, spacing, magnitude);
        Ok(())
    }
}

impl<T: Real> Scratch<T> {
    /// Frees all that was for one grid.
    pub(crate) fn free_all_but_tree(&mut self) {
        *self = Self {
            bvh: std::mem::take(&mut self.bvh),
            ..Self::default()
        };
    }

    /// Capacity of all buffers, in entries.
    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.bvh.capacity()
            + self.sites.capacity()
            + self.distance.capacity()
            + self.closest.capacity()
    }
}

/// Writes the signed distance from every cell center to `mesh` into `phi`, `(nx, ny, nz)`, in the user's unit,
/// and the closest face of each cell into `closest`, the residual.
///
/// The distance is exact: computed in double precision from [`Grid::center_f64`] to the vertices as they stand,
/// and rounded once. The sign is that of `χ − c` at the cell: negative inside, and positive at the level
/// itself. Inside and at distance 0 it is the smallest negative number, so that the sign holds there too.
/// Where `chi` is on another grid than `phi`, the sign between its values is that of the mesh.
///
/// # Errors
/// [`Error::Empty`], [`Error::Range`], and [`Error::Band`].
pub fn forward<T: Real>(
    mesh: &Mesh<T>,
    chi: &Field<T>,
    c: T,
    band: Band,
    scratch: &mut Scratch<T>,
    phi: &mut Field<T>,
    closest: &mut Vec<u32>,
) -> Result<(), Error> {
    forward_on(mesh, chi.into(), c, band, scratch, phi, Some(closest))
}

/// Like [`forward`], for an indicator that is dense or in blocks, and with or without closest faces.
pub(crate) fn forward_on<T: Real>(
    mesh: &Mesh<T>,
    chi: Cells<'_, T>,
    c: T,
    band: Band,
    scratch: &mut Scratch<T>,
    phi: &mut Field<T>,
    closest: Option<&mut Vec<u32>>,
) -> Result<(), Error> {
    let grid = *phi.grid();
    let width = band.width()?;
    // Beyond the blocks of χ sides come from cells of the band, where this has no gaps.
    let h = grid.spacing().f64();
    let fills = !chi.is_whole() && width.is_finite() && width > spread::MARGIN * h;
    let reach = match chi.is_whole() || fills {
        true => width,
        false => f64::INFINITY,
    };
    scratch.prepare(mesh, &grid)?;
    let pseudonormals = std::mem::take(&mut scratch.pseudonormals);
    let sides = Sides::new(mesh, chi, c, &grid, pseudonormals);
    for_each_wave(
        mesh,
        reach,
        scratch,
        phi,
        closest,
        |wave, phi, mut closest| {
            let inside = |i: usize, face: u32| sides.is_inside(wave.first + i, face);
            let faces = closest.as_deref_mut();
            match chi.is_whole() {
                true => wave.write(spread::each(inside), phi, faces),
                false => wave.write(spread::along(inside, h), phi, faces),
            }
            if reach > width {
                clamp(T::of(width), phi, closest);
            }
        },
    );
    scratch.pseudonormals = sides.into_pseudonormals();
    if fills {
        spread::fill(grid.shape(), T::of(width), phi.values_mut());
    }
    Ok(())
}

/// Distances of a wave of blocks, before they have signs.
struct Wave<'a, T> {
    grid: &'a Grid<T>,
    scratch: &'a Scratch<T>,
    /// Place in the field of its first cell.
    first: usize,
}

/// Computes unsigned distances up to `reach` wave by wave; `write(wave, φ, closest)` writes each to its part of the field.
fn for_each_wave<T: Real>(
    mesh: &Mesh<T>,
    reach: f64,
    scratch: &mut Scratch<T>,
    phi: &mut Field<T>,
    mut closest: Option<&mut Vec<u32>>,
    write: impl Fn(&Wave<'_, T>, &mut [T], Option<&mut [u32]>),
) {
    let grid = *phi.grid();
    if let Some(closest) = &mut closest {
        closest.resize(grid.cells(), NO_TRIANGLE);
    }
    let plane = grid.strides()[0];
    let planes_per_wave = wave_planes(grid.shape());
    let waves = phi.values_mut().chunks_mut(planes_per_wave * plane);
    for (wave, phi) in waves.enumerate() {
        let planes = wave * planes_per_wave..wave * planes_per_wave + phi.len() / plane;
        let first = planes.start * plane;
        solve_wave(&grid, mesh, planes, reach, scratch);
        let wave = Wave {
            grid: &grid,
            scratch,
            first,
        };
        let closest = closest.as_mut();
        write(
            &wave,
            phi,
            closest.map(|closest| &mut closest[first..first + phi.len()]),
        );
    }
}

/// Limits φ to a band; cells beyond it have no closest face.
fn clamp<T: Real>(width: T, phi: &mut [T], mut closest: Option<&mut [u32]>) {
    for (i, phi) in phi.iter_mut().enumerate() {
        if phi.abs() > width {
            *phi = phi.signum() * width;
            if let Some(closest) = &mut closest {
                closest[i] = NO_TRIANGLE;
            }
        }
    }
}

/// Planes of cells in a wave: whole blocks.
fn wave_planes(shape: [usize; 3]) -> usize {
    let per_layer = shape[1].div_ceil(BLOCK) * shape[2].div_ceil(BLOCK);
    BLOCK * BLOCKS_PER_WAVE.div_ceil(per_layer)
}

/// Distances of all blocks between two planes, block after block, into the scratch memory.
fn solve_wave<T: Real>(
    grid: &Grid<T>,
    mesh: &Mesh<T>,
    planes: std::ops::Range<usize>,
    width: f64,
    scratch: &mut Scratch<T>,
) {
    const CELLS: usize = BLOCK * BLOCK * BLOCK;
    let shape = grid.shape();
    let across = [shape[1].div_ceil(BLOCK), shape[2].div_ceil(BLOCK)];
    let blocks = planes.len().div_ceil(BLOCK) * across[0] * across[1];
    scratch.distance.resize(blocks * CELLS, T::zero());
    scratch.closest.resize(blocks * CELLS, NO_TRIANGLE);
    let triangles = Triangles::new(mesh, &scratch.bvh);
    let sites = &scratch.sites;
    let task = Task {
        grid,
        triangles: &triangles,
        sites,
        width,
        near: (NEAR * sites.longest_edge()).powi(2),
        magnitude: magnitude(grid).max(scratch.bvh.magnitude()),
        arch: Arch::new(),
    };
    let results = scratch.distance.chunks_mut(CELLS);
    let results = results.zip(scratch.closest.chunks_mut(CELLS));
    parallel::each(results, |index, (distance, closest)| {
        let (layer, rest) = (
            index / (across[0] * across[1]),
            index % (across[0] * across[1]),
        );
        let start = [
            planes.start + layer * BLOCK,
            rest / across[1] * BLOCK,
            rest % across[1] * BLOCK,
        ];
        let block = Block::new(start, BLOCK, [planes.end, shape[1], shape[2]]);
        let mut output = Output { distance, closest };
        scratch.workspaces.with(Workspace::default, |workspace| {
            task.solve(&block, workspace, &mut output)
        });
    });
}

/// The largest absolute coordinate of a grid.
fn magnitude<T: Real>(grid: &Grid<T>) -> f64 {
    let corners = grid.lower().into_iter().chain(grid.upper());
    corners.fold(0.0, |m, x| m.max(x.f64().abs()))
}

impl<T: Real> Wave<'_, T> {
    /// Writes the results in the order of the field; `sign(i, φ, closest)` gives the distances of a row that begins
    /// at place `i` of the wave their signs.
    fn write(
        &self,
        sign: impl Fn(usize, &mut [T], &[u32]) + Sync,
        phi: &mut [T],
        closest: Option<&mut [u32]>,
    ) {
        let scratch = self.scratch;
        let [_, ny, nz] = self.grid.shape();
        let across = [ny.div_ceil(BLOCK), nz.div_ceil(BLOCK)];
        let closest: Vec<_> = match closest {
            Some(closest) => closest.chunks_mut(nz).map(Some).collect(),
            None => phi.chunks(nz).map(|_| None).collect(),
        };
        let rows = phi.chunks_mut(nz).zip(closest);
        parallel::map_each_with(Vec::new, rows, |own, row, (phi, closest)| {
            let closest = closest.unwrap_or_else(|| {
                own.resize(nz, NO_TRIANGLE);
                own
            });
            let (i, j) = (row / ny, row % ny);
            let first_block = (i / BLOCK * across[0] + j / BLOCK) * across[1];
            let runs = phi.chunks_mut(BLOCK).zip(closest.chunks_mut(BLOCK));
            for (run, (phi, closest)) in runs.enumerate() {
                let from = (((first_block + run) * BLOCK + i % BLOCK) * BLOCK + j % BLOCK) * BLOCK;
                phi.copy_from_slice(&scratch.distance[from..from + phi.len()]);
                closest.copy_from_slice(&scratch.closest[from..from + closest.len()]);
            }
            sign(row * nz, phi, closest);
        });
    }
}
