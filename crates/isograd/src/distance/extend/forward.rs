//! The loops over vertices and cells.

use super::fit::{self, Fit, Neighbor};
use super::rule::{ENOUGH, MARGIN, MOST, REACH, SMALLEST_AREA};
use super::{Error, Extension, NO_TRIANGLE, Region, Residual, Samples, Surface};
use crate::data::Attribute;
use crate::distance::triangle;
use crate::element::fit as element;
use crate::neighbors::{CellIndex, NearCells};
use crate::parallel::{self, CHUNK};
use crate::vector::{scale, sub, to_f64};
use crate::{Grid, Mesh, Real};

/// Vertices in one chunk of the loop over them: few enough that small surfaces keep all threads busy.
const VERTICES: usize = 256;

/// Cells in one chunk of a loop over the grid.
const CELLS: usize = 1 << 16;

/// Scratch buffers reused between calls.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// Cells of the band in each chunk of the grid.
    counts: Vec<usize>,
}

/// Extends an attribute of the samples to the vertices of the surface and to the cells of a region. Values have the
/// unit of the attribute.
///
/// # Errors
/// As [`Error`] lists; the outputs are then not to be used.
pub fn forward<T: Real>(
    samples: Samples<'_, T>,
    attribute: &Attribute<T>,
    surface: Surface<'_, T>,
    region: impl Into<Region>,
    scratch: &mut Scratch,
    residual: &mut Residual<T>,
    out: &mut Extension<T>,
) -> Result<(), Error> {
    check_samples(samples, attribute)?;
    let grid = surface.phi.grid();
    let bounds = region.into().bounds()?;
    if surface.closest.len() != grid.cells() {
        return Err(Error::Closest {
            entries: surface.closest.len(),
            cells: grid.cells(),
        });
    }
    find_band(surface, bounds, &mut scratch.counts, &mut out.cells);
    check_faces(surface, &out.cells)?;
    out.components = attribute.components;
    out.shape = grid.shape();
    extend_to_vertices(
        samples,
        attribute,
        surface.mesh,
        residual,
        &mut out.vertices,
    );
    extend_to_cells(surface, &mut residual.barycentric, out);
    Ok(())
}

/// Extends an attribute of the samples to the vertices of a mesh near them, which need not be the surface that φ is the
/// distance to: `(V, components)`, row by row, in the unit of the attribute.
///
/// # Errors
/// [`Error::Samples`], [`Error::NotFinite`] and [`Error::Area`].
pub fn at_vertices<T: Real>(
    samples: Samples<'_, T>,
    attribute: &Attribute<T>,
    mesh: &Mesh<T>,
) -> Result<Vec<T>, Error> {
    check_samples(samples, attribute)?;
    let mut values = Vec::new();
    extend_to_vertices(
        samples,
        attribute,
        mesh,
        &mut Residual::default(),
        &mut values,
    );
    Ok(values)
}

pub(super) fn check_samples<T: Real>(
    samples: Samples<'_, T>,
    attribute: &Attribute<T>,
) -> Result<(), Error> {
    let (count, areas) = (samples.neighborhoods.index.len(), samples.areas);
    let (values, components) = (&attribute.values, attribute.components);
    let expected = count.checked_mul(components);
    if areas.len() != count || expected != Some(values.len()) || values.is_empty() {
        return Err(Error::Samples {
            samples: count,
            areas: areas.len(),
            values: values.len(),
            components,
        });
    }
    if let Some(k) = parallel::first(values.len(), |k| !values[k].is_finite()) {
        return Err(Error::NotFinite {
            sample: k / components,
        });
    }
    let bad = |i: usize| !(areas[i] >= T::zero()) || !areas[i].is_finite();
    match parallel::first(count, bad) {
        Some(sample) => Err(Error::Area {
            sample,
            area: areas[sample].f64(),
        }),
        None => Ok(()),
    }
}

pub(super) fn check_faces<T: Real>(surface: Surface<'_, T>, cells: &[u32]) -> Result<(), Error> {
    let face = |i: usize| surface.closest[cells[i] as usize];
    let missing = |i: usize| face(i) as usize >= surface.mesh.faces().len();
    match parallel::first(cells.len(), missing) {
        Some(i) => Err(Error::Face { face: face(i) }),
        None => Ok(()),
    }
}

/// Lists the cells with a closest face and φ between two bounds in ascending order: a count per chunk, then every chunk into its own place.
fn find_band<T: Real>(
    surface: Surface<'_, T>,
    [least, most]: [T; 2],
    counts: &mut Vec<usize>,
    cells: &mut Vec<u32>,
) {
    let (phi, closest) = (surface.phi.values(), surface.closest);
    let inside = |&i: &usize| least <= phi[i] && phi[i] <= most && closest[i] != NO_TRIANGLE;
    let chunk = |k: usize| k * CELLS..phi.len().min((k + 1) * CELLS);
    parallel::fill(counts, phi.len().div_ceil(CELLS), |k| {
        chunk(k).filter(inside).count()
    });
    // Every place is written below.
    cells.resize(counts.iter().sum(), 0);
    let mut rest = &mut cells[..];
    let mut parts = Vec::with_capacity(counts.len());
    for &count in &*counts {
        let (part, after) = rest.split_at_mut(count);
        parts.push(part);
        rest = after;
    }
    parallel::each(parts, |k, part| {
        for (place, cell) in part.iter_mut().zip(chunk(k).filter(inside)) {
            *place = cell as u32;
        }
    });
}

/// Scratch buffers of one thread.
#[derive(Default)]
struct Workspace<T> {
    near: NearCells<T>,
    neighbors: Vec<Neighbor>,
    nearest: Vec<(u32, T)>,
}

fn extend_to_vertices<T: Real>(
    samples: Samples<'_, T>,
    attribute: &Attribute<T>,
    mesh: &Mesh<T>,
    residual: &mut Residual<T>,
    values: &mut Vec<T>,
) {
    let components = attribute.components;
    let mean = parallel::sum_array(samples.areas.len(), |i| [samples.areas[i].f64()])[0]
        / samples.areas.len() as f64;
    residual.smallest_area = if mean > 0.0 {
        SMALLEST_AREA * mean
    } else {
        1.0
    };
    let smallest_area = residual.smallest_area;
    residual.fits.resize(mesh.vertices().len(), Fit::default());
    values.resize(mesh.vertices().len() * components, T::zero());
    let fits = residual.fits.chunks_mut(VERTICES);
    let outputs = fits.zip(values.chunks_mut(VERTICES * components));
    let chunks = mesh.vertices().chunks(VERTICES).zip(outputs);
    parallel::map_each_with(
        Workspace::default,
        chunks,
        |workspace, _, (vertices, (fits, values))| {
            let values = values.chunks_exact_mut(components);
            for ((&vertex, fit), value) in vertices.iter().zip(fits).zip(values) {
                let radius = gather(samples, smallest_area, vertex, workspace);
                *fit = fit::fit(radius, &mut workspace.neighbors);
                evaluate(&workspace.neighbors, attribute, value);
            }
        },
    );
}

/// Collects the samples around a vertex with their weights `w_j`, and returns the radius.
fn gather<T: Real>(
    samples: Samples<'_, T>,
    smallest_area: f64,
    vertex: [T; 3],
    workspace: &mut Workspace<T>,
) -> f64 {
    let Workspace {
        near,
        neighbors,
        nearest,
    } = workspace;
    let index = &samples.neighborhoods.index;
    let least = samples.radius;
    let mut collect = |radius| collect(samples, smallest_area, vertex, radius, near, neighbors);
    if collect(least) >= ENOUGH.min(index.len()) {
        return least.f64();
    }
    let radius = grown_radius(index, vertex, least, nearest);
    collect(radius);
    radius.f64()
}

/// Collects the samples within a radius of a vertex with their weights `w_j`, in an order that depends on
/// the samples alone. Returns how many are well within.
pub(super) fn collect<T: Real>(
    samples: Samples<'_, T>,
    smallest_area: f64,
    vertex: [T; 3],
    radius: T,
    near: &mut NearCells<T>,
    neighbors: &mut Vec<Neighbor>,
) -> usize {
    let Samples {
        neighborhoods,
        areas,
        ..
    } = samples;
    let index = &neighborhoods.index;
    let (y, reach) = (to_f64(vertex), radius.f64());
    neighbors.clear();
    let mut enough = 0;
    near.for_each_within(index, vertex, radius, |position, _| {
        let j = index.order()[position] as usize;
        let x = to_f64(index.point(position));
        let offset = scale(sub(x, y), 1.0 / reach);
        let squared = crate::vector::norm_squared(offset);
        enough += usize::from(squared <= 1.0 / (REACH * REACH));
        neighbors.push(Neighbor {
            sample: j as u32,
            offset,
            weight: (areas[j].f64() + smallest_area) * element::kernel(squared),
            correction: 0.0,
        });
    });
    enough
}

/// `max(R, min(1.5 r₆, 1.05 r₆₄))`.
fn grown_radius<T: Real>(
    index: &CellIndex<T>,
    vertex: [T; 3],
    least: T,
    nearest: &mut Vec<(u32, T)>,
) -> T {
    index.nearest(vertex, MOST, nearest);
    let distance = |k: usize| {
        let last = nearest.len().saturating_sub(1);
        nearest
            .get(last.min(k - 1))
            .map_or(T::zero(), |&(_, d2)| d2.sqrt())
    };
    let reach = T::of(REACH) * distance(ENOUGH);
    least.max(reach.min(T::of(MARGIN) * distance(MOST)))
}

/// `Σ_j p_j t_j v_j`, as the mean and a correction to it, so that constants are exact.
fn evaluate<T: Real>(neighbors: &[Neighbor], attribute: &Attribute<T>, value: &mut [T]) {
    for (c, value) in value.iter_mut().enumerate() {
        let at =
            |n: &Neighbor| attribute.values[n.sample as usize * attribute.components + c].f64();
        let mean: f64 = neighbors.iter().map(|n| n.weight * at(n)).sum();
        let rise: f64 = neighbors
            .iter()
            .map(|n| n.correction * (at(n) - mean))
            .sum();
        *value = T::of(mean + rise);
    }
}

fn extend_to_cells<T: Real>(
    surface: Surface<'_, T>,
    barycentric: &mut Vec<[T; 3]>,
    out: &mut Extension<T>,
) {
    let Extension {
        components,
        vertices,
        cells,
        values,
        ..
    } = out;
    let (components, grid) = (*components, surface.phi.grid());
    barycentric.resize(cells.len(), [T::zero(); 3]);
    values.resize(cells.len() * components, T::zero());
    let barycentric = barycentric.chunks_mut(CHUNK);
    let outputs = barycentric.zip(values.chunks_mut(CHUNK * components));
    let chunks = cells.chunks(CHUNK).zip(outputs);
    parallel::each(chunks, |_, (cells, (barycentric, values))| {
        let values = values.chunks_exact_mut(components);
        for ((&cell, weights), value) in cells.iter().zip(barycentric).zip(values) {
            let face = surface.closest[cell as usize] as usize;
            *weights = closest_weights(grid, cell as usize, surface.mesh, face);
            blend(vertices, surface.mesh.faces()[face], *weights, value);
        }
    });
}

/// Barycentric coordinates of the point of a face that is closest to a cell's center.
fn closest_weights<T: Real>(grid: &Grid<T>, cell: usize, mesh: &Mesh<T>, face: usize) -> [T; 3] {
    let center = grid.center_f64(grid.cell(cell));
    let closest = triangle::closest_point(center, mesh.corners(face).map(to_f64));
    closest.barycentric.map(T::of)
}

/// `Σ_k β_k u_k` at a face, as differences from one corner, so that constants are exact.
pub(super) fn blend<T: Real>(vertices: &[T], face: [u32; 3], barycentric: [T; 3], value: &mut [T]) {
    let corners = face.map(|v| v as usize * value.len());
    let [_, b, c] = barycentric.map(T::f64);
    for (k, value) in value.iter_mut().enumerate() {
        let [u0, u1, u2] = corners.map(|corner| vertices[corner + k].f64());
        *value = T::of(u0 + b * (u1 - u0) + c * (u2 - u0));
    }
}
