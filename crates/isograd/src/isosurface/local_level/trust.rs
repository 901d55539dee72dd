//! How far a sample is followed, and where the surface is to be seen from it: by how thick the body is there.

use rayon::prelude::*;

use super::forward::Near;
use super::{FOLLOWED, FOLLOWED_THIN, LEAST_THICKNESS, Residual};
use crate::{Field, Real, parallel, vector};

/// Variance in cells² of the step that `χ` and the gradient taken here make of a plane, but for the smoothing: the
/// B-spline of the splat has ¼, that of the gradient ¼, and the elements about ¼.
const STEP: f64 = 0.75;

/// Share of the usual slope above which the body counts as thick.
const STEEPEST: f64 = 0.999;

impl<T: Real> Near<'_, T> {
    /// Fills `ω_i` and `δ_i`, from the slope of `chi`, smoothed by `smoothing` cells, along the normals.
    pub(super) fn trust(
        &self,
        chi: &Field<T>,
        smoothing: f64,
        thin: bool,
        residual: &mut Residual<T>,
    ) {
        // In place of the shifts, which are made of them.
        let slopes = &mut residual.shifts;
        let samples = 0..self.samples.points.len();
        let slope = |i: usize| self.slope(chi, i);
        samples.into_par_iter().map(slope).collect_into_vec(slopes);
        let [sum, area] = parallel::sum_array(slopes.len(), |i| {
            let a = self.area(i).f64();
            [a * slopes[i].f64().powi(2), a]
        });
        let step = Step {
            usual: (sum / area).sqrt(),
            width: (STEP + smoothing * smoothing).sqrt(),
        };
        let range = if thin { FOLLOWED_THIN } else { FOLLOWED };
        let trust = slopes.par_iter().map(|slope| {
            let thickness = step.thickness(slope.f64());
            T::of(rise(thickness, range))
        });
        trust.collect_into_vec(&mut residual.trust);
        if thin {
            let shift = |slope: &mut T| *slope = T::of(step.shift(slope.f64()));
            slopes.par_iter_mut().for_each(shift);
        } else {
            slopes.clear();
        }
    }

    /// `n·∇χ` at sample `i`, per cell, with quadratic B-splines, which have no seams between cells; 0 where it falls
    /// instead.
    fn slope(&self, chi: &Field<T>, i: usize) -> T {
        let Some(stencil) = self.stencil(i) else {
            return T::zero();
        };
        let ([x, y, z], [dx, dy, dz]) = (stencil.weights(), stencil.slopes());
        let [_, ny, nz] = self.grid.shape();
        let [cx, cy, cz] = stencil.corner;
        let mut gradient = [T::zero(); 3];
        for i in 0..3 {
            for j in 0..3 {
                let start = ((cx + i) * ny + cy + j) * nz + cz;
                for (k, &value) in chi.values()[start..start + 3].iter().enumerate() {
                    gradient[0] += dx[i] * y[j] * z[k] * value;
                    gradient[1] += x[i] * dy[j] * z[k] * value;
                    gradient[2] += x[i] * y[j] * dz[k] * value;
                }
            }
        }
        vector::dot(gradient, self.samples.normals[i]).max(T::zero())
    }
}

/// The step of `χ` through the surface of a thick body: a Gaussian one.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Its slope at the surface, per cell.
    usual: f64,
    /// Its standard deviation, in cells.
    width: f64,
}

impl Step {
    /// `q`: the slope at a sample over that of a thick body. What is not a number counts as flat.
    fn share(self, slope: f64) -> f64 {
        let share = slope / self.usual;
        match share > 0.0 {
            true => share.min(STEEPEST),
            false => 0.0,
        }
    }

    /// Thickness, in cells, of the plate on whose faces `χ` has this slope: two opposite steps that overlap leave
    /// `q = 1 − exp(−t²/2w²)`.
    fn thickness(self, slope: f64) -> f64 {
        self.width * (-2.0 * (-self.share(slope)).ln_1p()).sqrt()
    }

    /// `δ`: how much more `χ` is at the faces of a plate of the least thickness than at those of this one. A thin
    /// plate is the dip `−t s exp(−x²/2w²)` of a step of slope `s`.
    fn shift(self, slope: f64) -> f64 {
        let thickness = self.thickness(slope);
        let depth = |t: f64| (-0.125 * (t / self.width).powi(2)).exp();
        self.usual * thickness * (depth(thickness) - depth(LEAST_THICKNESS)).max(0.0)
    }
}

/// From 0 at the lower end to 1 at the upper one, with no slope at both.
fn rise(x: f64, [low, high]: [f64; 2]) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `χ` of a plate of thickness `t` by integration of the Gaussian.
    fn plate(x: f64, t: f64, w: f64) -> f64 {
        let n = 4000;
        let inside = (0..n).map(|i| {
            let y = t * ((i as f64 + 0.5) / n as f64 - 0.5);
            (-0.5 * ((x - y) / w).powi(2)).exp()
        });
        -inside.sum::<f64>() * t / n as f64 / (w * std::f64::consts::TAU.sqrt())
    }

    #[test]
    fn slopes_of_smoothed_plates_tell_their_thickness_and_the_rise_to_that_of_a_cell() {
        for width in [0.9, 1.3] {
            let step = Step {
                usual: 1.0 / (width * std::f64::consts::TAU.sqrt()),
                width,
            };
            for t in [0.05, 0.3, 0.7, 0.95, 2.0] {
                let at = |x: f64| plate(x, t, width);
                let slope = (at(0.5 * t + 1e-4) - at(0.5 * t - 1e-4)) / 2e-4;
                // The sum over 4000 places is good to 1e-7, differences of it to 1e-5.
                assert!((step.thickness(slope) / t - 1.0).abs() < 1e-4, "{t}");
                let rise = (at(0.5 * LEAST_THICKNESS) - at(0.5 * t)).max(0.0);
                // A dip is taken for a Gaussian: right to second order in t/w.
                let error = (step.shift(slope) - rise).abs();
                assert!(error < 0.15 * rise + 1e-6, "{t}: {error} of {rise}");
            }
        }
    }

    #[test]
    fn what_is_not_a_number_is_flat() {
        let step = Step {
            usual: 0.0,
            width: 1.0,
        };
        assert_eq!(step.thickness(0.0), 0.0);
        assert_eq!(step.shift(f64::NAN), 0.0);
        assert!(step.thickness(1.0).is_finite() && step.shift(f64::INFINITY) == 0.0);
    }
}
