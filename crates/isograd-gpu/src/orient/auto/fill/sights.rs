//! What samples see along rays from their discs.

use cubecl::prelude::*;

use super::occupied::{Cells, free_in};
use super::regions::region_at;
use super::sky::free_rays;
use super::{BLOCK, Fill};
use crate::element::sight::{self, RAYS, STEPS};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error};

/// What members see, in their order; see [`isograd::orient::fill::Sights`].
#[derive(Clone, Debug)]
pub struct Sights {
    /// `(M,)` the evidence, in −1..1: positive where the axis points into the air.
    pub evidence: Buffer<f32>,
    /// `(M, 2)` the light in front, along the axis, and behind: −1 in matter, up to 1 in the open air.
    pub ends: Buffer<f32>,
}

pub(super) fn look<R: Runtime>(device: &Device<R>, fill: &Fill) -> Result<Sights, Error> {
    let count = fill.discs.len();
    let sights = Sights {
        evidence: device.empty(count)?,
        ends: device.empty(2 * count)?,
    };
    if count == 0 {
        return Ok(sights);
    }
    let sides: Vec<i32> = fill.sides.iter().map(|&side| i32::from(side)).collect();
    look_both_ways::launch::<R>(
        device.client(),
        device.groups(count, BLOCK),
        CubeDim::new_1d(BLOCK),
        fill.discs.centers.arg(),
        fill.discs.axes.arg(),
        fill.occupied.arg(),
        fill.regions.before.arg(),
        fill.regions.of_runs.arg(),
        device.upload(&sides)?.arg(),
        fill.sky.digits.arg(),
        sights.evidence.arg(),
        sights.ends.arg(),
    );
    Ok(sights)
}

/// The free cell that a ray meets first, if `found`: bit `lane` of word `word` of its row; and after how many steps.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Sight {
    pub found: bool,
    pub row: u32,
    pub word: u32,
    pub lane: u32,
    pub step: u32,
}

/// The cell along an axis, the first or last one where there is none.
#[cube]
fn cell_of(at: f32, cells: u32) -> u32 {
    min(u32::cast_from(max(at, 0.0f32)), cells - 1u32)
}

#[cube]
pub(super) fn first_free(cells: &Cells, from: Vector3<f32>, direction: Vector3<f32>) -> Sight {
    let mut found = false;
    let mut row = 0u32.runtime();
    let mut z = 0u32.runtime();
    let mut step = 0u32.runtime();
    while step < STEPS as u32 && !found {
        let far = sight::distance::<f32>(f32::cast_from(step));
        let at = from.add(direction.scale(far));
        row = cell_of(at.x, cells.nx) * cells.ny + cell_of(at.y, cells.ny);
        z = cell_of(at.z, cells.nz);
        let free = free_in(cells, row, z / 32u32);
        if (free >> (z % 32u32)) & 1u32 == 1u32 {
            found = true;
        } else {
            step += 1u32;
        }
    }
    Sight {
        found,
        row,
        word: z / 32u32,
        lane: z % 32u32,
        step,
    }
}

/// Light in the cell that a ray meets: −1 in matter, up to 1 in the open air, less for a longer way.
#[cube]
fn light(
    cells: &Cells,
    before: &Array<u32>,
    of_runs: &Array<u32>,
    sides: &Array<i32>,
    digits: &Array<u32>,
    from: Vector3<f32>,
    direction: Vector3<f32>,
) -> f32 {
    let met = first_free(cells, from, direction);
    let mut light = 0.0f32;
    if met.found {
        let region = region_at(cells, before, of_runs, met.row, met.word, met.lane);
        light = f32::cast_from(sides[region as usize]);
        // Region 0 is the open air; other air is a cavity, which sees no sky.
        if region == 0u32 {
            let rays = free_rays(digits, met.row * cells.words + met.word, met.lane);
            light = sight::open_air::<f32>(f32::cast_from(rays), f32::cast_from(RAYS as u32));
        }
        let step = f32::cast_from(met.step);
        light = sight::dimmed::<f32>(light, step, f32::cast_from(STEPS as u32));
    }
    light
}

/// Two directions at right angles to an axis and to each other; zero where it has none.
#[derive(CubeType, Clone, Copy)]
struct Tangents {
    first: Vector3<f32>,
    second: Vector3<f32>,
}

#[cube]
fn tangents(axis: Vector3<f32>) -> Tangents {
    let y_less = axis.y.abs() < axis.x.abs();
    let of_two = select(y_less, axis.y.abs(), axis.x.abs());
    let z_least = axis.z.abs() < of_two;
    let unit = Vector3::<f32>::of(
        select(y_less || z_least, 0.0f32, 1.0f32),
        select(y_less && !z_least, 1.0f32, 0.0f32),
        select(z_least, 1.0f32, 0.0f32),
    );
    let first = axis.cross(unit).direction();
    Tangents {
        first,
        second: axis.cross(first),
    }
}

/// The evidence of each disc: light on one side less light on the other, over a cone of directions.
#[cube(launch)]
fn look_both_ways(
    centers: &Array<f32>,
    axes: &Array<f32>,
    cells: &Cells,
    before: &Array<u32>,
    of_runs: &Array<u32>,
    sides: &Array<i32>,
    digits: &Array<u32>,
    evidence: &mut Array<f32>,
    ends: &mut Array<f32>,
) {
    if ABSOLUTE_POS < evidence.len() {
        let center = Vector3::<f32>::at(centers, ABSOLUTE_POS);
        let axis = Vector3::<f32>::at(axes, ABSOLUTE_POS);
        let round = tangents(axis);
        let mut sum = 0.0f32;
        // The axis itself, and then two directions for either tangent.
        for pair in 0u32..5u32 {
            let tangent = round.first.choose(pair < 3u32, round.second);
            let turn = select(pair % 2u32 == 1u32, 1.0f32, -1.0f32);
            let along = axis.add(tangent.scale(turn)).choose(pair > 0u32, axis);
            let back = along.scale(-1.0f32);
            let ahead = light(cells, before, of_runs, sides, digits, center, along);
            let behind = light(cells, before, of_runs, sides, digits, center, back);
            if pair == 0u32 {
                ends[2 * ABSOLUTE_POS] = ahead;
                ends[2 * ABSOLUTE_POS + 1] = behind;
                sum = sight::along_axis::<f32>(ahead, behind);
            } else {
                sum += ahead - behind;
            }
        }
        evidence[ABSOLUTE_POS] = sight::evidence::<f32>(sum);
    }
}
