//! Number of directions in which each free cell sees out of the grid.

use super::sight;
use crate::parallel;

/// Directions of one sweep: the neighbors of a cell that come before it in C order.
const DIRECTIONS: u32 = 13;

const _: () = assert!(2 * DIRECTIONS as usize == sight::RAYS);

/// Scratch of the two sweeps, and their counts for each cell.
#[derive(Clone, Debug, Default)]
pub(super) struct Visibility {
    sweeps: [Sweep; 2],
}

#[derive(Clone, Debug, Default)]
struct Sweep {
    count: Vec<u8>,
    /// The plane before, the plane at work (both with a border that is open in all directions), and a row that
    /// is all ones where free.
    before: Vec<u16>,
    current: Vec<u16>,
    free: Vec<u16>,
}

impl Visibility {
    /// From each cell a ray starts in each of the 26 directions to its neighbors; it is free if it
    /// leaves the grid without meeting an occupied cell.
    pub(super) fn compute(&mut self, occupied: &[u8], shape: [usize; 3]) {
        let [forward, backward] = &mut self.sweeps;
        parallel::join(
            || forward.run(occupied, shape, false),
            || backward.run(occupied, shape, true),
        );
    }

    /// How many of the [`sight::RAYS`] are free.
    #[inline(always)]
    pub(super) fn free(&self, cell: usize) -> u8 {
        let [forward, backward] = &self.sweeps;
        forward.count[cell] + backward.count[cell]
    }
}

impl Sweep {
    /// One pass in C order, or in the reverse of it, carrying a bit for each direction from cell to cell.
    fn run(&mut self, occupied: &[u8], [nx, ny, nz]: [usize; 3], backward: bool) {
        let width = nz + 2;
        self.count.resize(nx * ny * nz, 0);
        self.free.resize(nz, 0);
        for plane in [&mut self.before, &mut self.current] {
            plane.clear();
            plane.resize((ny + 2) * width, u16::MAX);
        }
        for x in 0..nx {
            for y in 0..ny {
                let row = (x * ny + y) * nz;
                self.load(occupied, row, backward);
                let (done, rest) = self.current.split_at_mut((y + 1) * width);
                sweep_row(
                    &self.free,
                    &self.before[y * width..],
                    &done[y * width..],
                    &mut rest[..width],
                );
                self.store(
                    row,
                    &Row {
                        from: (y + 1) * width + 1,
                        backward,
                    },
                );
            }
            std::mem::swap(&mut self.before, &mut self.current);
        }
    }

    fn load(&mut self, occupied: &[u8], row: usize, backward: bool) {
        let nz = self.free.len();
        let mask = |&o: &u8| if o == 0 { u16::MAX } else { 0 };
        if backward {
            let end = occupied.len() - row;
            let cells = occupied[end - nz..end].iter().rev();
            self.free
                .iter_mut()
                .zip(cells)
                .for_each(|(free, o)| *free = mask(o));
        } else {
            let cells = &occupied[row..row + nz];
            self.free
                .iter_mut()
                .zip(cells)
                .for_each(|(free, o)| *free = mask(o));
        }
    }

    fn store(&mut self, row: usize, at: &Row) {
        let nz = self.free.len();
        let bits = self.current[at.from..at.from + nz].iter();
        let ones = |bits: &u16| bits.count_ones() as u8;
        if at.backward {
            let end = self.count.len() - row;
            let counts = self.count[end - nz..end].iter_mut().rev();
            counts
                .zip(bits)
                .for_each(|(count, bits)| *count = ones(bits));
        } else {
            let counts = self.count[row..row + nz].iter_mut();
            counts
                .zip(bits)
                .for_each(|(count, bits)| *count = ones(bits));
        }
    }
}

/// Where a finished row lies in its plane, and which way it runs in the grid.
struct Row {
    from: usize,
    backward: bool,
}

/// One row, from three rows of the plane before it (the first starts at `before`) and the row before it.
/// Rows have a border of one cell at either end.
fn sweep_row(free: &[u16], before: &[u16], previous: &[u16], out: &mut [u16]) {
    let nz = free.len();
    let width = nz + 2;
    let rows = [before, &before[width..], &before[2 * width..], previous].map(|row| &row[..width]);
    let cells = &mut out[1..=nz];
    for z in 0..nz {
        let mut bits = 0;
        for (r, row) in rows.iter().enumerate() {
            for dz in 0..3 {
                bits |= row[z + dz] & (1 << (3 * r + dz));
            }
        }
        cells[z] = bits & free[z];
    }
    let mut along = 1 << (DIRECTIONS - 1);
    for (cell, &free) in cells.iter_mut().zip(free) {
        along &= free;
        *cell |= along;
    }
}
