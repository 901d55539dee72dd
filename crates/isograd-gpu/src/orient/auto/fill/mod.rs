//! Evidence for the sign of an axis: which of its two sides is closer to the open air.
//!
//! # Map
//! Members of a cloud, with their points, axes and reaches, and a [`Lattice`] round them → what each member [sees](Sights):
//! what [`isograd::orient::fill`] finds, whose page says why. Every member is drawn as a disc; free cells that
//! are joined through faces make [regions], which the walls between them tell to be air or matter; and of each cell is
//! counted how much of the [sky] it sees.
//!
//! Cells are bits of words along the last axis: a kernel has 32 of them in hand at once.
//!
//! # Residual, pullback
//! None: signs are held constant.
//!
//! # Not differentiable
//! All of it.

mod discs;
mod occupied;
pub mod regions;
mod sights;
pub mod sky;
mod walls;

pub use isograd::orient::fill::Lattice;
pub use occupied::Occupied;
pub use sights::Sights;

use cubecl::prelude::Runtime;

use crate::device::check_length;
use crate::{Buffer, Device, Error, Scalar};
use discs::Discs;
use regions::Regions;
use sky::Sky;

/// Units of a group.
const BLOCK: u32 = 64;

/// Some members of a cloud.
#[derive(Clone, Copy, Debug)]
pub struct Members<'a, T> {
    /// `(M,)` rows of the arrays below.
    pub rows: &'a Buffer<u32>,
    /// `(N, 3)` finite.
    pub points: &'a Buffer<T>,
    /// `(N, 3)` of unit length, or zero.
    pub axes: &'a Buffer<f32>,
    /// `(N,)` how far the samples round each are apart, in units of `growth`.
    pub reach: &'a Buffer<f32>,
    /// A reach of 1, in the unit of the points.
    pub growth: f64,
}

/// The grid: what is occupied, and what that makes of the rest.
#[derive(Clone, Debug)]
pub struct Fill {
    /// The cells that members cover.
    pub occupied: Occupied,
    /// The regions of the others.
    pub regions: Regions,
    /// Of each region: +1 for air, −1 for matter, 0 where no wall tells. Region 0 is the open air.
    pub sides: Vec<i8>,
    /// How much of the sky free cells see.
    pub sky: Sky,
    discs: Discs,
}

/// What each member sees. Waits for the device.
///
/// # Errors
/// [`Error::Length`], [`Error::TooLarge`], [`Error::Failed`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    lattice: &Lattice,
    members: &Members<'_, T>,
) -> Result<Sights, Error> {
    Fill::new(device, lattice, members)?.look(device)
}

impl Fill {
    /// Draws the members and tells air from matter. Waits for the device.
    ///
    /// # Errors
    /// As [`forward`].
    pub fn new<R: Runtime, T: Scalar>(
        device: &Device<R>,
        lattice: &Lattice,
        members: &Members<'_, T>,
    ) -> Result<Self, Error> {
        let n = members.reach.len();
        check_length("the points", members.points, 3 * n)?;
        check_length("the axes", members.axes, 3 * n)?;
        let discs = Discs::place(device, lattice, members)?;
        let occupied = discs.draw(device, lattice.shape())?;
        let regions = Regions::find(device, &occupied)?;
        let sky = Sky::new(device, &occupied)?;
        let sides = walls::sides(device, &occupied, &regions, &discs)?;
        Ok(Self {
            occupied,
            regions,
            sides,
            sky,
            discs,
        })
    }

    /// What each member sees.
    ///
    /// # Errors
    /// [`Error::TooLarge`].
    pub fn look<R: Runtime>(&self, device: &Device<R>) -> Result<Sights, Error> {
        sights::look(device, self)
    }
}
