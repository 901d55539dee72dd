//! Which cells are occupied, one bit a cell.
//!
//! Bit `z % 32` of word `z / 32` of row `(x, y)` is set where cell `(x, y, z)` is occupied. Bits past the end of a row are
//! not set.

use cubecl::prelude::*;

use super::BLOCK;
use crate::{Buffer, Device, Error};

/// Cells in one word.
pub(super) const WORD: usize = 32;

/// Most words of a grid, so that the runs of its cells can be numbered.
const MOST_WORDS: usize = 1 << 27;

/// The occupied cells of a grid.
#[derive(Clone, Debug)]
pub struct Occupied {
    pub(super) bits: Buffer<u32>,
    shape: [usize; 3],
}

impl Occupied {
    /// None are.
    pub(super) fn none<R: Runtime>(device: &Device<R>, shape: [usize; 3]) -> Result<Self, Error> {
        let bits = device.empty(count_words(device, shape)?)?;
        clear::launch::<R>(
            device.client(),
            device.groups(bits.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            bits.arg(),
        );
        Ok(Self { bits, shape })
    }

    /// Those of the `(nx, ny, nz)` `cells` that are not 0; the last axis varies fastest.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::TooLarge`].
    pub fn from_cells<R: Runtime>(
        device: &Device<R>,
        cells: &[u8],
        shape: [usize; 3],
    ) -> Result<Self, Error> {
        let words = count_words(device, shape)?;
        let expected = shape.iter().product();
        if cells.len() != expected {
            return Err(Error::Length {
                what: "the array of cells",
                found: cells.len(),
                expected,
            });
        }
        let mut bits = Vec::with_capacity(words);
        for row in cells.chunks(shape[2].max(1)) {
            bits.extend(row.chunks(WORD).map(|word| {
                let bit = |(lane, &cell): (usize, &u8)| u32::from(cell != 0) << lane;
                word.iter().enumerate().map(bit).sum::<u32>()
            }));
        }
        let bits = device.upload(&bits)?;
        Ok(Self { bits, shape })
    }

    /// The cells in the host's memory: 1 where occupied, else 0. Waits for the device.
    ///
    /// # Errors
    /// [`Error::Failed`].
    pub fn cells<R: Runtime>(&self, device: &Device<R>) -> Result<Vec<u8>, Error> {
        let bits = device.download(&self.bits)?;
        let rows = bits.chunks(self.shape[2].div_ceil(WORD).max(1));
        let cells = rows
            .flat_map(|row| (0..self.shape[2]).map(|z| (row[z / WORD] >> (z % WORD) & 1) as u8));
        Ok(cells.collect())
    }

    /// Numbers of cells along x, y and z.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Number of words.
    pub(super) fn words(&self) -> usize {
        self.bits.len()
    }

    /// Most runs of free cells that its words can have.
    pub(super) fn most_runs(&self) -> usize {
        self.words() * self.shape[2].min(WORD).div_ceil(2)
    }

    /// As an argument of a kernel.
    pub(super) fn arg<R: Runtime>(&self) -> CellsLaunch<R> {
        let [nx, ny, nz] = self.shape.map(|n| n as u32);
        let words = self.shape[2].div_ceil(WORD) as u32;
        CellsLaunch::new(self.bits.arg(), nx, ny, nz, words)
    }
}

fn count_words<R: Runtime>(device: &Device<R>, shape: [usize; 3]) -> Result<usize, Error> {
    let [nx, ny, nz] = shape;
    let words = nx.saturating_mul(ny).saturating_mul(nz.div_ceil(WORD));
    if words > MOST_WORDS {
        return Err(Error::TooLarge {
            device: device.name().to_owned(),
            bytes: (words as u64).saturating_mul(4),
            limit: 4 * MOST_WORDS as u64,
        });
    }
    Ok(words)
}

/// The cells, in a kernel.
#[derive(CubeType, CubeLaunch)]
pub struct Cells {
    pub bits: Array<u32>,
    pub nx: u32,
    pub ny: u32,
    pub nz: u32,
    /// Words of a row.
    pub words: u32,
}

#[cube(launch)]
fn clear(bits: &mut Array<u32>) {
    if ABSOLUTE_POS < bits.len() {
        bits[ABSOLUTE_POS] = 0u32;
    }
}

/// The cells that there are of word `w` of a row.
#[cube]
pub(super) fn present(cells: &Cells, w: u32) -> u32 {
    let left = cells.nz - w * 32u32;
    select(
        left >= 32u32,
        0xffff_ffffu32,
        (1u32 << (left & 31u32)) - 1u32,
    )
}

/// The free cells of word `w` of a row.
#[cube]
pub(super) fn free_in(cells: &Cells, row: u32, w: u32) -> u32 {
    !cells.bits[(row * cells.words + w) as usize] & present(cells, w)
}
