//! The coarse pass, which only samples that scatter need. Their means on coarse cells, N numbers from N, are found on the CPU, by
//! [`isograd::isosurface::local_level::coarse`]; the cells follow them on the device, as in all passes.

use cubecl::prelude::*;
use isograd::isosurface::local_level::coarse::{self, Coarse};

use super::near::Near;
use super::sample::{SAMPLE, STATE};
use crate::splat::Samples;
use crate::{Buffer, Device, Error, Scalar};

/// Residual of the coarse pass.
#[derive(Clone, Debug)]
pub(super) struct CoarsePass<T> {
    /// Residual of the part on the CPU.
    pub coarse: Coarse<T>,
    /// `(N, 2)` in sorted order: the means that samples were given, and 0.
    pub given: Buffer<T>,
}

/// Samples on the CPU, in input order.
struct OnHost<T> {
    points: Vec<[T; 3]>,
    normals: Vec<[T; 3]>,
    areas: Vec<T>,
    /// `(N,)` index of each sample, in sorted order.
    places: Vec<u32>,
}

impl<T: Scalar> OnHost<T> {
    fn new<R: Runtime>(
        device: &Device<R>,
        samples: Samples<'_, T>,
        places: &Buffer<u32>,
    ) -> Result<Self, Error> {
        let points = device.download(samples.points)?;
        let points: Vec<[T; 3]> = points.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect();
        Ok(Self {
            // The means do not depend on them.
            normals: vec![[T::zero(); 3]; points.len()],
            points,
            areas: device.download(samples.areas)?,
            places: device.download(places)?,
        })
    }

    fn samples(&self) -> isograd::splat::Samples<'_, T> {
        isograd::splat::Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }

    /// Input order from sorted order.
    fn to_input(&self, sorted: impl Fn(usize) -> T) -> Vec<T> {
        let mut out = vec![T::zero(); self.places.len()];
        for (k, &i) in self.places.iter().enumerate() {
            out[i as usize] = sorted(k);
        }
        out
    }
}

impl<R: Runtime, T: Scalar> Near<'_, R, T> {
    /// The means that the samples are given, whose state before the pass is `state`; `None` if there is nothing to follow.
    pub(super) fn find_coarse(
        &self,
        samples: Samples<'_, T>,
        area_weights: bool,
        first_gain: f64,
        state: &Buffer<T>,
    ) -> Result<Option<CoarsePass<T>>, Error> {
        let host = OnHost::new(self.device, samples, &self.order.places)?;
        let state = self.device.download(state)?;
        let offsets = host.to_input(|k| state[STATE * k]);
        let found = coarse::forward(self.grid, host.samples(), area_weights, first_gain, offsets);
        let Some((coarse, given)) = found else {
            return Ok(None);
        };
        let given = host.places.iter().map(|&i| given[i as usize]);
        let given: Vec<T> = given.flat_map(|given| [given, T::zero()]).collect();
        let given = self.device.upload(&given)?;
        Ok(Some(CoarsePass { coarse, given }))
    }

    /// The samples as if all were trusted: so that the cotangents of their values are those of the means that they were given.
    pub(super) fn trusting(&self) -> Result<Buffer<T>, Error> {
        let mut samples = self.device.download(self.samples)?;
        for sample in samples.chunks_exact_mut(SAMPLE) {
            sample[SAMPLE - 1] = T::one();
        }
        self.device.upload(&samples)
    }

    /// From the `(N, 10)` cotangents `bars` that [`Self::trusting`] samples got to those of the samples. Returns the cotangent of
    /// the gain of the first pass.
    pub(super) fn pull_coarse(
        &self,
        samples: Samples<'_, T>,
        area_weights: bool,
        CoarsePass { coarse, .. }: &CoarsePass<T>,
        bars: &mut Buffer<T>,
    ) -> Result<f64, Error> {
        let host = OnHost::new(self.device, samples, &self.order.places)?;
        let packed = self.device.download(self.samples)?;
        let mut sorted = self.device.download(bars)?;
        let count = super::pull_samples::BARS;
        let given_bar = host.to_input(|k| sorted[count * k]);
        let found = coarse::pullback(self.grid, host.samples(), area_weights, coarse, given_bar);
        for (k, bars) in sorted.chunks_exact_mut(count).enumerate() {
            let i = host.places[k] as usize;
            let (trust, s_bar) = (packed[SAMPLE * k + SAMPLE - 1], found.offsets[i]);
            bars[0] = trust * s_bar;
            bars[2] = match trust > T::zero() {
                true => s_bar * coarse.offsets()[i] / trust,
                false => T::zero(),
            };
            for a in 0..3 {
                bars[3 + a] += found.places[i][a];
            }
            bars[count - 1] += found.areas[i];
        }
        *bars = self.device.upload(&sorted)?;
        Ok(found.gain)
    }
}
