//! Samples as discs in their tangent planes; lengths in cells.

use cubecl::prelude::*;

use super::occupied::Occupied;
use super::{BLOCK, Lattice, Members};
use crate::element::disc;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// The discs of members, in their order.
#[derive(Clone, Debug)]
pub(super) struct Discs {
    /// `(M, 3)`.
    pub centers: Buffer<f32>,
    /// `(M, 3)`.
    pub axes: Buffer<f32>,
    /// `(M,)`.
    pub radii: Buffer<f32>,
}

/// The grid, for points of type `F`. The low corner is the sum of two numbers, so that in single precision too points
/// that are far from the origin get their places as exactly as they are known.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
struct Frame<F: Float + CubeElement> {
    x: F,
    y: F,
    z: F,
    x_rest: F,
    y_rest: F,
    z_rest: F,
    cell: F,
    nx: u32,
    ny: u32,
    nz: u32,
}

impl Discs {
    /// Places the members on the grid.
    pub(super) fn place<R: Runtime, T: Scalar>(
        device: &Device<R>,
        lattice: &Lattice,
        members: &Members<'_, T>,
    ) -> Result<Self, Error> {
        let count = members.rows.len();
        let discs = Self {
            centers: device.empty(3 * count)?,
            axes: device.empty(3 * count)?,
            radii: device.empty(count)?,
        };
        if count == 0 {
            return Ok(discs);
        }
        place_discs::launch::<T, R>(
            device.client(),
            device.groups(count, BLOCK),
            CubeDim::new_1d(BLOCK),
            members.rows.arg(),
            members.points.arg(),
            members.axes.arg(),
            members.reach.arg(),
            discs.centers.arg(),
            discs.axes.arg(),
            discs.radii.arg(),
            frame(lattice),
            (members.growth / lattice.cell()) as f32,
        );
        Ok(discs)
    }

    /// Number of discs.
    pub(super) fn len(&self) -> usize {
        self.radii.len()
    }

    /// The cells of a grid that they cover.
    pub(super) fn draw<R: Runtime>(
        &self,
        device: &Device<R>,
        shape: [usize; 3],
    ) -> Result<Occupied, Error> {
        let occupied = Occupied::none(device, shape)?;
        let [nx, ny, nz] = shape.map(|n| n as u32);
        draw_discs::launch::<R>(
            device.client(),
            device.groups(self.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            self.centers.arg(),
            self.axes.arg(),
            self.radii.arg(),
            occupied.bits.arg(),
            nx,
            ny,
            nz,
            self.len() as u32,
        );
        Ok(occupied)
    }
}

fn frame<R: Runtime, T: Scalar>(lattice: &Lattice) -> FrameLaunch<T, R> {
    let of = <T as isograd::Real>::of;
    let [low, rest] = {
        let low = lattice.lower().map(of);
        let rest = |a: usize| of(lattice.lower()[a] - isograd::Real::f64(low[a]));
        [low, [0, 1, 2].map(rest)]
    };
    let [nx, ny, nz] = lattice.shape().map(|n| n as u32);
    FrameLaunch::new(
        low[0],
        low[1],
        low[2],
        rest[0],
        rest[1],
        rest[2],
        of(lattice.cell()),
        nx,
        ny,
        nz,
    )
}

/// Position along an axis, in cells.
#[cube]
fn position<F: Float>(x: F, lower: F, rest: F, cell: F, cells: u32) -> f32 {
    let place = f32::cast_from((x - lower - rest) / cell);
    disc::inside::<f32>(place, f32::cast_from(cells))
}

#[cube(launch)]
fn place_discs<F: Float + CubeElement>(
    rows: &Array<u32>,
    points: &Array<F>,
    all_axes: &Array<f32>,
    reach: &Array<f32>,
    centers: &mut Array<f32>,
    axes: &mut Array<f32>,
    radii: &mut Array<f32>,
    frame: Frame<F>,
    growth: f32,
) {
    if ABSOLUTE_POS < radii.len() {
        let row = rows[ABSOLUTE_POS] as usize;
        let p = Vector3::<F>::at(points, row);
        let center = Vector3::<f32>::of(
            position::<F>(p.x, frame.x, frame.x_rest, frame.cell, frame.nx),
            position::<F>(p.y, frame.y, frame.y_rest, frame.cell, frame.ny),
            position::<F>(p.z, frame.z, frame.z_rest, frame.cell, frame.nz),
        );
        center.write(centers, ABSOLUTE_POS);
        Vector3::<f32>::at(all_axes, row).write(axes, ABSOLUTE_POS);
        radii[ABSOLUTE_POS] = disc::radius::<f32>(growth * reach[row]);
    }
}

/// The first cell along an axis that a disc can cover.
#[cube]
fn first_cell(center: f32, radius: f32) -> u32 {
    u32::cast_from(max(center - radius, 0.0f32))
}

/// The cell after the last one.
#[cube]
fn end_cell(center: f32, radius: f32, cells: u32) -> u32 {
    min(u32::cast_from(center + radius) + 1u32, cells)
}

/// Sets the bits of the cells whose center is in a disc, and of the cell of its own center. The order in which units do
/// that makes no difference.
#[cube(launch)]
fn draw_discs(
    centers: &Array<f32>,
    axes: &Array<f32>,
    radii: &Array<f32>,
    bits: &mut Array<Atomic<u32>>,
    nx: u32,
    ny: u32,
    nz: u32,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let center = Vector3::<f32>::at(centers, ABSOLUTE_POS);
        let axis = Vector3::<f32>::at(axes, ABSOLUTE_POS);
        let radius = radii[ABSOLUTE_POS];
        let half = disc::half::<f32>(axis.x, axis.y, axis.z);
        let words = nz.div_ceil(32u32);
        let own_row = u32::cast_from(center.x) * ny + u32::cast_from(center.y);
        set_bits(bits, own_row * words, u32::cast_from(center.z), 1u32);
        let first = first_cell(center.z, radius);
        let end = end_cell(center.z, radius, nz);
        for x in first_cell(center.x, radius)..end_cell(center.x, radius, nx) {
            for y in first_cell(center.y, radius)..end_cell(center.y, radius, ny) {
                let mut covered = 0u32;
                for z in first..end {
                    let offset = Vector3::<f32>::of(
                        f32::cast_from(x) + 0.5f32 - center.x,
                        f32::cast_from(y) + 0.5f32 - center.y,
                        f32::cast_from(z) + 0.5f32 - center.z,
                    );
                    let height = offset.dot(axis);
                    if disc::covers::<f32>(offset.dot(offset), height, half, radius) {
                        covered |= 1u32 << (z - first);
                    }
                }
                set_bits(bits, (x * ny + y) * words, first, covered);
            }
        }
    }
}

/// Sets bits of a row that begins at word `start`, the lowest at cell `z`.
#[cube]
fn set_bits(bits: &Array<Atomic<u32>>, start: u32, z: u32, set: u32) {
    let word = (start + z / 32u32) as usize;
    let lane = z % 32u32;
    let low = set << lane;
    // By 32 in all, in two steps: a shift of 32 is none.
    let high = (set >> 1u32) >> (31u32 - lane);
    if low != 0u32 {
        bits[word].fetch_or(low);
    }
    if high != 0u32 {
        bits[word + 1].fetch_or(high);
    }
}
