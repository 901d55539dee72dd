//! The whole, forward and back, beside the CPU's.

use cubecl::prelude::Runtime;
use isograd::isosurface::Level;
use isograd::neighbors::{RadiiCotangent, Radius};
use isograd::normals::radii_pullback;
use isograd::orient::{Method, ParityOptions};
use isograd::poisson::Smoothing;
use isograd::{Grid, Options, Real, Reconstructor, Resolution};
use isograd_gpu::distance::Band;
use isograd_gpu::pipeline::{self, Error, RadiiAndSigns};
use isograd_gpu::splat::Weights;
use isograd_gpu::{Device, Scalar, orient};

use crate::clouds::{bare, on_cpu, on_grid, real, relative, sampled};
use crate::devices::{Numbers, tests};

tests! {
    in_each_number:
        phi_and_its_gradient_are_those_of_the_cpu,
        what_the_device_finds_and_holds_is_what_the_cpu_finds;
    on_each_device: points_outside_the_grid_are_named;
}

/// The plan that is compared on a cloud.
#[derive(Clone)]
struct Case {
    shape: &'static str,
    samples: usize,
    cells: usize,
    options: Options,
}

fn cases() -> [Case; 4] {
    let torus = Case {
        shape: "torus",
        samples: 3000,
        cells: 32,
        options: on_grid(),
    };
    let small = Case {
        samples: 1500,
        cells: 22,
        ..torus.clone()
    };
    [
        torus,
        Case {
            shape: "fish",
            samples: 2000,
            cells: 40,
            options: on_grid()
                .smoothing(Smoothing::Cells(1.0))
                .level(Level::Thin),
        },
        Case {
            options: on_grid()
                .splat(Weights::Paper)
                .area(false)
                .band(Band::Within(0.2)),
            ..small.clone()
        },
        Case {
            options: on_grid().screening(4.0).level(Level::Mean),
            ..small
        },
    ]
}

/// Cotangents of all results.
struct Bars<T> {
    sdf: Vec<T>,
    indicator: Vec<T>,
    iso_value: T,
    vertices: Vec<[T; 3]>,
    normals: Vec<[T; 3]>,
    areas: Vec<T>,
}

impl<T: Scalar> Bars<T> {
    /// Of about equal weight, in the units of the results.
    fn of(result: &isograd::Reconstruction<T>) -> Self {
        let spacing = Real::f64(result.sdf().grid().spacing());
        let mut numbers = Numbers(12);
        let mut list = |count: usize, scale: f64| -> Vec<T> {
            let next = |_| real(scale * numbers.signed());
            (0..count).map(next).collect()
        };
        let (cells, samples) = (result.sdf().values().len(), result.normals().len());
        let vertices = result.mesh().vertices().len();
        Self {
            sdf: weights(result.sdf().values(), spacing),
            indicator: list(cells, 0.01 * spacing),
            iso_value: list(1, 10.0 * spacing)[0],
            vertices: list(3 * vertices, 1.0).as_chunks().0.to_vec(),
            normals: list(3 * samples, 0.1 * spacing).as_chunks().0.to_vec(),
            areas: list(samples, 0.1 / spacing),
        }
    }

    fn on_cpu(&self) -> isograd::Cotangent<'_, T> {
        isograd::Cotangent {
            sdf: Some(&self.sdf),
            indicator: Some(&self.indicator),
            iso_value: self.iso_value,
            vertices: Some(&self.vertices),
            normals: Some(&self.normals),
            areas: Some(&self.areas),
            extensions: &[],
        }
    }
}

fn phi_and_its_gradient_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    // Of the whole chain; gradients pass twice as many stages.
    let tolerance = if T::NAME == "f32" { 1e-4 } else { 1e-10 };
    for Case {
        shape: name,
        samples,
        cells,
        options,
    } in cases()
    {
        let cloud = bare::<T>(name, samples);
        let grid = Grid::fit(&cloud, Resolution::Cells(cells), real(0.1)).unwrap();
        let mut plan = Reconstructor::new(grid, options.clone()).unwrap();
        let expected = plan.reconstruct(&cloud).unwrap();

        let plan = pipeline::Reconstructor::new(device.clone(), grid, (&options).into()).unwrap();
        let held = RadiiAndSigns::find(device, &cloud, Radius::Auto, &Method::Auto).unwrap();
        let points = device.upload(cloud.points().as_flattened()).unwrap();
        let result = plan.reconstruct(&points, &held).unwrap();
        let found = device.download(&result.sdf).unwrap();
        let difference = relative(&found, expected.sdf().values());
        println!("{name} {}: φ {difference:.1e}", T::NAME);
        assert!(difference < tolerance, "{name}: {difference:e}");

        let bars = Bars::of(expected);
        let upload = |values: &[T]| device.upload(values).unwrap();
        let all = [
            upload(&bars.sdf),
            upload(&bars.indicator),
            upload(&[bars.iso_value]),
            upload(bars.vertices.as_flattened()),
            upload(bars.normals.as_flattened()),
            upload(&bars.areas),
        ];
        let pull = |result: &pipeline::Reconstruction<T>, cotangent: [bool; 6]| {
            let given = |k: usize| cotangent[k].then_some(&all[k]);
            let cotangent = pipeline::Cotangent {
                sdf: given(0),
                indicator: given(1),
                iso_value: given(2),
                vertices: given(3),
                normals: given(4),
                areas: given(5),
                extensions: &[],
            };
            let bars = plan.pullback(result, &cotangent).unwrap();
            let axis_radii = bars.axis_radii.as_ref().expect("axes");
            let of_spacing = bars.spacing.as_ref();
            let spacing = of_spacing.map(|bar| device.download(bar).unwrap());
            let spacing = spacing.unwrap_or(vec![T::of(0.0)]);
            let [points, radii, axis_radii, grid] =
                [&bars.points, &bars.radii, axis_radii, &bars.grid]
                    .map(|bar| device.download(bar).unwrap());
            [points, radii, axis_radii, grid, spacing]
        };
        let samples = on_cpu(cloud.points(), Method::Given).unwrap();
        let near = samples.neighborhoods();
        let widened = device.download(&held.radii).unwrap();
        let mut of_all = None;
        for given in cotangents() {
            let expected = expected.pullback(&only(&bars.on_cpu(), given));
            let expected = expected.unwrap();
            let [x, y, z] = expected.grid.lower;
            let [fixed, of_radii, of_axis_radii, of_grid, of_spacing] = pull(&result, given);
            let mut of_points = fixed.as_chunks().0.to_vec();
            let mut radii = RadiiCotangent::of(near, &of_radii);
            radii.add_spacing(Real::f64(of_spacing[0]));
            let widened = [&widened[..], &near.radius];
            radii_pullback(near, widened, &of_axis_radii, &mut of_points, &mut radii);
            isograd::neighbors::pullback(near, &radii, &mut of_points);
            let errors = [
                relative(of_points.as_flattened(), expected.points.as_flattened()),
                match given == [false, false, false, false, true, true] {
                    // Neither axes nor areas know of the grid.
                    true => of_grid.iter().map(|bar| Real::f64(bar.abs())).sum(),
                    false => relative(&of_grid, &[x, y, z, expected.grid.spacing]),
                },
            ];
            println!("{given:?}: x̄ and that of the grid {errors:?}");
            let most = errors.into_iter().fold(0.0, f64::max);
            assert!(most < 10.0 * tolerance, "{name} {given:?}: {most:e}");
            if given == [true; 6] {
                of_all = Some([fixed, of_radii, of_axis_radii, of_grid, of_spacing]);
            }
        }

        // The next step of a body that has not moved: the same bits, sides told by the normals before.
        let held = held.facing(result.normals.clone()).unwrap();
        let again = plan.reconstruct(&points, &held).unwrap();
        assert_eq!(device.download(&again.sdf).unwrap(), found);
        assert_eq!(Some(pull(&again, [true; 6])), of_all);
    }
}

/// Which results have a cotangent: φ alone, all, none of the fields, the vertices alone.
fn cotangents() -> [[bool; 6]; 4] {
    let (yes, no) = (true, false);
    [
        [yes, no, no, no, no, no],
        [yes; 6],
        [no, no, no, no, yes, yes],
        [no, no, no, yes, no, no],
    ]
}

fn only<'a, T: Scalar>(
    all: &isograd::Cotangent<'a, T>,
    given: [bool; 6],
) -> isograd::Cotangent<'a, T> {
    isograd::Cotangent {
        sdf: all.sdf.filter(|_| given[0]),
        indicator: all.indicator.filter(|_| given[1]),
        iso_value: if given[2] { all.iso_value } else { real(0.0) },
        vertices: all.vertices.filter(|_| given[3]),
        normals: all.normals.filter(|_| given[4]),
        areas: all.areas.filter(|_| given[5]),
        extensions: &[],
    }
}

/// Cotangents of φ near the surface, where the closest triangle does not jump.
fn weights<T: Scalar>(phi: &[T], spacing: f64) -> Vec<T> {
    let mut numbers = Numbers(11);
    phi.iter()
        .map(|&phi| {
            let weight = numbers.signed();
            let near = Real::f64(phi).abs() < 1.5 * spacing;
            real(if near { weight } else { 0.0 })
        })
        .collect()
}

fn points_outside_the_grid_are_named<R: Runtime>(device: &Device<R>) {
    let cloud = bare::<f32>("torus", 500);
    let grid = Grid::new([0.0; 3], 0.1, [12, 12, 12]).unwrap();
    let plan = pipeline::Reconstructor::new(device.clone(), grid, Default::default()).unwrap();
    let held = RadiiAndSigns::find(device, &cloud, Radius::Auto, &Method::Auto).unwrap();
    let points = device.upload(cloud.points().as_flattened()).unwrap();
    match plan.reconstruct(&points, &held) {
        Err(Error::Outside { count, first }) => assert!(count > 100 && first < 500),
        other => panic!("{:?}", other.err()),
    }
}

/// Points go to the device, and nothing else does.
fn what_the_device_finds_and_holds_is_what_the_cpu_finds<R: Runtime, T: Scalar>(
    device: &Device<R>,
) {
    let (tight, loose): (f64, f64) = if T::NAME == "f32" {
        (1e-5, 2e-4)
    } else {
        (1e-12, 1e-9)
    };
    let cloud = sampled::<T>("torus", 2000);
    let grid = Grid::fit(&cloud, Resolution::Cells(24), real(0.1)).unwrap();
    let plan = pipeline::Reconstructor::new(device.clone(), grid, Default::default()).unwrap();
    let points = device.upload(cloud.points().as_flattened()).unwrap();
    let normals = device
        .upload(cloud.normals().unwrap().as_flattened())
        .unwrap();
    let parity = ParityOptions::default();
    let methods = [
        (Method::Signs, orient::Method::Signs(normals)),
        (Method::Parity(parity), orient::Method::Parity(parity)),
    ];
    for (on_cpu, on_device) in methods {
        for radius in [Radius::Auto, Radius::Fixed(0.08)] {
            let expected = RadiiAndSigns::find(device, &cloud, radius, &on_cpu).unwrap();
            let found = RadiiAndSigns::find_on_device(device, &points, radius, &on_device).unwrap();
            let common = Real::f64(found.common_radius) / Real::f64(expected.common_radius);
            assert!((common - 1.0).abs() < tight, "{common}");
            for (found, expected, most) in [
                (&found.radii, &expected.radii, loose),
                (&found.area_radii, &expected.area_radii, loose),
                (&found.outward, &expected.outward, loose),
                // In single precision, whatever the number type.
                (&found.confidence, &expected.confidence, loose.max(1e-5)),
            ] {
                let [found, expected] = [found, expected].map(|b| device.download(b).unwrap());
                let difference = relative(&found, &expected);
                assert!(difference < most, "{on_cpu:?}, {radius:?}: {difference:e}");
            }
            if radius != Radius::Auto {
                continue;
            }
            let [found, expected] = [&found, &expected].map(|held| {
                let result = plan.reconstruct(&points, held).unwrap();
                device.download(&result.sdf).unwrap()
            });
            let difference = relative(&found, &expected);
            println!("{on_cpu:?}, {radius:?}, {}: φ {difference:.1e}", T::NAME);
            assert!(
                difference < loose,
                "{on_cpu:?}, {radius:?}: φ {difference:e}"
            );
        }
    }
    let none = device.upload::<T>(&[]).unwrap();
    let method = orient::Method::Parity(parity);
    let refused = RadiiAndSigns::find_on_device(device, &none, Radius::Auto, &method).err();
    assert!(matches!(
        refused,
        Some(Error::Samples(isograd::Error::Neighbors(_)))
    ));
    let short = orient::Method::Signs(none.clone());
    let refused = RadiiAndSigns::find_on_device(device, &points, Radius::Auto, &short).err();
    assert!(matches!(refused, Some(Error::Device(_))));
}
