//! How far a sample is followed, and where the surface is to be seen from it: by how thick the body is there.

use rayon::prelude::*;

use super::forward::{Choice, Near};
use super::stencil::Derivatives;
use super::{FOLLOWED, FOLLOWED_THIN, LEAST_THICKNESS, Residual};
use crate::element::plate;
use crate::{Field, Real, parallel, vector};

/// Variance in cells² of the step that `χ` and the gradient taken here make of a plane, but for the smoothing: the
/// B-spline of the splat has ¼, that of the gradient ¼, and the elements about ¼.
const STEP: f64 = 0.75;

/// Share of the usual slope above which the body counts as thick.
pub const STEEPEST: f64 = 0.999;

impl<T: Real> Near<'_, T> {
    /// Fills `slopes` with the `u_i` of `chi` and `ω_i`, and adds `δ_i` to `now`.
    pub(super) fn trust(
        &self,
        chi: &Field<T>,
        choice: Choice,
        now: &mut [T],
        slopes: &mut Vec<T>,
        residual: &mut Residual<T>,
    ) {
        slopes.resize(self.samples.points.len(), T::zero());
        self.for_each(
            slopes,
            #[inline(always)]
            |i, slope| {
                let edge = self.edge(chi, i, |_| [[[T::zero(); 3]; 3]; 3]);
                *slope = match edge {
                    Some(edge) => vector::dot(edge.gradient, self.samples.normals[i]),
                    None => T::zero(),
                };
            },
        );
        let [sum, area] = parallel::sum_array(slopes.len(), |i| {
            let (a, slope) = (self.area(i).f64(), rising(slopes[i]));
            [a * slope * slope, a]
        });
        residual.step = Step::new(sum, area, choice);
        residual.area = area;
        let step = residual.step;
        let trust = now.par_iter_mut().zip(slopes).map(|(now, slope)| {
            let slope = rising(*slope);
            *now += T::of(step.shift(slope));
            T::of(step.trust(slope))
        });
        trust.collect_into_vec(&mut residual.trust);
    }

    /// What B-splines make of `chi` at sample `i`, with what is added to the 3³ cells that begin at a corner.
    #[inline(always)]
    pub(super) fn edge(
        &self,
        chi: &Field<T>,
        i: usize,
        added: impl Fn([usize; 3]) -> [[[T; 3]; 3]; 3],
    ) -> Option<Derivatives<T>> {
        let stencil = self.stencil(i)?;
        let [_, ny, nz] = self.grid.shape();
        let [x, y, z] = stencil.corner;
        let added = added(stencil.corner);
        Some(stencil.derivatives(
            #[inline(always)]
            |i, j| {
                let start = ((x + i) * ny + y + j) * nz + z;
                let added = added[i][j];
                let row = &chi.values()[start..start + 3];
                [row[0] + added[0], row[1] + added[1], row[2] + added[2]]
            },
        ))
    }

    /// Fills `bars` with the cotangents of `u` and `â` of every sample; `found(i)` has those of its `ω` and `δ`. Returns
    /// that of the smoothing.
    pub(super) fn pull_trust(
        &self,
        slopes: &[T],
        residual: &Residual<T>,
        found: impl Fn(usize) -> [f64; 2] + Sync,
        bars: &mut Vec<[f64; 3]>,
    ) -> f64 {
        let step = residual.step;
        let samples = 0..slopes.len();
        let direct = samples.into_par_iter().map(|i| {
            let [trust_bar, shift_bar] = found(i);
            step.pullback(rising(slopes[i]), trust_bar, shift_bar)
        });
        direct.collect_into_vec(bars);
        let [usual_bar, width_bar] =
            parallel::sum_array(slopes.len(), |i| [bars[i][1], bars[i][2]]);
        let share = step.usual_pullback(usual_bar, residual.area);
        bars.par_iter_mut().enumerate().for_each(|(i, bars)| {
            let (a, slope) = (self.area(i).f64(), rising(slopes[i]));
            bars[0] += share * a * slope;
            bars[1] = 0.5 * share * (slope * slope - step.usual * step.usual);
        });
        step.width_pullback(width_bar)
    }
}

/// A slope, or 0 where `χ` falls instead.
fn rising<T: Real>(slope: T) -> f64 {
    slope.f64().max(0.0)
}

/// The step of `χ` through the surface of a thick body: a Gaussian one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// `U`: its slope at the surface, per cell.
    pub usual: f64,
    /// `w`: its standard deviation, in cells.
    pub width: f64,
    /// What the smoothing has of that, in cells.
    pub smoothing: f64,
    /// Whether parts thinner than a cell are followed and made thicker.
    pub thin: bool,
}

impl Step {
    /// That of samples, for `Σ â u²` of slopes that rise and `Σ â`.
    pub fn new(squares: f64, area: f64, choice: Choice) -> Self {
        Self {
            usual: (squares / area).sqrt(),
            width: (STEP + choice.smoothing * choice.smoothing).sqrt(),
            smoothing: choice.smoothing,
            thin: choice.thin,
        }
    }

    /// For the cotangent of the usual slope and the `area` of [`Self::new`]: `Ū/(U Σâ)`, by which a sample's `u` has
    /// `â u` and its `â` has `½(u² − U²)`.
    pub fn usual_pullback(self, usual_bar: f64, area: f64) -> f64 {
        match usual_bar == 0.0 {
            true => 0.0,
            false => usual_bar / (self.usual * area),
        }
    }

    /// The cotangent of the smoothing for that of the width.
    pub fn width_pullback(self, width_bar: f64) -> f64 {
        width_bar * self.smoothing / self.width
    }

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

    /// `ω`.
    fn trust(self, slope: f64) -> f64 {
        plate::trust(self.followed(slope))
    }

    /// From 0 to 1 as the thickness goes from where nothing is followed to where all is.
    fn followed(self, slope: f64) -> f64 {
        let [low, high] = self.range();
        plate::followed(self.thickness(slope), low, high)
    }

    /// The thicknesses, in cells, between which `ω` goes from 0 to 1.
    pub fn range(self) -> [f64; 2] {
        match self.thin {
            true => FOLLOWED_THIN,
            false => FOLLOWED,
        }
    }

    /// `δ`: how much more `χ` is at the faces of a plate of the least thickness than at those of this one. A thin
    /// plate is the dip `−t s exp(−x²/2w²)` of a step of slope `s`.
    fn shift(self, slope: f64) -> f64 {
        match self.thin {
            true => self.usual * self.thickness(slope) * self.rise(self.thickness(slope)),
            false => 0.0,
        }
    }

    /// How much less the dip is at the faces of the plate of least thickness, of its depth, if it is less.
    fn rise(self, thickness: f64) -> f64 {
        plate::rise(self.depth(thickness), self.depth(LEAST_THICKNESS))
    }

    /// The dip of `χ` at the faces of a plate of this thickness, in cells, over that in its middle.
    pub fn depth(self, thickness: f64) -> f64 {
        (-0.125 * (thickness / self.width).powi(2)).exp()
    }

    /// Cotangents of the slope, the usual slope and the width, for those of `ω` and `δ`.
    fn pullback(self, slope: f64, trust_bar: f64, shift_bar: f64) -> [f64; 3] {
        let (share, thickness) = (self.share(slope), self.thickness(slope));
        if !(share > 0.0 && share < STEEPEST) || (trust_bar, shift_bar) == (0.0, 0.0) {
            return [0.0; 3];
        }
        let ([low, high], t) = (self.range(), self.followed(slope));
        let mut thickness_bar = plate::trust_pullback(trust_bar, t, low, high);
        let (mut usual_bar, mut width_bar) = (0.0, 0.0);
        let (rise, w) = (self.rise(thickness), self.width);
        if self.thin && rise > 0.0 {
            let growth = |t: f64| plate::growth(t, w, self.depth(t));
            thickness_bar += shift_bar * self.usual * (rise - growth(thickness));
            usual_bar += shift_bar * thickness * rise;
            let growth = growth(thickness) - growth(LEAST_THICKNESS);
            width_bar += shift_bar * self.usual * thickness * growth / w;
        }
        width_bar += thickness_bar * thickness / w;
        let share_bar = plate::share_pullback(thickness_bar, thickness, w, share);
        [
            share_bar / self.usual,
            usual_bar - share_bar * share / self.usual,
            width_bar,
        ]
    }
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
                smoothing: 0.0,
                thin: true,
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
            smoothing: 0.0,
            thin: true,
        };
        assert_eq!(step.thickness(0.0), 0.0);
        assert_eq!(step.shift(f64::NAN), 0.0);
        assert!(step.thickness(1.0).is_finite() && step.shift(f64::INFINITY) == 0.0);
    }

    #[test]
    fn pullback_is_the_derivative_of_trust_and_shift() {
        for thin in [false, true] {
            for slope in [-0.1, 0.003, 0.02, 0.1, 0.17, 0.21, 0.25, 0.45] {
                let (usual, width) = (0.4, 0.95);
                let (trust_bar, shift_bar) = (0.8, 1.7);
                let step = |usual: f64, width: f64| Step {
                    usual,
                    width,
                    smoothing: 0.0,
                    thin,
                };
                let value = |slope: f64, usual: f64, width: f64| {
                    let step = step(usual, width);
                    trust_bar * step.trust(slope) + shift_bar * step.shift(slope)
                };
                let bars = step(usual, width).pullback(slope, trust_bar, shift_bar);
                for (input, got) in bars.into_iter().enumerate() {
                    let at = |h: f64| {
                        let mut inputs = [slope, usual, width];
                        inputs[input] += h;
                        let [slope, usual, width] = inputs;
                        value(slope, usual, width)
                    };
                    let expected = (at(1e-6) - at(-1e-6)) / 2e-6;
                    let scale = expected.abs().max(1.0);
                    assert!(
                        (got - expected).abs() < 1e-6 * scale,
                        "{slope}: {got} {expected}"
                    );
                }
            }
        }
    }
}
