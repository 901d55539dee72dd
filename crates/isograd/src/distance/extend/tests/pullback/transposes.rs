//! Against finite differences of the whole stage.

use super::*;
use crate::testing::{inner, product};
use crate::vector::{add, dot, scale};

const STEP: f64 = 2e-6;

/// `⟨J v, w⟩` by central differences against the same of the pullback. Cells whose closest point passes to
/// another feature within the step have no derivative: their cotangents are 0.
fn assert_adjoint(
    change: impl Fn(&mut Scene<f64>, &mut Attribute<f64>, f64),
    product: impl Fn(&Cotangent<f64>, &Scene<f64>) -> f64,
) {
    let scene = || Scene::<f64>::even(2500, 20);
    let (_, residual) = scene().extend(&scene().attribute(wavy));
    let common = scene().neighborhoods.common_radius;
    assert!(residual.fits.iter().all(|fit| fit.radius == common));
    assert_adjoint_of(STEP, scene, change, product);
}

fn assert_adjoint_of(
    step: f64,
    make: impl Fn() -> Scene<f64>,
    change: impl Fn(&mut Scene<f64>, &mut Attribute<f64>, f64),
    product: impl Fn(&Cotangent<f64>, &Scene<f64>) -> f64,
) {
    let scene = make();
    let attribute = scene.attribute(wavy);
    let (extension, residual) = scene.extend(&attribute);
    let moved = |t: f64| {
        let (mut scene, mut attribute) = (make(), attribute.clone());
        change(&mut scene, &mut attribute, t);
        scene.extend(&attribute)
    };
    let ends = [moved(-step), moved(step)];
    let mut bars = Bars::of(&extension);
    let mut left_out = 0;
    let support = |r: &Residual<f64>, b: usize| r.barycentric[b].map(|w| w > 0.0);
    for b in 0..extension.cells.len() {
        assert!(ends.iter().all(|end| end.0.cells[b] == extension.cells[b]));
        if ends
            .iter()
            .any(|end| support(&end.1, b) != support(&residual, b))
        {
            bars.cells[2 * b..2 * b + 2].fill(0.0);
            left_out += 1;
        }
    }
    assert!(left_out * 20 < extension.cells.len(), "{left_out}");
    let found = product(&scene.pull(&attribute, &bars), &scene);
    let expected = (bars.loss(&ends[1].0) - bars.loss(&ends[0].0)) / (2.0 * step);
    // The third derivative of the weights is about 1/R³ = 1e3 times the step squared.
    assert!(
        (found - expected).abs() <= 1e-6 * (1.0 + expected.abs()),
        "{found} {expected}"
    );
    assert!(expected.abs() > 1e-2);
}

#[test]
fn attribute_gets_the_transpose() {
    assert_adjoint(
        |_, attribute, t| {
            for (v, d) in attribute.values.iter_mut().zip(values::<f64>(5000, 31)) {
                *v += t * d;
            }
        },
        |bar, _| product(&bar.attribute, &values(5000, 31)),
    );
}

#[test]
fn points_get_the_transpose() {
    assert_adjoint(
        |scene, _, t| {
            let radius = scene.neighborhoods.common_radius;
            for (x, d) in scene.points.iter_mut().zip(vectors::<f64>(2500, 32)) {
                *x = add(*x, scale(d, t));
            }
            scene.gather_within(radius);
        },
        |bar, _| inner(&bar.points, &vectors(2500, 32)),
    );
}

#[test]
fn areas_get_the_transpose() {
    // Their mean, which a₀ depends on, stays.
    let direction = |scene: &Scene<f64>| -> Vec<f64> {
        let raw = values::<f64>(2500, 33);
        let mean = raw.iter().sum::<f64>() / 2500.0;
        let scale = scene.areas.iter().sum::<f64>() / 2500.0;
        raw.iter().map(|d| scale * (d - mean)).collect()
    };
    assert_adjoint(
        |scene, _, t| {
            let direction = direction(scene);
            for (a, d) in scene.areas.iter_mut().zip(direction) {
                *a += t * d;
            }
        },
        |bar, scene| product(&bar.areas, &direction(scene)),
    );
}

#[test]
fn vertices_of_the_surface_get_the_transpose() {
    assert_adjoint(
        |scene, _, t| {
            let count = scene.mesh.vertices.len();
            for (y, d) in scene.mesh.vertices.iter_mut().zip(vectors(count, 34)) {
                *y = add(*y, scale(d, t));
            }
        },
        |bar, _| inner(&bar.vertices, &vectors(bar.vertices.len(), 34)),
    );
}

#[test]
fn the_grid_gets_the_transpose() {
    let lower = [0.4, -0.8, 0.5];
    assert_adjoint(
        |scene, _, t| {
            let grid = scene.phi.grid();
            let moved = add(grid.lower(), scale(lower, t));
            let grid = Grid::new(moved, grid.spacing() + 0.03 * t, grid.shape()).expect("a grid");
            scene.phi = Field::new(grid, scene.phi.values().to_vec()).expect("a field");
        },
        |bar, _| dot(bar.grid.lower, lower) + 0.03 * bar.grid.spacing,
    );
}

/// Radii of which more than half have grown: to 1.5 times the distance of the 6th sample, and in one half, whose samples
/// are in clusters, to 1.05 times that of the 64th.
fn grown() -> Scene<f64> {
    let mut scene = Scene::<f64>::even(2500, 20);
    for k in (0..2500).filter(|k| k % 128 != 0) {
        if scene.points[k - k % 128][0] > 0.0 {
            let random = vectors::<f64>(2500, 36)[k];
            scene.points[k] = add(scene.points[k - k % 128], scale(random, 0.03));
        }
    }
    scene.gather_within(0.4 * scene.neighborhoods.common_radius);
    scene
}

#[test]
fn points_and_vertices_get_the_transpose_where_radii_have_grown() {
    let scene = grown();
    let (_, residual) = scene.extend(&scene.attribute(wavy));
    let common = scene.neighborhoods.common_radius;
    let count = residual
        .fits
        .iter()
        .filter(|fit| fit.radius > common)
        .count();
    assert!(
        2 * count > residual.fits.len() && count < residual.fits.len(),
        "{count}"
    );
    assert_adjoint_of(
        0.1 * STEP,
        grown,
        |scene, _, t| {
            for (x, d) in scene.points.iter_mut().zip(vectors::<f64>(2500, 32)) {
                *x = add(*x, scale(d, t));
            }
            let count = scene.mesh.vertices.len();
            for (y, d) in scene.mesh.vertices.iter_mut().zip(vectors(count, 34)) {
                *y = add(*y, scale(d, t));
            }
            scene.gather_within(scene.neighborhoods.common_radius);
        },
        |bar, _| {
            let of_vertices = inner(&bar.vertices, &vectors(bar.vertices.len(), 34));
            inner(&bar.points, &vectors(2500, 32)) + of_vertices
        },
    );
}

#[test]
fn the_least_radius_gets_the_transpose() {
    assert_adjoint_of(
        STEP,
        grown,
        |scene, _, t| scene.gather_within(scene.neighborhoods.common_radius * (1.0 + t)),
        |bar, _| bar.radius,
    );
}
