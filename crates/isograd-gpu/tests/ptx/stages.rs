//! Calls that launch every kernel. The data are nothing; counts that host code asks for are answered.

use isograd::Grid;
use isograd::splat::Weights;
use isograd_gpu::differential::{self, Differential, LocalCotangent};
use isograd_gpu::distance::{Band, Mesh, lattice, query};
use isograd_gpu::primitives::{reduce, scan, sort};
use isograd_gpu::splat::{self, SampleCotangent, Samples};
use isograd_gpu::{
    Buffer, Device, Scalar, area, iso_value, isosurface, neighbors, normals, pipeline, poisson,
};

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
    samples::<T>(device);
    solves::<T>(device);
    surfaces::<T>(device);
    distances::<T>(device);
    derivatives::<T>(device);
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
    let radius = <T as isograd::Real>::of(0.1);
    let (areas, residual) = area::forward(device, &near, radius).unwrap();
    area::pullback(device, &residual, &areas).unwrap();
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
    let bars = SampleCotangent::zeros(device, SAMPLES).unwrap();
    for weights in [Weights::BSpline, Weights::Paper] {
        let (b, of_splat) = splat::forward(device, samples, &grid(), weights).unwrap();
        splat::pullback(device, &of_splat, samples, &b, &bars).unwrap();
        let (level, residual) = iso_value::forward(device, &b, &grid(), &points, &areas).unwrap();
        for values in [None, Some(&areas)] {
            iso_value::pullback(
                device, &residual, &of_splat, samples, &level, values, &b, &bars,
            )
            .unwrap();
        }
    }
}

/// Lines of factors 2, 3, 4, 5 and others, and products with matrices.
fn solves<T: Scalar>(device: &Device<Recorder>) {
    for shape in [[64, 90, 77], [37, 128, 1], [625, 2, 3]] {
        let solver = poisson::Solver::<T>::new(device, shape).unwrap();
        let b = numbers(device, shape.iter().product());
        let (chi, residual) = poisson::forward(device, &solver, &b, 0.8).unwrap();
        poisson::pullback(device, &solver, &residual, &chi).unwrap();
        let solver = poisson::Solver::<T>::by_products(device, shape).unwrap();
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
    let (measures, residual) =
        isosurface::measure::forward(device, &surface.vertices, &surface.faces).unwrap();
    isosurface::measure::pullback(device, &residual, &measures.area_and_volume).unwrap();
}

fn distances<T: Scalar>(device: &Device<Recorder>) {
    let mesh = Mesh {
        vertices: numbers::<T>(device, 3 * VERTICES),
        faces: device.empty(3 * FACES).unwrap(),
    };
    let (chi, level) = (numbers::<T>(device, cells()), numbers::<T>(device, 1));
    for band in [Band::Full, Band::Cells(3.0)] {
        let (phi, residual) = lattice::forward(device, &mesh, &grid(), &chi, &level, band).unwrap();
        lattice::pullback(device, &residual, &phi).unwrap();
    }
    let (points, grid) = (&mesh.vertices, grid());
    let hits = query::signed(device, &mesh, points, Some((&chi, &grid))).unwrap();
    let bars = (&hits.distances, Some(&hits.points));
    query::pullback(device, &mesh, points, &hits, bars.0, bars.1).unwrap();
}

fn derivatives<T: Scalar>(device: &Device<Recorder>) {
    let (phi, points) = (
        numbers::<T>(device, cells()),
        numbers::<T>(device, 3 * SAMPLES),
    );
    let normals = differential::unit_normals(device, &phi, &grid()).unwrap();
    differential::unit_normals_pullback(device, &phi, &grid(), &normals, &phi).unwrap();
    let known = Differential::new(device, &phi, &grid(), &Default::default()).unwrap();
    let local = known.at_points(device, &points).unwrap();
    known.outside(device, &points).unwrap();
    let bar = LocalCotangent {
        gradient: Some(&local.gradient),
        normal: Some(&local.normal),
        curvature: Some(&local.curvature),
    };
    known
        .pullback_at_points(device, &phi, &points, bar, &phi, &points)
        .unwrap();
}

fn whole<T: Scalar>(device: &Device<Recorder>) {
    let held = pipeline::Held {
        radii: numbers::<T>(device, SAMPLES),
        area_radii: numbers(device, SAMPLES),
        common_radius: <T as isograd::Real>::of(0.1),
        outward: numbers(device, 3 * SAMPLES),
    };
    let plan = pipeline::Reconstructor::new(device.clone(), grid(), Default::default()).unwrap();
    answer(&[&[0, 0], &[100, 0, VERTICES as u32, FACES as u32]]);
    let result = plan.reconstruct(&held.outward, &held).unwrap();
    plan.pullback(&result, &result.sdf).unwrap();
}
