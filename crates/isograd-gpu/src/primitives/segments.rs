//! Sums over segments of an array, each of any length, in a fixed order.
//!
//! Segments are cut into pieces of at most [`PIECE`] elements, each summed by one unit; then the sums of the
//! pieces of a segment are its elements, and so on until no segment has more than one piece's worth. No unit
//! sums more, however the elements are spread, and nothing is downloaded: the number of pieces is bounded by
//! the numbers of segments and elements.

use cubecl::prelude::*;

use super::scan::exclusive_sum;
use crate::device::{Ready, launch};
use crate::{Buffer, Device, Error, Scalar};

/// Units of a group.
const BLOCK: u32 = 256;

/// Most elements of a piece.
pub(crate) const PIECE: usize = 64;

/// Segment of an unused row of the table of pieces.
pub(crate) const NO_SEGMENT: u32 = u32::MAX;

/// Pieces of segments. Clones share the memory.
#[derive(Clone)]
pub(crate) struct Pieces {
    /// `(P, 3)`: segment, first element, and one past the last; [`NO_SEGMENT`] in those that are too many.
    pub table: Buffer<u32>,
    /// The first piece of each segment, and their number.
    pub starts: Buffer<u32>,
}

/// Layout of the rows of a sum in memory.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub(crate) struct Rows {
    /// Numbers of a row, each summed for itself.
    pub width: usize,
    /// Rows that lie one after another...
    pub group: usize,
    /// ...before the next ones, which begin so many numbers further on.
    pub pitch: usize,
}

impl Rows {
    /// Rows without anything between them.
    pub fn dense(width: usize) -> Self {
        Self {
            width,
            group: 1,
            pitch: width,
        }
    }
}

impl Pieces {
    /// Cuts the segments that begin at `starts`, whose last entry is the end of the last one. They have at most
    /// `elements` elements in all.
    pub fn new<R: Runtime>(
        device: &Device<R>,
        starts: &Buffer<u32>,
        elements: usize,
    ) -> Result<Self, Error> {
        let segments = starts.len() - 1;
        let counts = device.empty(segments)?;
        launch!(device, segments, BLOCK => count_pieces(
            starts, counts, segments as u32, PIECE as u32,
        ));
        let first = exclusive_sum(device, &counts)?;
        let most = segments + elements / PIECE;
        let table = device.empty(3 * most)?;
        launch!(device, most, BLOCK => list_pieces(
            starts, first, table, segments as u32, most as u32, PIECE as u32,
        ));
        Ok(Self {
            table,
            starts: first,
        })
    }

    /// The most pieces that there can be.
    pub fn most(&self) -> usize {
        self.table.len() / 3
    }
}

/// The `(S, width)` sums of the rows of each segment. Element `i` is row `places[i]`; without places, row `i`.
/// `starts` are those of the segments, `elements` is how many they have in all, at most.
pub(crate) fn sum_rows<T: Scalar, R: Runtime>(
    device: &Device<R>,
    values: &Buffer<T>,
    rows: Rows,
    places: Option<&Buffer<u32>>,
    starts: &Buffer<u32>,
    elements: usize,
) -> Result<Buffer<T>, Error> {
    let pieces = Pieces::new(device, starts, elements)?;
    let sums = device.empty(pieces.most() * rows.width)?;
    launch!(device, sums.len(), BLOCK => sum_pieces<T>(
        values, places.unwrap_or(&device.empty(0)?), pieces.table, sums, pieces.most() as u32,
        Ready::new(rows), places.is_some(),
    ));
    join_pieces(device, sums, rows.width, pieces, elements)
}

/// The `(S, width)` sums of segments from the `(P, width)` sums of their pieces. No segment has more than
/// `elements` elements.
pub(crate) fn join_pieces<T: Scalar, R: Runtime>(
    device: &Device<R>,
    sums: Buffer<T>,
    width: usize,
    pieces: Pieces,
    elements: usize,
) -> Result<Buffer<T>, Error> {
    let most = elements.div_ceil(PIECE);
    if most > PIECE {
        let (rows, count) = (Rows::dense(width), pieces.most());
        let finer = Pieces::new(device, &pieces.starts, count)?;
        let joined = device.empty(finer.most() * width)?;
        launch!(device, joined.len(), BLOCK => sum_pieces<T>(
            sums, device.empty::<u32>(0)?, finer.table, joined, finer.most() as u32,
            Ready::new(rows), false,
        ));
        return join_pieces(device, joined, width, finer, most);
    }
    let segments = pieces.starts.len() - 1;
    let joined = device.empty(segments * width)?;
    launch!(device, joined.len(), BLOCK => sum_segments<T>(
        sums, pieces.starts, joined, segments as u32, width,
    ));
    Ok(joined)
}

#[cube(launch)]
fn count_pieces(starts: &Array<u32>, counts: &mut Array<u32>, segments: u32, piece: u32) {
    if ABSOLUTE_POS < segments as usize {
        let length = starts[ABSOLUTE_POS + 1] - starts[ABSOLUTE_POS];
        let whole = length / piece;
        counts[ABSOLUTE_POS] = select(whole * piece < length, whole + 1u32, whole);
    }
}

/// The segment of a piece by bisection: the last one whose first piece is not after it.
#[cube(launch)]
fn list_pieces(
    starts: &Array<u32>,
    first: &Array<u32>,
    table: &mut Array<u32>,
    segments: u32,
    most: u32,
    piece: u32,
) {
    if ABSOLUTE_POS < most as usize {
        let own = ABSOLUTE_POS as u32;
        let at = ABSOLUTE_POS * 3;
        if own < first[segments as usize] {
            let mut low = 0u32.runtime();
            let mut high = segments;
            while high - low > 1u32 {
                let middle = (low + high) / 2u32;
                if first[middle as usize] <= own {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let begin = starts[low as usize] + (own - first[low as usize]) * piece;
            table[at] = low;
            table[at + 1] = begin;
            table[at + 2] = min(begin + piece, starts[low as usize + 1]);
        } else {
            table[at] = NO_SEGMENT;
            table[at + 1] = 0u32;
            table[at + 2] = 0u32;
        }
    }
}

/// One unit sums one column of one piece.
#[cube(launch)]
fn sum_pieces<F: Float>(
    values: &Array<F>,
    places: &Array<u32>,
    table: &Array<u32>,
    sums: &mut Array<F>,
    most: u32,
    #[comptime] rows: Rows,
    #[comptime] by_place: bool,
) {
    let piece = ABSOLUTE_POS / rows.width;
    let column = ABSOLUTE_POS % rows.width;
    if piece < most as usize {
        let mut sum = F::new(0.0);
        for element in table[piece * 3 + 1]..table[piece * 3 + 2] {
            let mut row = element as usize;
            if comptime!(by_place) {
                row = places[element as usize] as usize;
            }
            sum += values[row / rows.group * rows.pitch + row % rows.group * rows.width + column];
        }
        sums[ABSOLUTE_POS] = sum;
    }
}

/// One unit sums one column of one segment.
#[cube(launch)]
fn sum_segments<F: Float>(
    sums: &Array<F>,
    starts: &Array<u32>,
    joined: &mut Array<F>,
    segments: u32,
    #[comptime] width: usize,
) {
    let segment = ABSOLUTE_POS / width;
    let column = ABSOLUTE_POS % width;
    if segment < segments as usize {
        let mut sum = F::new(0.0);
        for piece in starts[segment]..starts[segment + 1] {
            sum += sums[piece as usize * width + column];
        }
        joined[ABSOLUTE_POS] = sum;
    }
}
