//! Segments of the surface in the squares of the lattice that are split at their midpoints.

use rayon::prelude::*;

use super::polygon::{Corner, Polygon};
use super::{Corners, Places, Square, Vertices, cells, plus, sides, with_next};
use crate::Grid;
use crate::Real;
use crate::data::Mesh;
use crate::data::blocks::{Blocks, EDGE};
use crate::isosurface::march::position;
use crate::isosurface::tables::{self, Loop};

/// A segment between two vertices that is split at its midpoint.
#[derive(Clone, Debug)]
struct Split<T> {
    /// `3·node + axis`, with the place of the low corner of the square in its block.
    square: u16,
    ends: [u32; 2],
    /// Along both sides of the square, from 0 to 1.
    place: [T; 2],
}

/// Those of all blocks.
pub(super) struct Splits<T> {
    /// In the order of their squares.
    blocks: Vec<Vec<Split<T>>>,
    /// Number of the first midpoint of each block among the vertices of the mesh.
    first: Vec<u32>,
}

/// Those of a block and the next ones.
pub(super) struct Near<'a, T> {
    splits: &'a Splits<T>,
    /// `None` where no segment is split.
    blocks: [Option<usize>; 8],
}

impl<T: Real> Splits<T> {
    pub(super) fn new<P: Places<T>>(vertices: &Vertices<T>, level: T, places: &P) -> Self {
        let blocks = 0..vertices.crossings.len();
        let of_block = |block: usize| match P::SPLITS && vertices.crossings[block].is_mixed {
            true => of_block(vertices, level, places, block),
            false => Vec::new(),
        };
        let blocks: Vec<Vec<Split<T>>> = blocks.into_par_iter().map(of_block).collect();
        let mut next = vertices.fractions.len();
        let first = blocks.iter().map(|splits| {
            let first = next;
            next += splits.len();
            first as u32
        });
        Self {
            first: first.collect(),
            blocks,
        }
    }

    /// Number of all.
    pub(super) fn len(&self) -> usize {
        self.blocks.iter().map(Vec::len).sum()
    }

    /// Appends the midpoints to the vertices of a mesh on the lattice of `grid`.
    pub(super) fn add_to(&self, grid: &Grid<T>, blocks: &Blocks, mesh: &mut Mesh<T>) {
        for (block, splits) in self.blocks.iter().enumerate() {
            for split in splits {
                let square = split.square as usize;
                let cell = plus(blocks.corner(block), Blocks::cell_of(square / 3));
                let ahead = sides(square % 3).into_iter().zip(split.place);
                mesh.vertices.push(position(grid, cell, ahead));
                mesh.midpoints.push(split.ends);
            }
        }
    }

    /// Those of the squares of the cubes of a block.
    pub(super) fn near(&self, blocks: &Blocks, block: usize) -> Near<'_, T> {
        let is_split = |block: &usize| !self.blocks[*block].is_empty();
        Near {
            splits: self,
            blocks: with_next(blocks, block).map(|next| next.filter(is_split)),
        }
    }
}

impl<T: Real> Near<'_, T> {
    /// The loop `of` of the cube `cell` of the block with the midpoints of its segments; `None` if no one is split.
    #[inline(always)]
    pub(super) fn polygon(
        &self,
        cell: [usize; 3],
        of: &Loop,
        vertex: impl Fn(u8) -> u32,
        fraction: impl Fn(u8) -> T,
    ) -> Option<Polygon> {
        if self.blocks == [None; 8] {
            return None;
        }
        let cycle = of.cycle();
        let mut corners = Vec::with_capacity(2 * cycle.len());
        for (n, &edge) in cycle.iter().enumerate() {
            let next = cycle[(n + 1) % cycle.len()];
            corners.push(Corner {
                vertex: vertex(edge),
                place: tables::vertex(edge, fraction(edge).f64()),
                faces: tables::faces_of(edge),
            });
            let face = tables::faces_of(edge) & tables::faces_of(next);
            corners.extend(self.midpoint(cell, face, [vertex(edge), vertex(next)]));
        }
        (corners.len() > cycle.len()).then_some(Polygon { corners })
    }

    /// The midpoint of the segment between two vertices on a face, one bit of [`tables::faces_of`], of a cube.
    fn midpoint(&self, cell: [usize; 3], face: u8, ends: [u32; 2]) -> Option<Corner> {
        let number = face.trailing_zeros() as usize;
        let (axis, high) = (number / 2, number % 2);
        let mut low = cell;
        low[axis] += high;
        let [x, y, z] = low.map(|c| c / EDGE);
        let block = self.blocks[4 * x + 2 * y + z]?;
        let square = (3 * Blocks::node(low) + axis) as u16;
        let splits = &self.splits.blocks[block];
        let from = splits.partition_point(|split| split.square < square);
        let [a, b] = ends;
        let is_it = |split: &Split<T>| split.ends == [a, b] || split.ends == [b, a];
        let of_square = splits[from..]
            .iter()
            .take_while(|split| split.square == square);
        let found = from + of_square.into_iter().position(is_it)?;
        let mut place = [0.0; 3];
        place[axis] = high as f64;
        for (side, along) in sides(axis).into_iter().zip(splits[found].place) {
            place[side] = along.f64();
        }
        Some(Corner {
            vertex: self.splits.first[block] + found as u32,
            place,
            faces: face,
        })
    }
}

/// Those in the squares whose low corners are in a block.
fn of_block<T: Real>(
    vertices: &Vertices<T>,
    level: T,
    places: &impl Places<T>,
    block: usize,
) -> Vec<Split<T>> {
    let corners = Corners::new(vertices.chi, level, block);
    let corner = vertices.chi.blocks.corner(block);
    let mut found = Vec::new();
    for cell in cells() {
        for axis in 0..3 {
            let [b, c] = sides(axis).map(|side| std::array::from_fn(|a| usize::from(a == side)));
            let signs = [cell, plus(cell, b), plus(cell, c), plus(plus(cell, b), c)];
            let signs = signs.map(|cell| corners.at(cell));
            let [Some(low), Some(beside), Some(above), Some(high)] = signs else {
                continue;
            };
            let square = Square {
                cell: plus(corner, cell),
                axis,
            };
            for segment in segments([low, beside, above, high]) {
                let ends = segment.map(|edge| {
                    let (start, side) = match edge {
                        0 => (cell, 0),
                        1 => (plus(cell, b), 1),
                        2 => (plus(cell, c), 0),
                        _ => (cell, 1),
                    };
                    vertices.number(block, start, sides(axis)[side])
                });
                let at = |n: usize| {
                    let fraction = vertices.fractions[ends[n] as usize];
                    match segment[n] {
                        0 => [fraction, T::zero()],
                        1 => [T::one(), fraction],
                        2 => [fraction, T::one()],
                        _ => [T::zero(), fraction],
                    }
                };
                if let Some(place) = places.in_square(square, [at(0), at(1)]) {
                    found.push(Split {
                        square: (3 * Blocks::node(cell) + axis) as u16,
                        ends,
                        place,
                    });
                }
            }
        }
    }
    found
}

/// Segments of the surface in a square, from the signs of its corners: the low one, the next ones along its first and its
/// second side, and the high one. Each joins two edges: 0 and 2 along the first side, 3 and 1 along the second one.
fn segments([low, beside, above, high]: [bool; 4]) -> impl Iterator<Item = [u8; 2]> {
    let crossed = [low != beside, beside != high, above != high, low != above];
    let [first, second] = match crossed {
        [true, true, true, true] if low => [Some([3, 0]), Some([1, 2])],
        [true, true, true, true] => [Some([0, 1]), Some([2, 3])],
        [true, true, _, _] => [Some([0, 1]), None],
        [true, _, true, _] => [Some([0, 2]), None],
        [true, _, _, true] => [Some([3, 0]), None],
        [_, true, true, _] => [Some([1, 2]), None],
        [_, true, _, true] => [Some([1, 3]), None],
        [_, _, true, true] => [Some([2, 3]), None],
        _ => [None, None],
    };
    [first, second].into_iter().flatten()
}
