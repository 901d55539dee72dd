//! The oracle is a dense minimization on a tiny grid.

use super::*;
use crate::isosurface::iso_value;
use crate::neighbors::tests::Random;
use crate::poisson::tests::{eliminate, stiffness};
use crate::splat::{self, SampleCotangent, Samples, Weights};
use crate::testing::{Direction, assert_adjoint, moved, moved_numbers, numbers, product};
use crate::{Field, vector};

const SHAPE: [usize; 3] = [7, 6, 8];

/// Samples anywhere two cells off the walls, and a plain solution.
struct Setting<T: Real> {
    points: Vec<[T; 3]>,
    normals: Vec<[T; 3]>,
    areas: Vec<T>,
    x0: Field<T>,
    plan: Plan<T>,
    order: splat::Residual,
}

impl<T: Real> Setting<T> {
    fn new(n: usize, lower: [f64; 3], spacing: f64) -> Self {
        let mut random = Random::new(5);
        let grid = Grid::new(lower.map(T::of), T::of(spacing), SHAPE).expect("a grid");
        let points = (0..n).map(|_| {
            let x = SHAPE.map(|cells| 2.0 + (cells as f64 - 4.0) * random.uniform());
            vector::of_f64([0, 1, 2].map(|a| 0.3 + 0.5 * x[a]))
        });
        let points: Vec<[T; 3]> = points.collect();
        let areas = (0..n).map(|_| T::of(0.1 * random.uniform())).collect();
        let plan = Plan::new(SHAPE);
        let mut values: Vec<T> = (0..grid.cells())
            .map(|_| T::of(random.uniform() - 0.5))
            .collect();
        plan.solve(&mut values, 0.0, &mut Default::default())
            .expect("sizes match");
        let mut out = Self {
            normals: vec![[T::one(), T::zero(), T::zero()]; n],
            points,
            areas,
            x0: Field::new(grid, values).expect("sizes match"),
            plan,
            order: splat::Residual::default(),
        };
        out.sort();
        out
    }

    fn samples(&self) -> Samples<'_, T> {
        Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }

    fn sort(&mut self) {
        let mut b = Field::zeros(*self.x0.grid());
        let samples = self.samples();
        let scratch = &mut Default::default();
        let mut order = splat::Residual::default();
        splat::forward(samples, Weights::BSpline, scratch, &mut order, &mut b).expect("inside");
        self.order = order;
    }

    fn equation(&self, screening: f64, area: bool) -> Equation<'_, T> {
        Equation {
            plan: &self.plan,
            grid: self.x0.grid(),
            samples: SortedSamples {
                samples: self.samples(),
                order: &self.order,
            },
            area,
            screening,
        }
    }

    fn solve(&self, screening: f64, area: bool) -> (Vec<T>, usize) {
        let mut chi = self.x0.values().to_vec();
        let equation = self.equation(screening, area);
        let made = forward(&equation, &mut chi, &mut Scratch::default()).expect("converges");
        (chi, made)
    }
}

#[test]
fn solution_is_that_of_the_dense_minimization() {
    let setting = Setting::<f64>::new(40, [0.3; 3], 0.5);
    let (grid, cells) = (*setting.x0.grid(), setting.x0.values().len());
    for screening in [0.0, 0.5, 20.0] {
        let mut matrix = stiffness(SHAPE, false);
        let b: Vec<f64> = matrix
            .iter()
            .map(|row| product(row, setting.x0.values()))
            .collect();
        // The rows of the samples, less their mean: the misfit for the best c.
        let areas: Vec<f64> = setting.areas.iter().map(|a| a / 0.25).collect();
        let rows: Vec<Vec<f64>> = setting
            .points
            .iter()
            .map(|&p| {
                let cube = crate::trilinear::Cube::new(&grid, grid.to_index(p));
                let mut row = vec![0.0; cells];
                for (cell, weight) in cube.cells().into_iter().zip(cube.weights()) {
                    row[cell] += weight;
                }
                row
            })
            .collect();
        let total: f64 = areas.iter().sum();
        let mean: Vec<f64> = (0..cells)
            .map(|c| rows.iter().zip(&areas).map(|(r, a)| a * r[c]).sum::<f64>() / total)
            .collect();
        for (row, a) in rows.iter().zip(&areas) {
            let row: Vec<f64> = row.iter().zip(&mean).map(|(r, m)| r - m).collect();
            for i in 0..cells {
                for j in 0..cells {
                    matrix[i][j] += screening * a * row[i] * row[j];
                }
            }
        }
        // Fixes the mean of χ at 0.
        matrix.iter_mut().flatten().for_each(|v| *v += 1.0);
        let expected = eliminate(matrix, b);
        let (chi, _) = setting.solve(screening, true);
        let size = product(&expected, &expected).sqrt();
        let errors = chi.iter().zip(&expected).map(|(a, b)| (a - b).powi(2));
        // The tolerance of the solver is 1e-11.
        assert!(errors.sum::<f64>().sqrt() < 1e-9 * size, "α = {screening}");
    }
}

#[test]
fn single_precision_stops_in_few_iterations_at_the_same_field() {
    let (single, double) = (
        Setting::<f32>::new(300, [0.3; 3], 0.5),
        Setting::<f64>::new(300, [0.3; 3], 0.5),
    );
    let ((single, made), (double, _)) = (single.solve(2.0, true), double.solve(2.0, true));
    let size = product(&double, &double).sqrt();
    let errors = single.iter().zip(&double);
    let error = errors
        .map(|(a, b)| (f64::from(*a) - b).powi(2))
        .sum::<f64>()
        .sqrt();
    assert!(
        error < 1e-4 * size && made < 60,
        "{error} of {size}, {made} iterations"
    );
}

#[test]
fn pullback_is_the_transpose_for_areas_and_for_counts() {
    let (n, screening, step) = (80, 1.5, 1e-7);
    for area in [true, false] {
        let mut setting = Setting::<f64>::new(n, [0.3; 3], 0.5);
        if !area {
            setting.areas.fill(1.0);
        }
        let mut random = Random::new(6);
        let cells = setting.x0.values().len();
        let (w, along) = (numbers(cells, &mut random), numbers(cells, &mut random));
        let mut v = Direction::new(n, &mut random);
        v.spacing = 0.04;

        let (chi, _) = setting.solve(screening, area);
        let chi = Field::new(*setting.x0.grid(), chi).expect("sizes match");
        let mut level = iso_value::Residual::default();
        iso_value::forward(&chi, &setting.points, &setting.areas, &mut level).expect("a level");
        let mut out = SampleCotangent::zeros(n);
        let mut x0_bar = w.clone();
        let equation = setting.equation(screening, area);
        let scratch = &mut Scratch::default();
        pullback(&equation, &level, &mut x0_bar, scratch, &mut out).expect("converges");
        let pulled = v.inner(&out) + product(&x0_bar, &along);
        assert_adjoint("screened", pulled, step, |s| {
            let place = vector::add([0.3; 3], vector::scale(v.lower, s));
            let mut at = Setting::<f64>::new(n, [0.3; 3], 0.5);
            let grid = Grid::new(place, 0.5 + s * v.spacing, SHAPE).expect("a grid");
            let values = moved_numbers(setting.x0.values(), &along, s);
            at.x0 = Field::new(grid, values).expect("sizes match");
            at.points = moved(&setting.points, &v.points, s);
            at.areas = moved_numbers(&setting.areas, &v.areas, s);
            at.sort();
            product(&at.solve(screening, area).0, &w)
        });
    }
}

#[test]
fn samples_without_area_leave_the_plain_solution() {
    let mut setting = Setting::<f32>::new(20, [0.3; 3], 0.5);
    setting.areas.fill(0.0);
    let (chi, made) = setting.solve(3.0, true);
    assert!(made == 0 && chi == setting.x0.values());
}
