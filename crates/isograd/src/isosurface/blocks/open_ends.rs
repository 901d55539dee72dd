//! Where a surface leaves the blocks of its field.

use super::WIDE;
use crate::data::blocks::{BlockField, EDGE};
use crate::{Real, parallel};

/// Absent blocks into which the surface `χ = level` continues.
pub(crate) fn open_ends<T: Real>(chi: &BlockField<T>, level: T) -> Vec<[usize; 3]> {
    let blocks = &chi.blocks;
    let shape = blocks.cells().map(|n| n.div_ceil(EDGE));
    let of_block = |block: usize| {
        let place = blocks.corner(block).map(|c| c / EDGE);
        let mut inside = None;
        let mut found = Vec::new();
        for next in 0..27 {
            let step = [next / 9, next / 3 % 3, next % 3];
            let at: [Option<usize>; 3] = std::array::from_fn(|a| {
                let at = (place[a] + step[a]).checked_sub(1)?;
                (at < shape[a]).then_some(at)
            });
            let [Some(x), Some(y), Some(z)] = at else {
                continue;
            };
            if blocks.at([x, y, z]).is_some() {
                continue;
            }
            let inside = inside.get_or_insert_with(|| surroundings(chi, level, block));
            if is_mixed(inside, step) {
                found.push([x, y, z]);
            }
        }
        found
    };
    parallel::map(blocks.len(), of_block).concat()
}

/// Whether cells that touch the neighboring block in the direction `step − 1` are on both sides.
fn is_mixed(inside: &[Option<bool>], step: [usize; 3]) -> bool {
    let [x, y, z] = step.map(|s| match s {
        0 => 1..2,
        1 => 0..WIDE,
        _ => EDGE..EDGE + 1,
    });
    let mut sides = [false; 2];
    for i in x {
        for j in y.clone() {
            for k in z.clone() {
                if let Some(inside) = inside[(i * WIDE + j) * WIDE + k] {
                    sides[usize::from(inside)] = true;
                }
            }
        }
    }
    sides == [true; 2]
}

/// Signs at a block and the cells around it; `None` where there is no value.
fn surroundings<T: Real>(chi: &BlockField<T>, level: T, block: usize) -> Vec<Option<bool>> {
    let corner = chi.blocks.corner(block);
    let sign = |place: usize| {
        let step = [place / WIDE / WIDE, place / WIDE % WIDE, place % WIDE];
        let mut cell = [0; 3];
        for a in 0..3 {
            cell[a] = (corner[a] + step[a]).checked_sub(1)?;
            if cell[a] >= chi.blocks.cells()[a] {
                return None;
            }
        }
        chi.get(cell).map(|value| value < level)
    };
    (0..WIDE * WIDE * WIDE).map(sign).collect()
}
