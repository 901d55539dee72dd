//! Signs of the cells, one bit per cell, and what they determine: the crossed edges, the
//! case of each cube, the number of each vertex.

use pulp::Arch;

use super::tables::TABLE;
use crate::{Real, parallel};

/// Cells in one word.
const WORD: usize = 64;

/// Bit `k % 64` of word `k / 64` of row `(i, j)` is set where cell `(i, j, k)` is inside. Bits past the
/// end of a row are not set.
#[derive(Debug, Default)]
pub(super) struct Signs {
    shape: [usize; 3],
    /// Words in a row.
    pub(super) words: usize,
    bits: Vec<u64>,
}

/// 64 neighboring cubes of a row.
pub(super) struct Block {
    /// Bit `k` of `corners[c]`: whether corner `c` (see [`super::tables`]) of cube `k` is inside.
    corners: [u64; 8],
    /// Bit `k`: whether cube `k` has corners on both sides.
    pub(super) active: u64,
}

impl Block {
    /// Sign pattern of cube `k`.
    #[inline(always)]
    pub(super) fn case(&self, k: u32) -> u8 {
        (0..8).fold(0, |case, c| case | ((self.corners[c] >> k & 1) as u8) << c)
    }
}

impl Signs {
    /// The bits of a field. Returns whether all values are finite.
    pub(super) fn fill<T: Real>(&mut self, values: &[T], shape: [usize; 3], level: T) -> bool {
        let [nx, ny, nz] = shape;
        self.shape = shape;
        let words = nz.div_ceil(WORD);
        self.words = words;
        self.bits.resize(nx * ny * words, 0);
        let plane = |_, (bits, values): (&mut [u64], &[T])| {
            crate::simd::dispatch(
                Arch::new(),
                #[inline(always)]
                || {
                    let rows = bits.chunks_exact_mut(words).zip(values.chunks_exact(nz));
                    rows.fold(true, |finite, (bits, values)| {
                        pack_row(values, level, bits) & finite
                    })
                },
            )
        };
        let planes = self.bits.chunks_exact_mut(ny * words);
        let finite = parallel::map_each(planes.zip(values.chunks_exact(ny * nz)), plane);
        !finite.contains(&false)
    }

    /// Place of word `w` of row `(i, j)`.
    #[inline(always)]
    pub(super) fn word(&self, i: usize, j: usize, w: usize) -> usize {
        (i * self.shape[1] + j) * self.words + w
    }

    /// Words in a plane of constant `x`.
    pub(super) fn plane(&self) -> usize {
        self.shape[1] * self.words
    }

    /// Word `w` of row `(i, j)`, and the same with every bit moved down by one cell.
    #[inline(always)]
    fn pair(&self, i: usize, j: usize, w: usize) -> [u64; 2] {
        let at = self.word(i, j, w);
        let own = self.bits[at];
        let next = if w + 1 < self.words {
            self.bits[at + 1]
        } else {
            0
        };
        [own, own >> 1 | next << (WORD - 1)]
    }

    /// The cells of word `w` that have a neighbor above them in the row.
    #[inline(always)]
    fn has_next(&self, w: usize) -> u64 {
        match self.shape[2] - 1 - w * WORD {
            n if n >= WORD => u64::MAX,
            n => (1 << n) - 1,
        }
    }

    /// Per axis, which of the lattice edges that start from the cells of a word are crossed.
    #[inline(always)]
    pub(super) fn crossed(&self, i: usize, j: usize, w: usize) -> [u64; 3] {
        let [own, above] = self.pair(i, j, w);
        let at = self.word(i, j, w);
        let differs = |there: bool, step: usize| if there { own ^ self.bits[at + step] } else { 0 };
        [
            differs(i + 1 < self.shape[0], self.plane()),
            differs(j + 1 < self.shape[1], self.words),
            (own ^ above) & self.has_next(w),
        ]
    }

    /// The cubes whose low corners are the cells of a word; `i` and `j` have a next plane and row.
    #[inline(always)]
    pub(super) fn block(&self, i: usize, j: usize, w: usize) -> Block {
        let [a, b] = self.pair(i, j, w);
        let [c, d] = self.pair(i, j + 1, w);
        let [e, f] = self.pair(i + 1, j, w);
        let [g, h] = self.pair(i + 1, j + 1, w);
        let corners = [a, b, c, d, e, f, g, h];
        let any = corners.iter().fold(0, |s, c| s | c);
        let all = corners.iter().fold(u64::MAX, |s, c| s & c);
        Block {
            corners,
            active: any & !all & self.has_next(w),
        }
    }

    /// Vertices on the lattice edges that start in plane `i`; `before[w]` becomes the number of them that
    /// come before word `w` of the plane.
    pub(super) fn count_vertices(&self, i: usize, before: &mut [u32]) -> usize {
        crate::simd::dispatch(
            Arch::new(),
            #[inline(always)]
            || {
                let mut count = 0;
                for (at, before) in before.iter_mut().enumerate() {
                    // Wraps only where the surface is refused for its number of vertices.
                    *before = count as u32;
                    let crossed = self.crossed(i, at / self.words, at % self.words);
                    count += crossed
                        .iter()
                        .map(|c| c.count_ones() as usize)
                        .sum::<usize>();
                }
                count
            },
        )
    }

    /// Triangles in the cubes between planes `i` and `i + 1`; none for the last plane.
    pub(super) fn count_faces(&self, i: usize) -> usize {
        let mut count = 0;
        self.for_each_block(i, |_, _, block| {
            for k in ones(block.active) {
                count += TABLE.count(block.case(k));
            }
        });
        count
    }

    /// Calls `visit(j, w, block)` for every block with an active cube between planes `i` and `i + 1`.
    #[inline(always)]
    pub(super) fn for_each_block(&self, i: usize, mut visit: impl FnMut(usize, usize, &Block)) {
        if i + 1 == self.shape[0] {
            return;
        }
        for j in 0..self.shape[1] - 1 {
            for w in 0..self.words {
                let block = self.block(i, j, w);
                if block.active != 0 {
                    visit(j, w, &block);
                }
            }
        }
    }

    /// Number of inside cells.
    pub(super) fn inside(&self) -> usize {
        self.bits.iter().map(|b| b.count_ones() as usize).sum()
    }

    /// Whether an inside cell lies at the low and at the high wall of each axis.
    pub(super) fn walls(&self) -> [[bool; 2]; 3] {
        let [nx, ny, nz] = self.shape;
        let last = nz - 1;
        let bit = |row: &[u64], k: usize| row[k / WORD] >> (k % WORD) & 1 == 1;
        let mut walls = [[false; 2]; 3];
        for (at, row) in self.bits.chunks_exact(self.words).enumerate() {
            let (i, j) = (at / ny, at % ny);
            let any = row.iter().any(|&w| w != 0);
            walls[0][0] |= i == 0 && any;
            walls[0][1] |= i == nx - 1 && any;
            walls[1][0] |= j == 0 && any;
            walls[1][1] |= j == ny - 1 && any;
            walls[2][0] |= bit(row, 0);
            walls[2][1] |= bit(row, last);
        }
        walls
    }
}

/// The places of the set bits, lowest first.
#[inline(always)]
pub(super) fn ones(mut word: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let k = word.trailing_zeros();
        let some = word != 0;
        word &= word.wrapping_sub(1);
        some.then_some(k)
    })
}

/// The bits of one row. Returns whether all its values are finite.
#[inline(always)]
fn pack_row<T: Real>(values: &[T], level: T, bits: &mut [u64]) -> bool {
    let (whole, rest) = values.as_chunks::<WORD>();
    let mut finite = true;
    for (values, bits) in whole.iter().zip(bits.iter_mut()) {
        let (word, good) = pack(values, level);
        *bits = word;
        finite &= good;
    }
    if let (false, Some(bits)) = (rest.is_empty(), bits.get_mut(whole.len())) {
        // The level itself counts as outside.
        let mut padded = [level; WORD];
        padded[..rest.len()].copy_from_slice(rest);
        let (word, good) = pack(&padded, level);
        *bits = word;
        finite &= good;
    }
    finite
}

/// Which of 64 values are below the level, and whether all are finite.
#[inline(always)]
fn pack<T: Real>(values: &[T; WORD], level: T) -> (u64, bool) {
    // One byte a value first: that much the compiler turns into SIMD compares.
    let mut below = [0u8; WORD];
    let mut bad = [0u8; WORD];
    for k in 0..WORD {
        below[k] = u8::from(values[k] < level);
        bad[k] = u8::from(!(values[k].abs() <= T::max_value()));
    }
    let mut word = 0;
    for (place, bytes) in below.as_chunks::<8>().0.iter().enumerate() {
        // The product brings bit 0 of byte b to bit 56 + b.
        let eight = u64::from_le_bytes(*bytes).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        word |= eight << (8 * place);
    }
    (word, bad.iter().fold(0, |s, b| s | b) == 0)
}
