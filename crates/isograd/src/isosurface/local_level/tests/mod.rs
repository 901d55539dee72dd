//! The oracle is plain: every sum over all samples at every cell, and the sample left out in fact.

mod derivative;

use super::*;
use crate::isosurface::iso_value;
use crate::neighbors::tests::{Random, torus};
use crate::splat::{self, SampleCotangent, Samples, SortedSamples, Weights};
use crate::testing::{bspline, numbers, product};
use crate::{Field, Grid, Real, vector};

/// Samples of a torus, their areas, and an indicator that is a little off on it.
struct Setting<T> {
    points: Vec<[T; 3]>,
    normals: Vec<[T; 3]>,
    areas: Vec<T>,
    chi: Field<T>,
    smoothing: f64,
    interpolation: Interpolation,
}

fn grid<T: Real>(lower: [f64; 3], spacing: f64) -> Grid<T> {
    Grid::new(lower.map(T::of), T::of(spacing), [28, 27, 16]).expect("a grid")
}

impl<T: Real> Setting<T> {
    /// `noise` moves the samples along their normals, in cells.
    fn new(n: usize, noise: f64) -> Self {
        let mut random = Random::new(3);
        let samples = torus(n, 2);
        let at = |&(x, normal): &([f64; 3], [f64; 3]), random: &mut Random| {
            let along = 0.1 * noise * (2.0 * random.uniform() - 1.0);
            vector::of_f64(vector::add(x, vector::scale(normal, along)))
        };
        Self {
            points: samples.iter().map(|s| at(s, &mut random)).collect(),
            normals: samples.iter().map(|s| vector::of_f64(s.1)).collect(),
            areas: (0..n)
                .map(|_| T::of(7.0 / n as f64 * (0.5 + random.uniform())))
                .collect(),
            chi: indicator(grid([-1.41, -1.36, -0.83], 0.1)),
            smoothing: 0.5,
            interpolation: Interpolation::Linear,
        }
    }

    fn samples(&self) -> Samples<'_, T> {
        Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }

    fn level(&self) -> (iso_value::Residual<T>, splat::Residual) {
        let mut level = iso_value::Residual::default();
        let (chi, interpolation) = ((&self.chi).into(), self.interpolation);
        iso_value::forward_on(chi, &self.points, &self.areas, interpolation, &mut level)
            .expect("a level");
        let mut order = splat::Residual::default();
        let mut b = Field::zeros(*self.chi.grid());
        let scratch = &mut Default::default();
        splat::forward(
            self.samples(),
            Weights::BSpline,
            scratch,
            &mut order,
            &mut b,
        )
        .expect("inside");
        (level, order)
    }

    /// The corrected indicator, and its level.
    fn run(&self, area: bool, thin: bool) -> (Field<T>, iso_value::Residual<T>, Residual<T>) {
        let (mut chi, (level, order)) = (self.chi.clone(), self.level());
        let mut residual = Residual::default();
        forward(
            &mut chi,
            SortedSamples {
                samples: self.samples(),
                order: &order,
            },
            Options {
                area,
                smoothing: self.smoothing,
                thin,
            },
            &level,
            &mut Scratch::default(),
            &mut residual,
        );
        (chi, level, residual)
    }
}

/// A step through the torus of radii 0.7 and 0.25, and a wave.
fn indicator<T: Real>(grid: Grid<T>) -> Field<T> {
    let value = |cell: usize| {
        let [x, y, z] = grid.center_f64(grid.cell(cell));
        let distance = (x.hypot(y) - 0.7).hypot(z) - 0.25;
        T::of(0.5 * (7.0 * distance).tanh() + 0.04 * (5.0 * x - 3.0 * y).sin() * (4.0 * z).cos())
    };
    let values = (0..grid.cells()).map(value).collect();
    Field::new(grid, values).expect("sizes match")
}

fn hat(x: f64) -> f64 {
    (1.0 - x.abs()).max(0.0)
}

/// The product over the axes of `f` between a cell center and index coordinates.
fn weight(f: fn(f64) -> f64, cell: [usize; 3], x: [f64; 3]) -> f64 {
    (0..3).map(|a| f(cell[a] as f64 + 0.5 - x[a])).product()
}

/// `e` at every cell, for these samples of these `r` and areas in cells.
fn means(grid: &Grid<f64>, places: &[[f64; 3]], areas: &[f64], r: &[f64]) -> Vec<f64> {
    let at = |cell: usize| {
        let cell = grid.cell(cell);
        let (mut sum, mut area) = (0.0, 0.05);
        for i in 0..places.len() {
            let part = areas[i] * weight(bspline, cell, places[i]);
            sum += part * r[i];
            area += part;
        }
        sum / area
    };
    (0..grid.cells()).map(at).collect()
}

/// The interpolant at index coordinates.
fn interpolate(of: Interpolation, grid: &Grid<f64>, field: &[f64], x: [f64; 3]) -> f64 {
    let f = match of {
        Interpolation::Linear => hat,
        Interpolation::Spline => bspline,
    };
    let cells = (0..grid.cells()).filter(|&c| field[c] != 0.0);
    cells.map(|c| field[c] * weight(f, grid.cell(c), x)).sum()
}

/// Turns some normals anywhere: the indicator is as flat along them as it is on thin parts.
fn turn(normals: &mut [[f64; 3]]) {
    let mut random = Random::new(7);
    for normal in normals.iter_mut().step_by(4) {
        let turned = [0; 3].map(|_| 2.0 * random.uniform() - 1.0);
        *normal = vector::scale(turned, 1.0 / vector::norm(turned));
    }
}

/// The slope along `n` of what quadratic B-splines make of a field.
fn smooth_slope(grid: &Grid<f64>, field: &[f64], x: [f64; 3], n: [f64; 3]) -> f64 {
    let step = 1e-5;
    let at = |s: f64| {
        let x = vector::add(x, vector::scale(n, s));
        let cells = (0..grid.cells()).map(|c| field[c] * weight(bspline, grid.cell(c), x));
        cells.sum::<f64>()
    };
    (at(step) - at(-step)) / (2.0 * step)
}

/// `ω` and `δ` of every sample.
fn trust_and_shifts(slopes: &[f64], areas: &[f64], thin: bool) -> (Vec<f64>, Vec<f64>) {
    let squares = slopes.iter().zip(areas).map(|(s, a)| a * s * s);
    let usual = (squares.sum::<f64>() / areas.iter().sum::<f64>()).sqrt();
    let [low, high] = if thin { FOLLOWED_THIN } else { FOLLOWED };
    let w2 = 0.75 + 0.25;
    let of = |slope: &f64| {
        let q = (slope / usual).clamp(0.0, 0.999);
        let thickness = (-2.0 * w2 * (1.0 - q).ln()).sqrt();
        let t = ((thickness - low) / (high - low)).clamp(0.0, 1.0);
        let rise = (-thickness * thickness / (8.0 * w2)).exp() - (-0.125 / w2).exp();
        let shift = if thin {
            usual * thickness * rise.max(0.0)
        } else {
            0.0
        };
        (t * t * (3.0 - 2.0 * t), shift)
    };
    slopes.iter().map(of).unzip()
}

#[test]
fn cells_lose_the_means_of_the_samples_near_by() {
    use Interpolation::{Linear, Spline};
    for (noise, thin, interpolation) in [
        (0.2, false, Linear),
        (0.2, true, Linear),
        (0.2, true, Spline),
        // Samples that are followed in common: with a part of the share, and with a part of the gain.
        (2.0, true, Spline),
        (1.5, true, Linear),
    ] {
        assert_means_are_lost(noise, thin, interpolation);
    }
}

fn assert_means_are_lost(noise: f64, thin: bool, interpolation: Interpolation) {
    let scatter = noise > 1.0;
    let mut setting = Setting::<f64>::new(if scatter { 150 } else { 60 }, noise);
    setting.interpolation = interpolation;
    turn(&mut setting.normals);
    let (got, level, residual) = setting.run(true, thin);
    let grid = *setting.chi.grid();
    let places: Vec<[f64; 3]> = setting.points.iter().map(|&p| grid.to_index(p)).collect();
    let areas: Vec<f64> = setting.areas.iter().map(|a| a / 0.01).collect();
    let n = places.len();
    let mut chi = setting.chi.values().to_vec();
    let slopes = places.iter().zip(&setting.normals);
    let slopes: Vec<f64> = slopes
        .map(|(&x, &n)| smooth_slope(&grid, &chi, x, n).max(0.0))
        .collect();
    let (trust, shifts) = trust_and_shifts(&slopes, &areas, thin);
    assert!(trust.contains(&1.0) && trust.iter().any(|&t| t < 0.9));
    assert!(shifts.iter().any(|&s| s > 0.0) == thin);
    let offsets = |chi: &[f64]| -> Vec<f64> {
        let value = |i: usize| interpolate(interpolation, &grid, chi, places[i]);
        let r = |i: usize| trust[i] * (value(i) + shifts[i] - level.value);
        (0..n).map(r).collect()
    };
    let mut flattened = 0.0;
    assert!(residual.passes.len() > 1);
    let coarse = residual.coarse.as_ref();
    println!("coarse: {:?}", coarse.map(|c| (c.share, c.pass.gain)));
    assert_eq!(coarse.is_some(), scatter);
    for pass in &residual.passes {
        let r = offsets(&chi);
        let e = means(&grid, &places, &areas, &r);
        let [mut rise, mut steep, mut rp, mut rr, mut pp] = [0.0; 5];
        for i in 0..n {
            let mut others = areas.clone();
            others[i] = 0.0;
            let without = means(&grid, &places, &others, &r);
            let p = interpolate(interpolation, &grid, &without, places[i]);
            let normal = setting.normals[i];
            let [w, u] = [&e, &chi].map(|f| smooth_slope(&grid, f, places[i], normal));
            rise += areas[i] * w * u;
            steep += areas[i] * u * u;
            rp += areas[i] * r[i] * p;
            rr += areas[i] * r[i] * r[i];
            pp += areas[i] * p * p;
        }
        let share = (rise / steep).max(0.0);
        let fit = (rp - share * rr) / (pp - 2.0 * share * rp + share * share * rr);
        let gain = fit.min(1.0) * (1.0 - (flattened + share) / FLATTENED);
        flattened += gain * share;
        // Slopes by differences are good to 1e-9.
        assert!((pass.gain - gain).abs() < 1e-8, "{} {gain}", pass.gain);
        for (chi, e) in chi.iter_mut().zip(e) {
            *chi -= pass.gain * e;
        }
    }
    let share = coarse_share(&residual);
    if scatter {
        let given = coarse_means(interpolation, &grid, (&places, &areas), &offsets(&chi));
        let given: Vec<f64> = given.into_iter().map(|m| share * m).collect();
        let e = means(&grid, &places, &areas, &given);
        for (chi, e) in chi.iter_mut().zip(e) {
            *chi -= e;
        }
    }
    let errors = got.values().iter().zip(&chi).map(|(a, b)| (a - b).abs());
    // Slopes by differences again.
    assert!(errors.fold(0.0, f64::max) < 1e-8);
}

/// `γ`: 1 up to a gain of ¼ of the first pass, 0 from ¾ on.
fn coarse_share(residual: &Residual<f64>) -> f64 {
    let first = residual.gains().next().unwrap_or(0.0);
    (1.5 - 2.0 * first).clamp(0.0, 1.0)
}

/// The means of the offsets `r` on cells 6 times as large, at the samples, times the gain there.
fn coarse_means(
    of: Interpolation,
    grid: &Grid<f64>,
    (places, areas): (&[[f64; 3]], &[f64]),
    r: &[f64],
) -> Vec<f64> {
    let coarse = Grid::new([0.0; 3], 1.0, grid.shape().map(|n| n.div_ceil(6) + 4)).expect("a grid");
    let places: Vec<[f64; 3]> = places.iter().map(|x| x.map(|x| x / 6.0 + 2.0)).collect();
    let areas: Vec<f64> = areas.iter().map(|a| a / 36.0).collect();
    let e = means(&coarse, &places, &areas, r);
    let (mut agreement, mut square) = (0.0, 0.0);
    for i in 0..r.len() {
        let mut others = areas.clone();
        others[i] = 0.0;
        let without = means(&coarse, &places, &others, r);
        let p = interpolate(of, &coarse, &without, places[i]);
        agreement += areas[i] * r[i] * p;
        square += areas[i] * p * p;
    }
    let gain = (agreement / square).clamp(0.0, 1.0);
    let mean = |&x: &[f64; 3]| gain * interpolate(of, &coarse, &e, x);
    places.iter().map(mean).collect()
}

#[test]
fn samples_come_to_lie_at_the_level() {
    let setting = Setting::<f32>::new(4000, 0.0);
    let (chi, level, residual) = setting.run(true, false);
    assert!(residual.gains().all(|gain| gain > 0.5));
    let rms = |chi: &Field<f32>| {
        let squares = setting.points.iter().map(|&p| {
            let r = f64::from(chi.interpolate(p)) - level.value;
            r * r
        });
        (squares.sum::<f64>() / 4000.0).sqrt()
    };
    let (before, after) = (rms(&setting.chi), rms(&chi));
    // The rest varies within a cell.
    assert!(after < 0.2 * before, "{before} {after}");
}

#[test]
fn samples_scattered_over_a_thick_layer_are_not_followed() {
    let setting = Setting::<f64>::new(4000, 1.5);
    let (chi, _, residual) = setting.run(true, false);
    let slope = |chi: &Field<f64>| {
        let at = |&p: &[f64; 3]| vector::norm(chi.interpolate_with_gradient(p).1);
        setting.points.iter().map(at).sum::<f64>()
    };
    let kept = slope(&chi) / slope(&setting.chi);
    println!(
        "{:?}, {kept} of the slope",
        residual.gains().collect::<Vec<_>>()
    );
    assert!(kept > 0.7, "{kept} of the slope is left");
}

fn same_bits<T: Real>() {
    let setting = Setting::<T>::new(5000, 0.1);
    crate::testing::assert_same_bits(|| {
        let (chi, _, residual) = setting.run(true, true);
        (chi.values().to_vec(), residual)
    });
}

#[test]
fn threads_do_not_change_a_bit() {
    same_bits::<f32>();
    same_bits::<f64>();
}

/// Samples without area, coinciding samples, and an indicator without slope.
#[test]
fn degenerate_samples_leave_finite_numbers() {
    let mut setting = Setting::<f32>::new(50, 0.0);
    setting.areas[..49].fill(0.0);
    let (chi, ..) = setting.run(true, false);
    assert!(chi.values().iter().all(|v| v.is_finite()));
    let first = setting.points[0];
    setting.points.fill(first);
    let (chi, ..) = setting.run(false, true);
    assert!(chi.values().iter().all(|v| v.is_finite()));
    setting.chi.values_mut().fill(1.0);
    let (chi, ..) = setting.run(true, false);
    // The mean of ones is one to rounding.
    assert!(chi.values().iter().all(|v| (v - 1.0).abs() < 1e-6));
}
