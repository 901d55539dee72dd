//! Marching cubes on the blocks of a field: vertices, triangles and rules are those of [`forward`](super::forward), vertices
//! and faces in the order of the blocks.

mod open_ends;

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

/// Bits of the cells of the block in a row of [`Corners`].
const OWN_CELLS: u16 = (1 << EDGE) - 1;

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
    /// See [`with_next`].
    owners: [Option<usize>; 8],
    /// Rows along z, `(SIDE, SIDE)`, a bit for each cell: whether it has a value, and whether that is inside.
    has_value: [u16; SIDE * SIDE],
    inside: [u16; SIDE * SIDE],
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
    let mut crossings = parallel::map(chi.blocks.len(), |block| Crossings::new(chi, level, block));
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
    parallel::each(edges, |block, edges| {
        find_edges(chi, block, &crossings[block], edges);
    });
    let edges = &mesh.edges;
    let fractions = parallel::map(edges.len(), |i| place(edges[i]));
    parallel::fill(&mut mesh.vertices, edges.len(), |i| {
        let cell = chi.grid.cell(edges[i].cell());
        position(&chi.grid, cell, edges[i].axis(), fractions[i])
    });
    mesh.faces.resize(faces, [0; 3]);
    let faces = split(&mut mesh.faces, crossings.iter().map(|of| of.faces));
    parallel::each(faces, |block, faces| {
        if !faces.is_empty() {
            fill_faces((chi, level), &crossings, &fractions, block, faces);
        }
    });
    Ok(Report {
        touches_wall: walls.as_flattened().contains(&true),
        walls,
        inside,
    })
}

impl Corners {
    fn new<T: Real>(chi: &BlockField<T>, level: T, block: usize) -> Self {
        let (blocks, corner) = (&chi.blocks, chi.blocks.corner(block));
        let room: [usize; 3] = std::array::from_fn(|a| (blocks.cells()[a] - corner[a]).min(SIDE));
        let mut of = Self {
            owners: with_next(blocks, block),
            has_value: [0; SIDE * SIDE],
            inside: [0; SIDE * SIDE],
        };
        for i in 0..room[0] {
            for j in 0..room[1] {
                let row = i * SIDE + j;
                for (first, length) in
                    [(0, room[2].min(EDGE)), (EDGE, room[2].saturating_sub(EDGE))]
                {
                    let cell = [i, j, first];
                    let Some(owner) = of.owner(cell) else {
                        continue;
                    };
                    let node = owner * NODES + Blocks::node(cell);
                    for (k, &value) in chi.values[node..node + length].iter().enumerate() {
                        of.has_value[row] |= 1 << (first + k);
                        of.inside[row] |= u16::from(value < level) << (first + k);
                    }
                }
            }
        }
        of
    }

    /// The block that a cell, counted from the corner of this one, belongs to.
    #[inline(always)]
    fn owner(&self, cell: [usize; 3]) -> Option<usize> {
        let [x, y, z] = cell.map(|c| c / EDGE);
        self.owners[4 * x + 2 * y + z]
    }

    /// Whether there are values on both sides.
    fn is_mixed(&self) -> bool {
        let outside = |(all, inside): (&u16, &u16)| all & !inside != 0;
        self.inside.iter().any(|&inside| inside != 0)
            && self.has_value.iter().zip(&self.inside).any(outside)
    }

    /// Of a row of the block: for each axis, which of the edges from its cells are crossed.
    #[inline(always)]
    fn crossed(&self, i: usize, j: usize) -> [u16; 3] {
        let row = i * SIDE + j;
        let between = |next: usize, shift: u32| {
            let both = self.has_value[row] & (self.has_value[next] >> shift);
            (self.inside[row] ^ (self.inside[next] >> shift)) & both & OWN_CELLS
        };
        [between(row + SIDE, 0), between(row + 1, 0), between(row, 1)]
    }

    /// Which cubes from the cells of a row have values at all corners, on both sides.
    #[inline(always)]
    fn cut(&self, i: usize, j: usize) -> u16 {
        let rows = [0, 1, SIDE, SIDE + 1].map(|n| i * SIDE + j + n);
        let fold = |bits: &[u16; SIDE * SIDE], by: fn(u16, u16) -> u16| {
            let [a, b, c, d] = rows.map(|row| bits[row]);
            let all = by(by(a, b), by(c, d));
            by(all, all >> 1)
        };
        let with_values = fold(&self.has_value, |a, b| a & b);
        let any = fold(&self.inside, |a, b| a | b);
        with_values & any & !fold(&self.inside, |a, b| a & b) & OWN_CELLS
    }

    /// Sign pattern of a cube.
    #[inline(always)]
    fn case(&self, [i, j, k]: [usize; 3]) -> u8 {
        let row = i * SIDE + j;
        let pair = |n: usize| (self.inside[row + n] >> k & 3) as u8;
        pair(0) | pair(1) << 2 | pair(SIDE) << 4 | pair(SIDE + 1) << 6
    }
}

/// The rows of a block along z.
fn rows() -> impl Iterator<Item = (usize, usize)> {
    (0..EDGE * EDGE).map(|row| (row / EDGE, row % EDGE))
}

/// The cells of a block whose bits are set in its rows.
#[inline(always)]
fn cells(row: impl Fn(usize, usize) -> u16) -> impl Iterator<Item = [usize; 3]> {
    rows().flat_map(move |(i, j)| ones(u64::from(row(i, j))).map(move |k| [i, j, k as usize]))
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

impl Crossings {
    fn new<T: Real>(chi: &BlockField<T>, level: T, block: usize) -> Self {
        let own = &chi.values[block * NODES..(block + 1) * NODES];
        let mut of = Self {
            is_finite: own.iter().all(|value| value.is_finite()),
            ..Self::default()
        };
        let corners = Corners::new(chi, level, block);
        of.count_inside(chi, block, &corners);
        if !corners.is_mixed() {
            return of;
        }
        for (i, j) in rows() {
            for (words, row) in of.crossed.iter_mut().zip(corners.crossed(i, j)) {
                words[i] |= u64::from(row) << (EDGE * j);
            }
        }
        for cell in cells(|i, j| corners.cut(i, j)) {
            of.faces += TABLE.count(corners.case(cell));
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
        for cell in cells(|i, j| corners.inside[i * SIDE + j] & OWN_CELLS) {
            self.inside += 1;
            for (a, at) in plus(corner, cell).into_iter().enumerate() {
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

/// Writes the triangles of a block, with the fraction of its edge at which each vertex lies.
fn fill_faces<T: Real>(
    (chi, level): (&BlockField<T>, T),
    crossings: &[Crossings],
    fractions: &[T],
    block: usize,
    faces: &mut [[u32; 3]],
) {
    let corners = Corners::new(chi, level, block);
    let mut places = faces.iter_mut();
    for cell in cells(|i, j| corners.cut(i, j)) {
        let vertex = |edge: u8| {
            let (corner, axis) = tables::start(edge);
            let start = plus(cell, corner);
            corners.owner(start).map_or(0, |owner| {
                crossings[owner].vertex(axis, start.map(|c| c % EDGE))
            })
        };
        let fraction = |edge: u8| fractions[vertex(edge) as usize];
        let add = |triangle: [u8; 3]| {
            if let Some(place) = places.next() {
                *place = triangle.map(vertex);
            }
        };
        TABLE.for_each_triangle(corners.case(cell), || fraction, add);
    }
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
