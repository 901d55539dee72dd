//! Gradient, normals and curvature and their pullbacks, beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::differential as cpu;
use isograd::{Field, Grid};
use isograd_gpu::differential::{self, Differential, Local, LocalCotangent, Options};
use isograd_gpu::{Buffer, Device, Error, Scalar};

use crate::devices::{Numbers, in_both_numbers, on_each_device};
use crate::samples::assert_near;

/// Axes of every length up to one where central differences alone are left, walls being five cells deep.
const SHAPES: [[usize; 3]; 7] = [
    [2, 2, 2],
    [2, 3, 4],
    [4, 2, 3],
    [3, 4, 2],
    [5, 7, 6],
    [8, 9, 31],
    [23, 37, 19],
];

fn grid<T: Scalar>(shape: [usize; 3]) -> Grid<T> {
    Grid::new([-0.9, 0.3, 7.1].map(T::of), T::of(0.07), shape).expect("valid")
}

/// `f` of the way from the middle of the grid, in its unit.
fn field<T: Scalar>(grid: Grid<T>, mut f: impl FnMut([f64; 3]) -> f64) -> Field<T> {
    let middle = [0, 1, 2].map(|a| 0.5 * (grid.lower()[a] + grid.upper()[a]).f64());
    let mut value = |at| {
        let x = grid.center(grid.cell(at)).map(T::f64);
        T::of(f([0, 1, 2].map(|a| x[a] - middle[a])))
    };
    Field::new(grid, (0..grid.cells()).map(&mut value).collect()).expect("sizes match")
}

/// The distance to a sphere that is off the middle, rough by a part of a cell.
fn rough<T: Scalar>(shape: [usize; 3], roughness: f64) -> Field<T> {
    let mut numbers = Numbers(11);
    field(grid(shape), |[x, y, z]| {
        let distance = (x - 0.013).hypot(y + 0.021).hypot(z - 0.034) - 0.3;
        distance + roughness * 0.07 * numbers.signed()
    })
}

fn noise<T: Scalar>(count: usize, seed: u64) -> Vec<T> {
    let mut numbers = Numbers(seed);
    (0..count).map(|_| T::of(numbers.signed())).collect()
}

fn triples<T: Scalar>(values: &[T]) -> Vec<[T; 3]> {
    values.chunks(3).map(|v| [v[0], v[1], v[2]]).collect()
}

#[test]
fn values_at_cells_are_those_of_the_cpu() {
    on_each_device!(check_values);
}

fn check_values<R: Runtime>(device: &Device<R>) {
    in_both_numbers!(device, check_values_in);
}

fn check_values_in<R: Runtime, T: Scalar>(device: &Device<R>, tolerance: f64) {
    for shape in SHAPES {
        let phi = rough::<T>(shape, 0.1);
        let grid = phi.grid();
        let on_device = device.upload(phi.values()).unwrap();
        let run = || {
            let gradient = differential::gradient(device, &on_device, grid).unwrap();
            let normals = differential::unit_normals(device, &on_device, grid).unwrap();
            [gradient, normals].map(|found| device.download(&found).unwrap())
        };
        let found = run();
        let (mut gradient, mut normals) = (Vec::new(), Vec::new());
        cpu::gradient(&phi, &mut gradient);
        cpu::unit_normals(&phi, &mut normals);
        assert_near("gradient", &found[0], gradient.as_flattened(), tolerance);
        assert_near("normals", &found[1], normals.as_flattened(), tolerance);
        assert!(found == run(), "other bits the second time");
        for smoothing in [0, 1, 2, 5] {
            let options = Options { smoothing };
            let run = || {
                let kappa =
                    differential::mean_curvature(device, &on_device, grid, &options).unwrap();
                device.download(&kappa).unwrap()
            };
            let mut expected = Vec::new();
            let scratch = &mut cpu::Scratch::default();
            cpu::mean_curvature(&phi, &options, scratch, &mut expected);
            let found = run();
            assert_near("curvature", &found, &expected, tolerance);
            assert!(found == run(), "other bits the second time");
        }
        assert_eq!(
            device.download(&on_device).unwrap(),
            phi.values(),
            "the input was smoothed"
        );
    }
}

#[test]
fn pullbacks_of_cells_are_those_of_the_cpu() {
    on_each_device!(check_pullbacks);
}

fn check_pullbacks<R: Runtime>(device: &Device<R>) {
    in_both_numbers!(device, check_pullbacks_in);
}

fn check_pullbacks_in<R: Runtime, T: Scalar>(device: &Device<R>, tolerance: f64) {
    for shape in SHAPES {
        let phi = rough::<T>(shape, 0.1);
        let (grid, cells) = (phi.grid(), phi.values().len());
        let on_device = device.upload(phi.values()).unwrap();
        // What others have added already must stay.
        let started = noise::<T>(cells, 3);
        let bars = noise::<T>(3 * cells, 4);
        let given = device.upload(&bars).unwrap();
        let pulled = |pull: &dyn Fn(&Buffer<T>) -> Result<(), Error>| {
            let run = || {
                let phi_bar = device.upload(&started).unwrap();
                pull(&phi_bar).unwrap();
                device.download(&phi_bar).unwrap()
            };
            let found = run();
            assert!(found == run(), "other bits the second time");
            found
        };
        let mut expected = started.clone();
        cpu::gradient_pullback(&phi, &triples(&bars), &mut expected).expect("lengths match");
        let found = pulled(&|bar| differential::gradient_pullback(device, grid, &given, bar));
        assert_near("of gradient", &found, &expected, tolerance);

        let scratch = &mut cpu::PullbackScratch::default();
        let mut expected = started.clone();
        let guarded =
            cpu::unit_normals_pullback(&phi, &triples(&bars), scratch, &mut expected).unwrap();
        let found = pulled(&|bar| {
            differential::unit_normals_pullback(device, &on_device, grid, &given, bar)
        });
        assert_near("of normals", &found, &expected, tolerance);
        assert_eq!(guarded, 0);

        let given = device.upload(&bars[..cells]).unwrap();
        for smoothing in [0, 1, 2, 5] {
            let options = Options { smoothing };
            let mut expected = started.clone();
            cpu::mean_curvature_pullback(&phi, &options, &bars[..cells], scratch, &mut expected)
                .unwrap();
            let found = pulled(&|bar| {
                let (phi, options) = (&on_device, &options);
                differential::mean_curvature_pullback(device, phi, grid, options, &given, bar)
            });
            assert_near("of curvature", &found, &expected, tolerance);
        }
    }
}

#[test]
fn bounds_and_zeros_are_those_of_the_cpu() {
    on_each_device!(check_bounds);
}

/// A constant, creases, the negative of a distance, and nearly nothing: where derivatives do not exist.
fn check_bounds<R: Runtime>(device: &Device<R>) {
    let grid = grid::<f32>([11, 9, 13]);
    for (at, phi) in [
        field(grid, |_| 0.7),
        field(grid, |x| x[0].abs() + x[1].abs()),
        field(grid, |x| -x[0].hypot(x[1]).hypot(x[2])),
        field(grid, |x| x[0] * x[1] * 1e-25),
    ]
    .iter()
    .enumerate()
    {
        let on_device = device.upload(phi.values()).unwrap();
        let mut normals = Vec::new();
        cpu::unit_normals(phi, &mut normals);
        let found = differential::unit_normals(device, &on_device, &grid).unwrap();
        let found = device.download(&found).unwrap();
        for (found, expected) in found.chunks(3).zip(&normals) {
            let zero = expected == &[0.0; 3];
            assert_eq!(found == [0.0; 3], zero, "{at}: {found:?} {expected:?}");
        }
        let bar = device.upload(&noise::<f32>(grid.cells(), 5)).unwrap();
        for smoothing in [0, 2] {
            let options = Options { smoothing };
            let kappa = differential::mean_curvature(device, &on_device, &grid, &options).unwrap();
            let kappa = device.download(&kappa).unwrap();
            let bound = 2.0 / grid.spacing() * 1.000_001;
            assert!(kappa.iter().all(|k| k.abs() <= bound), "{at}");
            assert!(at != 0 || kappa.iter().all(|&k| k == 0.0));
            assert!(at != 2 || kappa.iter().any(|&k| k < -0.999 * bound));
            let phi_bar = device.upload(&vec![0.0; grid.cells()]).unwrap();
            let phi = &on_device;
            differential::mean_curvature_pullback(device, phi, &grid, &options, &bar, &phi_bar)
                .unwrap();
            let phi_bar = device.download(&phi_bar).unwrap();
            assert!(phi_bar.iter().all(|x| x.is_finite()), "{at}");
            assert!(at != 0 || phi_bar.iter().all(|&x| x == 0.0));
        }
    }
}

/// Points anywhere in a grid, at its corners and along its walls; and `crowd` more of them in one cell.
fn points<T: Scalar>(grid: &Grid<T>, count: usize, crowd: usize) -> Vec<[T; 3]> {
    let mut numbers = Numbers(21);
    let shape = grid.shape();
    let mut points = vec![grid.lower(), grid.upper()];
    points.extend((0..count + crowd).map(|i| {
        let place = shape.map(|n| match i < count {
            true => numbers.unit() * n as f64,
            false => (n / 2) as f64 + 0.501 + 0.998 * numbers.unit(),
        });
        grid.from_index(place.map(T::of))
    }));
    let last = points.len() - 1;
    points[last][1] = grid.upper()[1];
    points
}

#[test]
fn values_at_points_are_those_of_the_cpu() {
    on_each_device!(check_points);
}

fn check_points<R: Runtime>(device: &Device<R>) {
    in_both_numbers!(device, check_points_in);
}

fn check_points_in<R: Runtime, T: Scalar>(device: &Device<R>, tolerance: f64) {
    for (shape, count, crowd) in [
        ([2, 3, 2], 50, 0),
        ([9, 13, 8], 700, 9001),
        ([31, 20, 27], 5003, 0),
    ] {
        let phi = rough::<T>(shape, 0.1);
        let points = points(phi.grid(), count, crowd);
        let options = Options::default();
        let of_cpu = cpu::Differential::new(&phi, &options);
        let mut expected = Vec::new();
        of_cpu.at_points(&points, &mut expected).expect("inside");
        let on_device = device.upload(phi.values()).unwrap();
        let places = device.upload(points.as_flattened()).unwrap();
        let known = Differential::new(device, &on_device, phi.grid(), &options).unwrap();
        assert_eq!(known.outside(device, &places).unwrap(), None);
        let found = known.at_points(device, &places).unwrap();
        let pick = |f: &dyn Fn(&cpu::Local<T>) -> [T; 3]| -> Vec<T> {
            expected.iter().flat_map(f).collect()
        };
        let near = |name, found: &Buffer<T>, expected: &[T]| {
            assert_near(name, &device.download(found).unwrap(), expected, tolerance);
        };
        near("gradient", &found.gradient, &pick(&|l| l.gradient));
        near("normal", &found.normal, &pick(&|l| l.normal));
        let curvature: Vec<T> = expected.iter().map(|l| l.curvature).collect();
        near("curvature", &found.curvature, &curvature);
        check_points_bar(device, &phi, &points, &of_cpu, &known, tolerance);
    }
}

/// Cotangents of all quantities, and of each alone.
fn check_points_bar<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Field<T>,
    points: &[[T; 3]],
    of_cpu: &cpu::Differential<T>,
    known: &Differential<T>,
    tolerance: f64,
) {
    let (count, cells) = (points.len(), phi.values().len());
    let (started, at_points) = (noise::<T>(cells, 6), noise::<T>(3 * count, 7));
    let bars = [8, 9, 10].map(|seed| noise::<T>(3 * count, seed));
    let on_device = device.upload(phi.values()).unwrap();
    let places = device.upload(points.as_flattened()).unwrap();
    for which in [
        [true; 3],
        [true, false, false],
        [false, true, false],
        [false, false, true],
    ] {
        let zero = T::of(0.0);
        let of = |k: usize, i: usize| match which[k] {
            true => [bars[k][3 * i], bars[k][3 * i + 1], bars[k][3 * i + 2]],
            false => [zero; 3],
        };
        let of_point = |i: usize| cpu::Local {
            gradient: of(0, i),
            normal: of(1, i),
            curvature: if which[2] { bars[2][i] } else { zero },
        };
        let bar: Vec<cpu::Local<T>> = (0..count).map(of_point).collect();
        let (mut phi_bar, mut points_bar) = (started.clone(), triples(&at_points));
        let scratch = &mut cpu::PullbackScratch::default();
        of_cpu
            .pullback_at_points(phi, points, &bar, scratch, &mut phi_bar, &mut points_bar)
            .expect("inside");
        let given = Local {
            gradient: device.upload(&bars[0]).unwrap(),
            normal: device.upload(&bars[1]).unwrap(),
            curvature: device.upload(&bars[2][..count]).unwrap(),
        };
        let given = LocalCotangent {
            gradient: which[0].then_some(&given.gradient),
            normal: which[1].then_some(&given.normal),
            curvature: which[2].then_some(&given.curvature),
        };
        let run = || {
            let found = device.upload(&started).unwrap();
            let of_points = device.upload(&at_points).unwrap();
            known
                .pullback_at_points(device, &on_device, &places, given, &found, &of_points)
                .unwrap();
            (
                device.download(&found).unwrap(),
                device.download(&of_points).unwrap(),
            )
        };
        let (found, of_points) = run();
        assert_near("phi_bar", &found, &phi_bar, tolerance);
        assert_near(
            "points_bar",
            &of_points,
            points_bar.as_flattened(),
            tolerance,
        );
        assert!((found, of_points) == run(), "other bits the second time");
    }
}

#[test]
fn points_outside_are_told_and_count_for_nothing() {
    on_each_device!(check_outside);
}

fn check_outside<R: Runtime>(device: &Device<R>) {
    let phi = rough::<f32>([9, 7, 8], 0.0);
    let grid = phi.grid();
    let on_device = device.upload(phi.values()).unwrap();
    let known = Differential::new(device, &on_device, grid, &Options::default()).unwrap();
    let [x, y, z] = grid.from_index([4.3, 3.2, 5.1]);
    let above = grid.upper()[1] * 1.000_001;
    let places = [
        [x, y, z],
        [x, above, z],
        [f32::NAN, y, z],
        [x, y, f32::INFINITY],
        [-1e30, y, z],
        [x, y, z],
    ];
    let points = device.upload(places.as_flattened()).unwrap();
    let outside = known.outside(device, &points).unwrap().expect("some are");
    assert_eq!((outside.count, outside.first), (4, 1));
    let found = known.at_points(device, &points).unwrap();
    let normal = device.download(&found.normal).unwrap();
    let curvature = device.download(&found.curvature).unwrap();
    assert!(
        normal[3..15]
            .iter()
            .chain(&curvature[1..5])
            .all(|&n| n == 0.0)
    );
    assert!(normal[..3] == normal[15..] && normal[0] != 0.0 && curvature[0] > 0.0);
    let pull = |points: &Buffer<f32>| {
        let n = points.len() / 3;
        let ones = device.upload(&vec![1.0f32; 3 * n]).unwrap();
        let bar = LocalCotangent {
            gradient: Some(&ones),
            normal: Some(&ones),
            curvature: None,
        };
        let phi_bar = device.upload(&vec![0.0f32; grid.cells()]).unwrap();
        let points_bar = device.upload(&vec![0.0f32; 3 * n]).unwrap();
        known
            .pullback_at_points(device, &on_device, points, bar, &phi_bar, &points_bar)
            .unwrap();
        let of_points = device.download(&points_bar).unwrap();
        (device.download(&phi_bar).unwrap(), of_points)
    };
    let (phi_bar, points_bar) = pull(&points);
    assert!(points_bar[3..15].iter().all(|&x| x == 0.0) && points_bar[0] != 0.0);
    let inside = device
        .upload([places[0], places[5]].as_flattened())
        .unwrap();
    assert_eq!(phi_bar, pull(&inside).0);
    // No points at all.
    let none = device.upload(&[]).unwrap();
    assert!(known.at_points(device, &none).unwrap().curvature.is_empty());
    assert_eq!(known.outside(device, &none).unwrap(), None);
    assert!(pull(&none).0.iter().all(|&x| x == 0.0));
}

#[test]
fn arrays_of_other_lengths_are_refused() {
    on_each_device!(check_lengths);
}

fn check_lengths<R: Runtime>(device: &Device<R>) {
    let grid = grid::<f32>([5, 4, 3]);
    let field = |n: usize| device.upload(&vec![0.0f32; n]).unwrap();
    let (right, wrong) = (field(60), field(61));
    let options = Options::default();
    let refused = |result: Result<(), Error>| {
        assert!(matches!(result, Err(Error::Length { .. })), "{result:?}");
    };
    refused(differential::gradient(device, &wrong, &grid).map(drop));
    refused(differential::mean_curvature(device, &wrong, &grid, &options).map(drop));
    refused(differential::gradient_pullback(
        device, &grid, &right, &right,
    ));
    refused(differential::gradient_pullback(
        device,
        &grid,
        &field(180),
        &wrong,
    ));
    let known = Differential::new(device, &right, &grid, &options).unwrap();
    refused(known.at_points(device, &wrong).map(drop));
    let bar = LocalCotangent {
        curvature: Some(&wrong),
        ..Default::default()
    };
    let points = field(9);
    let result = known.pullback_at_points(device, &right, &points, bar, &right, &field(9));
    refused(result);
}
