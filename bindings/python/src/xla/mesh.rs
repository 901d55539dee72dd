//! The surface of a cloud in arrays of fixed size, and its pullback.

use isograd::{Cotangent, Mesh, Real};

use super::Target;
use super::buffers::Call;
use super::common::{Float, cloud};
use crate::backend::Failure;

/// Inputs: points, optionally normals. Outputs: vertices and faces, as many as fit, and the number of both; alone or
/// with what the pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_mesh";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let cloud = cloud(call.vectors::<T>("the points")?, call.normals()?)?;
        let vertices = call.vectors_out("the vertices")?;
        let faces = call.vectors_out("the faces")?;
        let counts = call.output("the counts", 1)?;
        let saved = match call.outputs_left() {
            0 => None,
            _ => Some(call.saved_outputs()?),
        };
        call.reconstruct(&cloud, |result| {
            write(result.mesh()?, vertices, faces, counts)?;
            saved.map_or(Ok(()), |saved| saved.fill(result))
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

/// Inputs: points, what the forward map saved, cotangent of the vertices, optionally normals. Outputs: cotangents of
/// points and normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_mesh_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let saved = call.saved()?;
        let mut vertices_bar = call.vectors("the cotangent of the vertices")?.to_vec();
        let normals = call.normals()?;
        let out = call.cloud_outputs(normals.is_some())?;
        call.restore(&cloud(points, normals)?, &saved, |restored| {
            // Places behind the vertices are constant; vertices that did not fit were not returned.
            let count = restored.result.mesh()?.vertices().len();
            vertices_bar.resize(count, [T::zero(); 3]);
            out.fill(restored.pullback(&Cotangent {
                vertices: Some(&vertices_bar),
                ..Cotangent::default()
            })?)
        })
    }
}
