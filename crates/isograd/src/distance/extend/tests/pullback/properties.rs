//! Properties of any pullback.

use super::*;
use crate::vector::{add, scale};

#[test]
fn motion_of_everything_together_changes_nothing() {
    let scene = Scene::<f64>::random(3000, 24);
    let attribute = scene.attribute(wavy);
    let bar = scene.pull(&attribute, &Bars::of(&scene.extend(&attribute).0));
    let total = |vectors: &[[f64; 3]]| vectors.iter().fold([0.0; 3], |sum, &v| add(sum, v));
    let sum = add(
        add(total(&bar.points), total(&bar.vertices)),
        bar.grid.lower,
    );
    // Sliver faces of the isosurface turn by 1/thickness: terms of up to 1e6 cancel.
    let size: f64 = bar.vertices.iter().flatten().map(|v| v.abs()).sum();
    assert!(
        sum.iter().all(|s| s.abs() <= 1e-12 * size),
        "{sum:?} {size}"
    );
    // A common factor of all areas makes no difference either.
    let factor: f64 = bar.areas.iter().zip(&scene.areas).map(|(b, a)| b * a).sum();
    let size: f64 = bar
        .areas
        .iter()
        .zip(&scene.areas)
        .map(|(b, a)| (b * a).abs())
        .sum();
    // a₀, which is held constant, is a millionth of the mean area.
    assert!(factor.abs() <= 1e-5 * size, "{factor} {size}");
}

/// The scene in double precision.
fn widened(scene: &Scene<f32>) -> Scene<f64> {
    let wide = |v: &[[f32; 3]]| v.iter().map(|&v| to_f64(v)).collect::<Vec<_>>();
    let grid = scene.phi.grid();
    let grid =
        Grid::new(to_f64(grid.lower()), grid.spacing().into(), grid.shape()).expect("a grid");
    let phi = scene.phi.values().iter().map(|&v| v.into()).collect();
    let mesh = Mesh::new(wide(scene.mesh.vertices()), scene.mesh.faces().to_vec());
    let mut new = Scene {
        points: wide(&scene.points),
        neighborhoods: Neighborhoods::default(),
        areas: scene.areas.iter().map(|&a| a.into()).collect(),
        mesh: mesh.expect("a mesh"),
        phi: Field::new(grid, phi).expect("a field"),
        closest: scene.closest.clone(),
    };
    new.gather_within(scene.neighborhoods.common_radius.into());
    new
}

#[test]
fn single_precision_agrees_with_double() {
    let narrow = Scene::<f32>::even(2500, 20);
    let wide = widened(&narrow);
    let attribute = narrow.attribute(wavy);
    let values = attribute.values.iter().map(|&v| v.into()).collect();
    let wide_attribute = Attribute {
        name: "velocity".into(),
        components: 2,
        values,
    };
    let bars = Bars::of(&narrow.extend(&attribute).0);
    let of = |v: &[f32]| v.iter().map(|&v| v.into()).collect::<Vec<f64>>();
    let wide_bars = Bars {
        vertices: of(&bars.vertices),
        cells: of(&bars.cells),
    };
    let (a, b) = (
        narrow.pull(&attribute, &bars),
        wide.pull(&wide_attribute, &wide_bars),
    );
    let close = |a: &[f32], b: &[f64]| {
        let largest = b.iter().fold(0.0f64, |m, b| m.max(b.abs()));
        for (a, b) in a.iter().zip(b) {
            // Values at the vertices are rounded to 6e-8, and divided by edges of 0.05 twice.
            assert!(
                (f64::from(*a) - b).abs() <= 1e-4 * largest,
                "{a} {b} {largest}"
            );
        }
    };
    close(&a.attribute, &b.attribute);
    close(&a.areas, &b.areas);
    close(a.points.as_flattened(), b.points.as_flattened());
    close(a.vertices.as_flattened(), b.vertices.as_flattened());
    close(&a.grid.lower, &b.grid.lower);
    close(&[a.grid.spacing], &[b.grid.spacing]);
}

fn same_bits<T: Real>() {
    let scene = Scene::<T>::random(6000, 40);
    let attribute = scene.attribute(wavy);
    let bars = Bars::of(&scene.extend(&attribute).0);
    crate::testing::assert_same_bits(|| numbers(&scene.pull(&attribute, &bars)));
}

#[test]
fn threads_do_not_change_a_bit() {
    same_bits::<f32>();
    same_bits::<f64>();
}

fn assert_finite<T: Real>(scene: &Scene<T>) -> usize {
    let attribute = scene.attribute(wavy);
    let bar = scene.pull(&attribute, &Bars::of(&scene.extend(&attribute).0));
    assert!(numbers(&bar).iter().all(|x| x.is_finite()));
    bar.guarded
}

fn degenerate<T: Real>() {
    // Samples that coincide, with areas and without.
    let mut scene = Scene::<T>::coinciding();
    assert_finite(&scene);
    scene.areas.fill(T::zero());
    assert_finite(&scene);

    // Vertices on samples, and on each other: faces without area, needles and slivers.
    let mut scene = Scene::<T>::random(2000, 20);
    let faces = scene.mesh.faces.clone();
    for (k, face) in faces.iter().step_by(3).enumerate() {
        let [a, b, c] = face.map(|v| v as usize);
        let vertices = &mut scene.mesh.vertices;
        match k % 5 {
            0 => vertices[a] = vertices[b],
            1 => vertices[a] = scene.points[k],
            2 => vertices[c] = scale(add(vertices[a], vertices[b]), T::of(0.5)),
            3 => vertices[a] = add(vertices[b], [T::of(1e-7); 3]),
            _ => (vertices[b], vertices[c]) = (vertices[a], vertices[a]),
        }
    }
    scene.measure_distance();
    assert_finite(&scene);
}

#[test]
fn degenerate_samples_and_faces_give_finite_cotangents() {
    degenerate::<f32>();
    degenerate::<f64>();
}

#[test]
fn thin_faces_are_guarded_and_counted() {
    let mut scene = Scene::<f64>::random(2000, 20);
    // A speck of a triangle, in the way of a row of cell centers along x.
    let [_, y, z] = scene.phi.grid().center([0, 10, 10]);
    let around = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]];
    let vertices = around
        .map(|[u, v]| [0.95, y + 1e-10 * u, z + 1e-10 * v])
        .to_vec();
    scene.mesh = Mesh::new(vertices, vec![[0, 1, 2]]).expect("valid");
    scene.measure_distance();
    assert!(assert_finite(&scene) > 0);
}

#[test]
fn what_is_left_out_counts_as_zero_and_memory_is_used_again() {
    let scene = Scene::<f64>::even(1500, 16);
    let attribute = scene.attribute(wavy);
    let (extension, residual) = scene.extend(&attribute);
    let bars = Bars::of(&extension);
    let inputs = scene.inputs(&attribute, &residual, &extension);
    let mut out = Cotangent::default();
    let mut pull = |vertices_bar: Option<&[f64]>, values_bar: Option<&[f64]>| {
        let inputs = Inputs {
            vertices_bar,
            values_bar,
            ..inputs
        };
        pullback(&inputs, &mut out).expect("pulls back");
        let memory = (
            out.attribute.as_ptr(),
            out.points.as_ptr(),
            out.vertices.as_ptr(),
        );
        (numbers(&out), memory)
    };
    let (both, memory) = pull(Some(&bars.vertices), Some(&bars.cells));
    let (of_vertices, _) = pull(Some(&bars.vertices), None);
    let (of_cells, _) = pull(None, Some(&bars.cells));
    for ((a, b), c) in both.iter().zip(&of_vertices).zip(&of_cells) {
        assert!((a - b - c).abs() <= 1e-9 * (1.0 + b.abs() + c.abs()));
    }
    assert!(pull(None, None).0.iter().all(|&x| x == 0.0));
    let zeros = vec![0.0; bars.cells.len()];
    assert!(pull(Some(&bars.vertices), Some(&zeros)).0 == of_vertices);
    assert_eq!(
        pull(Some(&bars.vertices), Some(&bars.cells)),
        (both, memory)
    );
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let scene = Scene::<f32>::even(800, 12);
    let attribute = scene.attribute(wavy);
    let (extension, residual) = scene.extend(&attribute);
    let bars = Bars::of(&extension);
    let refused = |extension: &Extension<f32>, residual: &Residual<f32>, bars: &Bars<f32>| {
        let inputs = scene.inputs(&attribute, residual, extension);
        pullback(&bars.on(inputs), &mut Cotangent::default())
    };
    assert_eq!(refused(&extension, &residual, &bars), Ok(()));
    let mismatch = |result| matches!(result, Err(Error::Mismatch { .. }));
    let mut short = Bars::of(&extension);
    short.cells.pop();
    assert!(mismatch(refused(&extension, &residual, &short)));
    let mut short = Bars::of(&extension);
    short.vertices.clear();
    assert!(mismatch(refused(&extension, &residual, &short)));
    let mut other = residual.clone();
    other.fits.pop();
    assert!(mismatch(refused(&extension, &other, &bars)));
    let mut other = residual.clone();
    other.barycentric.pop();
    assert!(mismatch(refused(&extension, &other, &bars)));
    for change in [
        |e: &mut Extension<f32>| e.shape = [1, 2, 3],
        |e: &mut Extension<f32>| e.components = 1,
        |e: &mut Extension<f32>| e.vertices.clear(),
        |e: &mut Extension<f32>| e.values.truncate(3),
    ] {
        let mut other = extension.clone();
        change(&mut other);
        assert!(mismatch(refused(&other, &residual, &bars)));
    }
    let mut other = extension.clone();
    other.cells[0] = 12 * 12 * 12;
    let expected = Error::Cell {
        cell: 1728,
        cells: 1728,
    };
    assert_eq!(refused(&other, &residual, &bars), Err(expected));
    let mut other = extension.clone();
    other.cells[0] = 0;
    let result = refused(&other, &residual, &bars);
    assert!(matches!(result, Err(Error::Face { .. })), "{result:?}");
}
