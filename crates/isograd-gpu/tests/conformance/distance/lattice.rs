//! The distance at cell centers.

use cubecl::prelude::Runtime;
use isograd::distance::NO_TRIANGLE;
use isograd::distance::lattice::Band;
use isograd::distance::triangle::closest_point;
use isograd::{Field, Grid, Mesh};
use isograd_gpu::distance::{self, Error};
use isograd_gpu::{Device, Scalar};

use super::{grid, meshes, signs, solve, solve_on_cpu, upload};
use crate::devices::{tests, tolerance};

tests! {
    in_each_number: distance_is_that_of_the_cpu;
    on_each_device:
        distance_is_that_of_all_triangles_tried, places_far_from_the_origin_lose_nothing,
        of_equal_triangles_the_first_is_named,
        band_is_exact_within_its_width_and_constant_beyond,
        cell_on_the_surface_keeps_the_sign_of_its_side,
        many_cells_and_two_runs_with_the_same_bits, bad_input_is_refused_with_a_reason;
}

/// The largest difference to the CPU's distances in cells; the signs must agree, and the faces named must be as
/// near as those of the CPU.
fn worst<R: Runtime, T: Scalar>(device: &Device<R>, mesh: &Mesh<T>, grid: Grid<T>) -> f64 {
    let chi = signs(grid);
    let (phi, closest, _) = solve(device, mesh, &chi, Band::Full);
    let (expected, _) = solve_on_cpu(mesh, &chi, Band::Full);
    let h = grid.spacing().f64();
    let mut worst: f64 = 0.0;
    for (index, &on_cpu) in expected.values().iter().enumerate() {
        assert_eq!(phi[index] < T::of(0.0), on_cpu < T::of(0.0));
        let corners = mesh.corners(closest[index] as usize).map(|p| p.map(T::f64));
        let named = closest_point(grid.center_f64(grid.cell(index)), corners).distance;
        for d in [phi[index].f64().abs(), named] {
            let error = (d - on_cpu.f64().abs()).abs() / h;
            assert!(error <= 1.0, "cell {index}: {d} for {on_cpu}");
            worst = worst.max(error);
        }
    }
    worst
}

fn distance_is_that_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let coarse = grid::<T>([-1.3, -1.2, -1.1], 0.1, [26, 23, 19]);
    let fine = grid::<T>([0.1, 0.2, -0.3], 0.004, [17, 33, 5]);
    let far = grid::<T>([-9.0, -8.0, 3.0], 0.9, [20, 19, 18]);
    let along = grid::<T>([-0.2, -0.3, -0.2], 0.025, [56, 24, 16]);
    let long = grid::<T>([-1.0, -0.2, 0.1], 0.01, [400, 3, 5]);
    for (name, mesh, grid) in [
        ("torus", meshes::torus::<T>(90, 31), long),
        ("torus", meshes::torus::<T>(90, 31), coarse),
        ("torus", meshes::torus(90, 31), far),
        ("fish", meshes::fish(12), along),
        (
            "sphere",
            // More triangles than the list of a group has room for.
            meshes::sphere(50, 51),
            grid([-0.95; 3], 0.1, [19; 3]),
        ),
        ("soup", meshes::soup(1, 1), coarse),
        ("soup", meshes::soup(2, 2), far),
        ("soup", meshes::soup(3, 3), fine),
        ("soup", meshes::soup(700, 4), coarse),
        ("soup", meshes::soup(700, 4), fine),
        ("soup", meshes::soup(700, 4), far),
        ("line", meshes::line(), coarse),
        ("point", meshes::point(9), coarse),
        ("fan", meshes::fan(37), coarse),
    ] {
        let error = worst(device, &mesh, grid);
        println!("{name} in {}: {error:.1e} cells", T::NAME);
        assert!(
            error <= tolerance::<T>(),
            "{name} in {}: {error:e}",
            T::NAME
        );
    }
}

fn distance_is_that_of_all_triangles_tried<R: Runtime>(device: &Device<R>) {
    let mesh = meshes::soup::<f32>(200, 11);
    let grid = grid([-1.4, -1.2, -1.3], 0.2, [13, 11, 17]);
    let (phi, ..) = solve(device, &mesh, &signs(grid), Band::Full);
    for (index, d) in phi.into_iter().enumerate() {
        let q = grid.center_f64(grid.cell(index));
        let distance =
            |face| closest_point(q, mesh.corners(face).map(|p| p.map(f64::from))).distance;
        let least = (0..200).map(distance).fold(f64::INFINITY, f64::min);
        assert!(
            (f64::from(d.abs()) - least).abs() <= 1e-4 * 0.2,
            "{d} for {least}"
        );
    }
}

/// The unit of the last place is 1/16 of a cell there: vertices are rounded, but the cells are where they are.
fn places_far_from_the_origin_lose_nothing<R: Runtime>(device: &Device<R>) {
    let base = [1e5f32, -3e5, 2e5];
    let moved = |p: [f32; 3]| std::array::from_fn(|a| base[a] + 40.0 * p[a]);
    let torus = meshes::torus::<f32>(60, 23);
    let vertices = torus.vertices().iter().map(|&p| moved(p)).collect();
    let mesh = Mesh::new(vertices, torus.faces().to_vec()).unwrap();
    let grid = Grid::new(moved([-1.1; 3]), 4.0, [22, 22, 22]).unwrap();
    let error = worst(device, &mesh, grid);
    assert!(error <= 1e-4, "{error:e}");
}

fn of_equal_triangles_the_first_is_named<R: Runtime>(device: &Device<R>) {
    let chi = signs(grid::<f32>([-1.0; 3], 0.2, [9, 10, 11]));
    for mesh in [meshes::point(700), meshes::copies(1), meshes::copies(700)] {
        let (_, closest, _) = solve(device, &mesh, &chi, Band::Full);
        assert!(closest.iter().all(|&face| face == 0));
    }
}

fn band_is_exact_within_its_width_and_constant_beyond<R: Runtime>(device: &Device<R>) {
    let grid = grid::<f32>([-1.3, -1.2, -1.0], 0.06, [43, 40, 35]);
    let chi = signs(grid);
    for (mesh, cells) in [(meshes::soup(30, 8), 1.5), (meshes::torus(90, 31), 3.0)] {
        let width = cells * f64::from(0.06f32);
        let (full, ..) = solve(device, &mesh, &chi, Band::Full);
        let (banded, closest, _) = solve(device, &mesh, &chi, Band::Within(width));
        let width = width as f32;
        let mut within = 0;
        for (index, d) in full.into_iter().enumerate() {
            let (found, face) = (banded[index], closest[index]);
            if d.abs() < width * (1.0 - 1e-5) {
                within += 1;
                assert!((found - d).abs() <= 4e-6, "{found} for {d}");
                assert_ne!(face, NO_TRIANGLE);
            } else if d.abs() > width * (1.0 + 1e-5) {
                assert_eq!((found, face), (width * d.signum(), NO_TRIANGLE));
            }
        }
        assert!(within > 100 && within < grid.cells() / 2, "{within} cells");
    }
}

fn cell_on_the_surface_keeps_the_sign_of_its_side<R: Runtime>(device: &Device<R>) {
    let grid = Grid::new([-1.0f32; 3], 0.5, [4; 3]).unwrap();
    let vertices = vec![grid.center([1, 2, 1]), [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]];
    let mesh = Mesh::new(vertices, vec![[0, 1, 2]]).unwrap();
    for (chi, expected) in [(-1.0, -f32::MIN_POSITIVE), (0.1, 0.0)] {
        let field = Field::new(grid, vec![chi; 64]).unwrap();
        let (phi, ..) = solve(device, &mesh, &field, Band::Full);
        assert_eq!(phi[grid.index([1, 2, 1])], expected);
    }
}

/// More groups than a dimension holds.
fn many_cells_and_two_runs_with_the_same_bits<R: Runtime>(device: &Device<R>) {
    let grid = grid::<f32>([-1.0; 3], 0.0125, [163, 161, 163]);
    assert!(grid.cells().div_ceil(64) > 65_535);
    let chi = signs(grid);
    let run = || solve(device, &meshes::soup(3, 7), &chi, Band::Within(0.1125));
    let (phi, closest, _) = run();
    let again = run();
    assert!(phi == again.0 && closest == again.1);
    let (expected, _) = solve_on_cpu(&meshes::soup(3, 7), &chi, Band::Within(0.1125));
    for (d, e) in phi.into_iter().zip(expected.values()) {
        assert!((d - e).abs() <= 1.25e-6, "{d} for {e}");
    }
}

fn bad_input_is_refused_with_a_reason<R: Runtime>(device: &Device<R>) {
    let grid = grid::<f32>([-1.0; 3], 0.5, [4; 3]);
    let chi = device.upload(&[0.0f32; 64]).unwrap();
    let level = device.upload(&[0.0f32]).unwrap();
    let mesh = upload(device, &meshes::line::<f32>());
    let refused = |mesh: &distance::Mesh<f32>, chi, band| {
        distance::lattice::forward(device, mesh, &grid, chi, &level, band).unwrap_err()
    };
    let mut empty = mesh.clone();
    empty.faces = device.upload(&[]).unwrap();
    assert!(matches!(refused(&empty, &chi, Band::Full), Error::Empty));
    let mut ragged = mesh.clone();
    ragged.faces = device.upload(&[0, 1]).unwrap();
    let error = refused(&ragged, &chi, Band::Full);
    assert!(matches!(error, Error::Triples { length: 2, .. }), "{error}");
    let error = refused(&mesh, &level, Band::Full);
    assert!(matches!(error, Error::Device(_)), "{error}");
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(&mesh, &chi, Band::Within(width));
        assert!(matches!(error, Error::Band { .. }), "{error}");
    }
}
