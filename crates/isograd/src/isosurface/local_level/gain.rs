//! The gain `λ` of a pass, from sums over the samples, and its pullback.

use super::FLATTENED;

/// Sums over the samples, each weighted by its area in cells².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// `Σ â w u`: slopes along the normals, of `e` and of `χ`.
    pub rise: f64,
    /// `Σ â u²`.
    pub slope: f64,
    /// `Σ â s p`: offsets and their predictions.
    pub agreement: f64,
    /// `Σ â s²`.
    pub offset: f64,
    /// `Σ â p²`.
    pub prediction: f64,
}

impl Sums {
    /// From the five sums in the order of the fields.
    pub fn new([rise, slope, agreement, offset, prediction]: [f64; 5]) -> Self {
        Self {
            rise,
            slope,
            agreement,
            offset,
            prediction,
        }
    }

    /// The five sums in the order of the fields.
    pub fn to_array(self) -> [f64; 5] {
        [
            self.rise,
            self.slope,
            self.agreement,
            self.offset,
            self.prediction,
        ]
    }

    /// `ρ`: the share of the slope of `χ` that subtracting `e` removes.
    fn share(&self) -> f64 {
        (self.rise / self.slope).max(0.0)
    }

    /// Numerator and denominator of the coefficient of the linear fit of `s` by `p − ρ s`.
    fn fit(&self) -> [f64; 2] {
        let share = self.share();
        [
            self.agreement - share * self.offset,
            self.prediction - 2.0 * share * self.agreement + share * share * self.offset,
        ]
    }

    /// `λ`, and the share of the slope removed after the pass, where `flattened` was removed before it. `λ` is 0 where
    /// the samples must not be followed, and where the sums are NaN.
    pub fn gain(&self, flattened: f64) -> [f64; 2] {
        let share = self.share();
        let [up, down] = self.fit();
        let (fit, left) = (up / down, 1.0 - (flattened + share) / FLATTENED);
        // NaN meets neither bound.
        if !(fit > 0.0 && left > 0.0) {
            return [0.0, flattened];
        }
        let gain = fit.min(1.0) * left;
        [gain, flattened + gain * share]
    }

    /// Cotangents of the sums and of `flattened`, from those of `λ` and of the share removed after the pass. `λ` must
    /// not be 0.
    pub fn pullback(&self, flattened: f64, gain_bar: f64, flattened_bar: f64) -> (Self, f64) {
        let share = self.share();
        let [up, down] = self.fit();
        let left = 1.0 - (flattened + share) / FLATTENED;
        let fit = up / down;
        let gain_bar = gain_bar + flattened_bar * share;
        let left_bar = gain_bar * fit.min(1.0);
        let fit_bar = if fit < 1.0 { gain_bar * left } else { 0.0 };
        let (up_bar, down_bar) = (fit_bar / down, -fit_bar * fit / down);
        let share_bar = flattened_bar * fit.min(1.0) * left - left_bar / FLATTENED
            + 2.0 * down_bar * (share * self.offset - self.agreement)
            - up_bar * self.offset;
        let rise_bar = match self.rise > 0.0 {
            true => share_bar / self.slope,
            false => 0.0,
        };
        let bars = Self {
            rise: rise_bar,
            slope: -rise_bar * share,
            agreement: up_bar - 2.0 * share * down_bar,
            offset: share * (share * down_bar - up_bar),
            prediction: down_bar,
        };
        (bars, flattened_bar - left_bar / FLATTENED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pullback_is_the_derivative_of_gain_and_share() {
        // A prediction that is too small, one that is too large, and a falling surface.
        for sums in [
            [0.3, 2.0, 0.9, 1.1, 1.4],
            [0.2, 3.0, 1.0, 1.1, 0.9],
            [-0.3, 2.0, 0.5, 1.1, 0.8],
        ] {
            let (gain_bar, flattened_bar, flattened) = (0.7, -1.3, 0.06);
            let value = |sums: [f64; 5], flattened: f64| {
                let [gain, after] = Sums::new(sums).gain(flattened);
                assert!(gain > 0.0);
                gain_bar * gain + flattened_bar * after
            };
            let (bars, before_bar) = Sums::new(sums).pullback(flattened, gain_bar, flattened_bar);
            let step = 1e-6;
            for (m, bar) in bars.to_array().into_iter().enumerate() {
                let at = |s: f64| {
                    let mut sums = sums;
                    sums[m] += s;
                    value(sums, flattened)
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                assert!((bar - difference).abs() < 1e-8, "{m}: {bar} {difference}");
            }
            let at = |s: f64| value(sums, flattened + s);
            let difference = (at(step) - at(-step)) / (2.0 * step);
            assert!((before_bar - difference).abs() < 1e-8);
        }
    }

    #[test]
    fn nothing_to_follow_is_no_gain() {
        assert_eq!(Sums::default().gain(0.0), [0.0, 0.0]);
        let flat = Sums::new([0.6, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(flat.gain(0.1), [0.0, 0.1]);
    }
}
