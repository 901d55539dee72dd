//! The distance to a reconstructed surface at any points: without φ, up to a limit, and with the sides of φ.

use isograd::distance::{Hit, NO_TRIANGLE};
use isograd::orient::Method;
use isograd::{
    Cotangent, Grid, Options, Pipeline, PointCloud, Reconstruction, Reconstructor, Solve,
    SurfaceResolution,
};

use crate::common::{TORUS, Uniform};

fn grid<T: Pipeline>() -> Grid<T> {
    let lower = [-1.213, -1.206, -0.619].map(T::of);
    Grid::new(lower, T::of(0.1), [24, 24, 12]).expect("a grid")
}

/// Marched on the grid of φ, on a finer one, on the automatic one, and in blocks.
fn options() -> [Options; 4] {
    let surface = |factor| Options::default().surface(SurfaceResolution::Factor(factor));
    [
        Options::default().surface(SurfaceResolution::Grid),
        surface(2.0),
        Options::default(),
        surface(2.0).solve(Solve::Sparse),
    ]
    .map(|options| options.orient(Method::Given).checks(false))
}

fn reconstruct<T: Pipeline>(cloud: &PointCloud<T>, options: Options) -> Reconstruction<T> {
    let mut plan = Reconstructor::new(grid(), options).expect("options");
    plan.reconstruct(cloud).expect("a surface");
    plan.into_reconstruction()
}

/// The part of a torus with y below 0, whose surface ends at a wall of the grid, moved there.
fn half_torus() -> PointCloud<f64> {
    let whole = TORUS.uniform::<f64>(8000, 3);
    let normals = whole.normals().expect("given");
    let pairs = whole.points().iter().zip(normals);
    let kept = pairs.filter(|(p, _)| p[1] < 0.0);
    let moved = |[x, y, z]: [f64; 3]| [x, y + 0.97, z];
    let (points, normals) = kept
        .map(|(&p, &n)| (moved(p), n))
        .unzip::<_, _, Vec<_>, Vec<_>>();
    let cloud = PointCloud::new(points).expect("finite");
    cloud.with_normals(normals).expect("one each")
}

fn centers<T: Pipeline>() -> Vec<[T; 3]> {
    let grid = grid::<T>();
    (0..grid.cells())
        .map(|i| grid.center(grid.cell(i)))
        .collect()
}

/// At the cell centers it is φ, side and all, on closed surfaces and on those that end at a wall.
#[test]
fn at_cell_centers_it_is_phi() {
    for (k, options) in options().into_iter().enumerate() {
        for cloud in [TORUS.uniform::<f64>(4000, 3), half_torus()] {
            assert_phi_at_centers(&reconstruct(&cloud, options.clone()), k);
        }
    }
}

fn assert_phi_at_centers(result: &Reconstruction<f64>, case: usize) {
    let hits = result.query(&centers(), f64::INFINITY).expect("a mesh");
    for (i, (hit, &phi)) in hits.iter().zip(result.sdf().values()).enumerate() {
        // Rounding; the faces of equal distance may be others.
        assert!(
            (hit.distance - phi).abs() < 1e-13,
            "{case}, cell {i}: {} for {phi}",
            hit.distance
        );
    }
}

/// Where values on half cells around a center differ, and those on whole cells agree.
#[test]
fn at_cell_centers_it_is_phi_where_only_half_cells_see_the_surface() {
    for seed in 0..8 {
        let options = Options::default().surface(SurfaceResolution::Factor(1.0));
        let cloud = TORUS.uniform::<f64>(1500, seed);
        let options = options.orient(Method::Given).checks(false);
        assert_phi_at_centers(&reconstruct(&cloud, options), seed as usize);
    }
}

/// Up to a limit outside, and everywhere inside, hits are those without a limit.
fn assert_limited<T: Pipeline>() {
    let mut random = Uniform::new(7);
    // Off the grid, too.
    let mut places: Vec<[T; 3]> = (0..5000)
        .map(|_| [3.0, 3.0, 2.0].map(|size| T::of(size * (random.next() - 0.5))))
        .collect();
    places.push([T::zero(), T::nan(), T::zero()]);
    for options in options() {
        let result = reconstruct(&TORUS.uniform::<T>(4000, 3), options);
        let all = result.query(&places, f64::INFINITY).expect("a mesh");
        for within in [1e-3, 0.15, 0.6] {
            let limited = result.query(&places, within).expect("a mesh");
            for ((hit, expected), &place) in limited.iter().zip(&all).zip(&places) {
                if expected.distance.f64() > within {
                    assert_eq!(*hit, Hit::beyond(place, within));
                } else if expected.triangle == NO_TRIANGLE {
                    assert!(hit.distance.is_nan() && hit.triangle == NO_TRIANGLE);
                } else {
                    assert_eq!(hit, expected);
                }
            }
        }
    }
}

#[test]
fn a_limit_leaves_out_what_is_farther_outside_and_nothing_else() {
    assert_limited::<f64>();
    assert_limited::<f32>();
}

/// Without φ: the same surface, distances and gradients, and no numbers in its place.
#[test]
fn without_phi_the_surface_is_the_same() {
    let cloud = TORUS.uniform::<f64>(3000, 3);
    for options in options() {
        let with = reconstruct(&cloud, options.clone());
        let without = reconstruct(&cloud, options.sdf(false));
        assert!(with.mesh() == without.mesh());
        let query = |of: &Reconstruction<f64>| of.query(&centers(), 0.3).expect("a mesh");
        assert_eq!(query(&with), query(&without));
        assert!(without.sdf().values().iter().all(|&phi| phi == 0.0));
        assert!(without.closest().iter().all(|&face| face == NO_TRIANGLE));
        let bars = vec![[0.3, -1.0, 0.7]; with.mesh().vertices().len()];
        let pull = |of: &Reconstruction<f64>| {
            let cotangent = Cotangent {
                vertices: Some(&bars),
                ..Cotangent::default()
            };
            of.pullback(&cotangent).expect("a pullback").points
        };
        assert_eq!(pull(&with), pull(&without));
    }
}
