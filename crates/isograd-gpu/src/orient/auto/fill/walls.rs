//! Which regions are air and which are matter, by the walls between them.

use cubecl::prelude::*;
use isograd::orient::fill::{Wall, sides_of_walls};

use super::BLOCK;
use super::discs::Discs;
use super::occupied::{Cells, Occupied};
use super::regions::{Regions, region_at};
use super::sights::first_free;
use crate::neighbors::gather;
use crate::primitives::flags::list;
use crate::primitives::sort::order;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error};

/// Numbers of a wall: the lower region, the higher, and samples.
const WALL: usize = 3;

/// The pairs of regions that discs have on their two sides, one after another in ascending order; those without two
/// come last.
struct Pairs {
    lower: Buffer<u32>,
    higher: Buffer<u32>,
}

/// +1 for air, −1 for matter, 0 where no wall tells, for each region. Waits for the device.
pub(super) fn sides<R: Runtime>(
    device: &Device<R>,
    occupied: &Occupied,
    regions: &Regions,
    discs: &Discs,
) -> Result<Vec<i8>, Error> {
    let count = regions.count(device)?;
    let mut walls = Vec::new();
    if count > 1 && discs.len() > 0 {
        let pairs = Pairs::find(device, occupied, regions, discs)?;
        walls = pairs.sorted(device, count)?.counted(device, count)?;
    }
    let mut sides = Vec::new();
    sides_of_walls(count, &mut walls, &mut sides);
    Ok(sides)
}

impl Pairs {
    fn find<R: Runtime>(
        device: &Device<R>,
        occupied: &Occupied,
        regions: &Regions,
        discs: &Discs,
    ) -> Result<Self, Error> {
        let pairs = Self {
            lower: device.empty(discs.len())?,
            higher: device.empty(discs.len())?,
        };
        find_pairs::launch::<R>(
            device.client(),
            device.groups(discs.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            discs.centers.arg(),
            discs.axes.arg(),
            occupied.arg(),
            regions.before.arg(),
            regions.of_runs.arg(),
            regions.count.arg(),
            pairs.lower.arg(),
            pairs.higher.arg(),
        );
        Ok(pairs)
    }

    fn sorted<R: Runtime>(self, device: &Device<R>, regions: usize) -> Result<Self, Error> {
        let limit = regions as u32 + 1;
        let by_higher = order(device, &self.higher, limit)?;
        let lower = gather(device, &self.lower, &by_higher.places, 1)?;
        let by_both = order(device, &lower, limit)?;
        Ok(Self {
            lower: by_both.keys,
            higher: gather(device, &by_higher.keys, &by_both.places, 1)?,
        })
    }

    /// Each pair once, with the number of times that it is there.
    fn counted<R: Runtime>(&self, device: &Device<R>, regions: usize) -> Result<Vec<Wall>, Error> {
        let samples = self.lower.len();
        let flags = device.empty(samples)?;
        let (client, dim) = (device.client(), CubeDim::new_1d(BLOCK));
        flag_first::launch::<R>(
            client,
            device.groups(samples, BLOCK),
            dim,
            self.lower.arg(),
            self.higher.arg(),
            flags.arg(),
            regions as u32,
        );
        let first = list(device, &flags)?;
        let most = samples.min(regions.saturating_mul(regions - 1) / 2);
        let table: Buffer<u32> = device.empty(WALL * most)?;
        count_pairs::launch::<R>(
            client,
            device.groups(most, BLOCK),
            dim,
            self.lower.arg(),
            self.higher.arg(),
            first.indices.arg(),
            first.sums.arg(),
            table.arg(),
            regions as u32,
        );
        let table = device.download(&table)?;
        let walls = table.as_chunks::<WALL>().0.iter();
        let counted = walls.map(|&[lower, higher, samples]| (samples as usize, (lower, higher)));
        Ok(counted.filter(|&(samples, _)| samples > 0).collect())
    }
}

/// The regions of the first free cells in front of each disc and behind it; the number of regions, twice, where there
/// are no two.
#[cube(launch)]
fn find_pairs(
    centers: &Array<f32>,
    axes: &Array<f32>,
    cells: &Cells,
    before: &Array<u32>,
    of_runs: &Array<u32>,
    count: &Array<u32>,
    lower: &mut Array<u32>,
    higher: &mut Array<u32>,
) {
    if ABSOLUTE_POS < lower.len() {
        let center = Vector3::<f32>::at(centers, ABSOLUTE_POS);
        let axis = Vector3::<f32>::at(axes, ABSOLUTE_POS);
        let front = first_free(cells, center, axis);
        let back = first_free(cells, center, axis.scale(-1.0f32));
        let mut low = count[0];
        let mut high = count[0];
        if front.found && back.found {
            let a = region_at(cells, before, of_runs, front.row, front.word, front.lane);
            let b = region_at(cells, before, of_runs, back.row, back.word, back.lane);
            if a != b {
                low = min(a, b);
                high = max(a, b);
            }
        }
        lower[ABSOLUTE_POS] = low;
        higher[ABSOLUTE_POS] = high;
    }
}

/// 1 for a pair that differs from the one before it.
#[cube(launch)]
fn flag_first(lower: &Array<u32>, higher: &Array<u32>, flags: &mut Array<u32>, regions: u32) {
    if ABSOLUTE_POS < flags.len() {
        let mut first = lower[ABSOLUTE_POS] < regions;
        if first && ABSOLUTE_POS > 0 {
            first = lower[ABSOLUTE_POS] != lower[ABSOLUTE_POS - 1]
                || higher[ABSOLUTE_POS] != higher[ABSOLUTE_POS - 1];
        }
        flags[ABSOLUTE_POS] = select(first, 1u32, 0u32);
    }
}

/// The walls, and how many samples each has; none in those that are too many. `sums` counts the first pairs of walls
/// before each.
#[cube(launch)]
fn count_pairs(
    lower: &Array<u32>,
    higher: &Array<u32>,
    indices: &Array<u32>,
    sums: &Array<u32>,
    table: &mut Array<u32>,
    regions: u32,
) {
    let walls = sums[sums.len() - 1];
    let at = WALL * ABSOLUTE_POS;
    if at < table.len() {
        let mut samples = 0u32;
        if (ABSOLUTE_POS as u32) < walls {
            let start = indices[ABSOLUTE_POS];
            let mut end = count_below(lower, regions);
            if ABSOLUTE_POS as u32 + 1u32 < walls {
                end = indices[ABSOLUTE_POS + 1];
            }
            table[at] = lower[start as usize];
            table[at + 1] = higher[start as usize];
            samples = end - start;
        }
        table[at + 2] = samples;
    }
}

/// How many of the ascending numbers are below a limit, by bisection.
#[cube]
fn count_below(ascending: &Array<u32>, limit: u32) -> u32 {
    let mut low = 0u32.runtime();
    let mut high = ascending.len() as u32;
    while low < high {
        let middle = (low + high) / 2u32;
        if ascending[middle as usize] < limit {
            low = middle + 1u32;
        } else {
            high = middle;
        }
    }
    low
}
