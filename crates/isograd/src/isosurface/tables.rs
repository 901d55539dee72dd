//! The triangles of one cube, for each of its 256 sign patterns.
//!
//! Computed from two rules. *Loops*: on each of the six faces, every run of inside corners is cut off by
//! one segment; the segments of all faces join end to end into closed loops of crossed edges. *Diagonals*:
//! a loop is triangulated without a diagonal between two vertices of the same face, for the cube beyond
//! that face might choose the same one and four triangles would meet there. Every loop has such a
//! triangulation (a test goes through all of them). Of several, the one that encloses the most is taken:
//! two that cut a quadrilateral along one diagonal and the other enclose the same only where it is flat,
//! so the surface does not jump when the choice changes.
//!
//! Corner `4·dx + 2·dy + dz` lies at `(dx, dy, dz)`. Edge `4·axis + 2·u + v` runs along `axis` from the
//! corner whose other two coordinates, in the order x, y, z, are `(u, v)`.

use std::sync::LazyLock;

use crate::Real;
use crate::element::crossing::crossing;
use crate::vector::{cross, dot, sub};

/// Roundings of a volume within which two triangulations count as the same surface: of a cube of volume 1.
pub const TIE: f64 = 64.0;

/// Loops of all cases, one after the other, and their triangles.
pub(super) struct Table {
    /// Loops before each case.
    start: [u16; 257],
    /// Triangles of each case.
    counts: [u8; 256],
    loops: Vec<Loop>,
    triangles: Vec<[u8; 3]>,
}

/// A closed loop of crossed edges of a cube.
#[derive(Clone, Copy, Debug)]
pub struct Loop {
    /// Its first triangle in the list of all.
    first: u16,
    /// Triangles in each triangulation.
    triangles: u8,
    /// Number of triangulations, one after the other.
    triangulations: u8,
}

/// The one table.
pub(super) static TABLE: LazyLock<Table> = LazyLock::new(Table::build);

/// Loops in which the surface cuts the edges of a cube of the lattice, counter-clockwise seen from outside. Corner
/// `4·dx + 2·dy + dz` lies at `(dx, dy, dz)` and is inside where its bit of `case` is set. Edge `4·axis + 2·u + v` runs
/// along `axis` from the corner whose other two coordinates, in the order x, y, z, are `(u, v)`.
pub fn loops_of(case: u8) -> &'static [Loop] {
    TABLE.loops(case)
}

impl Loop {
    /// Its triangulations, that with the shortest diagonals first: triangles, each three edges of the cube.
    pub fn triangulations(&self) -> impl Iterator<Item = &'static [[u8; 3]]> {
        TABLE.triangulations(self)
    }
}

impl Table {
    #[inline(always)]
    fn loops(&self, case: u8) -> &[Loop] {
        let case = case as usize;
        &self.loops[self.start[case] as usize..self.start[case + 1] as usize]
    }

    #[inline(always)]
    fn triangulations(&self, of: &Loop) -> impl Iterator<Item = &[[u8; 3]]> {
        let count = usize::from(of.triangles);
        let all = usize::from(of.triangulations) * count;
        self.triangles[of.first.into()..][..all].chunks_exact(count)
    }

    /// How many triangles the cube has whose corner `c` is inside where bit `c` of `case` is set.
    #[inline(always)]
    pub(super) fn count(&self, case: u8) -> usize {
        self.counts[case as usize].into()
    }

    /// Calls `found` with each triangle, three of its edges, of a cube. If there is a choice, `fractions` is called for
    /// where the vertices lie on their edges, from 0 to 1, given to `T`.
    #[inline(always)]
    pub(super) fn for_each_triangle<T: Real, F: Fn(u8) -> T>(
        &self,
        case: u8,
        fractions: impl FnOnce() -> F,
        mut found: impl FnMut([u8; 3]),
    ) {
        let loops = self.loops(case);
        let is_open = loops.iter().any(|of| of.triangulations > 1);
        let fractions = is_open.then(fractions);
        for of in loops {
            let triangles = self.triangles(of, fractions.as_ref());
            triangles.iter().for_each(|&triangle| found(triangle));
        }
    }

    /// The triangulation of a loop that encloses the most where its vertices lie at these fractions of their edges, which are
    /// needed if there is a choice.
    #[inline(always)]
    fn triangles<T: Real>(&self, of: &Loop, fraction: Option<impl Fn(u8) -> T>) -> &[[u8; 3]] {
        let mut best = &self.triangles[of.first.into()..][..of.triangles.into()];
        if let Some(fraction) = fraction.filter(|_| of.triangulations > 1) {
            let mut vertices = [[0.0; 3]; 12];
            for &edge in best.as_flattened() {
                vertices[edge as usize] = vertex(edge, fraction(edge).f64());
            }
            let mut largest = enclosed(best, &vertices);
            for other in self.triangulations(of).skip(1) {
                let volume = enclosed(other, &vertices);
                if volume > largest + TIE * T::epsilon().f64() {
                    (best, largest) = (other, volume);
                }
            }
        }
        best
    }

    fn build() -> Self {
        let mut table = Self {
            start: [0; 257],
            counts: [0; 256],
            loops: Vec::new(),
            triangles: Vec::new(),
        };
        for case in 0..=255u8 {
            for cycle in loops(case) {
                let all = triangulations(&cycle);
                let of = Loop {
                    first: table.triangles.len() as u16,
                    triangles: (cycle.len() - 2) as u8,
                    triangulations: all.len() as u8,
                };
                table.counts[case as usize] += of.triangles;
                table.loops.push(of);
                table.triangles.extend(all.concat());
            }
            table.start[case as usize + 1] = table.loops.len() as u16;
        }
        table
    }
}

/// Six times the volume between triangles and the first vertex.
#[inline(always)]
fn enclosed(triangles: &[[u8; 3]], vertices: &[[f64; 3]; 12]) -> f64 {
    let origin = vertices[triangles[0][0] as usize];
    let volume = |triangle: &[u8; 3]| {
        let [a, b, c] = triangle.map(|edge| sub(vertices[edge as usize], origin));
        dot(a, cross(b, c))
    };
    // The first triangle has the first vertex.
    triangles[1..].iter().map(volume).sum()
}

/// The point at a fraction of an edge of a cube.
#[inline(always)]
fn vertex(edge: u8, fraction: f64) -> [f64; 3] {
    let (corner, axis) = start(edge);
    let mut point = corner.map(|c| c as f64);
    point[axis] = fraction;
    point
}

/// Where the level lies on an edge, which is crossed, between these values at the corners of the cube.
#[inline(always)]
pub(super) fn fraction<T: Real>(edge: u8, values: &[T; 8], level: T) -> T {
    let (corner, axis) = start(edge);
    let from = 4 * corner[0] + 2 * corner[1] + corner[2];
    crossing(values[from], values[from + usize::from(BIT[axis])], level)
}

/// The two faces of the cube that an edge lies on, as bits: `2·axis` of the low one and `2·axis + 1` of the high one.
#[inline(always)]
fn faces_of(edge: u8) -> u8 {
    let (corner, axis) = start(edge);
    let face = |a: usize| 1 << (2 * a + corner[a]);
    (0..3).filter(|&a| a != axis).map(face).sum()
}

/// The corner from which an edge runs, and its axis.
#[inline(always)]
pub(super) fn start(edge: u8) -> ([usize; 3], usize) {
    let (axis, u, v) = (edge as usize / 4, edge as usize / 2 % 2, edge as usize % 2);
    ([[0, u, v], [u, 0, v], [u, v, 0]][axis], axis)
}

/// Weight of each axis in the number of a corner.
const BIT: [u8; 3] = [4, 2, 1];

/// The edge between two neighboring corners.
fn edge(a: u8, b: u8) -> u8 {
    let low = a & b;
    match a ^ b {
        4 => low & 3,
        2 => 4 + ((low >> 1) & 2 | low & 1),
        _ => 8 + (low >> 1),
    }
}

/// The four corners of each face, counter-clockwise seen from outside the cube.
fn faces() -> [[u8; 4]; 6] {
    std::array::from_fn(|f| {
        let (axis, high) = (f / 2, f % 2 == 1);
        let (u, v) = (BIT[(axis + 1) % 3], BIT[(axis + 2) % 3]);
        if high {
            [0, u, u | v, v].map(|c| c | BIT[axis])
        } else {
            [0, v, u | v, u]
        }
    })
}

/// The loops of crossed edges of a case, each counter-clockwise seen from outside the surface.
pub(super) fn loops(case: u8) -> Vec<Vec<u8>> {
    let mut next = successors(case);
    let mut all = Vec::new();
    for start in 0..12 {
        let mut cycle = Vec::new();
        let mut e = start;
        while let Some(after) = next[e as usize].take() {
            cycle.push(e);
            e = after;
        }
        if !cycle.is_empty() {
            all.push(cycle);
        }
    }
    all
}

/// For each crossed edge the next one of its loop. A face is walked around its corners; each run of inside
/// corners gives the segment from the edge where the walk enters it to the edge where the walk leaves.
fn successors(case: u8) -> [Option<u8>; 12] {
    let inside = |corner: u8| case >> corner & 1 == 1;
    let mut next = [None; 12];
    for corners in faces() {
        for i in 0..4 {
            let (before, first) = (corners[(i + 3) % 4], corners[i]);
            if inside(before) || !inside(first) {
                continue;
            }
            let mut last = i;
            while inside(corners[(last + 1) % 4]) {
                last += 1;
            }
            let leaves = edge(corners[last % 4], corners[(last + 1) % 4]);
            next[edge(before, first) as usize] = Some(leaves);
        }
    }
    next
}

/// Whether two edges lie on one face of the cube.
pub(super) fn share_face(a: u8, b: u8) -> bool {
    faces_of(a) & faces_of(b) != 0
}

/// All triangulations of a loop, none with a diagonal within a face of the cube, those with the shortest diagonals (the
/// vertices taken at the middle of their edges) first.
pub(super) fn triangulations(cycle: &[u8]) -> Vec<Vec<[u8; 3]>> {
    let mut all = cover(cycle, 0, cycle.len() - 1);
    all.sort_by_key(|(squares, _)| *squares);
    all.into_iter().map(|(_, triangles)| triangles).collect()
}

/// All ways to cut the part of a loop between its vertices `i` and `j` into triangles, each with its sum of squared
/// diagonals. A loop has seven vertices at most.
fn cover(cycle: &[u8], i: usize, j: usize) -> Vec<(u32, Vec<[u8; 3]>)> {
    if j == i + 1 {
        return vec![(0, Vec::new())];
    }
    let whole = i == 0 && j + 1 == cycle.len();
    if !whole && share_face(cycle[i], cycle[j]) {
        return Vec::new();
    }
    let own = match whole {
        true => 0,
        false => distance_squared(cycle[i], cycle[j]),
    };
    let mut all = Vec::new();
    for k in i + 1..j {
        let (left, right) = (cover(cycle, i, k), cover(cycle, k, j));
        for (a, left) in &left {
            for (b, right) in &right {
                let mut triangles = vec![[cycle[i], cycle[k], cycle[j]]];
                triangles.extend(left);
                triangles.extend(right);
                all.push((own + a + b, triangles));
            }
        }
    }
    all
}

/// Squared distance between the middles of two edges, in half edge lengths.
fn distance_squared(a: u8, b: u8) -> u32 {
    let (a, b) = (middle(a), middle(b));
    (0..3).map(|d| a[d].abs_diff(b[d]).pow(2)).sum()
}

/// Middle of an edge, in half edge lengths.
fn middle(e: u8) -> [u32; 3] {
    let (u, v) = (2 * u32::from(e >> 1 & 1), 2 * u32::from(e & 1));
    match e / 4 {
        0 => [1, u, v],
        1 => [u, 1, v],
        _ => [u, v, 1],
    }
}

#[cfg(test)]
mod tests;
