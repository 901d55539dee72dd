//! Trust and shift of each sample, from the thickness of the body there.

use super::Residual;
use super::forward::Options;
use super::means::GridSamples;
use super::stencil::Derivatives;
use super::step::Step;
use crate::data::cells::Cells;
use crate::{Real, parallel, vector};

impl<T: Real> GridSamples<'_, T> {
    /// Fills the slopes `u_i` of the first pass and the trust `ω_i`, and adds the shifts `δ_i` to `remaining`.
    pub(super) fn fill_trust(
        &self,
        chi: Cells<'_, T>,
        options: Options,
        remaining: &mut [T],
        residual: &mut Residual<T>,
    ) {
        let slopes = &mut residual.passes[0].slopes;
        slopes.resize(self.samples.points.len(), T::zero());
        self.for_each(
            slopes,
            #[inline(always)]
            |i, slope| {
                let derivatives = self.derivatives(chi, i, |_| [[[T::zero(); 3]; 3]; 3]);
                *slope = match derivatives {
                    Some(at) => vector::dot(at.gradient, self.samples.normals[i]),
                    None => T::zero(),
                };
            },
        );
        let [squares, area] = parallel::sum_array(slopes.len(), |i| {
            let (a, slope) = (self.area(i).f64(), rising(slopes[i]));
            [a * slope * slope, a]
        });
        let step = Step::new(squares, area, options);
        (residual.area, residual.step, residual.total_area) = (options.area, step, area);
        let slope = |i: usize| rising(slopes[i]);
        parallel::for_each(remaining, |i, r| *r += T::of(step.shift(slope(i))));
        parallel::fill(&mut residual.trust, slopes.len(), |i| {
            T::of(step.trust(slope(i)))
        });
    }

    /// Derivatives at sample `i` of the B-spline of `chi`, plus a correction on the 3³ cells from a corner on.
    #[inline(always)]
    pub(super) fn derivatives(
        &self,
        chi: Cells<'_, T>,
        i: usize,
        correction: impl Fn([usize; 3]) -> [[[T; 3]; 3]; 3],
    ) -> Option<Derivatives<T>> {
        let stencil = self.stencil(i)?;
        let [x, y, z] = stencil.corner;
        let correction = correction(stencil.corner);
        Some(stencil.derivatives(
            #[inline(always)]
            |i, j| {
                let added = correction[i][j];
                let row = chi.row::<3>([x + i, y + j, z]);
                [row[0] + added[0], row[1] + added[1], row[2] + added[2]]
            },
        ))
    }

    /// Fills `bars` with the cotangents of `u` and `â` of every sample (and of the width, per sample); `trust_bars(i)`
    /// are those of its `ω` and `δ`. Returns that of the smoothing.
    pub(super) fn pull_trust(
        &self,
        residual: &Residual<T>,
        trust_bars: impl Fn(usize) -> [f64; 2] + Sync,
        bars: &mut Vec<[f64; 3]>,
    ) -> f64 {
        let (step, slopes) = (residual.step, residual.first_slopes());
        parallel::fill(bars, slopes.len(), |i| {
            let [trust_bar, shift_bar] = trust_bars(i);
            step.pullback(rising(slopes[i]), trust_bar, shift_bar)
        });
        let [usual_bar, width_bar] =
            parallel::sum_array(slopes.len(), |i| [bars[i][1], bars[i][2]]);
        let share = step.usual_pullback(usual_bar, residual.total_area);
        parallel::for_each(bars, |i, bars| {
            let (a, slope) = (self.area(i).f64(), rising(slopes[i]));
            bars[0] += share * a * slope;
            bars[1] = 0.5 * share * (slope * slope - step.usual * step.usual);
        });
        step.width_pullback(width_bar)
    }
}

/// A slope, or 0 where `χ` falls.
fn rising<T: Real>(slope: T) -> f64 {
    slope.f64().max(0.0)
}
