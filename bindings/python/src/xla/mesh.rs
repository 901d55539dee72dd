//! The surface of a cloud in arrays of fixed size, and its pullback.

use isograd::{Cotangent, Mesh, Real};

use super::Target;
use super::buffers::Call;
use super::common::{Cloud, CloudBar, Float, Keep, Kept, with_result};
use crate::backend::Failure;

/// Points, perhaps normals → vertices and faces, as many as fit, and how many there are of both; alone or with what
/// the pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_mesh";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let cloud = Cloud {
            points: call.vectors::<T>("the points")?,
            given: call.given()?,
        };
        let mut vertices = call.vectors_out::<T>("the vertices")?;
        let mut faces = call.vectors_out::<u32>("the faces")?;
        let mut counts = call.output::<u32>("the counts", 1)?;
        let mut keep = match call.outputs() {
            0 => None,
            _ => Some(Keep::<T>::take(&mut call)?),
        };
        let settings = call.settings;
        call.for_each(|k| {
            with_result(settings, &cloud.of(k)?, |result| {
                let mesh = result.mesh()?;
                write(mesh, vertices.of(k), faces.of(k), counts.of(k))?;
                keep.as_mut().map_or(Ok(()), |keep| keep.fill(k, result))
            })
        })
    }
}

/// Writes what fits, and zeros behind. A face with a vertex that does not fit is written as `(0, 0, 0)`.
fn write<T: Real>(
    mesh: &Mesh<T>,
    vertices: &mut [[T; 3]],
    faces: &mut [[u32; 3]],
    counts: &mut [u32],
) -> Result<(), Failure> {
    let [vertex_count, face_count] = counts else {
        return Err("the counts must be two".into());
    };
    // 32-bit indices name all vertices and faces.
    *vertex_count = mesh.vertices().len() as u32;
    *face_count = mesh.faces().len() as u32;
    vertices.fill([T::zero(); 3]);
    faces.fill([0; 3]);
    for (out, &vertex) in vertices.iter_mut().zip(mesh.vertices()) {
        *out = vertex;
    }
    for (out, &face) in faces.iter_mut().zip(mesh.faces()) {
        if face.iter().all(|&v| (v as usize) < vertices.len()) {
            *out = face;
        }
    }
    Ok(())
}

/// Points, what the forward map kept, cotangent of the vertices, perhaps normals → cotangents of points and normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_mesh_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let kept = Kept::<T>::take(&mut call)?;
        let vertices_bar = call.vectors::<T>("the cotangent of the vertices")?;
        let given = call.given()?;
        let mut out = CloudBar::<T>::take(&mut call, given.is_some())?;
        let (settings, cloud) = (call.settings, Cloud { points, given });
        call.for_each(|k| {
            kept.restore(settings, k, &cloud.of(k)?, |restored| {
                // Places behind the vertices are constant, and vertices that did not fit were not seen.
                let count = restored.result.mesh()?.vertices().len();
                let mut bar = vertices_bar.of(k).to_vec();
                bar.resize(count, [T::zero(); 3]);
                let cotangent = Cotangent {
                    vertices: Some(&bar),
                    ..Cotangent::default()
                };
                out.fill(k, restored.pull(&cotangent)?)
            })
        })
    }
}
