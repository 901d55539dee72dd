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
    let scene = Scene::<f64>::even(2500, 20);
    let attribute = scene.attribute(wavy);
    let (extension, residual) = scene.extend(&attribute);
    let common = scene.neighborhoods.common_radius;
    assert!(residual.fits.iter().all(|fit| fit.radius == common));
    let moved = |t: f64| {
        let (mut scene, mut attribute) = (Scene::<f64>::even(2500, 20), attribute.clone());
        change(&mut scene, &mut attribute, t);
        scene.extend(&attribute)
    };
    let ends = [moved(-STEP), moved(STEP)];
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
    let expected = (bars.loss(&ends[1].0) - bars.loss(&ends[0].0)) / (2.0 * STEP);
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
