//! The pipeline, compiled once for each number type, in this crate: see [`concrete`](crate::concrete).

use std::ops::ControlFlow;

use super::pullback::PullbackScratch;
use super::{
    CloudCotangent, Cotangent, Error, Orienter, PullbackError, Reconstruction, Reconstructor,
    RestoreError, Saved, Stage,
};
use crate::concrete::concrete;
use crate::data::{Attribute, PointCloud};
use crate::distance::{self, Distance, Hit, extend};
use crate::poisson;

concrete! {
    /// A number type that [plans](Reconstructor) are compiled for: `f32` or `f64`.
    pub trait Pipeline: Distance;

    fn poisson_plan(shape: [usize; 3]) -> poisson::Plan<Self> = poisson::Plan::new(shape);

    fn run(
        plan: &mut Reconstructor<Self>,
        stage: Stage,
        cloud: &PointCloud<Self>,
        held: Option<&Reconstruction<Self>>
    ) -> Result<(), Error> = plan.run(stage, cloud, held);

    fn orient(
        plan: &mut Orienter<Self>,
        cloud: &PointCloud<Self>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>
    ) -> Result<(), Error> = plan.run(cloud, observer);

    fn rebuild(
        plan: &mut Reconstructor<Self>,
        cloud: &PointCloud<Self>,
        saved: &Saved<'_, Self>
    ) -> Result<(), RestoreError> = plan.rebuild(cloud, saved);

    fn pull(
        reconstruction: &Reconstruction<Self>,
        cotangent: &Cotangent<'_, Self>,
        scratch: &mut PullbackScratch<Self>,
        out: &mut CloudCotangent<Self>
    ) -> Result<(), PullbackError> = reconstruction.pull(cotangent, scratch, out);

    fn query(
        reconstruction: &Reconstruction<Self>,
        points: &[[Self; 3]],
        within: f64
    ) -> Result<Vec<Hit<Self>>, distance::Error> = reconstruction.hits(points, within);

    fn extend(
        reconstruction: &Reconstruction<Self>,
        attribute: &Attribute<Self>,
        region: extend::Region,
        scratch: &mut extend::Scratch,
        residual: &mut extend::Residual<Self>,
        extension: &mut extend::Extension<Self>
    ) -> Result<(), extend::Error> = reconstruction.extend_selected(attribute, region, scratch, residual, extension);

    fn vertex_values(
        reconstruction: &Reconstruction<Self>,
        attribute: &Attribute<Self>
    ) -> Result<Vec<Self>, extend::Error> = reconstruction.selected_at_vertices(attribute);
}
