//! The step of the indicator through a surface, and the thickness of a plate from the slope on its faces.

use super::forward::Options;
use super::{FOLLOWED, FOLLOWED_THIN, LEAST_THICKNESS};
use crate::element::plate;

/// Variance in cells² of the step that `χ` and its gradient here make of a plane, without the smoothing: the
/// B-spline of the splat contributes ¼, that of the gradient ¼, and the elements about ¼.
const UNSMOOTHED: f64 = 0.75;

/// Share of the usual slope above which the body counts as thick.
pub const STEEPEST: f64 = 0.999;

/// The step of `χ` through the surface of a thick body, the integral of a Gaussian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// `U`: its slope at the surface, per cell.
    pub usual: f64,
    /// `w`: its standard deviation, in cells.
    pub width: f64,
    /// Width of the smoothing, which is part of `width`, in cells.
    pub smoothing: f64,
    /// Whether parts thinner than a cell are followed and made thicker.
    pub thin: bool,
}

impl Step {
    /// The step of samples with `squares` the sum `Σ â u²` over rising slopes and `area` the sum `Σ â`.
    pub fn new(squares: f64, area: f64, options: Options) -> Self {
        Self {
            usual: (squares / area).sqrt(),
            width: Self::width_of(options.smoothing),
            smoothing: options.smoothing,
            thin: options.thin,
        }
    }

    /// `w` for a smoothing of this width, all in cells.
    pub fn width_of(smoothing: f64) -> f64 {
        (UNSMOOTHED + smoothing * smoothing).sqrt()
    }

    /// `Ū/(U Σâ)` for the cotangent `Ū` of the usual slope and the `area` of [`Self::new`]. Times `â u` it is the
    /// cotangent of a sample's `u`, times `½(u² − U²)` that of its `â`.
    pub fn usual_pullback(self, usual_bar: f64, area: f64) -> f64 {
        match usual_bar == 0.0 {
            true => 0.0,
            false => usual_bar / (self.usual * area),
        }
    }

    /// Cotangent of the smoothing from that of the width.
    pub fn width_pullback(self, width_bar: f64) -> f64 {
        width_bar * self.smoothing / self.width
    }

    /// `q`: the slope at a sample over that of a thick body; 0 for NaN.
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
    pub(super) fn trust(self, slope: f64) -> f64 {
        plate::trust(self.followed(slope))
    }

    /// Position of the thickness in [`Self::range`], from 0 to 1.
    fn followed(self, slope: f64) -> f64 {
        let [low, high] = self.range();
        plate::followed(self.thickness(slope), low, high)
    }

    /// The thicknesses, in cells, between which `ω` rises from 0 to 1.
    pub fn range(self) -> [f64; 2] {
        match self.thin {
            true => FOLLOWED_THIN,
            false => FOLLOWED,
        }
    }

    /// `δ`: rise of `χ` from the faces of this plate to those of one of [`LEAST_THICKNESS`]. A thin
    /// plate makes the dip `−t s exp(−x²/2w²)` for a step of slope `s`.
    pub(super) fn shift(self, slope: f64) -> f64 {
        match self.thin {
            true => self.usual * self.thickness(slope) * self.rise(self.thickness(slope)),
            false => 0.0,
        }
    }

    /// Rise of the dip to the faces of the plate of least thickness, as a share of its depth; not negative.
    fn rise(self, thickness: f64) -> f64 {
        plate::rise(self.depth(thickness), self.depth(LEAST_THICKNESS))
    }

    /// Dip of `χ` at the faces of a plate of this thickness, in cells, over the dip at its middle.
    pub fn depth(self, thickness: f64) -> f64 {
        (-0.125 * (thickness / self.width).powi(2)).exp()
    }

    /// Cotangents of the slope, the usual slope and the width, from those of `ω` and `δ`.
    pub(super) fn pullback(self, slope: f64, trust_bar: f64, shift_bar: f64) -> [f64; 3] {
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
    fn slope_of_a_smoothed_plate_gives_its_thickness_and_the_rise_to_that_of_a_cell() {
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
    fn slopes_of_nan_count_as_flat() {
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
