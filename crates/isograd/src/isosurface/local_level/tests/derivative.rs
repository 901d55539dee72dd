//! The pullback against differences of the map in all inputs at once.

use super::*;

/// Directions in which the inputs move.
struct Rates {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    areas: Vec<f64>,
    chi: Vec<f64>,
    lower: [f64; 3],
    spacing: f64,
    smoothing: f64,
}

impl Rates {
    fn new(n: usize, cells: usize, random: &mut Random) -> Self {
        let mut vectors = || {
            let vector = |_| [0; 3].map(|_| 2.0 * random.uniform() - 1.0);
            (0..n).map(vector).collect()
        };
        Self {
            points: vectors(),
            normals: vectors(),
            areas: numbers(n, random).iter().map(|a| 1e-3 * a).collect(),
            chi: numbers(cells, random),
            lower: [0.3, -0.2, 0.5],
            spacing: 0.04,
            smoothing: 0.4,
        }
    }
}

impl Setting<f64> {
    fn moved(&self, rates: &Rates, s: f64) -> Self {
        let vectors = |of: &[[f64; 3]], rates: &[[f64; 3]]| {
            let moved = of.iter().zip(rates);
            let moved = moved.map(|(x, v)| vector::add(*x, vector::scale(*v, s)));
            moved.collect::<Vec<_>>()
        };
        let numbers = |of: &[f64], rates: &[f64]| {
            let moved = of.iter().zip(rates).map(|(x, v)| x + s * v);
            moved.collect::<Vec<_>>()
        };
        let here = self.chi.grid();
        let lower = vector::add(here.lower(), vector::scale(rates.lower, s));
        let grid = grid(lower, here.spacing() + s * rates.spacing);
        let chi = numbers(self.chi.values(), &rates.chi);
        Self {
            points: vectors(&self.points, &rates.points),
            normals: vectors(&self.normals, &rates.normals),
            areas: numbers(&self.areas, &rates.areas),
            chi: Field::new(grid, chi).expect("sizes match"),
            smoothing: self.smoothing + s * rates.smoothing,
        }
    }

    /// Cotangents of all inputs for `w` at the cells that come out, times the rates.
    fn pulled(&self, area_weights: bool, thin: bool, w: &[f64], rates: &Rates) -> f64 {
        let (chi, level, residual) = self.run(area_weights, thin);
        assert!(!residual.passes.is_empty());
        let n = self.points.len();
        let mut out = SampleCotangent {
            points: vec![[0.0; 3]; n],
            normals: vec![[0.0; 3]; n],
            areas: vec![0.0; n],
            ..SampleCotangent::default()
        };
        let (mut values_bar, mut chi_bar) = (Vec::new(), w.to_vec());
        let (order, grid, samples) = (self.level().1, self.chi.grid(), self.samples());
        let found = pullback(
            &chi,
            samples,
            area_weights,
            &order,
            &residual,
            &mut chi_bar,
            &mut PullbackScratch::default(),
            &mut values_bar,
            &mut out,
        );
        iso_value::pullback(
            grid,
            samples,
            &level,
            &order,
            found.level,
            &values_bar,
            &mut chi_bar,
            &mut out,
        );
        let vectors = |a: &[[f64; 3]], b: &[[f64; 3]]| {
            let products = a.iter().zip(b).map(|(a, b)| vector::dot(*a, *b));
            products.sum::<f64>()
        };
        vectors(&out.points, &rates.points)
            + vectors(&out.normals, &rates.normals)
            + product(&out.areas, &rates.areas)
            + product(&chi_bar, &rates.chi)
            + vector::dot(out.grid.lower, rates.lower)
            + out.grid.spacing * rates.spacing
            + found.smoothing * rates.smoothing
    }
}

#[test]
fn pullback_is_the_derivative_in_all_inputs() {
    for (area_weights, thin, noise) in [(true, true, 0.0), (true, false, 0.1), (false, false, 0.0)]
    {
        let mut setting = Setting::<f64>::new(900, noise);
        // As flat along some normals as on thin parts.
        turn(&mut setting.normals);
        let mut random = Random::new(4);
        let cells = setting.chi.values().len();
        let w = numbers(cells, &mut random);
        let rates = Rates::new(900, cells, &mut random);
        let pulled = setting.pulled(area_weights, thin, &w, &rates);
        // No sample may cross a plane through cell centers, where slopes jump.
        let step = 1e-7;
        let at = |s: f64| {
            let (chi, ..) = setting.moved(&rates, s).run(area_weights, thin);
            product(chi.values(), &w)
        };
        let difference = (at(step) - at(-step)) / (2.0 * step);
        let error = (pulled / difference - 1.0).abs();
        println!("{pulled}, differences {difference}: {error:e}");
        assert!(error < 1e-6, "{pulled}, not {difference} ({error:e})");
    }
}
