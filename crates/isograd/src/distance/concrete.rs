//! Queries, compiled once for each number type, in this crate: see [`concrete`](crate::concrete).

use super::interpolate::{Bars, Cotangent, VertexValues};
use super::{Error, Hit, Query};
use crate::concrete::concrete;
use crate::{Field, Real};

concrete! {
    /// A number type that [queries](Query) are compiled for: `f32` or `f64`.
    pub trait Distance: Real;

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
