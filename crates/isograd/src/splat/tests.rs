//! The oracle stores `V` on the whole grid and applies the operators with their rows at the walls.

use super::*;
use crate::neighbors::tests::even_sphere;
use crate::poisson;
use crate::testing::noise;

#[derive(Clone)]
struct Cloud {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    areas: Vec<f64>,
}

impl Cloud {
    fn samples(&self) -> Samples<'_, f64> {
        Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }
}

/// Samples anywhere in the allowed part of the grid, with any vectors and areas.
fn random_cloud(grid: &Grid<f64>, count: usize, seed: u64) -> Cloud {
    let mut signed = noise(seed);
    let mut next = || 0.5 * (signed() + 1.0);
    let mut vector = |low: f64, high: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|a| low + (high[a] - low) * next())
    };
    let inner = grid.shape().map(|n| n as f64 - 2.0);
    Cloud {
        points: (0..count)
            .map(|_| grid.from_index(vector(2.0, inner)))
            .collect(),
        normals: (0..count).map(|_| vector(-1.0, [1.0; 3])).collect(),
        areas: (0..count).map(|_| vector(0.0, [1.0; 3])[0]).collect(),
    }
}

fn splat<T: Real>(grid: &Grid<f64>, cloud: &Cloud, weights: Weights) -> Vec<f64> {
    let cast = |v: &[[f64; 3]]| v.iter().map(|&p| vector::of_f64(p)).collect::<Vec<_>>();
    let lower = vector::of_f64(grid.lower());
    let grid = Grid::new(lower, T::of(grid.spacing()), grid.shape()).expect("valid");
    let areas: Vec<T> = cloud.areas.iter().map(|&a| T::of(a)).collect();
    // The previous contents must not matter.
    let mut b = Field::new(grid, vec![T::of(f64::NAN); grid.cells()]).expect("sizes match");
    let (points, normals) = (cast(&cloud.points), cast(&cloud.normals));
    let samples = Samples {
        points: &points,
        normals: &normals,
        areas: &areas,
    };
    forward(
        samples,
        weights,
        &mut Scratch::default(),
        &mut Residual::default(),
        &mut b,
    )
    .expect("valid samples");
    b.values().iter().map(|v| v.f64()).collect()
}

/// The 27 weights at offset `f` from the center of the central cell, as the design or the paper print
/// them, in C order.
fn printed_weights(weights: Weights, f: [f64; 3]) -> [f64; 27] {
    let offset = |o: usize| [o / 9, o / 3 % 3, o % 3].map(|d| d as f64 - 1.0);
    let raw: [f64; 27] = std::array::from_fn(|o| match weights {
        Weights::BSpline => (0..3)
            .map(|a| match offset(o)[a] {
                -1.0 => 0.5 * (0.5 - f[a]).powi(2),
                0.0 => 0.75 - f[a] * f[a],
                _ => 0.5 * (0.5 + f[a]).powi(2),
            })
            .product(),
        Weights::Paper if o == 13 => 0.5,
        Weights::Paper => (0..3)
            .map(|a| 0.5 * (1.0 - (f[a] - offset(o)[a]).abs() / 2.0).max(0.0))
            .product(),
    });
    match weights {
        Weights::BSpline => raw,
        Weights::Paper => raw.map(|w| w / raw.iter().sum::<f64>()),
    }
}

/// `V`, one field per component.
fn dense_vectors(grid: &Grid<f64>, cloud: &Cloud, weights: Weights) -> [Vec<f64>; 3] {
    let mut v = [(); 3].map(|()| vec![0.0; grid.cells()]);
    for (i, point) in cloud.points.iter().enumerate() {
        let x = grid.to_index(*point);
        let cell = x.map(|u| u.floor());
        let f = std::array::from_fn(|a| x[a] - cell[a] - 0.5);
        for (o, alpha) in printed_weights(weights, f).into_iter().enumerate() {
            let o = [o / 9, o / 3 % 3, o % 3];
            let at = grid.index(std::array::from_fn(|a| cell[a] as usize + o[a] - 1));
            for d in 0..3 {
                v[d][at] += alpha * cloud.areas[i] * cloud.normals[i][d] / grid.spacing().powi(2);
            }
        }
    }
    v
}

/// `low·u_{p−1} + center·u_p + high·u_{p+1}` along one axis; beyond a wall, `u` is reflected, times `sign`.
fn along(grid: &Grid<f64>, u: &[f64], axis: usize, row: [f64; 3], sign: f64) -> Vec<f64> {
    let (n, stride) = (grid.shape()[axis], grid.strides()[axis]);
    let at = |i: usize| {
        let p = grid.cell(i)[axis];
        let low = if p == 0 { sign * u[i] } else { u[i - stride] };
        let high = if p + 1 == n {
            sign * u[i]
        } else {
            u[i + stride]
        };
        row[0] * low + row[1] * u[i] + row[2] * high
    };
    (0..u.len()).map(at).collect()
}

/// `b = Σ_d D_d V_d`.
fn dense_right_hand_side(grid: &Grid<f64>, v: [Vec<f64>; 3]) -> Vec<f64> {
    let mut b = vec![0.0; grid.cells()];
    for (d, mut u) in v.into_iter().enumerate() {
        for axis in 0..3 {
            u = if axis == d {
                along(grid, &u, axis, [0.5, 0.0, -0.5], -1.0)
            } else {
                along(grid, &u, axis, [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0], 1.0)
            };
        }
        b.iter_mut().zip(u).for_each(|(b, u)| *b += u);
    }
    b
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    // A NaN must not be lost in a maximum.
    a.iter().zip(b).fold(0.0, |m, (x, y)| {
        let d = (x - y).abs();
        if d > m || d.is_nan() { d } else { m }
    })
}

const BOTH: [Weights; 2] = [Weights::BSpline, Weights::Paper];

fn small_grid() -> Grid<f64> {
    Grid::new([-1.0, 0.5, 2.0], 0.25, [21, 9, 12]).expect("valid")
}

#[test]
fn right_hand_side_is_that_of_the_stored_vector_field() {
    let grid = small_grid();
    let cloud = random_cloud(&grid, 500, 1);
    for weights in BOTH {
        let expected = dense_right_hand_side(&grid, dense_vectors(&grid, &cloud, weights));
        let largest = largest_difference(&expected, &vec![0.0; grid.cells()]);
        let double = largest_difference(&splat::<f64>(&grid, &cloud, weights), &expected);
        let single = largest_difference(&splat::<f32>(&grid, &cloud, weights), &expected);
        // Rounding of a few dozen terms; in f32 also of positions, at 1e-6 of a cell.
        assert!(
            double < 1e-14 * largest,
            "{weights:?}: {double:e} of {largest}"
        );
        assert!(
            single < 1e-5 * largest,
            "{weights:?}: {single:e} of {largest}"
        );
    }
}

#[test]
fn right_hand_side_sums_to_nothing_and_its_first_moment_is_the_area_vector() {
    let grid = small_grid();
    let cloud = random_cloud(&grid, 200, 2);
    for weights in BOTH {
        let b = splat::<f64>(&grid, &cloud, weights);
        // Rounding of 2,000 numbers of size 10.
        assert!(b.iter().sum::<f64>().abs() < 1e-11);
        for d in 0..3 {
            let moment: f64 = (0..b.len()).map(|i| b[i] * grid.cell(i)[d] as f64).sum();
            let vector = cloud.normals.iter().zip(&cloud.areas);
            let expected: f64 = vector.map(|(n, a)| n[d] * a / 0.0625).sum();
            // Weights that do not add up to 1 would show here.
            assert!((moment - expected).abs() < 1e-10, "{moment} {expected}");
        }
    }
}

#[test]
fn shift_by_whole_cells_shifts_the_right_hand_side() {
    let grid = small_grid();
    // Positions in 1/64 cell, so that the shift is exact.
    let mut cloud = random_cloud(&grid, 100, 3);
    let snap = |x: f64| (x * 256.0).round() / 256.0;
    cloud.points = cloud
        .points
        .iter()
        .map(|p| [snap(p[0]).clamp(-0.5, 1.0), snap(p[1]), snap(p[2])])
        .collect();
    let before = splat::<f64>(&grid, &cloud, Weights::BSpline);
    cloud.points.iter_mut().for_each(|p| p[0] += 3.0 * 0.25);
    let after = splat::<f64>(&grid, &cloud, Weights::BSpline);
    let offset = 3 * grid.strides()[0];
    assert_eq!(before[..before.len() - offset], after[offset..]);
    assert!(after[..offset].iter().all(|&v| v == 0.0));
}

/// Change of `b` when a sample crosses the face between two cells.
fn jump(weights: Weights) -> f64 {
    let grid = small_grid();
    let across = |side: f64| {
        let cloud = Cloud {
            points: vec![grid.from_index([9.0 + side * 1e-9, 4.3, 5.7])],
            normals: vec![[0.6, 0.0, 0.8]],
            areas: vec![0.0625],
        };
        splat::<f64>(&grid, &cloud, weights)
    };
    largest_difference(&across(-1.0), &across(1.0))
}

#[test]
fn bspline_is_continuous_across_a_cell_face_and_the_paper_weights_are_not() {
    // The point moves by 2e-9 cells.
    assert!(jump(Weights::BSpline) < 1e-8);
    assert!(jump(Weights::Paper) > 1e-2);
}

#[test]
fn threads_do_not_change_a_bit() {
    let grid = Grid::new([0.0; 3], 1.0, [45, 20, 16]).expect("valid");
    let cloud = random_cloud(&grid, 5000, 4);
    for weights in BOTH {
        crate::testing::assert_same_bits(|| splat::<f32>(&grid, &cloud, weights));
    }
}

#[test]
fn scratch_and_residual_can_be_used_again() {
    let grid = small_grid();
    let (mut scratch, mut residual) = (Scratch::default(), Residual::default());
    let mut b = Field::zeros(grid);
    for (count, seed) in [(300, 5), (0, 6), (40, 7)] {
        let cloud = random_cloud(&grid, count, seed);
        forward(
            cloud.samples(),
            Weights::Paper,
            &mut scratch,
            &mut residual,
            &mut b,
        )
        .expect("valid samples");
        assert_eq!(b.values(), splat::<f64>(&grid, &cloud, Weights::Paper));
        let mut sorted = residual.order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..count as u32));
    }
}

#[test]
fn samples_exactly_two_cells_from_the_walls_are_taken() {
    let grid = small_grid();
    let cloud = Cloud {
        points: vec![
            grid.from_index([2.0; 3]),
            grid.from_index([19.0, 7.0, 10.0]),
        ],
        normals: vec![[1.0, 0.0, 0.0]; 2],
        areas: vec![1.0; 2],
    };
    let b = splat::<f64>(&grid, &cloud, Weights::BSpline);
    assert!(b.iter().sum::<f64>().abs() < 1e-12);
}

#[test]
fn bad_input_is_refused_with_its_index_and_leaves_the_field_alone() {
    let grid = small_grid();
    let good = random_cloud(&grid, 3000, 8);
    let refused = |point: [f64; 3], normal: f64, area: f64, grid: &Grid<f64>| {
        let mut b = Field::zeros(*grid);
        b.values_mut().fill(7.0);
        let mut cloud = good.clone();
        cloud.points[2500] = point;
        cloud.normals[2500][1] = normal;
        cloud.areas[2500] = area;
        let (mut scratch, mut residual) = (Scratch::default(), Residual::default());
        let w = Weights::BSpline;
        let error = forward(cloud.samples(), w, &mut scratch, &mut residual, &mut b);
        assert!(b.values().iter().all(|&v| v == 7.0));
        error.expect_err("refused").to_string()
    };
    let inside = good.points[0];
    for x in [1.99, 19.01, -1e300, f64::NAN, f64::INFINITY] {
        let message = refused(grid.from_index([x, 4.0, 4.0]), 0.0, 1.0, &grid);
        assert!(
            message.contains("point 2500") && message.contains("padding"),
            "{message}"
        );
    }
    assert!(refused(inside, f64::NAN, 1.0, &grid).contains("point 2500"));
    assert!(refused(inside, 0.0, f64::INFINITY, &grid).contains("point 2500"));
    let tiny = Grid::new([0.0; 3], 1.0, [2, 4, 9]).expect("valid");
    assert!(refused([1.0; 3], 0.0, 1.0, &tiny).contains("point 0"));
    let (mut scratch, mut residual) = (Scratch::default(), Residual::default());
    let mut b = Field::zeros(grid);
    let samples = Samples {
        points: &[inside],
        normals: &[],
        areas: &[1.0],
    };
    let count = forward(samples, Weights::Paper, &mut scratch, &mut residual, &mut b);
    assert!(
        count
            .expect_err("refused")
            .to_string()
            .contains("0 normals")
    );
}

/// The indicator of a sphere is −½ and ½ about its mean: constant on both sides, with a jump of 1.
#[test]
fn indicator_of_a_sphere_rises_by_one_from_inside_to_outside() {
    let count = 20_000;
    let radius = 0.8;
    let normals = even_sphere(count);
    let cloud = Cloud {
        points: normals.iter().map(|n| n.map(|v| radius * v)).collect(),
        areas: vec![4.0 * std::f64::consts::PI * radius * radius / count as f64; count],
        normals,
    };
    let grid = Grid::new([-1.2; 3], 0.06, [40, 40, 40]).expect("valid");
    for weights in BOTH {
        let mut chi = splat::<f64>(&grid, &cloud, weights);
        poisson::Plan::new(grid.shape())
            .solve(&mut chi, 0.0, &mut poisson::Scratch::default())
            .expect("sizes match");
        let chi = Field::new(grid, chi).expect("sizes match");
        let outside = chi.interpolate([1.1, -1.1, 1.1]);
        for point in [[0.0; 3], [0.5, 0.0, 0.0], [-0.3, 0.3, 0.4]] {
            let rise = outside - chi.interpolate(point);
            // The surface is 3.6 and more cells away. What is left is the unevenness of the samples, and for
            // the paper's weights that their center of mass is not the sample.
            let tolerance = if weights == Weights::Paper {
                5e-3
            } else {
                1e-3
            };
            assert!((rise - 1.0).abs() < tolerance, "{weights:?}: {rise}");
        }
        let residual = &mut Default::default();
        let (points, areas) = (&cloud.points, &cloud.areas);
        let c =
            crate::isosurface::iso_value::forward(&chi, points, areas, residual).expect("a value");
        // A blur of s cells puts more than half of a ball around a surface sample outside the sphere, by
        // s/(√2π r): 0.02 for s = 0.75 and r = 13 cells.
        let rise = outside - c;
        assert!((0.46..0.5).contains(&rise), "{weights:?}: {rise}");
    }
}
