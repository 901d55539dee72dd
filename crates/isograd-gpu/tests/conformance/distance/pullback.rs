//! Cotangents of the distances, beside the CPU's pullback at the same closest faces.

use cubecl::prelude::Runtime;
use isograd::distance::lattice::{Band, PullbackScratch};
use isograd::{Field, Grid, GridCotangent, Mesh, Real};
use isograd_gpu::distance::lattice;
use isograd_gpu::{Device, Scalar};

use super::{grid, meshes, signs, solve};
use crate::clouds::relative;
use crate::devices::{Numbers, tests, tolerance};

tests! {
    in_each_number: cotangents_are_those_of_the_cpu;
    on_each_device:
        cotangent_at_distance_zero_is_along_the_normal, cotangents_have_the_same_bits_again;
}

/// A cotangent at random, a quarter of it zero.
fn cotangent<T: Real>(cells: usize) -> Vec<T> {
    let mut numbers = Numbers(77);
    let mut number = || {
        let x = numbers.signed();
        T::of(if x < -0.5 { 0.0 } else { x })
    };
    (0..cells).map(|_| number()).collect()
}

/// The largest difference to the CPU's cotangents, in parts of the largest of their kind; of those of affine
/// motions where the mesh has thin triangles.
fn worst<R: Runtime, T: Scalar>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    grid: Grid<T>,
    band: Band,
    thin: bool,
) -> f64 {
    let chi = signs(grid);
    let (phi, closest, residual) = solve(device, mesh, &chi, band);
    let phi_bar = cotangent::<T>(grid.cells());
    let bars = lattice::pullback(device, &residual, &device.upload(&phi_bar).unwrap()).unwrap();
    let phi = Field::new(grid, phi).unwrap();
    let mut expected = vec![[T::of(0.0); 3]; mesh.vertices().len()];
    let of_grid = isograd::distance::lattice::pullback(
        mesh,
        &phi,
        &closest,
        &phi_bar,
        &mut PullbackScratch::default(),
        &mut expected,
    );
    let vertices = device.download(&bars.vertices).unwrap();
    let [vertices, on_cpu] = [&vertices[..], expected.as_flattened()].map(|bars| {
        let bars: Vec<f64> = bars.iter().map(|x| x.f64()).collect();
        if thin {
            of_affine_motions(mesh, &bars)
        } else {
            bars
        }
    });
    let GridCotangent { lower, spacing } = of_grid;
    let of_grid = [lower[0], lower[1], lower[2], spacing];
    let of_cells = device.download(&bars.grid).unwrap();
    let of_cells: Vec<f64> = of_cells.into_iter().map(T::f64).collect();
    relative(&vertices, &on_cpu)
        .max(relative(&of_cells[..3], &of_grid[..3]))
        .max(relative(&of_cells[3..], &of_grid[3..]))
}

/// Derivatives along twelve motions of each triangle on its own: moved along an axis, stretched, sheared. The
/// single corners of a needle, or of a triangle without area, have cotangents that rounding shares out; so has a triangle
/// that names one vertex of theirs.
fn of_affine_motions<T: Real>(mesh: &Mesh<T>, bars: &[f64]) -> Vec<f64> {
    let of_face = |face: &[u32; 3]| {
        let mut work = [0.0; 12];
        for (vertex, axis) in (0..9).map(|i| (face[i / 3] as usize, i % 3)) {
            let bar = bars[3 * vertex + axis];
            work[axis] += bar;
            for k in 0..3 {
                work[3 + 3 * axis + k] += bar * mesh.vertices()[vertex][k].f64();
            }
        }
        work
    };
    let are_different = |[a, b, c]: &&[u32; 3]| a != b && b != c && c != a;
    let faces = mesh.faces().iter().filter(are_different);
    faces.flat_map(of_face).collect()
}

fn cotangents_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let coarse = grid::<T>([-1.3, -1.2, -1.1], 0.1, [26, 23, 19]);
    let wide = grid::<T>([-1.0, -0.9, -0.8], 0.05, [41, 43, 40]);
    let far = grid::<T>([2.0, 3.0, 2.0], 0.05, [41, 43, 40]);
    let narrow = grid::<T>([-0.2, -0.3, -0.2], 0.025, [56, 24, 16]);
    for (name, mesh, grid, band) in [
        ("torus", meshes::torus::<T>(90, 31), coarse, Band::Full),
        ("torus", meshes::torus(90, 31), coarse, Band::Within(0.2)),
        ("fish", meshes::fish(12), narrow, Band::Full),
        ("soup", meshes::soup(300, 4), coarse, Band::Full),
        // One face for all cells, and one vertex for all.
        ("triangle", meshes::copies(1), wide, Band::Full),
        ("torus from afar", meshes::torus(90, 31), far, Band::Full),
        // One vertex of more faces than two rounds of pieces hold.
        ("fan", meshes::fan(4200), coarse, Band::Full),
        ("line", meshes::line(), coarse, Band::Full),
        ("point", meshes::point(3), coarse, Band::Full),
    ] {
        let thin = matches!(name, "soup" | "line");
        let error = worst(device, &mesh, grid, band, thin);
        println!("{name} in {}: {error:.1e}", T::NAME);
        assert!(
            error <= tolerance::<T>(),
            "{name} in {}: {error:e}",
            T::NAME
        );
    }
}

/// The plane of the triangle goes through centers of cells.
fn cotangent_at_distance_zero_is_along_the_normal<R: Runtime>(device: &Device<R>) {
    let grid = grid::<f32>([-1.0; 3], 0.5, [4, 4, 5]);
    let vertices = vec![[-9.0, -9.0, -0.25], [9.0, -9.0, -0.25], [0.0, 9.0, -0.25]];
    let mesh = Mesh::new(vertices, vec![[0, 1, 2]]).unwrap();
    let (phi, _, residual) = solve(device, &mesh, &signs(grid), Band::Full);
    let cell = grid.index([1, 2, 1]);
    assert!(phi[cell].abs() <= f32::MIN_POSITIVE);
    let mut phi_bar = vec![0.0f32; grid.cells()];
    phi_bar[cell] = 2.0;
    let bars = lattice::pullback(device, &residual, &device.upload(&phi_bar).unwrap()).unwrap();
    let vertices = device.download(&bars.vertices).unwrap();
    let sum: [f32; 3] = std::array::from_fn(|a| vertices[a] + vertices[3 + a] + vertices[6 + a]);
    assert_eq!(sum.map(|x| (x * 1e5).round() / 1e5), [0.0, 0.0, -2.0]);
}

fn cotangents_have_the_same_bits_again<R: Runtime>(device: &Device<R>) {
    let grid = grid::<f32>([-1.3, -1.2, -1.1], 0.1, [26, 23, 19]);
    let phi_bar = device.upload(&cotangent::<f32>(grid.cells())).unwrap();
    let run = || {
        let (.., residual) = solve(device, &meshes::torus(40, 21), &signs(grid), Band::Full);
        let bars = lattice::pullback(device, &residual, &phi_bar).unwrap();
        let all = [bars.vertices, bars.grid].map(|b| device.download(&b).unwrap());
        all.concat()
            .into_iter()
            .map(f32::to_bits)
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}
