//! The forward map: signs, counts, then vertices and faces into their final places.

use pulp::Arch;

use super::signs::{Signs, ones};
use super::tables::{self, TABLE};
use super::{Error, Report};
use crate::data::cells::Cells;
use crate::data::{Field, Grid, LatticeEdge, Mesh};
use crate::element::crossing::crossing;
use crate::{Real, parallel, vector};

/// Scratch buffers reused between calls: about a fifth of a byte per cell.
#[derive(Debug, Default)]
pub struct Scratch {
    signs: Signs,
    /// Per word of the signs, the number of vertices of its plane that come before it.
    before: Vec<u32>,
    planes: Vec<Plane>,
}

/// One plane of cells: where its vertices and faces begin in the mesh, and how many there are.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    vertices: usize,
    faces: usize,
    first_vertex: usize,
    first_face: usize,
}

/// The surface `χ = level`, in the user's unit: closed away from the walls, faces counter-clockwise seen
/// from the side where `χ ≥ level`. Overwrites `mesh`, whose memory is used again, and fills
/// [`Mesh::edges`]. The same bits for any number of threads.
///
/// # Errors
/// A level or a value that is not finite, a field that lies on one side of the level, or more vertices
/// than 32-bit indices can name. `mesh` is then left empty.
pub fn forward<T: Real>(
    chi: &Field<T>,
    level: T,
    scratch: &mut Scratch,
    mesh: &mut Mesh<T>,
) -> Result<Report, Error> {
    mesh.clear();
    if !level.is_finite() {
        return Err(Error::Level { level: level.f64() });
    }
    if !scratch.signs.fill(chi.values(), chi.grid().shape(), level) {
        return Err(not_finite(chi));
    }
    let report = report(&scratch.signs);
    if report.inside == 0 || report.inside == chi.grid().cells() {
        return Err(one_sided(chi, level, report.inside == 0));
    }
    let (vertices, faces) = scratch.count(chi.grid().shape()[0]);
    if vertices >= u32::MAX as usize {
        return Err(Error::TooManyVertices { vertices });
    }
    mesh.vertices.resize(vertices, [T::zero(); 3]);
    mesh.edges.resize(vertices, LatticeEdge::new(0, 0));
    mesh.faces.resize(faces, [0; 3]);
    scratch.emit(chi, level, mesh);
    Ok(report)
}

impl Scratch {
    /// Counts the vertices and faces of every plane, and returns how many there are in all.
    fn count(&mut self, planes: usize) -> (usize, usize) {
        let signs = &self.signs;
        self.before.resize(planes * signs.plane(), 0);
        self.planes.resize(planes, Plane::default());
        let before = self.before.chunks_exact_mut(signs.plane());
        parallel::each(self.planes.iter_mut().zip(before), |i, (plane, before)| {
            plane.vertices = signs.count_vertices(i, before);
            plane.faces = signs.count_faces(i);
        });
        let mut total = (0, 0);
        for plane in &mut self.planes {
            (plane.first_vertex, plane.first_face) = total;
            total = (total.0 + plane.vertices, total.1 + plane.faces);
        }
        total
    }

    fn emit<T: Real>(&self, chi: &Field<T>, level: T, mesh: &mut Mesh<T>) {
        let vertices = split(&mut mesh.vertices, self.planes.iter().map(|p| p.vertices));
        let edges = split(&mut mesh.edges, self.planes.iter().map(|p| p.vertices));
        let faces = split(&mut mesh.faces, self.planes.iter().map(|p| p.faces));
        let planes = vertices.into_iter().zip(edges).zip(faces);
        parallel::each(planes, |i, ((vertices, edges), faces)| {
            crate::simd::dispatch(
                Arch::new(),
                #[inline(always)]
                || {
                    emit_vertices(&self.signs, chi, level, i, vertices, edges);
                    self.emit_faces(chi, level, i, faces);
                },
            );
        });
    }

    #[inline(always)]
    fn emit_faces<T: Real>(&self, chi: &Field<T>, level: T, i: usize, faces: &mut [[u32; 3]]) {
        let mut places = faces.iter_mut();
        self.signs.for_each_block(i, |j, w, block| {
            let rows =
                [(i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)].map(|(i, j)| self.row(i, j, w));
            for k in ones(block.active) {
                let ids = cube_vertices(&rows, k);
                let fractions = || {
                    let values = values_at_corners(chi, [i, j, 64 * w + k as usize]);
                    move |edge| tables::fraction(edge, &values, level)
                };
                TABLE.for_each_triangle(block.case(k), fractions, |triangle| {
                    if let Some(place) = places.next() {
                        *place = triangle.map(|edge| ids[edge as usize]);
                    }
                });
            }
        });
    }

    #[inline(always)]
    fn row(&self, i: usize, j: usize, w: usize) -> Row {
        let crossed = self.signs.crossed(i, j, w);
        let next = if w + 1 < self.signs.words {
            self.signs.crossed(i, j, w + 1)[0]
        } else {
            0
        };
        Row {
            crossed,
            above: crossed[0] >> 1 | next << 63,
            first: self.planes[i].first_vertex as u32 + self.before[self.signs.word(i, j, w)],
        }
    }
}

/// The crossed edges that start from 64 neighboring cells of a row.
struct Row {
    crossed: [u64; 3],
    /// `crossed[0]`, moved down by one cell.
    above: u64,
    /// Number of the first vertex on them.
    first: u32,
}

impl Row {
    /// Numbers of the vertices on the edges from cell `k` along x, y, z, and from cell `k + 1` along x, y.
    /// They are counted in the order of cells, then axes; an edge that is not crossed has no number, and
    /// what stands in its place is not used.
    #[inline(always)]
    fn vertices(&self, k: u32) -> [u32; 5] {
        let below = (1u64 << k) - 1;
        let count = |c: u64| (c & below).count_ones();
        let bit = |c: u64| (c >> k & 1) as u32;
        let [cx, cy, cz] = self.crossed;
        let x = self.first + count(cx) + count(cy) + count(cz);
        let y = x + bit(cx);
        let z = y + bit(cy);
        let next_x = z + bit(cz);
        [x, y, z, next_x, next_x + bit(self.above)]
    }
}

/// The vertex on each of the twelve edges of cube `k`, numbered as in [`super::tables`].
#[inline(always)]
fn cube_vertices(rows: &[Row; 4], k: u32) -> [u32; 12] {
    let [a, b, c, d] = [0, 1, 2, 3].map(|r: usize| rows[r].vertices(k));
    [
        a[0], a[3], b[0], b[3], a[1], a[4], c[1], c[4], a[2], b[2], c[2], d[2],
    ]
}

#[inline(always)]
fn emit_vertices<T: Real>(
    signs: &Signs,
    chi: &Field<T>,
    level: T,
    i: usize,
    vertices: &mut [[T; 3]],
    edges: &mut [LatticeEdge],
) {
    let (grid, values) = (chi.grid(), chi.values());
    let strides = grid.strides();
    let mut places = vertices.iter_mut().zip(edges);
    for at in 0..signs.plane() {
        let (j, w) = (at / signs.words, at % signs.words);
        let crossed = signs.crossed(i, j, w);
        for k in ones(crossed[0] | crossed[1] | crossed[2]) {
            let cell = [i, j, 64 * w + k as usize];
            let p = grid.index(cell);
            for axis in (0..3).filter(|&a| crossed[a] >> k & 1 == 1) {
                let eta = crossing(values[p], values[p + strides[axis]], level);
                if let Some((vertex, edge)) = places.next() {
                    *vertex = position(grid, cell, axis, eta);
                    *edge = LatticeEdge::new(p, axis);
                }
            }
        }
    }
}

/// Values at the corners of the cube whose low corner is `cell`.
#[inline(always)]
fn values_at_corners<T: Real>(chi: &Field<T>, [i, j, k]: [usize; 3]) -> [T; 8] {
    let mut values = [T::zero(); 8];
    for (n, pair) in values.as_chunks_mut::<2>().0.iter_mut().enumerate() {
        *pair = Cells::from(chi).row([i + n / 2, j + n % 2, k]);
    }
    values
}

/// The point at the fraction `eta` of the way from the center of `cell` to the next along `axis`. Each step rounds
/// monotonically, so the point lies between the two rounded centers.
#[inline(always)]
pub(super) fn position<T: Real>(grid: &Grid<T>, cell: [usize; 3], axis: usize, eta: T) -> [T; 3] {
    let mut point = grid.center_f64(cell);
    let along = cell[axis] as f64 + 0.5 + eta.f64();
    point[axis] = grid.lower()[axis].f64() + grid.spacing().f64() * along;
    vector::of_f64(point)
}

fn report(signs: &Signs) -> Report {
    let walls = signs.walls();
    Report {
        touches_wall: walls.iter().flatten().any(|&touched| touched),
        walls,
        inside: signs.inside(),
    }
}

/// Cuts a slice into pieces of the given lengths.
pub(super) fn split<E>(mut whole: &mut [E], lengths: impl Iterator<Item = usize>) -> Vec<&mut [E]> {
    lengths
        .map(|n| {
            let (piece, rest) = std::mem::take(&mut whole).split_at_mut(n);
            whole = rest;
            piece
        })
        .collect()
}

fn not_finite<T: Real>(chi: &Field<T>) -> Error {
    let values = chi.values();
    let at = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
    Error::NotFinite {
        cell: chi.grid().cell(at),
        value: values[at].f64(),
    }
}

fn one_sided<T: Real>(chi: &Field<T>, level: T, nothing_inside: bool) -> Error {
    let level = level.f64();
    let values = chi.values().iter();
    let (min, max) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v.f64()), high.max(v.f64()))
    });
    if nothing_inside {
        Error::NothingInside { level, min, max }
    } else {
        Error::NothingOutside { level, min, max }
    }
}
