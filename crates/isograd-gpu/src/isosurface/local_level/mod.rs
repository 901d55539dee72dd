//! The iso-value as a field, as [`isograd::isosurface::local_level`].
//!
//! # Map
//! As there: `χ_o ← χ_o − λ e_o`, up to [`PASSES`] times, with `e_o` the mean near a cell of what the indicator is off
//! at the samples, each followed as far (`ω`) as the body there is thick, and `λ` found from sums over the samples.
//! `D` and `M = D e` are fields that each cell gathers from the samples, which are sorted by cell; `e` is their
//! quotient where it is read. Sums over samples and cells are in the number type of the field, by a fixed tree. Those
//! that `λ` is made of, five a pass, come back to the host, where `λ` is found in double precision by the same
//! lines as on the CPU. The coarse pass of samples that scatter finds its means on the CPU.
//!
//! # Memory
//! Two fields besides `χ` as it was and as it is, let go at the end. The pullback has three, and `χ` as it was.
//!
//! # Residual
//! The samples in the form that is worked with; and of each pass its sums, and of each sample `s_i` and `u_i`.
//!
//! # Pullback
//! As on the CPU, pass by pass backward: samples → cells → samples. Of each pass one sum comes back, for `λ̄`; of the coarse
//! one the cotangents of all samples.
//!
//! # Bad samples
//! Those that the splat leaves out are left out here.
//!
//! # Not differentiable
//! As on the CPU.

mod cells;
mod coarse;
mod forward;
mod near;
mod plate;
mod pull_samples;
mod pullback;
mod sample;
mod trust;

pub use forward::forward;
pub use isograd::isosurface::local_level::{Options, PASSES};
pub use pullback::{Cotangents, pullback};

use isograd::isosurface::local_level::{Step, Sums};

use crate::Buffer;

/// Residual of the pullback, besides the inputs.
#[derive(Clone, Debug)]
pub struct Residual<T> {
    area_weights: bool,
    step: Step,
    /// `Σ â_i`.
    area: f64,
    /// `(N, 8)` samples in sorted order: see `sample`.
    samples: Buffer<T>,
    passes: Vec<Pass<T>>,
    coarse: Option<coarse::CoarsePass<T>>,
    /// `(N, 2)` `s_i` and `u_i` before the first pass.
    first: Buffer<T>,
}

/// One pass.
#[derive(Clone, Debug)]
struct Pass<T> {
    /// `λ`.
    gain: f64,
    sums: Sums,
    /// Share of the slope of `χ` that was gone before it.
    flattened: f64,
    /// `(N, 2)` `s_i` and `u_i` before it, in sorted order.
    state: Buffer<T>,
}

impl<T> Residual<T> {
    /// `λ` of each pass but the coarse one; none where the samples were not followed one by one.
    pub fn gains(&self) -> impl Iterator<Item = f64> + '_ {
        self.passes.iter().map(|pass| pass.gain)
    }

    /// `γ λ` of the coarse pass; 0 if there was none.
    pub fn coarse_gain(&self) -> f64 {
        let pass = self.coarse.as_ref();
        pass.map_or(0.0, |pass| pass.coarse.gain())
    }
}
