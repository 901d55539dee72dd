//! Distance at every cell center to a mesh that comes without an indicator.
//!
//! Signs are found block by block, from the winding number. Where that is a whole number it can change only at the surface:
//! then one point decides for all cells of a block, or of a part of it, between which the surface cannot pass.

use pulp::Arch;

use super::spread::{MARGIN, put};
use super::{Band, Scratch, for_each_wave};
use crate::distance::bvh::{LANES, Points};
use crate::distance::winding::{INSIDE, Sources, Winding, is_closed};
use crate::distance::{Distance, Error};
use crate::vector::{norm, sub};
use crate::{Field, Grid, Mesh, Real, parallel, simd};

/// How the sides of a mesh are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// The mesh is closed: faces run through each edge as often in one direction as in the other. A point that is enclosed,
    /// however often and in whichever direction, is inside.
    Closed,
    /// The mesh is not closed, or neighboring faces are wound against each other: a point is inside where the absolute value of
    /// the generalized winding number is at least ½. In a hole φ changes its sign without passing 0.
    WindingNumber,
}

impl Sign {
    /// `closed` or `winding number`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::WindingNumber => "winding number",
        }
    }
}

/// Writes the signed distance from every cell center to `mesh` into `phi`, `(nx, ny, nz)`, in the user's unit, and the
/// closest face of each cell into `closest`, the residual of [`pullback`](super::pullback). Returns how signs were found.
///
/// Like [`forward`](super::forward), for a mesh that comes without an indicator: the sign is that of its winding number, which
/// needs neither shared vertices nor outward faces. Pieces may intersect, and cavities count as outside if their faces point
/// into them.
///
/// # Errors
/// [`Error::Empty`], [`Error::Range`], and [`Error::Band`].
///
/// ```
/// use isograd::distance::lattice::{Band, Scratch, Sign, forward_of_mesh};
/// use isograd::{Field, Grid, Mesh};
///
/// let vertices = vec![[0.0_f64; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let mesh = Mesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
/// let mut phi = Field::zeros(Grid::new([-0.1; 3], 0.1, [12; 3])?);
/// let mut closest = Vec::new();
/// let sign = forward_of_mesh(&mesh, Band::Full, &mut Scratch::default(), &mut phi, &mut closest)?;
/// assert_eq!(sign, Sign::Closed);
/// assert!((phi.at([1, 2, 3]) + 0.05).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn forward_of_mesh<T: Distance>(
    mesh: &Mesh<T>,
    band: Band,
    scratch: &mut Scratch<T>,
    phi: &mut Field<T>,
    closest: &mut Vec<u32>,
) -> Result<Sign, Error> {
    T::of_mesh(mesh, band, scratch, phi, closest)
}

/// [`forward_of_mesh`], compiled where it is called: see [`concrete`](crate::distance::concrete).
pub(in crate::distance) fn fill<T: Real>(
    mesh: &Mesh<T>,
    band: Band,
    scratch: &mut Scratch<T>,
    phi: &mut Field<T>,
    closest: &mut Vec<u32>,
) -> Result<Sign, Error> {
    let width = band.width()?;
    let grid = *phi.grid();
    scratch.prepare(mesh, &grid)?;
    let faces = Some(closest);
    for_each_wave(mesh, width, scratch, phi, faces, |wave, phi, closest| {
        wave.write(|_, _, _| (), phi, closest);
    });
    let sign = match is_closed(mesh) {
        true => Sign::Closed,
        false => Sign::WindingNumber,
    };
    let sides = Sides {
        winding: Winding::new(mesh, &scratch.bvh),
        grid,
        distance: phi.values(),
        is_closed: sign == Sign::Closed,
        arch: Arch::new(),
    };
    let masks = sides.all();
    write_signs(&grid, &masks, phi.values_mut());
    Ok(sign)
}

/// Cells of a block along an axis, and of the parts that share a list of triangles.
const BLOCK: usize = 8;
const PART: usize = 4;

/// Which cells of a block are inside: bit `BLOCK j + k` of entry `i`.
type Mask = [u64; BLOCK];

/// Numbers of blocks along each axis.
fn blocks(shape: [usize; 3]) -> [usize; 3] {
    shape.map(|n| n.div_ceil(BLOCK))
}

fn write_signs<T: Real>(grid: &Grid<T>, masks: &[Mask], phi: &mut [T]) {
    let [_, ny, nz] = grid.shape();
    let [_, across, along] = blocks(grid.shape());
    parallel::each(phi.chunks_mut(nz), |row, phi| {
        let (i, j) = (row / ny, row % ny);
        let first = (i / BLOCK * across + j / BLOCK) * along;
        for (mask, phi) in masks[first..].iter().zip(phi.chunks_mut(BLOCK)) {
            let bits = mask[i % BLOCK] >> (BLOCK * (j % BLOCK));
            for (k, phi) in phi.iter_mut().enumerate() {
                put(bits >> k & 1 == 1, phi);
            }
        }
    });
}

/// Sides of the cells of a grid.
struct Sides<'a, T> {
    winding: Winding<'a, T>,
    grid: Grid<T>,
    /// Unsigned distance at each cell, or its lower bound.
    distance: &'a [T],
    is_closed: bool,
    arch: Arch,
}

/// Cells `low..high` of a grid.
#[derive(Clone, Copy)]
struct Region {
    low: [usize; 3],
    high: [usize; 3],
}

impl Region {
    fn new(low: [usize; 3], side: usize, limit: [usize; 3]) -> Self {
        let high = std::array::from_fn(|a| (low[a] + side).min(limit[a]));
        Self { low, high }
    }

    /// The cells, row by row.
    fn cells(self) -> impl Iterator<Item = [usize; 3]> {
        let Self { low, high } = self;
        (low[0]..high[0]).flat_map(move |i| {
            (low[1]..high[1]).flat_map(move |j| (low[2]..high[2]).map(move |k| [i, j, k]))
        })
    }

    fn middle(self) -> [usize; 3] {
        std::array::from_fn(|a| (self.low[a] + self.high[a] - 1) / 2)
    }

    /// Largest distance from the center of cell `from` to that of another cell, in cells.
    fn reach(self, from: [usize; 3]) -> f64 {
        norm(std::array::from_fn(|a| {
            (from[a] - self.low[a]).max(self.high[a] - 1 - from[a]) as f64
        }))
    }
}

/// Buffers of a thread.
#[derive(Default)]
struct Workspace {
    sources: Sources,
    /// Cells at which the winding number is needed.
    seeds: Vec<[usize; 3]>,
    /// The seed of each cell of a part.
    of_cell: Vec<u32>,
    open: Vec<[usize; 3]>,
}

impl<T: Real> Sides<'_, T> {
    fn all(&self) -> Vec<Mask> {
        let shape = self.grid.shape();
        let [nx, ny, nz] = blocks(shape);
        let solve = |workspace: &mut Workspace, block: usize| {
            let at = [block / nz / ny, block / nz % ny, block % nz];
            let block = Region::new(at.map(|n| n * BLOCK), BLOCK, shape);
            let mut mask = [0; BLOCK];
            self.solve(block, BLOCK, workspace, &mut mask);
            mask
        };
        parallel::map_with(Workspace::default, nx * ny * nz, solve)
    }

    fn solve(&self, region: Region, side: usize, workspace: &mut Workspace, mask: &mut Mask) {
        workspace.seeds.clear();
        workspace.of_cell.clear();
        let middle = region.middle();
        let reach = region.reach(middle) * self.grid.spacing().f64();
        if self.is_closed && self.at(middle) > MARGIN * reach {
            workspace.seeds.push(middle);
            workspace.of_cell.resize(region.cells().count(), 0);
        } else if side > PART {
            for corner in 0..8 {
                let low = [0, 1, 2].map(|a| region.low[a] + PART * (corner >> a & 1));
                if (0..3).all(|a| low[a] < region.high[a]) {
                    let part = Region::new(low, PART, region.high);
                    self.solve(part, PART, workspace, mask);
                }
            }
            return;
        } else {
            self.seed(region, workspace);
        }
        let inside = self.are_inside(workspace);
        for ([i, j, k], &seed) in region.cells().zip(&workspace.of_cell) {
            let bit = u64::from(inside[seed as usize]);
            mask[i % BLOCK] |= bit << (BLOCK * (j % BLOCK) + k % BLOCK);
        }
    }

    fn at(&self, cell: [usize; 3]) -> f64 {
        self.distance[self.grid.index(cell)].f64()
    }

    /// Finds the sets of cells that are connected by neighbors between which the surface cannot pass, and a cell of each.
    /// Of a mesh that is not closed each cell is a set of its own.
    fn seed(&self, region: Region, workspace: &mut Workspace) {
        const NONE: u32 = u32::MAX;
        let Workspace {
            seeds,
            of_cell,
            open,
            ..
        } = workspace;
        if !self.is_closed {
            seeds.extend(region.cells());
            of_cell.extend(0..seeds.len() as u32);
            return;
        }
        let size: [usize; 3] = std::array::from_fn(|a| region.high[a] - region.low[a]);
        let place = |cell: [usize; 3]| {
            let [i, j, k] = std::array::from_fn(|a| cell[a] - region.low[a]);
            (i * size[1] + j) * size[2] + k
        };
        let apart = MARGIN * self.grid.spacing().f64();
        of_cell.resize(size.iter().product(), NONE);
        for cell in region.cells() {
            if of_cell[place(cell)] != NONE {
                continue;
            }
            let seed = seeds.len() as u32;
            seeds.push(cell);
            of_cell[place(cell)] = seed;
            open.push(cell);
            while let Some(from) = open.pop() {
                let distance = self.at(from);
                for step in 0..6 {
                    let axis = step / 2;
                    let mut to = from;
                    to[axis] = match step % 2 {
                        0 => to[axis] + 1,
                        _ => to[axis].wrapping_sub(1),
                    };
                    let is_in = (region.low[axis]..region.high[axis]).contains(&to[axis]);
                    if is_in && of_cell[place(to)] == NONE && distance + self.at(to) > apart {
                        of_cell[place(to)] = seed;
                        open.push(to);
                    }
                }
            }
        }
    }

    /// Whether the centers of the seeds are inside.
    fn are_inside(&self, workspace: &mut Workspace) -> Vec<bool> {
        let local = |cell: &[usize; 3]| self.winding.to_local(self.grid.center_f64(*cell));
        let points: Vec<[f64; 3]> = workspace.seeds.iter().map(local).collect();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in &points {
            for a in 0..3 {
                low[a] = low[a].min(point[a]);
                high[a] = high[a].max(point[a]);
            }
        }
        let center = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
        let radius = 0.5 * norm(sub(high, low));
        self.winding.collect(center, radius, &mut workspace.sources);
        let sources = &workspace.sources;
        let inside = points.chunks(LANES).flat_map(|chunk| {
            // The last packet repeats its last point.
            let at = |l: usize| chunk[l.min(chunk.len() - 1)];
            let packet: Points = [0, 1, 2].map(|a| std::array::from_fn(|l| at(l)[a]));
            let numbers = simd::vectorized!(self.arch, sources.winding_numbers(&packet));
            numbers.into_iter().take(chunk.len())
        });
        inside.map(|number| number.abs() >= INSIDE).collect()
    }
}
