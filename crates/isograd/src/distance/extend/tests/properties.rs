//! Properties of an extension.

use super::super::Fit;
use super::*;
use crate::distance::NO_TRIANGLE;
use crate::vector::{add, cross, norm, scale, sub};

/// Velocity of a body that moves and turns; at most 1.8 on the torus.
fn rigid(x: [f64; 3]) -> [f64; 3] {
    add([0.3, -0.2, 0.5], cross([0.4, -0.7, 1.1], x))
}

fn wavy([x, y, z]: [f64; 3]) -> [f64; 2] {
    [
        (4.0 * x + y).sin() * (3.0 * z).cos(),
        (3.0 * y - 2.0 * x).cos(),
    ]
}

fn constants_are_kept<T: Real>() {
    let scene = Scene::<T>::random(1500, 24);
    let constant = [0.1, -3.7e5, 2.0 / 3.0];
    let (extension, _) = scene.extend(&scene.attribute(|_| constant));
    // A sum of weights that is 1 to a few rounding errors.
    let tolerance = 8.0 * T::epsilon().f64();
    for value in extension
        .vertices
        .chunks_exact(3)
        .chain(extension.values.chunks_exact(3))
    {
        for (v, c) in value.iter().zip(constant) {
            assert!((v.f64() - c).abs() <= tolerance * c.abs(), "{v} for {c}");
        }
    }
}

#[test]
fn constants_are_exact_to_rounding() {
    constants_are_kept::<f32>();
    constants_are_kept::<f64>();
}

#[test]
fn rigid_motion_is_reproduced() {
    for (n, bound) in [(2000, 4e-3), (20_000, 1e-3)] {
        let scene = Scene::<f64>::random(n, 40);
        let (extension, _) = scene.extend(&scene.attribute(rigid));
        let (largest, mean) = scene.vertex_error(&extension, rigid);
        println!("{n}: largest {largest:.2e}, mean {mean:.2e}");
        // Only the ridge stands between the fit and the linear field.
        assert!(
            largest <= bound && mean <= bound / 20.0,
            "{n}: {largest:e}, {mean:e}"
        );
    }
}

#[test]
fn error_of_a_curved_field_falls_with_the_area_of_a_sample() {
    let error = |n| {
        let scene = Scene::<f64>::random(n, 40);
        let (extension, _) = scene.extend(&scene.attribute(wavy));
        scene.vertex_error(&extension, wavy).1
    };
    let (coarse, fine) = (error(2000), error(16_000));
    println!("curved field: {coarse:.2e} at 2000, {fine:.2e} at 16000");
    // Second order in the spacing: 8 times the samples, 8 times less.
    assert!(fine <= coarse / 6.0, "{coarse:e} {fine:e}");
    assert!(fine <= 5e-3);
}

#[test]
fn a_cell_has_the_value_of_its_closest_surface_point() {
    let scene = Scene::<f64>::random(20_000, 40);
    let (extension, residual) = scene.extend(&scene.attribute(wavy));
    let grid = scene.phi.grid();
    for ((cell, value), &barycentric) in extension.iter().zip(&residual.barycentric) {
        let x = grid.center(grid.cell(cell));
        let face = scene.closest[cell];
        let corners = scene.mesh.corners(face as usize);
        let closest = (0..3).fold([0.0; 3], |p, k| add(p, scale(corners[k], barycentric[k])));
        let distance = norm(sub(x, closest));
        assert!((distance - scene.phi.values()[cell].abs()).abs() <= 1e-12);
        let truth = wavy(closest);
        for c in 0..2 {
            // Curvature of the field over a cell of 0.055, and over the samples around a vertex.
            assert!((value[c] - truth[c]).abs() <= 0.03, "{value:?} {truth:?}");
        }
        let mut queried = [0.0; 2];
        extension
            .at(&scene.mesh, face, barycentric, &mut queried)
            .expect("a face");
        assert_eq!(queried, value);
    }
}

#[test]
fn the_region_is_listed_and_nothing_else_is_written() {
    let scene = Scene::<f32>::random(1500, 24);
    let attribute = scene.attribute(wavy);
    // φ itself ends at 4 cells.
    for (cells, inside) in [0.7, 3.0, 4.0, 50.0]
        .map(|n| [(n, false), (n, true)])
        .concat()
    {
        let reach = cells * scene.phi.grid().spacing();
        let region = match inside {
            true => Region::Inside(reach.into()),
            false => Region::Band(reach.into()),
        };
        let (extension, _) = scene.extend_in(&attribute, region).expect("extends");
        let mut dense = vec![f32::NEG_INFINITY; 2 * scene.closest.len()];
        extension.scatter(&mut dense).expect("the size of the grid");
        for (cell, value) in dense.chunks_exact(2).enumerate() {
            let phi = scene.phi.values()[cell];
            let near = phi <= reach && (inside || phi >= -reach);
            if near && scene.closest[cell] != NO_TRIANGLE {
                assert!(value.iter().all(|v| v.is_finite()));
            } else {
                assert_eq!(value, [f32::NEG_INFINITY; 2]);
            }
        }
        assert!(extension.cells.is_sorted());
        assert_eq!(extension.cells.len() * 2, extension.values.len());
    }
    let (extension, _) = scene.extend(&attribute);
    let expected = Err(Error::Length {
        length: 5,
        expected: 2 * 24usize.pow(3),
    });
    assert_eq!(extension.scatter(&mut [0.0; 5]), expected);
}

#[test]
fn a_hole_takes_its_values_from_the_samples_round_it() {
    let points: Vec<[f64; 3]> = torus(4000, 1)
        .into_iter()
        .map(|(p, _)| p)
        .filter(|p| norm(sub(*p, [0.7, 0.0, 0.25])) > 0.35 && p[0] > -0.5)
        .collect();
    let scene = Scene::<f64>::new(&points, 40);
    let (extension, residual) = scene.extend(&scene.attribute(wavy));
    let grown = residual
        .fits
        .iter()
        .filter(|f| f.radius > scene.neighborhoods.common_radius.f64());
    assert!(grown.count() > 100);
    // The field lies between −1 and 1; a slope carries a little beyond that, but does not run away.
    assert!(extension.vertices.iter().all(|v| v.abs() <= 2.0));
    let (extension, _) = scene.extend(&scene.attribute(rigid));
    let (largest, mean) = scene.vertex_error(&extension, rigid);
    println!("holes: largest {largest:.2e}, mean {mean:.2e}");
    // The speed is up to 1.8; the samples end half a body away from some vertices.
    assert!(largest <= 1.0 && mean <= 0.2, "{largest} {mean}");
}

#[test]
fn an_outlier_does_not_fill_a_hole() {
    let outlier = [0.7, 0.0, 0.4];
    let hole = |p: &[f64; 3]| norm(sub(*p, outlier)) > 0.4;
    let points = torus(4000, 1).into_iter().map(|(p, _)| p);
    let points: Vec<[f64; 3]> = points.filter(hole).chain([outlier]).collect();
    let scene = Scene::<f64>::new(&points, 32);
    let last = points.len() - 1;
    assert!(scene.neighborhoods.isolated[last]);
    let mut attribute = scene.attribute(wavy);
    attribute.values[2 * last..].fill(100.0);
    let (extension, residual) = scene.extend(&attribute);
    let sees = |(y, fit): (&[f64; 3], &Fit)| norm(sub(*y, outlier)) < 0.7 * fit.radius;
    assert!(
        scene
            .mesh
            .vertices()
            .iter()
            .zip(&residual.fits)
            .filter(|&v| sees(v))
            .count()
            > 20
    );
    // The samples lie between −1 and 1, and the outlier weighs a millionth of one of them.
    assert!(extension.vertices.iter().all(|v| v.abs() <= 2.0));
}

#[test]
fn unit_of_length_makes_no_difference() {
    let scene = Scene::<f64>::random(1500, 24);
    let attribute = scene.attribute(rigid);
    let (expected, _) = scene.extend(&attribute);
    for unit in [1e-9, 1e12] {
        let points: Vec<[f64; 3]> = scene.points.iter().map(|p| scale(*p, unit)).collect();
        let mut neighborhoods = Neighborhoods::default();
        neighbors::forward(&points, Radius::Auto, &mut neighborhoods).expect("samples");
        let vertices = scene
            .mesh
            .vertices()
            .iter()
            .map(|p| scale(*p, unit))
            .collect();
        let mesh = Mesh::new(vertices, scene.mesh.faces().to_vec()).expect("a mesh");
        let samples = Samples {
            neighborhoods: &neighborhoods,
            radius: neighborhoods.common_radius,
            areas: &scene.areas,
        };
        let surface = Surface {
            mesh: &mesh,
            ..scene.surface()
        };
        let (mut residual, mut found) = (Residual::default(), Extension::default());
        let scratch = &mut Scratch::default();
        forward(
            samples,
            &attribute,
            surface,
            3.0 * scene.phi.grid().spacing(),
            scratch,
            &mut residual,
            &mut found,
        )
        .expect("extends");
        for (a, b) in expected.vertices.iter().zip(&found.vertices) {
            // Rounding of the scaled coordinates, divided by the ridge's share.
            assert!((a - b).abs() <= 1e-9, "{a} {b}");
        }
    }
}

#[test]
fn coinciding_samples_and_samples_without_area_give_finite_values() {
    let mut scene = Scene::<f64>::coinciding();
    for areas in [scene.areas.clone(), vec![0.0; 400]] {
        scene.areas = areas;
        let (extension, _) = scene.extend(&scene.attribute(rigid));
        assert!(
            extension
                .vertices
                .iter()
                .chain(&extension.values)
                .all(|v| v.abs() <= 2.0)
        );
    }
}

fn same_bits<T: Real>() {
    let scene = Scene::<T>::random(6000, 40);
    let attribute = scene.attribute(wavy);
    crate::testing::assert_same_bits(|| scene.extend(&attribute));
}

#[test]
fn threads_do_not_change_a_bit() {
    same_bits::<f32>();
    same_bits::<f64>();
}

#[test]
fn memory_is_used_again() {
    let scene = Scene::<f32>::random(1500, 24);
    let attribute = scene.attribute(wavy);
    let (mut extension, mut residual) = scene.extend(&attribute);
    let expected = (extension.clone(), residual.clone());
    let addresses = |e: &Extension<f32>, r: &Residual<f32>| {
        (
            e.vertices.as_ptr(),
            e.cells.as_ptr(),
            e.values.as_ptr(),
            r.fits.as_ptr(),
        )
    };
    let before = addresses(&extension, &residual);
    let spacing = f64::from(scene.phi.grid().spacing());
    let (samples, surface, scratch) = (scene.samples(), scene.surface(), &mut Scratch::default());
    forward(
        samples,
        &attribute,
        surface,
        spacing,
        scratch,
        &mut residual,
        &mut extension,
    )
    .expect("extends");
    forward(
        samples,
        &attribute,
        surface,
        3.0 * spacing,
        scratch,
        &mut residual,
        &mut extension,
    )
    .expect("extends");
    assert_eq!(before, addresses(&extension, &residual));
    assert!((extension, residual) == expected);
}

#[test]
fn bad_input_is_refused_with_its_reason() {
    let scene = Scene::<f32>::random(500, 16);
    let good = scene.attribute(wavy);
    let refused = |scene: &Scene<f32>, attribute: &Attribute<f32>, band| {
        scene.try_extend(attribute, band).expect_err("refused")
    };
    for band in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(&scene, &good, band), Error::Band { .. }));
    }
    let few = Attribute {
        values: vec![0.0; 7],
        ..good.clone()
    };
    assert!(
        refused(&scene, &few, 3.0)
            .to_string()
            .contains("7 values of 2 components for 500")
    );
    let none = Attribute {
        components: 0,
        values: vec![],
        ..good.clone()
    };
    assert!(matches!(refused(&scene, &none, 3.0), Error::Samples { .. }));
    let mut bad = good.clone();
    bad.values[41] = f32::NAN;
    assert_eq!(refused(&scene, &bad, 3.0), Error::NotFinite { sample: 20 });

    let mut broken = Scene::<f32>::random(500, 16);
    broken.areas[3] = -1.0;
    assert_eq!(
        refused(&broken, &good, 3.0),
        Error::Area {
            sample: 3,
            area: -1.0
        }
    );
    let mut broken = Scene::<f32>::random(500, 16);
    broken
        .closest
        .iter_mut()
        .filter(|f| **f != NO_TRIANGLE)
        .for_each(|f| *f = 9_999_999);
    assert_eq!(
        refused(&broken, &good, 3.0),
        Error::Face { face: 9_999_999 }
    );
    broken.closest.pop();
    assert!(matches!(
        refused(&broken, &good, 3.0),
        Error::Closest { .. }
    ));

    let (extension, _) = scene.extend(&good);
    let mut value = [0.0; 2];
    let far = extension.at(&scene.mesh, u32::MAX, [1.0, 0.0, 0.0], &mut value);
    assert_eq!(far, Err(Error::Face { face: u32::MAX }));
    assert!(
        extension
            .at(&scene.mesh, 0, [1.0, 0.0, 0.0], &mut [0.0])
            .is_err()
    );
}
