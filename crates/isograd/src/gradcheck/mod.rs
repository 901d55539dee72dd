//! The pullback of the whole pipeline against finite differences, on a user's own cloud.
//!
//! # What is compared
//! A functional of φ that has a derivative everywhere: the weighted volume of the body with soft edges,
//! `L = h³ Σ_o u(x_o) g(φ_o)`, where `g` falls smoothly from 1 on the surface to 0 at `φ = 6h`, and `u` is a smooth function
//! of place that rises from one end of the body to the other (else a translation would change nothing). Inside, `g` is
//! constant: φ has a kink in the middle of a thin part, and a sum over cells of anything that sees the kink depends on how
//! it lies between the cells. For the exact φ of a plate half a cell thick and `g = 1/(1 + exp(φ/2h))`, the derivative by a
//! translation is 0.5 to 1.3 of the difference over a cell, for this `g` 0.998 to 1.006.
//!
//! All points are moved along a [direction](Motion), whose longest vector has length 1, and three derivatives of `L` are
//! taken:
//!
//! - by [pullback](crate::Reconstruction::pullback);
//! - by central differences over a small step, with the signs
//!   [held](crate::Reconstructor::reconstruct_held): what the pullback is the derivative of, so both agree to
//!   many digits;
//! - by central differences over a step of half a cell either way, with nothing held: what an optimizer sees
//!   that takes real steps.
//!
//! Where the last two part, [`Row::parting`] says where most of it comes from, and [`Difference`] how many signs changed
//! on the way.

mod check;
mod functional;
mod motion;
#[cfg(test)]
mod tests;

pub use motion::Motion;

use crate::{Error, Grid, PointCloud, PullbackError, Reconstructor, SurfaceResolution};
use check::Check;

/// Options of a check.
#[derive(Clone, Debug)]
pub struct Options {
    /// The pipeline.
    pub reconstruction: crate::Options,
    /// Directions in which the points are moved.
    pub motions: Vec<Motion>,
    /// Motion of the point that moves most in the large step, either way, in cells.
    pub step: f64,
    /// Seed of the random directions.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            reconstruction: crate::Options::default(),
            motions: Motion::ALL.to_vec(),
            step: 0.5,
            seed: 1,
        }
    }
}

/// Why nothing was compared.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The step is not a positive number.
    #[error("a step of {step} cells; give a positive number, such as 0.5")]
    Step {
        /// The value given.
        step: f64,
    },
    /// The cloud, or the moved one, was not reconstructed.
    #[error("{what}: {source}")]
    Reconstruct {
        /// Which cloud.
        what: String,
        /// Why.
        source: Error,
    },
    /// The pullback failed.
    #[error(transparent)]
    Pullback(#[from] PullbackError),
}

/// A finite difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Motion of the point that moves most, either way, in cells.
    pub step: f64,
    /// Its value, per unit length of that motion.
    pub value: f64,
    /// Points whose number of neighbors changed, with [`Radius::Cut`](crate::neighbors::Radius::Cut): their weights
    /// jump. 0 with other radii.
    pub neighborhoods: usize,
    /// Points whose normal changed sides.
    pub normals: usize,
    /// Edges of the surface's lattice that the surface began or ceased to cross: a cell at an end of them changed from
    /// inside to outside, or back.
    pub edges: usize,
    /// Points that passed a plane through cell centers, where the slope of the iso-value jumps, or a face of a cell,
    /// where those of the gains and the trust of the local iso-value do, and with the paper's weights the indicator.
    pub crossings: usize,
}

impl Difference {
    /// Whether nothing changed that has no derivative.
    pub fn is_smooth(&self) -> bool {
        self.neighborhoods + self.normals + self.edges + self.crossings == 0
    }
}

/// Where the difference over a large step is not the derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parting {
    /// Center of the block of cells from which most of it comes, in the cloud's coordinates.
    pub place: [f64; 3],
    /// Difference in that block, as a share of the differences of all blocks, from 0 to 1.
    pub share: f64,
}

/// One direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The direction.
    pub motion: Motion,
    /// Derivative by pullback, per unit length of the motion of the point that moves most.
    pub pullback: f64,
    /// The derivative if every part of the surface moved outward by a unit length: where that of the motion is a small
    /// share of it, the motion is along the surface, or contributions cancel, and the ratios say little.
    pub scale: f64,
    /// Over a small step, signs held.
    pub small: Difference,
    /// Over a large step, nothing held.
    pub large: Difference,
    /// Where those two part.
    pub parting: Parting,
    /// Cells that are left out of this row, of `L` itself: the small step takes them across the medial axis,
    /// where φ has a slope on either side and no derivative.
    pub ridges: usize,
}

impl Row {
    /// Pullback over the difference of the small step; 1 where all is right.
    pub fn small_ratio(&self) -> f64 {
        self.pullback / self.small.value
    }

    /// Pullback over the difference of the large step.
    pub fn large_ratio(&self) -> f64 {
        self.pullback / self.large.value
    }
}

/// The whole comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientCheck {
    /// One row for each motion.
    pub rows: Vec<Row>,
    /// Places where a derivative was bounded: see [`crate::CloudCotangent::guarded`].
    pub guarded: usize,
    /// A [size of the surface's cells](SurfaceResolution::Spacing) with which it would be marched on half cells, where
    /// [`Level::Thin`](crate::isosurface::Level::Thin) is not: derivatives then vary less within a cell.
    pub half_cells: Option<f64>,
}

/// Compares derivatives on `cloud`; see the [module](self). Its given normals, where they are used, are
/// held. `observer` is told before each motion is tried.
///
/// # Errors
/// As [`CheckError`] lists; a moved cloud may reach the wall of the grid where the cloud itself does not.
pub fn gradcheck(
    cloud: &PointCloud<f64>,
    grid: Grid<f64>,
    options: &Options,
    observer: &mut dyn FnMut(Motion),
) -> Result<GradientCheck, CheckError> {
    if !(options.step > 0.0) || !options.step.is_finite() {
        return Err(CheckError::Step { step: options.step });
    }
    let reconstruction = options.reconstruction.clone().checks(false);
    let failed = |source| CheckError::Reconstruct {
        what: "the cloud as it is".into(),
        source,
    };
    let mut plan = Reconstructor::new(grid, reconstruction.clone()).map_err(failed)?;
    let base = plan.reconstruct(cloud).map_err(failed)?.clone();
    // An automatic resolution of the surface is that of the cloud as it is.
    let surface = SurfaceResolution::Factor(grid.spacing() / base.surface_grid().spacing());
    let plan = Reconstructor::new(grid, reconstruction.surface(surface)).map_err(failed)?;
    let mut check = Check::new(cloud, &base, plan)?;
    let mut rows = Vec::new();
    for &motion in &options.motions {
        observer(motion);
        rows.push(check.row(motion, options)?);
    }
    Ok(GradientCheck {
        rows,
        guarded: check.guarded(),
        half_cells: base.cells_to_be_halved(),
    })
}
