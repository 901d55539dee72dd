//! Against finite differences, and against what area and volume must satisfy.

use super::measure::Measures;
use super::{Scratch, forward, measure_pullback};
use crate::data::{Field, Grid, Mesh};
use crate::vector::{add, dot, scale, sub};
use crate::{Real, vector};

/// The isosurface of a sphere of radius `r`, closed.
fn sphere<T: Real>(cells: usize, r: f64) -> Mesh<T> {
    let grid = Grid::new([T::of(-1.0); 3], T::of(2.0 / cells as f64), [cells; 3]).expect("valid");
    let center = [0.013, -0.007, 0.011];
    let at = |i| T::of(vector::norm(sub(grid.center_f64(grid.cell(i)), center)) - r);
    let chi = Field::new(grid, (0..grid.cells()).map(at).collect()).expect("a field");
    let mut mesh = Mesh::default();
    forward(&chi, T::zero(), &mut Scratch::default(), &mut mesh).expect("a surface");
    mesh
}

fn gradient<T: Real>(mesh: &Mesh<T>, area_bar: f64, volume_bar: f64) -> (Vec<[T; 3]>, usize) {
    let mut bar = Vec::new();
    let guarded = measure_pullback(mesh, area_bar, volume_bar, &mut bar);
    (bar, guarded)
}

fn along<T: Real>(bar: &[[T; 3]], motion: impl Fn(usize) -> [f64; 3]) -> f64 {
    let term = |(v, b): (usize, &[T; 3])| dot(vector::to_f64(*b), motion(v));
    bar.iter().enumerate().map(term).sum()
}

#[test]
fn area_and_volume_are_homogeneous_and_do_not_see_where_they_are() {
    for at in [[0.0; 3], [30.0, -20.0, 10.0]] {
        let mut mesh = sphere::<f64>(24, 0.7);
        for vertex in &mut mesh.vertices {
            *vertex = add(*vertex, at);
        }
        let measures = Measures::of(&mesh);
        let (area, _) = gradient(&mesh, 1.0, 0.0);
        let (volume, _) = gradient(&mesh, 0.0, 1.0);
        // Rounding of coordinates below 40, over some thousand vertices.
        let place = |v: usize| mesh.vertices[v];
        assert!((along(&area, place) - 2.0 * measures.area).abs() < 1e-10);
        assert!((along(&volume, place) - 3.0 * measures.volume).abs() < 1e-10);
        for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            assert!(along(&area, |_| axis).abs() < 1e-12);
            assert!(along(&volume, |_| axis).abs() < 1e-12);
            let turned = |v: usize| vector::cross(axis, mesh.vertices[v]);
            assert!(along(&area, turned).abs() < 1e-10);
            assert!(along(&volume, turned).abs() < 1e-10);
        }
    }
}

#[test]
fn a_growing_sphere_gains_what_a_sphere_does() {
    let r = 0.7;
    let mesh = sphere::<f64>(48, r);
    let (area, guarded) = gradient(&mesh, 1.0, 0.0);
    let (volume, _) = gradient(&mesh, 0.0, 1.0);
    let outward = |v: usize| scale(mesh.vertices[v], 1.0 / r);
    let pi = std::f64::consts::PI;
    // The surface is flat between its vertices: an error of (h/r)² of the whole, at the most.
    assert!((along(&area, outward) / (8.0 * pi * r) - 1.0).abs() < 4e-3);
    assert!((along(&volume, outward) / (4.0 * pi * r * r) - 1.0).abs() < 4e-3);
    assert_eq!(guarded, 0);
}

#[test]
fn gradient_agrees_with_finite_differences_also_of_an_open_mesh() {
    let mut mesh = sphere::<f64>(9, 0.6);
    let wave = |v: usize, a: usize| (3.7 * v as f64 + 1.9 * a as f64).sin();
    for open in [false, true] {
        if open {
            // Round the box's center, which is held constant: no face at the ends is taken.
            mesh.faces.truncate(mesh.faces.len() / 2);
        }
        let (weights, step) = ([0.8, -1.7], 1e-6);
        let bounds = crate::data::bounds(&mesh.vertices).expect("vertices");
        let inner = |v: usize| {
            (0..3).all(|a| mesh.vertices[v][a] > bounds.0[a] && mesh.vertices[v][a] < bounds.1[a])
        };
        let motion = |v: usize| {
            let free = if inner(v) { 1.0 } else { 0.0 };
            [0, 1, 2].map(|a| free * wave(v, a))
        };
        let loss = |t: f64| {
            let mut moved = mesh.clone();
            for v in 0..mesh.vertices.len() {
                moved.vertices[v] = add(mesh.vertices[v], scale(motion(v), t));
            }
            let measures = Measures::of(&moved);
            weights[0] * measures.area + weights[1] * measures.volume
        };
        let (bar, _) = gradient(&mesh, weights[0], weights[1]);
        let expected = (loss(step) - loss(-step)) / (2.0 * step);
        assert!((along(&bar, motion) - expected).abs() < 1e-7 * (1.0 + expected.abs()));
    }
}

#[test]
fn faces_without_area_give_nothing_and_are_counted() {
    let vertices = vec![
        [0.0f32; 3],
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let faces = vec![[0, 1, 2], [1, 1, 3], [0, 1, 3]];
    let mesh = Mesh::new(vertices.clone(), faces).expect("valid");
    let alone = Mesh::new(vertices, vec![[0, 1, 3]]).expect("valid");
    let (bar, guarded) = gradient(&mesh, 1.0, 0.0);
    assert_eq!(guarded, 2);
    assert_eq!((bar, 0), gradient(&alone, 1.0, 0.0));
    assert_eq!(gradient(&mesh, 0.0, 1.0).1, 0);
    assert_eq!(gradient(&Mesh::<f64>::default(), 1.0, 1.0), (vec![], 0));
}

#[test]
fn cotangents_are_added_to_those_that_are_there_and_threads_change_no_bit() {
    let mesh = sphere::<f32>(30, 0.6);
    crate::testing::assert_same_bits(|| gradient(&mesh, 0.3, 0.9).0);
    let one = gradient(&mesh, 0.3, 0.9).0;
    let mut twice = one.clone();
    measure_pullback(&mesh, 0.3, 0.9, &mut twice);
    for (a, b) in twice.iter().zip(&one) {
        assert_eq!(*a, scale(*b, 2.0));
    }
}
