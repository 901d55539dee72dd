//! Mean and maximum of errors, and how they are written.

use isograd_page::table::number;
use rayon::prelude::*;
use serde::Serialize;

/// Mean and maximum of absolute errors, and how many they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Mean of the absolute values.
    pub mean: f64,
    /// The 99th percentile, by nearest rank.
    pub p99: f64,
    /// The greatest.
    pub max: f64,
    /// Their number.
    pub count: usize,
}

impl Spread {
    /// Of `error(0) … error(count − 1)`: the same digits on any number of threads. All NaN where there is
    /// nothing or an error is NaN, so that nothing that was not measured looks exact.
    pub fn of(count: usize, error: impl Fn(usize) -> f64 + Sync) -> Self {
        let mut errors: Vec<f64> = (0..count).into_par_iter().map(|i| error(i).abs()).collect();
        errors.par_sort_unstable_by(f64::total_cmp);
        let Some(&max) = errors.last() else {
            return Self {
                mean: f64::NAN,
                p99: f64::NAN,
                max: f64::NAN,
                count,
            };
        };
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

/// Mean and maximum.
pub fn pair(spread: &Spread) -> String {
    format!("{} / {}", number(spread.mean), number(spread.max))
}

/// Mean, 99th percentile and maximum.
pub fn triple(spread: &Spread) -> String {
    format!(
        "{} / {} / {}",
        number(spread.mean),
        number(spread.p99),
        number(spread.max)
    )
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
    fn what_was_not_measured_does_not_look_exact() {
        assert!(Spread::of(0, |_| 0.0).mean.is_nan());
        let broken = Spread::of(3, |i| if i == 1 { f64::NAN } else { 0.0 });
        assert!(broken.mean.is_nan() && broken.max.is_nan());
    }
}
