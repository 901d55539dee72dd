//! The loops of the pullback: cells → faces → vertices → samples, each a gather in a fixed order.

use super::forward::{check_faces, check_samples};
use super::shares::{Shares, Workspace, add_to_samples};
use super::{Error, Extension, Residual, Samples, Surface};
use crate::Real;
use crate::data::{Attribute, GridCotangent};
use crate::distance::tangent::tangent;
use crate::distance::triangle::closest_point;
use crate::gather::{Buckets, bounded};
use crate::parallel::{self, CHUNK};
use crate::vector::{add, dot, to_f64};

/// Inputs and outputs of [`forward`](super::forward), and cotangents of its outputs.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a, T> {
    /// The samples.
    pub samples: Samples<'a, T>,
    /// Their attribute.
    pub attribute: &'a Attribute<T>,
    /// The surface.
    pub surface: Surface<'a, T>,
    /// Residual of the forward map.
    pub residual: &'a Residual<T>,
    /// Result of the forward map.
    pub extension: &'a Extension<T>,
    /// `(V, components)` cotangent of the values at the vertices, row by row, finite, in 1 over the unit of the
    /// attribute for a loss without a unit; `None` counts as zero.
    pub vertices_bar: Option<&'a [T]>,
    /// `(B, components)` cotangent of the values at the cells, likewise.
    pub values_bar: Option<&'a [T]>,
}

impl<T: Real> Inputs<'_, T> {
    /// Sets `bar` to `ū_v` as passed by the caller.
    pub(super) fn start_bar(&self, vertex: usize, bar: &mut Vec<f64>) {
        let components = self.attribute.components;
        bar.clear();
        match self.vertices_bar {
            Some(given) => {
                let own = &given[vertex * components..][..components];
                bar.extend(own.iter().map(|u| u.f64()));
            }
            None => bar.resize(components, 0.0),
        }
    }

    /// Adds `β_k ū_cell` to `ū` of a corner of the face of a cell.
    #[inline(always)]
    pub(super) fn add_cell(&self, values_bar: &[T], b: usize, corner: usize, bar: &mut [f64]) {
        let [_, y, z] = self.residual.barycentric[b].map(T::f64);
        let weight = [1.0 - y - z, y, z][corner];
        let of_cell = &values_bar[b * bar.len()..][..bar.len()];
        for (bar, u) in bar.iter_mut().zip(of_cell) {
            *bar += weight * u.f64();
        }
    }
}

/// Cotangents of the inputs of an extension; the memory is reused by the next call.
#[derive(Clone, Debug, Default)]
pub struct Cotangent<T> {
    /// `(N, components)` of the attribute, row by row, in the order of the samples.
    pub attribute: Vec<T>,
    /// `(N, 3)` of the points, in the order in which they were given, not that of the index.
    pub points: Vec<[T; 3]>,
    /// `(N,)` of the areas.
    pub areas: Vec<T>,
    /// `(V, 3)` of the vertices of the surface.
    pub vertices: Vec<[T; 3]>,
    /// Of the grid, through the centers of the cells.
    pub grid: GridCotangent<T>,
    /// `R R̄` of the least radius `R`.
    pub radius: f64,
    /// Cells and vertices where a derivative does not exist or has no bound, and a bounded one was taken.
    pub guarded: usize,
    work: Work,
}

/// Buffers between the steps.
#[derive(Clone, Debug, Default)]
struct Work {
    /// Cells of the band, as places in its list, by closest face.
    cells_of: Buckets,
    /// Faces by vertex.
    faces_of: Buckets,
    /// `ȳ` of the corners of each face, through `β`.
    corners: Vec<[[f64; 3]; 3]>,
    /// Cotangents of the samples from each chunk of vertices.
    shares: Vec<Shares>,
}

/// Pulls cotangents of an extension back to all its inputs. Overwrites `out`. The same bits for any number of
/// threads.
///
/// `a₀`, φ (which chooses the band) and the list of closest faces are held constant; see the [module](super) for that and
/// for what is guarded.
///
/// # Errors
/// As the forward map, and [`Error::Mismatch`] or [`Error::Cell`] where something has the wrong length or names
/// a cell that is not there; `out` is then not to be used.
pub fn pullback<T: Real>(inputs: &Inputs<'_, T>, out: &mut Cotangent<T>) -> Result<(), Error> {
    let (samples, attribute) = (inputs.samples, inputs.attribute);
    check_samples(samples, attribute)?;
    check(inputs)?;
    out.guarded = 0;
    from_cells(inputs, out);
    from_vertices(inputs, out);
    let bars = out.work.shares.iter().map(|shares| shares.least_radius);
    out.radius = bounded::<T>(bars.sum(), &mut out.guarded).f64();
    let stride = attribute.components;
    out.attribute.resize(attribute.values.len(), T::zero());
    out.points.resize(samples.areas.len(), [T::zero(); 3]);
    out.areas.resize(samples.areas.len(), T::zero());
    out.guarded += add_to_samples(
        &out.work.shares,
        stride,
        &mut out.attribute,
        &mut out.points,
        &mut out.areas,
    );
    Ok(())
}

/// Whether all arrays fit together, so that no index below is out of range.
fn check<T: Real>(inputs: &Inputs<'_, T>) -> Result<(), Error> {
    let (surface, band) = (inputs.surface, &inputs.extension.cells);
    let cells = surface.phi.grid().cells();
    if surface.closest.len() != cells {
        return Err(Error::Closest {
            entries: surface.closest.len(),
            cells,
        });
    }
    if let Some(&(what, length, expected)) = lengths(inputs).iter().find(|(_, a, b)| a != b) {
        return Err(Error::Mismatch {
            what,
            length,
            expected,
        });
    }
    let outside = |i: usize| band[i] as usize >= cells;
    if let Some(i) = parallel::first(band.len(), outside) {
        let cell = band[i];
        return Err(Error::Cell { cell, cells });
    }
    check_faces(surface, band)
}

/// Name, length and required length of each array.
#[rustfmt::skip]
fn lengths<T: Real>(inputs: &Inputs<'_, T>) -> [(&'static str, usize, usize); 10] {
    let (residual, extension) = (inputs.residual, inputs.extension);
    let (components, [nx, ny, nz]) = (inputs.attribute.components, inputs.surface.phi.grid().shape());
    let (vertices, band) = (inputs.surface.mesh.vertices().len(), extension.cells.len());
    let (at_vertices, at_cells) = (vertices * components, band * components);
    let of = |bar: Option<&[T]>, expected: usize| bar.map_or(expected, <[T]>::len);
    [
        ("a value of the extension", extension.components, components),
        ("axis x of the extension", extension.shape[0], nx),
        ("axis y of the extension", extension.shape[1], ny),
        ("axis z of the extension", extension.shape[2], nz),
        ("the list of fits", residual.fits.len(), vertices),
        ("the list of barycentric weights", residual.barycentric.len(), band),
        ("the list of values at vertices", extension.vertices.len(), at_vertices),
        ("the list of values at cells", extension.values.len(), at_cells),
        ("the cotangent of the vertices", of(inputs.vertices_bar, at_vertices), at_vertices),
        ("the cotangent of the values", of(inputs.values_bar, at_cells), at_cells),
    ]
}

/// Cotangents of a face through the barycentric weights of its cells.
#[derive(Clone, Copy, Default)]
struct FaceBars {
    corners: [[f64; 3]; 3],
    /// Of the low corner of the grid, and of its spacing.
    lower: [f64; 3],
    spacing: f64,
    guarded: usize,
}

/// The pullback of `β`: to the corners of the faces, and to the grid.
fn from_cells<T: Real>(inputs: &Inputs<'_, T>, out: &mut Cotangent<T>) {
    out.grid = GridCotangent::default();
    let Some(values_bar) = inputs.values_bar else {
        return;
    };
    let (faces, closest) = (inputs.surface.mesh.faces().len(), inputs.surface.closest);
    let cells = &inputs.extension.cells;
    let Work {
        cells_of, corners, ..
    } = &mut out.work;
    cells_of.fill(faces, cells.len(), |b| [closest[cells[b] as usize]]);
    corners.resize(faces, [[0.0; 3]; 3]);
    let cells_of = &*cells_of;
    let chunks = parallel::map_each(corners.chunks_mut(CHUNK), |chunk, corners| {
        let mut sum = FaceBars::default();
        for (k, corners) in corners.iter_mut().enumerate() {
            let face = chunk * CHUNK + k;
            let got = face_bars(inputs, values_bar, face, cells_of.of(face));
            *corners = got.corners;
            sum.lower = add(sum.lower, got.lower);
            sum.spacing += got.spacing;
            sum.guarded += got.guarded;
        }
        sum
    });
    let (mut lower, mut spacing) = ([0.0; 3], 0.0);
    for chunk in chunks {
        lower = add(lower, chunk.lower);
        spacing += chunk.spacing;
        out.guarded += chunk.guarded;
    }
    out.grid.lower = lower.map(|x| bounded(x, &mut out.guarded));
    out.grid.spacing = bounded(spacing, &mut out.guarded);
}

fn face_bars<T: Real>(
    inputs: &Inputs<'_, T>,
    values_bar: &[T],
    face: usize,
    cells: &[u32],
) -> FaceBars {
    let mut sum = FaceBars::default();
    let (mesh, grid) = (inputs.surface.mesh, inputs.surface.phi.grid());
    let components = inputs.attribute.components;
    // Differences of values are known to ε of the values, and γ divides them by the thickness squared: from √ε
    // cells on, noise stays below a value per cell.
    let thinnest = T::epsilon().f64().sqrt() * grid.spacing().f64();
    let corners = mesh.corners(face).map(to_f64);
    let value = |k: usize, c: usize| {
        let vertex = mesh.faces()[face][k] as usize;
        inputs.extension.vertices[vertex * components + c].f64()
    };
    for &b in cells {
        let bar = &values_bar[b as usize * components..][..components];
        if bar.iter().all(|u| *u == T::zero()) {
            continue;
        }
        let cell = grid.cell(inputs.extension.cells[b as usize] as usize);
        let closest = closest_point(grid.center_f64(cell), corners);
        let rise = |k: usize| -> f64 {
            let terms = bar.iter().enumerate();
            terms
                .map(|(c, u)| u.f64() * (value(k, c) - value(0, c)))
                .sum()
        };
        let got = tangent(&closest, corners, [0.0, rise(1), rise(2)], thinnest);
        for k in 0..3 {
            sum.corners[k] = add(sum.corners[k], got.corners[k]);
        }
        sum.lower = add(sum.lower, got.query);
        sum.spacing += dot(got.query, cell.map(|o| o as f64 + 0.5));
        sum.guarded += usize::from(got.guarded);
    }
    sum
}

/// Cotangents of the faces from the cells of the band.
struct Cells<'a> {
    cells_of: &'a Buckets,
    faces_of: &'a Buckets,
    corners: &'a [[[f64; 3]; 3]],
}

/// Cotangent of a vertex from the cells of its faces: returns `ȳ_v`, and adds to `ū_v`.
fn through_cells<T: Real>(
    inputs: &Inputs<'_, T>,
    cells: &Cells<'_>,
    vertex: usize,
    bar: &mut [f64],
) -> [f64; 3] {
    let Some(values_bar) = inputs.values_bar else {
        return [0.0; 3];
    };
    let (faces, mut sum) = (inputs.surface.mesh.faces(), [0.0; 3]);
    cells
        .faces_of
        .for_each_corner(faces, vertex, |face, corner| {
            sum = add(sum, cells.corners[face][corner]);
            for &b in cells.cells_of.of(face) {
                inputs.add_cell(values_bar, b as usize, corner, bar);
            }
        });
    sum
}

/// The pullback of the fits: to the vertices, and into a list of shares of the samples for each chunk.
fn from_vertices<T: Real>(inputs: &Inputs<'_, T>, out: &mut Cotangent<T>) {
    let mesh = inputs.surface.mesh;
    let Work {
        cells_of,
        faces_of,
        corners,
        shares,
    } = &mut out.work;
    faces_of.fill_with_faces(mesh);
    let cells = Cells {
        cells_of,
        faces_of,
        corners,
    };
    out.vertices.resize(mesh.vertices().len(), [T::zero(); 3]);
    shares.resize_with(mesh.vertices().len().div_ceil(CHUNK), Shares::default);
    let chunks = out.vertices.chunks_mut(CHUNK).zip(shares);
    let guarded = parallel::map_each_with(
        Workspace::default,
        chunks,
        |work, chunk, (vertices_bar, shares)| {
            let mut guarded = 0;
            shares.begin(work);
            for (k, vertex_bar) in vertices_bar.iter_mut().enumerate() {
                let vertex = chunk * CHUNK + k;
                inputs.start_bar(vertex, &mut work.bar);
                let through_surface = through_cells(inputs, &cells, vertex, &mut work.bar);
                let through_fit = shares.add_fit(inputs, vertex, work, &mut guarded);
                *vertex_bar = add(through_surface, through_fit).map(|x| bounded(x, &mut guarded));
            }
            shares.finish();
            guarded
        },
    );
    out.guarded += guarded.into_iter().sum::<usize>();
}
