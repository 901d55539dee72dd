//! The pullback against differences of the map in all inputs at once.

use super::*;
use crate::testing::{Direction, assert_adjoint, moved, moved_numbers};

/// Directions in which the inputs move.
struct Rates {
    samples: Direction,
    chi: Vec<f64>,
    smoothing: f64,
}

impl Rates {
    fn new(n: usize, cells: usize, random: &mut Random) -> Self {
        let mut samples = Direction::new(n, random);
        samples.areas.iter_mut().for_each(|a| *a *= 1e-3);
        samples.spacing = 0.04;
        Self {
            samples,
            chi: numbers(cells, random),
            smoothing: 0.4,
        }
    }
}

impl Setting<f64> {
    fn moved(&self, rates: &Rates, s: f64) -> Self {
        let (here, v) = (self.chi.grid(), &rates.samples);
        let lower = vector::add(here.lower(), vector::scale(v.lower, s));
        let grid = grid(lower, here.spacing() + s * v.spacing);
        let chi = moved_numbers(self.chi.values(), &rates.chi, s);
        Self {
            points: moved(&self.points, &v.points, s),
            normals: moved(&self.normals, &v.normals, s),
            areas: moved_numbers(&self.areas, &v.areas, s),
            chi: Field::new(grid, chi).expect("sizes match"),
            smoothing: self.smoothing + s * rates.smoothing,
            interpolation: self.interpolation,
        }
    }

    /// Cotangents of all inputs for the cotangent `w` of the result, times the rates.
    fn pulled(&self, area: bool, thin: bool, w: &[f64], rates: &Rates) -> f64 {
        let (chi, level, residual) = self.run(area, thin);
        assert!(residual.all_passes().next().is_some());
        let mut out = SampleCotangent::zeros(self.points.len());
        let (mut bars, mut chi_bar) = (Cotangent::default(), w.to_vec());
        let samples = SortedSamples {
            samples: self.samples(),
            order: &self.level().1,
        };
        pullback(
            &chi,
            samples,
            &residual,
            &mut chi_bar,
            &mut PullbackScratch::default(),
            &mut bars,
            &mut out,
        );
        iso_value::pullback(
            self.chi.grid(),
            samples,
            &level,
            bars.level,
            &bars.values,
            &mut chi_bar,
            &mut out,
        );
        rates.samples.inner(&out) + product(&chi_bar, &rates.chi) + bars.smoothing * rates.smoothing
    }
}

#[test]
fn pullback_is_the_derivative_in_all_inputs() {
    use Interpolation::{Linear, Spline};
    for (n, noise, area, thin, interpolation) in [
        (900, 0.0, true, true, Linear),
        (900, 0.1, true, false, Linear),
        (900, 0.0, false, false, Linear),
        (900, 0.0, true, true, Spline),
        // Samples that are followed in common.
        (900, 0.7, true, true, Linear),
        (900, 1.6, true, false, Spline),
        (900, 2.0, true, true, Spline),
        (150, 2.0, true, true, Spline),
        (150, 1.5, true, true, Linear),
        (60, 2.0, false, true, Linear),
    ] {
        let scatter = noise > 0.5;
        let mut setting = Setting::<f64>::new(n, noise);
        setting.interpolation = interpolation;
        // As flat along some normals as on thin parts.
        turn(&mut setting.normals);
        let mut random = Random::new(4);
        let cells = setting.chi.values().len();
        let w = numbers(cells, &mut random);
        let rates = Rates::new(n, cells, &mut random);
        let coarse = setting.run(area, thin).2.coarse;
        println!(
            "coarse: {:?}",
            coarse.as_ref().map(|c| (c.share, c.pass.gain))
        );
        assert_eq!(coarse.is_some(), scatter, "{n} {noise}");
        let pulled = setting.pulled(area, thin, &w, &rates);
        // No sample may cross a plane through cell centers, where slopes jump.
        assert_adjoint("local iso-value", pulled, 1e-7, |s| {
            let (chi, ..) = setting.moved(&rates, s).run(area, thin);
            product(chi.values(), &w)
        });
    }
}
