//! Regions of free cells that are joined through faces.
//!
//! The free cells of a word are runs, numbered in the order of memory. Every run is first given a neighbor before it as
//! its parent: these trees are no deeper than a row is long, and doubling makes every root the parent of its whole tree.
//! What is left are trees that touch; they are joined root to root, the higher to the lower, by units that do not wait
//! for each other (after J. Jaiganesh, M. Burtscher, "A high-performance connected components implementation for GPUs",
//! 2018). So whatever they come first to, the root of a region is its first run.

use cubecl::prelude::*;

use super::BLOCK;
use super::occupied::{Cells, Occupied, WORD, free_in};
use crate::primitives::scan::exclusive_sum;
use crate::{Buffer, Device, Error};

/// Stands for the region of an occupied cell.
pub const NO_REGION: u32 = u32::MAX;

/// The regions of the free cells of a grid, numbered in the order of their first cells.
#[derive(Clone, Debug)]
pub struct Regions {
    /// Runs before each word, and of all of them.
    pub(super) before: Buffer<u32>,
    /// The region of each run.
    pub(super) of_runs: Buffer<u32>,
    /// How many regions there are.
    pub(super) count: Buffer<u32>,
}

impl Regions {
    /// Finds the regions.
    ///
    /// # Errors
    /// [`Error::TooLarge`].
    pub fn find<R: Runtime>(device: &Device<R>, occupied: &Occupied) -> Result<Self, Error> {
        let (words, runs) = (occupied.words(), occupied.most_runs());
        let (of_words, of_runs) = (device.groups(words, BLOCK), device.groups(runs, BLOCK));
        let (client, dim) = (device.client(), CubeDim::new_1d(BLOCK));
        let counts = device.empty(words)?;
        count_runs::launch::<R>(client, of_words.clone(), dim, occupied.arg(), counts.arg());
        let before = exclusive_sum(device, &counts)?;
        let parents = device.empty(runs)?;
        link_runs::launch::<R>(
            client,
            of_words.clone(),
            dim,
            occupied.arg(),
            before.arg(),
            parents.arg(),
        );
        let [nx, ny, nz] = occupied.shape();
        let parents = shorten(device, &before, parents, nx + ny + nz.div_ceil(WORD))?;
        join_runs::launch::<R>(
            client,
            of_words,
            dim,
            occupied.arg(),
            before.arg(),
            parents.arg(),
        );
        let roots = shorten(device, &before, parents, runs)?;
        let flags = device.empty(runs)?;
        let groups = of_runs.clone();
        flag_roots::launch::<R>(client, groups, dim, before.arg(), roots.arg(), flags.arg());
        let numbers = exclusive_sum(device, &flags)?;
        let regions = Self {
            before,
            of_runs: device.empty(runs)?,
            count: device.empty(1)?,
        };
        number_runs::launch::<R>(
            client,
            of_runs,
            dim,
            regions.before.arg(),
            roots.arg(),
            numbers.arg(),
            regions.of_runs.arg(),
            regions.count.arg(),
        );
        Ok(regions)
    }

    /// How many there are. Waits for the device.
    ///
    /// # Errors
    /// [`Error::Failed`].
    pub fn count<R: Runtime>(&self, device: &Device<R>) -> Result<usize, Error> {
        Ok(device.download(&self.count)?[0] as usize)
    }

    /// The region of each of the `(nx, ny, nz)` cells of the grid that they were found in; [`NO_REGION`] where it is
    /// occupied.
    ///
    /// # Errors
    /// [`Error::TooLarge`].
    pub fn of_cells<R: Runtime>(
        &self,
        device: &Device<R>,
        occupied: &Occupied,
    ) -> Result<Buffer<u32>, Error> {
        let regions = device.empty(occupied.shape().iter().product())?;
        regions_of_cells::launch::<R>(
            device.client(),
            device.groups(regions.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            occupied.arg(),
            self.before.arg(),
            self.of_runs.arg(),
            regions.arg(),
        );
        Ok(regions)
    }
}

/// The root of every run, where no tree is deeper than `depth`.
fn shorten<R: Runtime>(
    device: &Device<R>,
    before: &Buffer<u32>,
    parents: Buffer<u32>,
    depth: usize,
) -> Result<Buffer<u32>, Error> {
    let (mut parents, mut shorter) = (parents, None);
    for _ in 0..depth.next_power_of_two().ilog2() {
        let next = shorter.map_or_else(|| device.empty(parents.len()), Ok)?;
        skip_parents::launch::<R>(
            device.client(),
            device.groups(parents.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            before.arg(),
            parents.arg(),
            next.arg(),
        );
        shorter = Some(std::mem::replace(&mut parents, next));
    }
    Ok(parents)
}

/// The first cells of the runs of a word.
#[cube]
fn starts(free: u32) -> u32 {
    free & !(free << 1u32)
}

/// The number of the run that the free cell at bit `lane` of a word belongs to.
#[cube]
fn run_at(before: &Array<u32>, word: u32, free: u32, lane: u32) -> u32 {
    let so_far = starts(free) & (0xffff_ffffu32 >> (31u32 - lane));
    before[word as usize] + u32::count_ones(so_far) - 1u32
}

/// The region of the free cell at bit `lane` of word `w` of a row.
#[cube]
pub(super) fn region_at(
    cells: &Cells,
    before: &Array<u32>,
    of_runs: &Array<u32>,
    row: u32,
    w: u32,
    lane: u32,
) -> u32 {
    let run = run_at(before, row * cells.words + w, free_in(cells, row, w), lane);
    of_runs[run as usize]
}

/// A word of free cells, and the words beside it on the low sides; 0 where there are none.
#[derive(CubeType, Clone, Copy)]
struct Beside {
    own: u32,
    /// The word before it in the row.
    z: u32,
    y: u32,
    x: u32,
}

#[cube]
fn beside(cells: &Cells, row: u32, w: u32) -> Beside {
    let mut z = 0u32;
    let mut y = 0u32;
    let mut x = 0u32;
    if w > 0u32 {
        z = free_in(cells, row, w - 1u32);
    }
    let in_plane = row % cells.ny;
    if in_plane > 0u32 {
        y = free_in(cells, row - 1u32, w);
    }
    if row >= cells.ny {
        x = free_in(cells, row - cells.ny, w);
    }
    Beside {
        own: free_in(cells, row, w),
        z,
        y,
        x,
    }
}

#[cube(launch)]
fn count_runs(cells: &Cells, counts: &mut Array<u32>) {
    if ABSOLUTE_POS < counts.len() {
        let word = ABSOLUTE_POS as u32;
        let free = free_in(cells, word / cells.words, word % cells.words);
        counts[ABSOLUTE_POS] = u32::count_ones(starts(free));
    }
}

/// The parent of each run: one that it touches and that comes before it, where there is one, else itself.
#[cube(launch)]
fn link_runs(cells: &Cells, before: &Array<u32>, parents: &mut Array<u32>) {
    if ABSOLUTE_POS + 1 < before.len() {
        let word = ABSOLUTE_POS as u32;
        let free = beside(cells, word / cells.words, word % cells.words);
        let mut rest = starts(free.own);
        let mut run = before[ABSOLUTE_POS];
        while rest != 0u32 {
            let first = rest & (!rest + 1u32);
            // Adding carries through the run.
            let own = free.own & !(free.own + first);
            let mut parent = run;
            if (own & free.y) != 0u32 {
                let lane = u32::trailing_zeros(own & free.y);
                parent = run_at(before, word - cells.words, free.y, lane);
            } else if (own & free.x) != 0u32 {
                let lane = u32::trailing_zeros(own & free.x);
                parent = run_at(before, word - cells.ny * cells.words, free.x, lane);
            } else if (own & 1u32) == 1u32 && (free.z >> 31u32) == 1u32 {
                parent = run - 1u32;
            }
            parents[run as usize] = parent;
            rest &= rest - 1u32;
            run += 1u32;
        }
    }
}

/// The parent of the parent of each run.
#[cube(launch)]
fn skip_parents(before: &Array<u32>, parents: &Array<u32>, next: &mut Array<u32>) {
    if (ABSOLUTE_POS as u32) < before[before.len() - 1] {
        next[ABSOLUTE_POS] = parents[parents[ABSOLUTE_POS] as usize];
    }
}

/// Joins the trees of all runs that touch.
#[cube(launch)]
fn join_runs(cells: &Cells, before: &Array<u32>, parents: &mut Array<Atomic<u32>>) {
    if ABSOLUTE_POS + 1 < before.len() {
        let word = ABSOLUTE_POS as u32;
        let free = beside(cells, word / cells.words, word % cells.words);
        if (free.own & 1u32) == 1u32 && (free.z >> 31u32) == 1u32 {
            let run = before[ABSOLUTE_POS];
            join(parents, run, run - 1u32);
        }
        let mut rest = starts(free.own & free.y);
        while rest != 0u32 {
            let lane = u32::trailing_zeros(rest);
            let other = run_at(before, word - cells.words, free.y, lane);
            join(parents, run_at(before, word, free.own, lane), other);
            rest &= rest - 1u32;
        }
        rest = starts(free.own & free.x);
        while rest != 0u32 {
            let lane = u32::trailing_zeros(rest);
            let other = run_at(before, word - cells.ny * cells.words, free.x, lane);
            join(parents, run_at(before, word, free.own, lane), other);
            rest &= rest - 1u32;
        }
    }
}

/// Joins the trees of two runs. Parents never come after their children, whoever else joins at the same time.
#[cube]
fn join(parents: &Array<Atomic<u32>>, a: u32, b: u32) {
    let mut one = parents[a as usize].load();
    let mut other = parents[b as usize].load();
    // Most have the same parent already. To ask for a root is what many units do at once.
    if one != other {
        one = root(parents, one);
        other = root(parents, other);
    }
    while one != other {
        let low = min(one, other);
        let high = max(one, other);
        let was = parents[high as usize].fetch_min(low);
        one = low;
        other = low;
        // Somebody was faster: `high` has left its parent, which is to be joined instead.
        if was != high {
            one = root(parents, low);
            other = root(parents, was);
        }
    }
}

/// The root of a run, as long as nobody joins it to another. The way there is halved.
#[cube]
fn root(parents: &Array<Atomic<u32>>, run: u32) -> u32 {
    let mut at = run;
    let mut parent = parents[at as usize].load();
    while parent != at {
        let next = parents[parent as usize].load();
        parents[at as usize].fetch_min(next);
        at = next;
        parent = parents[at as usize].load();
    }
    at
}

#[cube(launch)]
fn flag_roots(before: &Array<u32>, roots: &Array<u32>, flags: &mut Array<u32>) {
    if ABSOLUTE_POS < flags.len() {
        let run = ABSOLUTE_POS as u32;
        let mut flag = 0u32;
        if run < before[before.len() - 1] {
            flag = select(roots[ABSOLUTE_POS] == run, 1u32, 0u32);
        }
        flags[ABSOLUTE_POS] = flag;
    }
}

/// The region of each run: how many roots come before its own.
#[cube(launch)]
fn number_runs(
    before: &Array<u32>,
    roots: &Array<u32>,
    numbers: &Array<u32>,
    of_runs: &mut Array<u32>,
    count: &mut Array<u32>,
) {
    if (ABSOLUTE_POS as u32) < before[before.len() - 1] {
        of_runs[ABSOLUTE_POS] = numbers[roots[ABSOLUTE_POS] as usize];
    }
    if ABSOLUTE_POS == 0 {
        count[0] = numbers[numbers.len() - 1];
    }
}

#[cube(launch)]
fn regions_of_cells(
    cells: &Cells,
    before: &Array<u32>,
    of_runs: &Array<u32>,
    regions: &mut Array<u32>,
) {
    if ABSOLUTE_POS < regions.len() {
        let row = ABSOLUTE_POS as u32 / cells.nz;
        let z = ABSOLUTE_POS as u32 % cells.nz;
        let lane = z % 32u32;
        regions[ABSOLUTE_POS] = NO_REGION;
        if (free_in(cells, row, z / 32u32) >> lane) & 1u32 == 1u32 {
            regions[ABSOLUTE_POS] = region_at(cells, before, of_runs, row, z / 32u32, lane);
        }
    }
}
