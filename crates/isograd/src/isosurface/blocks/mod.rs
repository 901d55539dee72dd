//! Marching cubes on the blocks of a field: vertices, triangles and rules are those of [`forward`](super::forward), vertices
//! and faces in the order of the blocks.

mod open_ends;

use rayon::prelude::*;

use super::march::{position, split};
use super::signs::ones;
use super::tables::{self, TABLE};
use super::{Error, Report};
pub(crate) use open_ends::open_ends;

use crate::data::blocks::{BlockField, Blocks, EDGE, NODES};
use crate::data::cells::Cells;
use crate::data::{LatticeEdge, Mesh};
use crate::element::crossing::crossing;
use crate::{Real, parallel};

/// Cells along each side of a block and the first ones of the next blocks.
const SIDE: usize = EDGE + 1;

/// Cells along each side of a block with one more all round.
const WIDE: usize = EDGE + 2;

/// Crossed edges and triangles of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Crossings {
    /// Per axis and plane of cells, which of the edges that start there are crossed.
    crossed: [[u64; EDGE]; 3],
    /// Number of vertices of the block before those.
    before: [[u16; EDGE]; 3],
    vertices: usize,
    faces: usize,
    first_vertex: usize,
    inside: usize,
    walls: [[bool; 2]; 3],
    is_finite: bool,
}

/// Signs at a block and the first cells of the next ones.
struct Corners {
    /// `(SIDE, SIDE, SIDE)`; `None` where there is no value.
    inside: Vec<Option<bool>>,
}

/// Where a vertex lies on its edge, from 0 to 1: linearly between the values at the ends.
#[inline(always)]
pub(crate) fn linear<T: Real>(chi: &BlockField<T>, level: T, edge: LatticeEdge) -> T {
    let [low, high] = Cells::from(chi).ends(edge);
    crossing(low, high, level)
}

/// Writes the surface `χ = level` of a field in blocks into `mesh`, in the user's unit, each vertex at the fraction
/// `place` of its edge. A cube without a value at each of its corners has no triangles. The same bits for any number of threads.
///
/// # Errors
/// As [`forward`](super::forward).
pub(crate) fn forward<T: Real>(
    chi: &BlockField<T>,
    level: T,
    place: &(dyn Fn(LatticeEdge) -> T + Sync),
    mesh: &mut Mesh<T>,
) -> Result<Report, Error> {
    mesh.clear();
    if !level.is_finite() {
        return Err(Error::Level { level: level.f64() });
    }
    let blocks = 0..chi.blocks.len();
    let mut crossings: Vec<Crossings> = blocks
        .into_par_iter()
        .map(|block| Crossings::new(chi, level, block))
        .collect();
    if let Some(block) = crossings.iter().position(|of| !of.is_finite) {
        return Err(Error::NotFinite {
            cell: chi.blocks.corner(block),
            value: f64::NAN,
        });
    }
    let [mut vertices, mut faces, mut inside] = [0; 3];
    let mut walls = [[false; 2]; 3];
    for of in &mut crossings {
        of.first_vertex = vertices;
        vertices += of.vertices;
        faces += of.faces;
        inside += of.inside;
        for (wall, touched) in walls
            .as_flattened_mut()
            .iter_mut()
            .zip(of.walls.as_flattened())
        {
            *wall |= touched;
        }
    }
    if faces == 0 {
        return Err(one_sided(chi, level, inside == 0));
    }
    if vertices >= u32::MAX as usize {
        return Err(Error::TooManyVertices { vertices });
    }
    mesh.edges.resize(vertices, LatticeEdge::new(0, 0));
    let edges = split(&mut mesh.edges, crossings.iter().map(|of| of.vertices));
    let work = edges.into_par_iter().enumerate();
    work.for_each(|(block, edges)| find_edges(chi, block, &crossings[block], edges));
    let edges = &mesh.edges;
    let fractions = parallel::map(edges.len(), |i| place(edges[i]));
    parallel::fill(&mut mesh.vertices, edges.len(), |i| {
        let cell = chi.grid.cell(edges[i].cell());
        position(&chi.grid, cell, edges[i].axis(), fractions[i])
    });
    let vertices = Vertices {
        chi,
        crossings: &crossings,
        fractions: &fractions,
    };
    let blocks = (0..chi.blocks.len()).into_par_iter();
    let blocks = blocks.filter(|&block| crossings[block].faces > 0);
    let faces = blocks.flat_map_iter(|block| faces_of(&vertices, level, block));
    mesh.faces.par_extend(faces);
    Ok(Report {
        touches_wall: walls.as_flattened().contains(&true),
        walls,
        inside,
    })
}

impl Corners {
    fn new<T: Real>(chi: &BlockField<T>, level: T, block: usize) -> Self {
        let (blocks, corner) = (&chi.blocks, chi.blocks.corner(block));
        let next = with_next(blocks, block);
        let sign = |at: usize| {
            let cell = [at / SIDE / SIDE, at / SIDE % SIDE, at % SIDE];
            let [x, y, z] = cell.map(|c| c / EDGE);
            let block = next[4 * x + 2 * y + z]?;
            let is_inside = (0..3).all(|a| corner[a] + cell[a] < blocks.cells()[a]);
            let node = Blocks::node(cell);
            is_inside.then(|| chi.values[block * NODES + node] < level)
        };
        Self {
            inside: (0..SIDE * SIDE * SIDE).map(sign).collect(),
        }
    }

    #[inline(always)]
    fn at(&self, [i, j, k]: [usize; 3]) -> Option<bool> {
        self.inside[(i * SIDE + j) * SIDE + k]
    }

    /// Sign pattern of a cube; `None` without a value at a corner.
    #[inline(always)]
    fn case(&self, [i, j, k]: [usize; 3]) -> Option<u8> {
        let mut case = 0;
        for c in 0..8 {
            let inside = self.at([i + (c >> 2), j + (c >> 1 & 1), k + (c & 1)])?;
            case |= u8::from(inside) << c;
        }
        Some(case)
    }
}

/// A block and those after it, block `4·dx + 2·dy + dz` that which is so many further along each axis.
fn with_next(blocks: &Blocks, block: usize) -> [Option<usize>; 8] {
    let place = blocks.corner(block).map(|c| c / EDGE);
    std::array::from_fn(|n| {
        let at = plus(place, [n >> 2, n >> 1 & 1, n & 1]);
        let is_inside = (0..3).all(|a| at[a] * EDGE < blocks.cells()[a]);
        is_inside.then(|| blocks.at(at)).flatten()
    })
}

/// The cells of a block.
fn cells() -> impl Iterator<Item = [usize; 3]> {
    (0..NODES).map(Blocks::cell_of)
}

impl Crossings {
    fn new<T: Real>(chi: &BlockField<T>, level: T, block: usize) -> Self {
        let own = &chi.values[block * NODES..(block + 1) * NODES];
        let mut of = Self {
            is_finite: own.iter().all(|value| value.is_finite()),
            ..Self::default()
        };
        let corners = Corners::new(chi, level, block);
        of.count_inside(chi, block, &corners);
        let has = |side: bool| corners.inside.contains(&Some(side));
        if !has(true) || !has(false) {
            return of;
        }
        for cell in cells() {
            let Some(inside) = corners.at(cell) else {
                continue;
            };
            for axis in 0..3 {
                let mut next = cell;
                next[axis] += 1;
                if corners.at(next).is_some_and(|other| other != inside) {
                    of.crossed[axis][cell[0]] |= 1 << (EDGE * cell[1] + cell[2]);
                }
            }
            if let Some(case) = corners.case(cell) {
                of.faces += TABLE.count(case);
            }
        }
        let words = of.crossed.as_flattened().iter();
        for (word, before) in words.zip(of.before.as_flattened_mut()) {
            *before = of.vertices as u16;
            of.vertices += word.count_ones() as usize;
        }
        of
    }

    fn count_inside<T: Real>(&mut self, chi: &BlockField<T>, block: usize, corners: &Corners) {
        let (corner, shape) = (chi.blocks.corner(block), chi.blocks.cells());
        for cell in cells().filter(|&cell| corners.at(cell) == Some(true)) {
            self.inside += 1;
            for a in 0..3 {
                let at = corner[a] + cell[a];
                self.walls[a][0] |= at == 0;
                self.walls[a][1] |= at == shape[a] - 1;
            }
        }
    }

    /// Number of the vertex on the edge from a cell of the block along an axis.
    #[inline(always)]
    fn vertex(&self, axis: usize, [i, j, k]: [usize; 3]) -> u32 {
        let below = (1u64 << (EDGE * j + k)) - 1;
        let own = (self.crossed[axis][i] & below).count_ones();
        self.first_vertex as u32 + u32::from(self.before[axis][i]) + own
    }
}

/// The crossed edges that start in a block.
fn find_edges<T: Real>(
    chi: &BlockField<T>,
    block: usize,
    of: &Crossings,
    edges: &mut [LatticeEdge],
) {
    let corner = chi.blocks.corner(block);
    let mut places = edges.iter_mut();
    for (n, word) in of.crossed.as_flattened().iter().enumerate() {
        let (axis, i) = (n / EDGE, n % EDGE);
        for bit in ones(*word) {
            let (j, k) = (bit as usize / EDGE, bit as usize % EDGE);
            if let Some(place) = places.next() {
                *place = LatticeEdge::new(chi.grid.index(plus(corner, [i, j, k])), axis);
            }
        }
    }
}

fn plus(a: [usize; 3], b: [usize; 3]) -> [usize; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The vertices on the edges of the lattice.
struct Vertices<'a, T> {
    chi: &'a BlockField<T>,
    crossings: &'a [Crossings],
    /// Where each lies on its edge.
    fractions: &'a [T],
}

impl<T: Real> Vertices<'_, T> {
    /// Number of the vertex on the edge along an axis from a cell that is counted from the corner of a block.
    #[inline(always)]
    fn number(&self, block: usize, cell: [usize; 3], axis: usize) -> u32 {
        let place = self.chi.blocks.corner(block).map(|c| c / EDGE);
        let owner = self.chi.blocks.at(plus(place, cell.map(|c| c / EDGE)));
        let local = cell.map(|c| c % EDGE);
        owner.map_or(0, |owner| self.crossings[owner].vertex(axis, local))
    }
}

/// The triangles of a block.
fn faces_of<T: Real>(vertices: &Vertices<T>, level: T, block: usize) -> Vec<[u32; 3]> {
    let corners = Corners::new(vertices.chi, level, block);
    let mut faces = Vec::with_capacity(vertices.crossings[block].faces);
    for cell in cells() {
        let case = corners.case(cell).unwrap_or(0);
        let vertex = |edge: u8| {
            let (corner, axis) = tables::start(edge);
            vertices.number(block, plus(cell, corner), axis)
        };
        let fraction = |edge: u8| vertices.fractions[vertex(edge) as usize];
        let add = |triangle: [u8; 3]| faces.push(triangle.map(vertex));
        TABLE.for_each_triangle(case, || fraction, add);
    }
    faces
}

fn one_sided<T: Real>(chi: &BlockField<T>, level: T, nothing_inside: bool) -> Error {
    let wider = |[low, high]: [f64; 2], v: &T| [low.min(v.f64()), high.max(v.f64())];
    let [min, max] = chi
        .values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], wider);
    let level = level.f64();
    match nothing_inside {
        true => Error::NothingInside { level, min, max },
        false => Error::NothingOutside { level, min, max },
    }
}
