//! Queries and distances of meshes, compiled once for each number type, in this crate: see [`concrete`](crate::concrete).

use super::interpolate::{Bars, Cotangent, VertexValues};
use super::lattice::fill_from_mesh;
use super::{Band, Error, Hit, Query, Scratch, Sign};
use crate::concrete::concrete;
use crate::{Field, Mesh, Real};

concrete! {
    /// A number type that [queries](Query) and [distances of meshes](super::lattice::forward_of_mesh) are compiled for: `f32`
    /// or `f64`.
    pub trait Distance: Real;

    fn of_mesh(
        mesh: &Mesh<Self>,
        band: Band,
        scratch: &mut Scratch<Self>,
        phi: &mut Field<Self>,
        closest: &mut Vec<u32>
    ) -> Result<Sign, Error> = fill_from_mesh(mesh, band, scratch, phi, closest);

    fn hits(
        query: &Query<Self>,
        points: &[[Self; 3]],
        signs: Option<&Field<Self>>
    ) -> Vec<Hit<Self>> = query.hits(points, signs);

    fn values(
        of: &VertexValues<'_, Self>,
        hits: &[Hit<Self>]
    ) -> Result<Vec<Self>, Error> = of.at_hits(hits);

    fn pull_hits(
        of: &VertexValues<'_, Self>,
        points: &[[Self; 3]],
        hits: &[Hit<Self>],
        bars: Bars<'_, Self>,
        out: &mut Cotangent<Self>
    ) -> Result<usize, Error> = of.pull(points, hits, bars, out);
}
