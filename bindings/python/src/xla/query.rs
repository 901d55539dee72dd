//! Signed distance at any points to the surface of a cloud, and its pullback.

use isograd::Cotangent;
use isograd::distance::{Hit, Query};

use super::Target;
use super::buffers::{Batch, BatchMut, Call};
use super::common::{Cloud, CloudBar, Float, Keep, Kept, with_result};
use crate::backend::Failure;
use crate::saved;

/// Points, queries, perhaps normals → distances, alone or with what the pullback needs.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_query";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let queries = call.vectors::<T>("the queries")?;
        let given = call.given()?;
        let mut distance = call.output::<T>("the distances", 1)?;
        let mut keep = match call.outputs() {
            0 => None,
            _ => Some((KeepHits::<T>::take(&mut call)?, Keep::<T>::take(&mut call)?)),
        };
        let (settings, cloud) = (call.settings, Cloud { points, given });
        call.for_each(|k| {
            with_result(settings, &cloud.of(k)?, |result| {
                let surface = Query::new(result.mesh()?.clone()).map_err(|e| e.to_string())?;
                let hits = surface.query(queries.of(k), Some(result.sdf()?));
                let distances: Vec<T> = hits.iter().map(|hit| hit.distance).collect();
                saved::copy("the distances", &distances, distance.of(k))?;
                match &mut keep {
                    None => Ok(()),
                    Some((of_hits, of_cloud)) => {
                        of_hits.fill(k, &hits)?;
                        of_cloud.fill(k, result)
                    }
                }
            })
        })
    }
}

/// Points, queries, what the forward map kept, cotangent of the distances, perhaps normals → cotangents of
/// queries, points and normals.
pub struct Pullback;

impl Target for Pullback {
    const NAME: &'static str = "isograd_query_pullback";

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let points = call.vectors::<T>("the points")?;
        let queries = call.vectors::<T>("the queries")?;
        let hits = KeptHits::<T>::take(&mut call)?;
        let kept = Kept::<T>::take(&mut call)?;
        let distance_bar = call.input::<T>("the cotangent of the distances", 1)?;
        let given = call.given()?;
        let mut queries_out = call.vectors_out("the cotangent of the queries")?;
        let mut out = CloudBar::<T>::take(&mut call, given.is_some())?;
        let (settings, cloud) = (call.settings, Cloud { points, given });
        call.for_each(|k| {
            kept.restore(settings, k, &cloud.of(k)?, |restored| {
                let surface = Query::new(restored.result.mesh()?.clone());
                let (mut queries_bar, mut vertices_bar) = (Vec::new(), Vec::new());
                let pulled = surface.map_err(|e| e.to_string())?.pullback(
                    queries.of(k),
                    &hits.of(k)?,
                    distance_bar.of(k),
                    None,
                    &mut queries_bar,
                    &mut vertices_bar,
                );
                pulled.map_err(|e| e.to_string())?;
                let what = "the queries' cotangent";
                saved::copy(what, &queries_bar, queries_out.of(k))?;
                let cotangent = Cotangent {
                    vertices: Some(&vertices_bar),
                    ..Cotangent::default()
                };
                out.fill(k, restored.pull(&cotangent)?)
            })
        })
    }
}

/// Where the hits are kept, as far as the pullback of a distance looks at them.
struct KeepHits<'a, T> {
    gradient: BatchMut<'a, [T; 3]>,
    triangle: BatchMut<'a, u32>,
    barycentric: BatchMut<'a, [T; 3]>,
}

impl<'a, T: Float> KeepHits<'a, T> {
    fn take(call: &mut Call<'a>) -> Result<Self, Failure> {
        Ok(Self {
            gradient: call.vectors_out("the gradients")?,
            triangle: call.output("the triangles", 1)?,
            barycentric: call.vectors_out("the barycentric weights")?,
        })
    }

    fn fill(&mut self, k: usize, hits: &[Hit<T>]) -> Result<(), Failure> {
        let gradient: Vec<_> = hits.iter().map(|hit| hit.gradient).collect();
        let triangle: Vec<_> = hits.iter().map(|hit| hit.triangle).collect();
        let barycentric: Vec<_> = hits.iter().map(|hit| hit.barycentric).collect();
        saved::copy("the gradients", &gradient, self.gradient.of(k))?;
        saved::copy("the triangles", &triangle, self.triangle.of(k))?;
        let what = "the barycentric weights";
        saved::copy(what, &barycentric, self.barycentric.of(k))
    }
}

struct KeptHits<'a, T> {
    gradient: Batch<'a, [T; 3]>,
    triangle: Batch<'a, u32>,
    barycentric: Batch<'a, [T; 3]>,
}

impl<'a, T: Float> KeptHits<'a, T> {
    fn take(call: &mut Call<'a>) -> Result<Self, Failure> {
        Ok(Self {
            gradient: call.vectors("the gradients")?,
            triangle: call.input("the triangles", 1)?,
            barycentric: call.vectors("the barycentric weights")?,
        })
    }

    fn of(&self, k: usize) -> Result<Vec<Hit<T>>, Failure> {
        let triangle = self.triangle.of(k);
        let (gradient, barycentric) = (self.gradient.of(k), self.barycentric.of(k));
        if gradient.len() != triangle.len() || barycentric.len() != triangle.len() {
            return Err("the kept hits are not of one query".into());
        }
        let hit = |i: usize| Hit {
            // Only the cotangent of the closest point would need these two.
            distance: T::nan(),
            point: [T::nan(); 3],
            gradient: gradient[i],
            triangle: triangle[i],
            barycentric: barycentric[i],
        };
        Ok((0..triangle.len()).map(hit).collect())
    }
}
