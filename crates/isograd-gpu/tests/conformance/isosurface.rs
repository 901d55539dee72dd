//! The isosurface stage beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::isosurface::{self as cpu, Report};
use isograd::{Field, Grid, Mesh};
use isograd_gpu::isosurface::{Error, Plan, Residual, Surface, forward, pullback};
use isograd_gpu::{Device, Scalar};

use crate::clouds::{difference, largest};
use crate::devices::{Numbers, tests};

tests! {
    in_each_number: surfaces_are_those_of_the_cpu, pullbacks_are_those_of_the_cpu;
    on_each_device:
        noise_of_any_shape_has_the_faces_of_the_cpu,
        more_groups_than_one_dimension_has_are_reached, two_runs_give_the_same_bits,
        what_has_no_surface_is_refused_in_the_words_of_the_cpu,
        arrays_that_do_not_fit_are_refused;
}

/// Values at the cell centers of a grid that is not at the origin.
fn field<T: Scalar>(shape: [usize; 3], f: impl FnMut([f64; 3]) -> f64) -> Field<T> {
    let h = 2.0 / shape.into_iter().fold(0, usize::max) as f64;
    let grid = Grid::new([-0.9, -1.1, -1.05].map(T::of), T::of(h), shape).expect("a grid");
    let centers = (0..grid.cells()).map(|at| grid.center_f64(grid.cell(at)));
    let values = centers.map(f).map(T::of).collect();
    Field::new(grid, values).expect("a field")
}

fn torus([x, y, z]: [f64; 3]) -> f64 {
    ((x * x + y * y).sqrt() - 0.5).hypot(z) - 0.23
}

/// Smooth everywhere, on both sides of 0, and at all walls.
fn waves([x, y, z]: [f64; 3]) -> f64 {
    (3.1 * x + 0.3).sin() * (2.3 * y - 0.2).cos() + (4.0 * z + x).sin() + 0.1
}

/// Noise, a tenth of it exactly at the level 0.
fn noise(seed: u64) -> impl FnMut([f64; 3]) -> f64 {
    let mut numbers = Numbers(seed);
    move |_| match numbers.signed() {
        v if v.abs() < 0.1 => 0.0,
        v => v,
    }
}

/// A surface in the host's memory.
#[derive(Debug, PartialEq)]
struct Host<T> {
    vertices: Vec<T>,
    faces: Vec<u32>,
    edges: Vec<u32>,
    report: Report,
}

fn host<R: Runtime, T: Scalar>(device: &Device<R>, surface: &Surface<T>) -> Host<T> {
    Host {
        vertices: device.download(&surface.vertices).expect("vertices"),
        faces: device.download(&surface.faces).expect("faces"),
        edges: device.download(&surface.edges).expect("edges"),
        report: surface.report,
    }
}

fn made<R: Runtime, T: Scalar>(
    device: &Device<R>,
    chi: &Field<T>,
    level: T,
) -> (Surface<T>, Residual<T>) {
    let plan = Plan::new(device).expect("a plan");
    let values = device.upload(chi.values()).expect("a field");
    let level = device.upload(&[level]).expect("a level");
    forward(device, &plan, &values, &level, chi.grid()).expect("a surface")
}

fn on_cpu<T: Scalar>(chi: &Field<T>, level: T) -> (Mesh<T>, Report) {
    let mut mesh = Mesh::default();
    let report = cpu::forward(chi, level, &mut cpu::Scratch::default(), &mut mesh);
    (mesh, report.expect("a surface"))
}

/// Fields of odd, prime and even sizes, on one word a row, on several, and up to the end of one.
fn fields<T: Scalar>() -> Vec<(&'static str, Field<T>, f64)> {
    vec![
        ("torus", field([40, 41, 37], torus), 0.0),
        ("torus at another level", field([31, 33, 65], torus), 0.06),
        ("waves", field([23, 29, 71], waves), 0.0),
        ("waves in whole words", field([17, 9, 64], waves), 0.3),
        ("noise", field([19, 13, 101], noise(1)), 0.0),
        ("noise of two planes", field([2, 2, 33], noise(2)), 0.0),
        ("noise of thin rows", field([37, 53, 2], noise(3)), 0.0),
        (
            "a corner",
            field([2, 2, 2], |x| x[0] + x[1] + x[2] + 1.2),
            0.0,
        ),
    ]
}

fn surfaces_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let mut worst = 0.0f64;
    for (name, chi, level) in fields::<T>().into_iter().chain([far_away()]) {
        let (mesh, report) = on_cpu(&chi, T::of(level));
        let found = host(device, &made(device, &chi, T::of(level)).0);
        assert_eq!(found.report, report, "{name}");
        let edges = mesh.edges().iter();
        let edges: Vec<u32> = edges.map(|e| (3 * e.cell() + e.axis()) as u32).collect();
        assert_eq!(found.edges, edges, "{name}");
        assert_eq!(found.faces, mesh.faces().as_flattened(), "{name}");
        let expected: Vec<f64> = mesh.vertices().iter().flatten().map(|v| v.f64()).collect();
        let roundings = difference(
            &found.vertices,
            &expected,
            T::EPSILON.f64() * largest(&expected),
        );
        // Three of a coordinate, and that of the division.
        assert!(roundings < 4.0, "{name}: {roundings}");
        worst = worst.max(roundings);
    }
    let number = <T as isograd::Real>::NAME;
    println!("{number}: vertices differ by {worst} roundings of the largest coordinate");
}

/// Where neighboring cells differ in the last digits only.
fn far_away<T: Scalar>() -> (&'static str, Field<T>, f64) {
    let grid = Grid::new([1e3, -2e3, 0.1].map(T::of), T::of(1e-2), [14, 15, 36]).expect("a grid");
    let values = (0..grid.cells()).map(|_| [0.0; 3]).map(noise(4)).map(T::of);
    let chi = Field::new(grid, values.collect()).expect("a field");
    ("far away", chi, 0.05)
}

fn noise_of_any_shape_has_the_faces_of_the_cpu<R: Runtime>(device: &Device<R>) {
    let mut numbers = Numbers(77);
    for seed in 0..40 {
        let mut side = |most: u32| (2 + numbers.bits() % most) as usize;
        let shape = [side(12), side(12), side(100)];
        let chi = field::<f32>(shape, noise(seed));
        let (mesh, report) = on_cpu(&chi, 0.0);
        let found = host(device, &made(device, &chi, 0.0).0);
        assert_eq!(found.report, report, "{shape:?}, seed {seed}");
        assert_eq!(
            found.faces,
            mesh.faces().as_flattened(),
            "{shape:?}, seed {seed}"
        );
    }
}

/// Rows of two cells fill words of 32: 65,700 groups of 256 units.
fn more_groups_than_one_dimension_has_are_reached<R: Runtime>(device: &Device<R>) {
    let chi = field::<f32>([720, 730, 2], waves);
    let (mesh, report) = on_cpu(&chi, 0.0);
    let (surface, residual) = made(device, &chi, 0.0);
    let found = host(device, &surface);
    assert_eq!(found.report, report);
    assert_eq!(found.faces, mesh.faces().as_flattened());
    let bars = cotangents::<f32>(mesh.vertices().len());
    let bars = device.upload(bars.as_flattened()).expect("an array");
    let out = pullback(device, &residual, &bars).expect("cotangents");
    let chi_bar = device.download(&out.chi).expect("an array");
    let last = chi_bar.iter().rposition(|&v| v != 0.0);
    // The last plane has vertices on its edges.
    assert!(last.is_some_and(|at| at > 719 * 730 * 2), "{last:?}");
}

fn cotangents<T: Scalar>(count: usize) -> Vec<[T; 3]> {
    Numbers(count as u64).vectors(count)
}

fn pullbacks_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let mut worst = [0.0f64; 3];
    let mut guarded = 0;
    for (name, chi, level) in fields::<T>().into_iter().chain([nearly_flat()]) {
        let (mesh, _) = on_cpu(&chi, T::of(level));
        let bars = cotangents::<T>(mesh.vertices().len());
        let mut chi_bar = vec![T::zero(); chi.values().len()];
        let expected = cpu::pullback(&chi, T::of(level), &mesh, &bars, &mut chi_bar);
        let chi_bar: Vec<f64> = chi_bar.iter().map(|v| v.f64()).collect();
        let (_, residual) = made(device, &chi, T::of(level));
        let uploaded = device.upload(bars.as_flattened()).expect("an array");
        let out = pullback(device, &residual, &uploaded).expect("cotangents");
        let count = device.download(&out.guarded).expect("a number")[0] as usize;
        assert_eq!(count, expected.guarded, "{name}");
        guarded += count;
        // Cells are compared with the largest; sums with what they would be without signs.
        let found = device.download(&out.chi).expect("an array");
        let of_chi = difference(&found, &chi_bar, largest(&chi_bar));
        let all: f64 = chi_bar.iter().map(|v| v.abs()).sum();
        let found = device.download(&out.level).expect("a number");
        let of_level = difference(&found, &[expected.level], all);
        let [x, y, z] = expected.grid.lower;
        let extent = chi.grid().shape().into_iter().fold(0, usize::max) as f64;
        let found = device.download(&out.grid).expect("numbers");
        let sum = bars.len() as f64;
        let of_grid = difference(&found[..3], &[x, y, z], sum).max(difference(
            &found[3..],
            &[expected.grid.spacing],
            sum * extent,
        ));
        let tolerance = if T::EPSILON.f64() < 1e-10 {
            1e-12
        } else {
            3e-6
        };
        for (worst, error) in worst.iter_mut().zip([of_chi, of_level, of_grid]) {
            assert!(error < tolerance, "{name}: {of_chi} {of_level} {of_grid}");
            *worst = worst.max(error);
        }
    }
    assert!(guarded > 0, "the guard was never needed");
    println!(
        "{}: χ, level and grid differ by {worst:?}",
        <T as isograd::Real>::NAME
    );
}

/// Hardly changes along most of its crossed edges, but for two cells.
fn nearly_flat<T: Scalar>() -> (&'static str, Field<T>, f64) {
    let mut chi = field([9, 11, 35], |x| 1e-8 * waves(x));
    chi.values_mut()[7] = T::of(1.0);
    chi.values_mut()[1234] = T::of(-1.0);
    ("nearly flat", chi, 0.0)
}

fn two_runs_give_the_same_bits<R: Runtime>(device: &Device<R>) {
    let chi = field::<f32>([31, 30, 45], noise(9));
    let run = || {
        let (surface, residual) = made(device, &chi, 0.0);
        let bars = cotangents::<f32>(surface.edges.len());
        let bars = device.upload(bars.as_flattened()).expect("an array");
        let out = pullback(device, &residual, &bars).expect("cotangents");
        let cotangent = [&out.chi, &out.level, &out.grid].map(|b| device.download(b).expect("it"));
        (host(device, &surface), cotangent)
    };
    assert!(run() == run());
}

fn what_has_no_surface_is_refused_in_the_words_of_the_cpu<R: Runtime>(device: &Device<R>) {
    let refused = |chi: &Field<f32>, level: f32| {
        let plan = Plan::new(device).expect("a plan");
        let values = device.upload(chi.values()).expect("a field");
        let at = device.upload(&[level]).expect("a level");
        let found = forward(device, &plan, &values, &at, chi.grid());
        let mut mesh = Mesh::default();
        let expected = cpu::forward(chi, level, &mut cpu::Scratch::default(), &mut mesh);
        let found = found.err().expect("refused").to_string();
        assert_eq!(found, expected.expect_err("refused").to_string());
    };
    let chi = field::<f32>([13, 11, 37], torus);
    refused(&chi, -2.0);
    refused(&chi, 5.0);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        refused(&chi, bad);
        for cells in [&[[3, 4, 35], [3, 4, 36]][..], &[[12, 10, 36]], &[[0, 0, 0]]] {
            let mut broken = chi.clone();
            for &cell in cells {
                let at = chi.grid().index(cell);
                broken.values_mut()[at] = bad;
            }
            refused(&broken, 0.0);
            refused(&broken, bad);
        }
    }
    // All of it at the level: that is outside.
    refused(&field([5, 6, 7], |_| 1.0), 1.0);
}

fn arrays_that_do_not_fit_are_refused<R: Runtime>(device: &Device<R>) {
    let chi = field::<f32>([5, 6, 7], |x| x[0] + 0.5);
    let plan = Plan::new(device).expect("a plan");
    let short = device.upload(&chi.values()[2..]).expect("an array");
    let whole = device.upload(chi.values()).expect("an array");
    let level = device.upload(&[0.0f32]).expect("a number");
    let refused = |chi_of: &_, level: &_| {
        let error = forward(device, &plan, chi_of, level, chi.grid()).err();
        matches!(
            error,
            Some(Error::Device(isograd_gpu::Error::Length { .. }))
        )
    };
    assert!(refused(&short, &level) && refused(&whole, &short));
    let (_, residual) = forward(device, &plan, &whole, &level, chi.grid()).expect("a surface");
    assert!(pullback(device, &residual, &short).is_err());
}
