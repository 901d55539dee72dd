//! Medians, and the distribution of errors.

use rayon::prelude::*;
use serde::Serialize;

/// Median, the upper one of an even count; NaN of an empty list.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Distribution of absolute errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// 99th percentile, by nearest rank.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
    /// Number of errors.
    pub count: usize,
}

impl Spread {
    /// Distribution of `|error(0)| … |error(count − 1)|`, with the same bits for any number of threads. NaN if there are
    /// no errors or one is NaN, so that a missing measurement never looks exact.
    pub fn of(count: usize, error: impl Fn(usize) -> f64 + Sync) -> Self {
        let mut errors: Vec<f64> = (0..count).into_par_iter().map(|i| error(i).abs()).collect();
        errors.par_sort_unstable_by(f64::total_cmp);
        let max = errors.last().copied().unwrap_or(f64::NAN);
        if max.is_nan() {
            return Self {
                mean: max,
                p99: max,
                max,
                count,
            };
        }
        let rank = (0.99 * count as f64).ceil() as usize;
        Self {
            mean: errors.iter().sum::<f64>() / count as f64,
            p99: errors[rank.max(1) - 1],
            max,
            count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_percentile_and_maximum_are_those_of_absolute_values() {
        let spread = Spread::of(1000, |i| i as f64 - 999.0);
        assert_eq!((spread.mean, spread.p99, spread.max), (499.5, 989.0, 999.0));
    }

    #[test]
    fn the_median_is_the_middle_value() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert!(median(vec![]).is_nan());
    }

    #[test]
    fn a_missing_measurement_does_not_look_exact() {
        assert!(Spread::of(0, |_| 0.0).mean.is_nan());
        let broken = Spread::of(3, |i| if i == 1 { f64::NAN } else { 0.0 });
        assert!(broken.mean.is_nan() && broken.max.is_nan());
    }
}
