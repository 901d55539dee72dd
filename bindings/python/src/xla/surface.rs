//! Distance, direction, closest point and values of the surface at cell centers or any places, and their pullback.

use isograd::distance::interpolate::{self, Bars, VertexValues};
use isograd::distance::triangle::{closest_point, unit_normal};
use isograd::distance::{Hit, NO_TRIANGLE};
use isograd::{Cotangent, ExtensionCotangent, Grid, Mesh, Real};
use isograd_backend::View;
use rayon::prelude::*;

use super::Target;
use super::buffers::Call;
use super::common::{Float, attribute, cloud, copy, copy_part, saved_hits};
use crate::backend::Failure;

/// Inputs: points, places, `(N, C)` values, optionally normals. Outputs: distances, directions, closest points, values
/// at them, faces and barycentric weights, and what else the pullback needs. Without places and with an output for each
/// cell, the places are the cell centers.
///
/// Outside beyond the band the distance is that of the band, the closest point is the place, all else 0; the inside has
/// no band.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_surface";
    #[cfg(feature = "cuda")]
    const HAS_BACKEND: bool = false;

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let places = call.vectors::<T>("the places")?;
        let attribute = attribute(call.input("the values", 2)?, points.len());
        let cloud = cloud(points, call.normals()?)?;
        let distance = call.output::<T>("the distances", 1)?;
        let gradient = call.vectors_out("the directions")?;
        let point = call.vectors_out("the closest points")?;
        let values = call.output::<T>("the values at the places", 2)?;
        let triangle = call.output::<u32>("the triangles", 1)?;
        let barycentric = call.vectors_out("the barycentric weights")?;
        let saved = call.saved_outputs()?;
        let band = call.band()?;
        call.reconstruct(&cloud, |result| {
            let mesh = surface(result)?;
            let hits = match places.is_empty() && !distance.is_empty() {
                true => at_centers(result, mesh, band)?,
                false => result.query(places, band)?,
            };
            let vertex_values = match attribute.components {
                0 => Vec::new(),
                _ => result.extend(&attribute, f64::MIN_POSITIVE)?.0.vertices,
            };
            let found = of_vertices(mesh, &vertex_values, attribute.components).at(&hits);
            copy("the values", &found.map_err(|e| e.to_string())?, values)?;
            copy_part("the distances", &hits, distance, |hit| hit.distance)?;
            copy_part("the directions", &hits, gradient, |hit| hit.gradient)?;
            copy_part("the closest points", &hits, point, |hit| hit.point)?;
            copy_part("the triangles", &hits, triangle, |hit| hit.triangle)?;
            copy_part("the barycentric weights", &hits, barycentric, |hit| {
                hit.barycentric
            })?;
            saved.fill(result)
        })
    }
}

/// Inputs: points, places, values; directions, faces and weights of the forward map, and what else it saved; cotangents
/// of distances, closest points and values; optionally normals. Outputs: cotangents of places, values, points and
/// normals. Directions are not pulled back: their cotangent is part of those of places and closest points.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_surface_pullback";
    #[cfg(feature = "cuda")]
    const HAS_BACKEND: bool = false;

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let places = call.vectors::<T>("the places")?;
        let attribute = attribute(call.input("the values", 2)?, points.len());
        let hits = saved_hits(&mut call)?;
        let saved = call.saved()?;
        let bars = Bars {
            distance: Some(call.input("the cotangent of the distances", 1)?),
            point: Some(call.vectors("the cotangent of the closest points")?),
            values: Some(call.input("the cotangent of the values", 2)?),
        };
        let normals = call.normals()?;
        let places_out = call.vectors_out("the cotangent of the places")?;
        let attribute_out = call.output("the cotangent of the samples' values", 2)?;
        let out = call.cloud_outputs(normals.is_some())?;
        call.restore(&cloud(points, normals)?, &saved, |restored| {
            let mesh = surface(restored.result)?;
            let are_centers = places.is_empty() && !hits.is_empty();
            let all = are_centers.then(|| centers(restored.result.grid()));
            let places = all.as_deref().unwrap_or(places);
            let extension = match attribute.components {
                0 => None,
                _ => Some(restored.result.extend(&attribute, f64::MIN_POSITIVE)?),
            };
            let vertex_values = extension.as_ref().map_or(&[][..], |(e, _)| &e.vertices);
            let interpolated = of_vertices(mesh, vertex_values, attribute.components);
            let mut bar = interpolate::Cotangent::default();
            let pulled = interpolated.pullback(places, &hits, bars, &mut bar);
            pulled.map_err(|e| e.to_string())?;
            if !are_centers {
                copy("the places' cotangent", &bar.points, places_out)?;
            }
            let extended = extension
                .as_ref()
                .map(|(extension, residual)| ExtensionCotangent {
                    attribute: &attribute,
                    extension,
                    residual,
                    vertices: Some(&bar.values),
                    values: None,
                });
            let cloud_bar = restored.pullback(&Cotangent {
                vertices: Some(&bar.vertices),
                extensions: extended.as_slice(),
                ..Cotangent::default()
            })?;
            let attribute_bar = cloud_bar.attributes.first().map_or(&[][..], |bar| bar);
            copy("the values' cotangent", attribute_bar, attribute_out)?;
            out.fill(cloud_bar)
        })
    }
}

/// The mesh that distances are measured from.
///
/// # Errors
/// A surface that is trimmed, or a sheet: φ, its values and its mesh are then of two surfaces.
fn surface<T: Float>(result: View<'_, T>) -> Result<&Mesh<T>, Failure> {
    let mesh = result.mesh()?;
    match std::ptr::eq(mesh, result.closest_mesh()?) {
        true => Ok(mesh),
        false => Err(Failure::Value(
            "trim and sheet are not supported here; use options with trim=\"off\" and sheet=\"off\"".into(),
        )),
    }
}

fn of_vertices<'a, T>(
    mesh: &'a Mesh<T>,
    values: &'a [T],
    components: usize,
) -> VertexValues<'a, T> {
    VertexValues {
        mesh,
        values,
        components,
    }
}

/// Hits at the cell centers, from φ and the closest faces, and by a search inside where these have a band of their own.
fn at_centers<T: Float>(
    result: View<'_, T>,
    mesh: &Mesh<T>,
    band: f64,
) -> Result<Vec<Hit<T>>, Failure> {
    let (sdf, closest, grid) = (result.sdf()?.values(), result.closest()?, result.grid());
    let is_far = |i: usize| sdf[i].f64() > band;
    let has_face = |i: usize| closest[i] != NO_TRIANGLE;
    let deep: Vec<usize> = (0..sdf.len())
        .into_par_iter()
        .filter(|&i| !is_far(i) && !has_face(i) && sdf[i] < T::zero())
        .collect();
    let center = |i: usize| grid.center(grid.cell(i));
    let mut hits: Vec<Hit<T>> = (0..sdf.len())
        .into_par_iter()
        .map(|i| match is_far(i) || !has_face(i) {
            true => Hit::beyond(center(i), band.min(sdf[i].f64())),
            false => on_face(mesh, closest[i], grid.center_f64(grid.cell(i)), sdf[i]),
        })
        .collect();
    let places: Vec<[T; 3]> = deep.iter().map(|&i| center(i)).collect();
    for (&i, hit) in deep.iter().zip(result.query(&places, f64::INFINITY)?) {
        hits[i] = hit;
    }
    Ok(hits)
}

/// The hit of a place whose closest face and distance are known.
fn on_face<T: Real>(mesh: &Mesh<T>, face: u32, place: [f64; 3], distance: T) -> Hit<T> {
    let corners = mesh.corners(face as usize).map(|corner| corner.map(T::f64));
    let closest = closest_point(place, corners);
    let sign = if distance < T::zero() { -1.0 } else { 1.0 };
    let gradient = match closest.distance > 0.0 {
        true => closest.offset.map(|x| sign * x / closest.distance),
        false => unit_normal(corners).unwrap_or([0.0; 3]),
    };
    Hit {
        distance,
        gradient: gradient.map(T::of),
        point: closest.point.map(T::of),
        triangle: face,
        barycentric: closest.barycentric.map(T::of),
    }
}

fn centers<T: Real>(grid: &Grid<T>) -> Vec<[T; 3]> {
    (0..grid.cells())
        .map(|i| grid.center(grid.cell(i)))
        .collect()
}
