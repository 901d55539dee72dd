//! Connected regions of free cells, and which of them are outside.

use std::collections::BTreeMap;

use crate::union_find::join;

/// Regions of cells that are free and joined through faces, held as runs along the rows of the grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Regions {
    /// Runs `start..end` of free cells, row by row.
    runs: Vec<(u32, u32)>,
    /// First run of each row, and the number of runs.
    rows: Vec<u32>,
    /// Union-find over runs; after [`Regions::find`], the region of each run.
    region: Vec<u32>,
    /// Number of regions.
    pub len: usize,
}

impl Regions {
    /// Finds the regions. Region 0 is the one that holds the first cell.
    pub(super) fn find(&mut self, occupied: &[u8], [nx, ny, nz]: [usize; 3]) {
        self.runs.clear();
        self.rows.clear();
        for row in occupied.chunks_exact(nz) {
            self.rows.push(self.runs.len() as u32);
            push_runs(row, &mut self.runs);
        }
        self.rows.push(self.runs.len() as u32);
        self.region.clear();
        self.region.extend(0..self.runs.len() as u32);
        for x in 0..nx {
            for y in 0..ny {
                let row = x * ny + y;
                if y > 0 {
                    self.join_rows(row - 1, row);
                }
                if x > 0 {
                    self.join_rows(row - ny, row);
                }
            }
        }
        self.number();
    }

    /// The region of a free cell of `row`, or `None` where the cell is occupied.
    pub(super) fn at(&self, row: usize, z: usize) -> Option<u32> {
        let (start, end) = (self.rows[row] as usize, self.rows[row + 1] as usize);
        let runs = &self.runs[start..end];
        let after = runs.partition_point(|&(first, _)| first as usize <= z);
        let run = after.checked_sub(1)?;
        ((z as u32) < runs[run].1).then(|| self.region[start + run])
    }

    /// Joins the runs of two neighboring rows that overlap.
    fn join_rows(&mut self, a: usize, b: usize) {
        let (mut i, mut j) = (self.rows[a], self.rows[b]);
        let (i_end, j_end) = (self.rows[a + 1], self.rows[b + 1]);
        while i < i_end && j < j_end {
            let (first, second) = (self.runs[i as usize], self.runs[j as usize]);
            if first.0 < second.1 && second.0 < first.1 {
                join(&mut self.region, i, j);
            }
            if first.1 < second.1 { i += 1 } else { j += 1 }
        }
    }

    /// Turns roots into numbers 0, 1, 2, … in the order of their first run.
    fn number(&mut self) {
        self.len = 0;
        for run in 0..self.region.len() {
            // A root is the first run of its region, so its number is known before it is needed.
            let parent = self.region[run] as usize;
            self.region[run] = if parent == run {
                self.len += 1;
                self.len as u32 - 1
            } else {
                self.region[parent]
            };
        }
    }
}

fn push_runs(row: &[u8], runs: &mut Vec<(u32, u32)>) {
    let mut z = 0;
    while z < row.len() {
        let Some(free) = row[z..].iter().position(|&o| o == 0) else {
            return;
        };
        let start = z + free;
        let length = row[start..].iter().position(|&o| o != 0);
        z = length.map_or(row.len(), |length| start + length);
        runs.push((start as u32, z as u32));
    }
}

/// Walls between two regions, the lower one first, and how many samples each has.
#[derive(Clone, Debug, Default)]
pub(super) struct Walls(BTreeMap<(u32, u32), usize>);

impl Walls {
    /// The walls that samples lie in, from the pair of regions of each.
    pub(super) fn of(samples: impl Iterator<Item = (u32, u32)>) -> Self {
        let mut walls = Self::default();
        samples.for_each(|wall| walls.add(wall, 1));
        walls
    }

    /// The walls of all samples, from those of some each.
    pub(super) fn sum(parts: Vec<Self>) -> Self {
        let mut all = Self::default();
        for (wall, samples) in parts.into_iter().flat_map(|part| part.0) {
            all.add(wall, samples);
        }
        all
    }

    fn add(&mut self, wall: (u32, u32), samples: usize) {
        *self.0.entry(wall).or_insert(0) += samples;
    }
}

/// Classifies the `regions`: `sides[r]` is +1 for air, −1 for matter, 0 where no wall separates it.
///
/// Region 0 is air. From region to region across the wall with the most samples, air and matter alternate: the cavity of a
/// hollow body is air again, and a body inside the cavity is matter.
///
/// # Panics
/// A wall names a region that does not exist.
pub(super) fn sides(regions: usize, walls: Walls, sides: &mut Vec<i8>) {
    let walls = walls.0.into_iter().map(|(wall, samples)| (samples, wall));
    let mut walls: Vec<(usize, (u32, u32))> = walls.collect();
    sides.clear();
    sides.resize(regions, 0);
    let Some(open_air) = sides.first_mut() else {
        return;
    };
    *open_air = 1;
    walls.sort_by_key(|&(samples, wall)| (std::cmp::Reverse(samples), wall));
    let mut neighbors = vec![Vec::new(); regions];
    for &(samples, (a, b)) in walls.iter() {
        neighbors[a as usize].push((samples, b));
        neighbors[b as usize].push((samples, a));
    }
    // Prim's algorithm: always the strongest wall between what is known and what is not.
    let mut open = std::collections::BinaryHeap::new();
    let mut reached = 0u32;
    loop {
        for &(samples, other) in &neighbors[reached as usize] {
            if sides[other as usize] == 0 {
                open.push((samples, std::cmp::Reverse((other, reached))));
            }
        }
        reached = loop {
            let Some((_, std::cmp::Reverse((other, from)))) = open.pop() else {
                return;
            };
            if sides[other as usize] == 0 {
                sides[other as usize] = -sides[from as usize];
                break other;
            }
        };
    }
}
