//! Calls that launch every kernel. The data are nothing; counts that host code asks for are answered.

use cubecl::prelude::CubeElement;
use isograd::Grid;
use isograd::isosurface::Level;
use isograd::neighbors::Radius;
use isograd::splat::Weights;
use isograd_gpu::distance::{Band, Mesh, extend, lattice};
use isograd_gpu::isosurface::{self, iso_value, local_level as local};
use isograd_gpu::orient::previous::{self, Before};
use isograd_gpu::primitives::{reduce, scan, sort};
use isograd_gpu::splat::{self, SampleCotangent, Samples, area};
use isograd_gpu::{Buffer, Device, Scalar, neighbors, normals, orient, pipeline, poisson, refine};

use crate::recorder::{Recorder, answer, forget_answers};

/// Samples of the cloud that is not there.
const SAMPLES: usize = 5000;
/// Vertices and faces of its surface.
const VERTICES: usize = 30_000;
const FACES: usize = 60_000;
/// Cells of its grid.
const SHAPE: [usize; 3] = [30, 31, 64];

/// Launches all kernels for one number type.
pub fn launch_all<T: Scalar>(device: &Device<Recorder>) {
    primitives::<T>(device);
    points::<T>(device);
    held::<T>(device);
    samples::<T>(device);
    solves::<T>(device);
    surfaces::<T>(device);
    distances::<T>(device);
    extensions::<T>(device);
    whole::<T>(device);
    forget_answers();
}

fn numbers<T: Scalar>(device: &Device<Recorder>, len: usize) -> Buffer<T> {
    device.empty(len).unwrap()
}

fn grid<T: Scalar>() -> Grid<T> {
    let number = |x| <T as isograd::Real>::of(x);
    Grid::new([number(0.0); 3], number(0.1), SHAPE).unwrap()
}

fn cells() -> usize {
    SHAPE.iter().product()
}

fn primitives<T: Scalar>(device: &Device<Recorder>) {
    let values = device.empty::<u32>(1000).unwrap();
    scan::exclusive_sum(device, &values).unwrap();
    let order = sort::order(device, &values, 300).unwrap();
    sort::starts(device, &order.keys, 300).unwrap();
    reduce::sum(device, &numbers::<T>(device, 100_000)).unwrap();
}

fn points<T: Scalar>(device: &Device<Recorder>) {
    let (points, radii) = (
        numbers::<T>(device, 3 * SAMPLES),
        numbers::<T>(device, SAMPLES),
    );
    let near = neighbors::forward(device, &points, &radii).unwrap();
    let (axes, residual) = normals::forward(device, &near).unwrap();
    normals::pullback(device, &residual, &axes).unwrap();
    residual.guarded(device).unwrap();
    let (refined, residual) = refine::forward(device, &near, &axes).unwrap();
    refine::pullback(device, &residual, &refined).unwrap();
    let radius = <T as isograd::Real>::of(0.1);
    let (areas, residual) = area::forward(device, &near, radius).unwrap();
    area::pullback(device, &residual, &areas).unwrap();
}

/// Radii and orientation, for a cloud in the unit cube: what is asked for are whether a point is not finite, the box,
/// and how many reaches are positive, with their median.
fn held<T: Scalar>(device: &Device<Recorder>) {
    let points = numbers::<T>(device, 3 * SAMPLES);
    let [unit_box, median] = [&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0][..], &[100.0, 0.01]].map(words::<T>);
    answer(&[
        &[0, 0],
        &unit_box,
        &median,
        &[0],
        &words::<T>(&[0.0, 0.01]),
        &unit_box,
    ]);
    let parity = orient::Method::Parity(Default::default());
    pipeline::RadiiAndSigns::find_on_device(device, &points, Radius::Auto, &parity).unwrap();
    forget_answers();
    let near = neighbors::forward(device, &points, &numbers(device, SAMPLES)).unwrap();
    orient::given::pullback(device, &points, &points).unwrap();
    sides(device, &near, &points);
}

fn sides<T: Scalar>(
    device: &Device<Recorder>,
    near: &neighbors::Neighborhoods<T>,
    points: &Buffer<T>,
) {
    let (axes, _) = normals::forward(device, near).unwrap();
    answer(&[&[0, 0]]);
    let method = orient::Method::Signs(points.clone());
    orient::forward(device, near, &axes, &method).unwrap();
    forget_answers();
    let radii = numbers(device, SAMPLES);
    let before = Before {
        outward: points,
        confidence: &radii,
    };
    previous::forward(device, near, &radii, &axes, before).unwrap();
}

/// Numbers as they are in memory.
fn words<T: Scalar>(numbers: &[f64]) -> Vec<u32> {
    let numbers: Vec<T> = numbers
        .iter()
        .map(|&x| <T as isograd::Real>::of(x))
        .collect();
    u32::from_bytes(T::as_bytes(&numbers)).to_vec()
}

fn samples<T: Scalar>(device: &Device<Recorder>) {
    let (points, areas) = (
        numbers::<T>(device, 3 * SAMPLES),
        numbers::<T>(device, SAMPLES),
    );
    let samples = Samples {
        points: &points,
        normals: &points,
        areas: &areas,
    };
    spreads(device, samples);
    local_levels(device, samples);
    screened(device, samples);
}

fn spreads<T: Scalar>(device: &Device<Recorder>, samples: Samples<'_, T>) {
    let Samples { points, areas, .. } = samples;
    let bars = SampleCotangent::zeros(device, SAMPLES).unwrap();
    for weights in [Weights::BSpline, Weights::Paper] {
        let (b, of_splat) = splat::forward(device, samples, &grid(), weights).unwrap();
        splat::pullback(device, &of_splat, samples, &b, &bars).unwrap();
        let (level, residual) = iso_value::forward(device, &b, &grid(), points, areas).unwrap();
        for values in [None, Some(areas)] {
            iso_value::pullback(
                device, &residual, &of_splat, samples, &level, values, &b, &bars,
            )
            .unwrap();
        }
    }
}

/// The step of χ, and then what is taken off in each of three passes.
fn local_levels<T: Scalar>(device: &Device<Recorder>, samples: Samples<'_, T>) {
    let Samples { points, areas, .. } = samples;
    let bars = SampleCotangent::zeros(device, SAMPLES).unwrap();
    let (chi, of_splat) = splat::forward(device, samples, &grid(), Weights::BSpline).unwrap();
    let (_, mean) = iso_value::forward(device, &chi, &grid(), points, areas).unwrap();
    for thin in [false, true] {
        let choice = local::Options {
            area: thin,
            smoothing: 1.0,
            thin,
        };
        let (step, pass) = (
            words::<T>(&[1.0; 2]),
            words::<T>(&[0.0, 1.0, 1.0, 1.0, 1.0]),
        );
        answer(&[&step, &pass, &pass, &pass]);
        let (chi, residual) =
            local::forward(device, &chi, samples, choice, &mean, &of_splat).unwrap();
        assert_eq!(residual.gains().count(), local::PASSES);
        local::pullback(device, &residual, &of_splat, samples, &chi, &chi, &bars).unwrap();
    }
}

/// Lines of factors 2, 3, 4, 5 and others, the chirp transform, and plain sums.
fn solves<T: Scalar>(device: &Device<Recorder>) {
    for shape in [[64, 90, 77], [37, 128, 1], [625, 2, 3]] {
        let solver = poisson::Solver::<T>::new(device, shape).unwrap();
        let b = numbers(device, shape.iter().product());
        let chi = solver.solve(device, &b, 0.8).unwrap();
        poisson::smoothing::pullback(device, 0.8, shape, &chi, &b).unwrap();
        let solver = poisson::Solver::<T>::by_definition(device, shape).unwrap();
        solver.solve(device, &b, 0.0).unwrap();
    }
}

fn surfaces<T: Scalar>(device: &Device<Recorder>) {
    let plan = isosurface::Plan::new(device).unwrap();
    let (chi, level) = (numbers::<T>(device, cells()), numbers::<T>(device, 1));
    // A value that is not finite: it is looked for.
    answer(&[&[100, 1 << 6, 0, 0]]);
    assert!(isosurface::forward(device, &plan, &chi, &level, &grid()).is_err());
    forget_answers();
    // Nothing inside: the range is asked for.
    answer(&[&[0, 0, 0, 0]]);
    assert!(isosurface::forward(device, &plan, &chi, &level, &grid()).is_err());
    forget_answers();
    answer(&[&[100, 0, VERTICES as u32, FACES as u32]]);
    let (surface, residual) = isosurface::forward(device, &plan, &chi, &level, &grid()).unwrap();
    isosurface::pullback(device, &residual, &surface.vertices).unwrap();
}

fn distances<T: Scalar>(device: &Device<Recorder>) {
    let mesh = Mesh {
        vertices: numbers::<T>(device, 3 * VERTICES),
        faces: device.empty(3 * FACES).unwrap(),
    };
    let (chi, level) = (numbers::<T>(device, cells()), numbers::<T>(device, 1));
    for band in [Band::Full, Band::Within(0.3)] {
        let (phi, residual) = lattice::forward(device, &mesh, &grid(), &chi, &level, band).unwrap();
        lattice::pullback(device, &residual, &phi).unwrap();
    }
}

/// An attribute of three components, one of five, and clouds too small for the usual numbers of samples. What is asked
/// for is how many numbers are bad, how many cells are in the band, and how many faces are not there.
fn extensions<T: Scalar>(device: &Device<Recorder>) {
    let mesh = Mesh {
        vertices: numbers::<T>(device, 3 * VERTICES),
        faces: device.empty(3 * FACES).unwrap(),
    };
    let (grid, phi) = (grid(), numbers::<T>(device, cells()));
    let closest = device.empty(cells()).unwrap();
    let surface = extend::Surface {
        mesh: &mesh,
        grid: &grid,
        phi: &phi,
        closest: &closest,
    };
    for (count, components) in [(SAMPLES, 3), (SAMPLES, 5), (3, 1)] {
        let areas = numbers::<T>(device, count);
        let near = neighbors::forward(device, &numbers(device, 3 * count), &areas).unwrap();
        let samples = extend::Samples {
            neighborhoods: &near,
            radius: <T as isograd::Real>::of(0.1),
            areas: &areas,
        };
        let values = numbers::<T>(device, components * count);
        let attribute = extend::Attribute {
            values: &values,
            components,
        };
        answer(&[&[0, 9000, 0]]);
        let (extension, residual) =
            extend::forward(device, samples, attribute, surface, 0.3).unwrap();
        let (at_vertices, in_band) = (&extension.vertices, &extension.values);
        answer(&[&[0, 0]]);
        extend::pullback(
            device,
            samples,
            attribute,
            surface,
            &residual,
            &extension,
            Some(at_vertices),
            Some(in_band),
        )
        .unwrap();
    }
    forget_answers();
}

fn whole<T: Scalar>(device: &Device<Recorder>) {
    let held = pipeline::RadiiAndSigns {
        radii: numbers::<T>(device, SAMPLES),
        area_radii: numbers(device, SAMPLES),
        common_radius: <T as isograd::Real>::of(0.1),
        spacing: <T as isograd::Real>::of(0.02),
        outward: numbers(device, 3 * SAMPLES),
        confidence: numbers(device, SAMPLES),
        lines: None,
        refines: true,
        has_moved: true,
    };
    // The local level has its own call.
    let options = pipeline::Options {
        level: Level::Mean,
        ..Default::default()
    };
    let plan = pipeline::Reconstructor::new(device.clone(), grid(), options).unwrap();
    // The areas, the samples outside, the surface.
    answer(&[
        &[1 << 30, 1 << 30, 1 << 30, 1 << 30],
        &[0, 0],
        &[100, 0, VERTICES as u32, FACES as u32],
    ]);
    let result = plan.reconstruct(&held.outward, &held).unwrap();
    let sdf = Some(&result.sdf);
    let cotangent = pipeline::Cotangent {
        sdf,
        ..Default::default()
    };
    plan.pullback(&result, &cotangent).unwrap();
}

fn screened<T: Scalar>(device: &Device<Recorder>, samples: Samples<'_, T>) {
    let Samples { points, areas, .. } = samples;
    let solver = poisson::Solver::<T>::new(device, SHAPE).unwrap();
    let (chi, splat) = splat::forward(device, samples, &grid(), Weights::BSpline).unwrap();
    let (_, level) = iso_value::forward(device, &chi, &grid(), points, areas).unwrap();
    let bars = SampleCotangent::zeros(device, SAMPLES).unwrap();
    let equation = poisson::screened::Equation {
        solver: &solver,
        samples,
        area_weights: true,
        splat: &splat,
        screening: 4.0,
    };
    // The area, what is left at first and after an iteration: 2 or more in both number types, then nothing.
    let two: &[u32] = &[1 << 30, 1 << 30];
    answer(&[two, two, &[]]);
    poisson::screened::forward(device, &equation, &chi).unwrap();
    answer(&[two, two, &[]]);
    poisson::screened::pullback(device, &equation, &level, &chi, &bars).unwrap();
    answer(&[two]);
    poisson::screened::smoothing_pullback(device, &equation, &level, 0.8, &chi).unwrap();
}
