//! Signed distance from any points to the surface of a cloud, and its pullback.

use isograd::Cotangent;
use isograd::distance::{Hit, pull_hits};

use super::Target;
use super::buffers::Call;
use super::common::{Float, cloud, copy, copy_part, saved_hits};
use crate::backend::Failure;

/// Inputs: points, queries, optionally normals. Outputs: distances, alone or with what the pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_query";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let queries = call.vectors::<T>("the queries")?;
        let cloud = cloud(points, call.normals()?)?;
        let distance = call.output::<T>("the distances", 1)?;
        let saved = match call.outputs_left() {
            0 => None,
            _ => Some((hit_outputs(&mut call)?, call.saved_outputs()?)),
        };
        call.reconstruct(&cloud, |result| {
            let hits = result.query(queries, f64::INFINITY)?;
            copy_part("the distances", &hits, distance, |hit| hit.distance)?;
            let Some((hit_outputs, saved)) = saved else {
                return Ok(());
            };
            hit_outputs.fill(&hits)?;
            saved.fill(result)
        })
    }
}

/// Inputs: points, queries, what the forward map saved, cotangent of the distances, optionally normals. Outputs:
/// cotangents of queries, points and normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_query_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let queries = call.vectors("the queries")?;
        let hits = saved_hits(&mut call)?;
        let saved = call.saved()?;
        let distance_bar = call.input("the cotangent of the distances", 1)?;
        let normals = call.normals()?;
        let queries_out = call.vectors_out("the cotangent of the queries")?;
        let out = call.cloud_outputs(normals.is_some())?;
        call.restore(&cloud(points, normals)?, &saved, |restored| {
            let (mut queries_bar, mut vertices_bar) = (Vec::new(), Vec::new());
            let pulled = pull_hits(
                restored.result.mesh()?,
                queries,
                &hits,
                distance_bar,
                None,
                &mut queries_bar,
                &mut vertices_bar,
            );
            pulled.map_err(|e| e.to_string())?;
            copy("the queries' cotangent", &queries_bar, queries_out)?;
            out.fill(restored.pullback(&Cotangent {
                vertices: Some(&vertices_bar),
                ..Cotangent::default()
            })?)
        })
    }
}

/// Outputs for the parts of the hits that the pullback of a distance needs.
struct HitOutputs<'a, T> {
    gradient: &'a mut [[T; 3]],
    triangle: &'a mut [u32],
    barycentric: &'a mut [[T; 3]],
}

fn hit_outputs<'a, T: Float>(call: &mut Call<'a>) -> Result<HitOutputs<'a, T>, Failure> {
    Ok(HitOutputs {
        gradient: call.vectors_out("the gradients")?,
        triangle: call.output("the triangles", 1)?,
        barycentric: call.vectors_out("the barycentric weights")?,
    })
}

impl<T: Float> HitOutputs<'_, T> {
    fn fill(self, hits: &[Hit<T>]) -> Result<(), Failure> {
        copy_part("the gradients", hits, self.gradient, |hit| hit.gradient)?;
        copy_part("the triangles", hits, self.triangle, |hit| hit.triangle)?;
        let weights = |hit: &Hit<T>| hit.barycentric;
        copy_part("the barycentric weights", hits, self.barycentric, weights)
    }
}
