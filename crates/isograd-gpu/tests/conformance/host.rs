//! The front for hosts, beside the CPU's plan.

use isograd::distance::extend;
use isograd::isosurface::trim::Trim;
use isograd::neighbors::Radius;
use isograd::orient::{Method, ParityOptions};
use isograd::poisson::Walls;
use isograd::{
    Attribute, Backend, Cotangent, ExtensionCotangent, Grid, Outliers, PointCloud, PullbackError,
    Real, Reconstructor, Resolution, Solve, Stage, SurfaceResolution,
};
use isograd_gpu::host::{Choice, Error, Number, Plan, choose};

use crate::clouds::{bare, on_grid as options, real, relative, sampled};

/// The backends whose device is there for this number type.
fn backends<T: Number>() -> Vec<Backend> {
    let mut found = Vec::new();
    #[cfg(feature = "wgpu")]
    found.push((Backend::Vulkan, vulkan::<T>()));
    #[cfg(feature = "cuda")]
    found.push((Backend::Cuda(0), cuda::<T>()));
    found.retain(|(backend, device)| {
        let reason = device.as_ref().err();
        reason.inspect(|error| println!("SKIPPED on {backend} in {}: {error}", T::NAME));
        reason.is_none()
    });
    found.into_iter().map(|(backend, _)| backend).collect()
}

#[cfg(feature = "wgpu")]
fn vulkan<T: Number>() -> Result<(), isograd_gpu::Error> {
    isograd_gpu::Device::vulkan()?.check_number::<T>()
}

#[cfg(feature = "cuda")]
fn cuda<T: Number>() -> Result<(), isograd_gpu::Error> {
    isograd_gpu::Device::cuda(0)?.check_number::<T>()
}

/// Tests on each backend, and tests on each backend in each of its number types.
macro_rules! on_each_backend {
    ($($test:ident),+; $($typed:ident),+) => {
        mod on_each_backend {
            $(#[test]
            fn $test() {
                super::backends::<f32>().into_iter().for_each(super::$test);
            })+
            $(#[test]
            fn $typed() {
                super::backends::<f32>().into_iter().for_each(super::$typed::<f32>);
                super::backends::<f64>().into_iter().for_each(super::$typed::<f64>);
            })+
        }
    };
}

on_each_backend! {
    previous_takes_the_sides_of_the_call_before,
    a_call_with_other_points_finds_their_sides_anew,
    sensors_tell_the_sides_as_on_the_cpu,
    given_normals_are_taken_and_have_cotangents,
    a_result_is_found_again_from_its_normals,
    what_devices_do_not_have_is_named,
    an_observer_that_breaks_stops_the_work;
    outliers_are_left_out_as_on_the_cpu,
    all_that_is_asked_for_is_what_the_cpu_gives,
    any_cotangent_comes_back_as_on_the_cpu,
    attributes_are_extended_and_pulled_back_as_on_the_cpu
}

fn grid<T: Number>(cloud: &PointCloud<T>) -> Grid<T> {
    Grid::fit(cloud, Resolution::Cells(32), real(0.1)).unwrap()
}

/// A cotangent of one of the results.
fn only<'a, T: Number>(set: impl FnOnce(&mut Cotangent<'a, T>)) -> Cotangent<'a, T> {
    let mut bar = Cotangent::default();
    set(&mut bar);
    bar
}

fn outliers_are_left_out_as_on_the_cpu<T: Number>(backend: Backend) {
    let clean = bare::<T>("torus", 2000);
    let grid = Grid::fit(&clean, Resolution::Cells(16), real(0.1)).unwrap();
    let mut points = clean.points().to_vec();
    points.insert(5, [real(90.0), real(0.0), real(-3.0)]);
    // Not far, but in mid-air.
    points.insert(9, [real(0.0); 3]);
    let spoilt = PointCloud::new(points).unwrap();
    for method in [
        Method::Auto,
        Method::Parity(ParityOptions::default()),
        Method::Previous,
    ] {
        // The second time with the radii and the signs of the first, where these are the method.
        let all = |cloud: &PointCloud<T>| {
            let mut plan = Plan::new(backend, grid, options().orient(method)).unwrap();
            let first = plan.reconstruct(cloud).unwrap();
            let second = plan.reconstruct(cloud).unwrap();
            let restored = plan.restore(cloud, first.normals().unwrap()).unwrap();
            [first, second, restored]
        };
        for (found, expected) in all(&spoilt).into_iter().zip(all(&clean)) {
            assert_eq!(found.outliers(), [5, 9]);
            assert_eq!(found.points(), 2002);
            assert_eq!(found.report().unwrap().outliers, [5, 9]);
            assert_eq!(found.sdf().unwrap(), expected.sdf().unwrap());
            let mut normals = found.normals().unwrap().to_vec();
            assert_eq!(normals.remove(9), [real::<T>(0.0); 3]);
            assert_eq!(normals.remove(5), [real::<T>(0.0); 3]);
            assert_eq!(normals, expected.normals().unwrap());
            let bar = vec![real::<T>(1.0); grid.cells()];
            let cotangent = only(|of| of.sdf = Some(&bar));
            let mut pulled = found.pullback(&cotangent).unwrap();
            assert_eq!(pulled.points.remove(9), [real::<T>(0.0); 3]);
            assert_eq!(pulled.points.remove(5), [real::<T>(0.0); 3]);
            assert_eq!(pulled, expected.pullback(&cotangent).unwrap());
        }
    }
    // All of them kept, one lies outside.
    let keep = options().outliers(Outliers::Keep);
    let mut plan = Plan::new(backend, grid, keep).unwrap();
    assert!(plan.reconstruct(&spoilt).is_err());
}

fn all_that_is_asked_for_is_what_the_cpu_gives<T: Number>(backend: Backend) {
    let tolerance = if T::NAME == "f32" { 2e-4 } else { 1e-9 };
    let cloud = bare::<T>("torus", 2000);
    let grid = grid(&cloud);
    let mut plan = Reconstructor::new(grid, options()).unwrap();
    let expected = plan.reconstruct(&cloud).unwrap();
    let mut plan = Plan::new(backend, grid, options()).unwrap();
    let name = plan.name();
    assert!(name.starts_with(&format!("{backend}: ")), "{name}");
    let found = plan.reconstruct(&cloud).unwrap();
    let close = |what: &str, found: &[T], expected: &[T]| {
        let difference = relative(found, expected);
        assert!(difference < tolerance, "{what} {}: {difference:e}", T::NAME);
    };
    let sdf = expected.sdf().values();
    close("φ", found.sdf().unwrap().values(), sdf);
    let chi = expected.indicator().values();
    close("χ", found.indicator().unwrap().values(), chi);
    close("c", &[found.iso_value().unwrap()], &[expected.iso_value()]);
    let vertices = expected.mesh().vertices().as_flattened();
    let mesh = found.mesh().unwrap();
    close("vertices", mesh.vertices().as_flattened(), vertices);
    assert_eq!(mesh.faces(), expected.mesh().faces());
    let normals = expected.normals().as_flattened();
    close("normals", found.normals().unwrap().as_flattened(), normals);
    close("areas", found.areas().unwrap(), expected.areas());
    // In single precision, whatever the number type.
    let (sure, wanted) = (found.confidence().unwrap(), expected.confidence());
    assert!(relative(sure, wanted) < 1e-5);
    let counts = found
        .neighbor_counts()
        .unwrap()
        .iter()
        .zip(expected.neighbor_counts());
    // A sample at the very edge of a neighborhood.
    assert!(counts.clone().all(|(a, b)| a.abs_diff(*b) <= 1));
    assert!(counts.filter(|(a, b)| a != b).count() <= 5);
    let same = found.closest().unwrap().iter().zip(expected.closest());
    let other = same.filter(|(a, b)| a != b).count();
    // Where two faces share the closest point, rounding chooses.
    assert!(
        other * 2 < sdf.len(),
        "{other} closest faces of {}",
        sdf.len()
    );

    let (report, wanted) = (found.report().unwrap(), expected.report());
    assert_eq!(report.points, 2000);
    assert!((report.radius / wanted.radius - 1.0).abs() < tolerance);
    assert_eq!(report.neighbors, wanted.neighbors);
    assert_eq!(report.doubt, wanted.doubt);
    assert_eq!(report.surface.euler, wanted.surface.euler);
    assert_eq!(report.surface.faces, wanted.surface.faces);
    assert_eq!(report.warnings, wanted.warnings);
    assert!((report.surface.volume / wanted.surface.volume - 1.0).abs() < tolerance);
    assert!((report.smoothing / wanted.smoothing - 1.0).abs() < tolerance);
    for stage in Stage::ALL {
        assert!(report.seconds.of(stage) > 0.0, "{stage:?}");
    }
}

fn any_cotangent_comes_back_as_on_the_cpu<T: Number>(backend: Backend) {
    // A cell that is about as far from two faces may be given either, in single precision.
    let tolerance = if T::NAME == "f32" { 5e-3 } else { 1e-8 };
    let cloud = bare::<T>("torus", 1500);
    let grid = grid(&cloud);
    let mut plan = Reconstructor::new(grid, options()).unwrap();
    let expected = plan.reconstruct(&cloud).unwrap();
    let mut plan = Plan::new(backend, grid, options()).unwrap();
    let found = plan.reconstruct(&cloud).unwrap();
    let near = |phi: &T| Real::f64(*phi).abs() < 1.5 * Real::f64(grid.spacing());
    let sdf = expected.sdf().values().iter();
    let sdf: Vec<T> = sdf
        .map(|phi| if near(phi) { *phi } else { real(0.0) })
        .collect();
    let indicator = expected.indicator().values();
    let vectors = |n: usize| -> Vec<[T; 3]> {
        let wave = |i: usize| real((0.7 * i as f64).sin());
        (0..n)
            .map(|i| [wave(i), wave(i + 1), wave(i + 2)])
            .collect()
    };
    let (vertices, normals) = (vectors(expected.mesh().vertices().len()), vectors(1500));
    for (what, bar) in [
        ("φ", only(|bar| bar.sdf = Some(&sdf))),
        ("χ", only(|bar| bar.indicator = Some(indicator))),
        ("c", only(|bar| bar.iso_value = real(1.0))),
        ("vertices", only(|bar| bar.vertices = Some(&vertices))),
        ("normals", only(|bar| bar.normals = Some(&normals))),
        ("areas", only(|bar| bar.areas = Some(expected.areas()))),
    ] {
        let wanted = expected.pullback(&bar).unwrap();
        let back = found.pullback(&bar).unwrap();
        assert_eq!(back.guarded, wanted.guarded, "{what}");
        let (a, b) = (back.points.as_flattened(), wanted.points.as_flattened());
        let difference = relative(a, b);
        println!("{what} in {} on {backend}: {difference:.1e}", T::NAME);
        assert!(difference < tolerance, "{what} {}: {difference:e}", T::NAME);
    }
    let refused = found.pullback(&only(|bar| bar.sdf = Some(&sdf[1..]))).err();
    assert!(matches!(
        refused,
        Some(Error::Pullback(PullbackError::Length { .. }))
    ));
}

fn attributes_are_extended_and_pulled_back_as_on_the_cpu<T: Number>(backend: Backend) {
    let tolerance = if T::NAME == "f32" { 2e-4 } else { 1e-9 };
    let cloud = bare::<T>("torus", 1500);
    let turning = |p: &[T; 3]| [real::<T>(0.3) - p[1], p[0], p[0] * p[2]];
    let attribute = Attribute {
        name: "velocity".into(),
        components: 3,
        values: cloud.points().iter().flat_map(turning).collect(),
    };
    let cloud = cloud.with_attribute(attribute.clone()).unwrap();
    let grid = grid(&cloud);
    let mut plan = Reconstructor::new(grid, options()).unwrap();
    let expected = plan.reconstruct(&cloud).unwrap();
    let (mut residual, mut extension) = Default::default();
    let scratch = &mut extend::Scratch::default();
    let band = 2.0 * Real::f64(grid.spacing());
    expected
        .extend_into(&attribute, band, scratch, &mut residual, &mut extension)
        .unwrap();
    let mut plan = Plan::new(backend, grid, options()).unwrap();
    let found = plan.reconstruct(&cloud).unwrap();
    let (made, kept) = found.extend_with_residual(&attribute, band).unwrap();
    assert_eq!(found.extend(&cloud, "velocity", band).unwrap(), made);
    let difference = relative(&made.vertices, &extension.vertices);
    assert!(difference < tolerance, "{}: {difference:e}", T::NAME);
    // φ is a rounding error off, and may end the band a cell later.
    let cells = made.cells.len().abs_diff(extension.cells.len());
    assert!(cells * 1000 < made.cells.len(), "{cells}");
    assert_eq!(made.shape, grid.shape());

    let wave = |i: usize| real::<T>((0.7 * i as f64).sin());
    let vertices: Vec<T> = (0..made.vertices.len()).map(wave).collect();
    let of_device = [ExtensionCotangent {
        attribute: &attribute,
        extension: &made,
        residual: &kept,
        vertices: Some(&vertices),
        values: None,
    }];
    let of_cpu = [ExtensionCotangent {
        extension: &extension,
        residual: &residual,
        ..of_device[0]
    }];
    let bar = |extensions| Cotangent {
        areas: Some(expected.areas()),
        extensions,
        ..Cotangent::default()
    };
    let back = found.pullback(&bar(&of_device)).unwrap();
    let wanted = expected.pullback(&bar(&of_cpu)).unwrap();
    assert_eq!(back.guarded, wanted.guarded);
    assert_eq!(back.attributes.len(), 1);
    let attribute_bar = relative(&back.attributes[0], &wanted.attributes[0]);
    let points_bar = relative(back.points.as_flattened(), wanted.points.as_flattened());
    println!(
        "attribute {}: {attribute_bar:.1e}, points {points_bar:.1e}",
        T::NAME
    );
    assert!(
        attribute_bar < 10.0 * tolerance,
        "attribute: {attribute_bar:e}"
    );
    assert!(points_bar < 10.0 * tolerance, "points: {points_bar:e}");
    let missing = found.extend(&cloud, "pressure", band).unwrap_err();
    assert!(
        missing.to_string().contains("it has: velocity"),
        "{missing}"
    );
    let short = Attribute {
        values: attribute.values[3..].to_vec(),
        ..attribute.clone()
    };
    let refused = found.extend_with_residual(&short, band).err();
    assert!(matches!(
        refused,
        Some(Error::Extension(extend::Error::Samples { .. }))
    ));
    let other = extend::Extension {
        shape: [1, 2, 3],
        ..made.clone()
    };
    let of_other = [ExtensionCotangent {
        extension: &other,
        ..of_device[0]
    }];
    let refused = found.pullback(&bar(&of_other)).err();
    assert!(matches!(
        refused,
        Some(Error::Extension(extend::Error::Mismatch { .. }))
    ));
}

fn previous_takes_the_sides_of_the_call_before(backend: Backend) {
    let cloud = bare::<f32>("torus", 1500);
    let options = options().orient(Method::Previous);
    // Room for it to turn.
    let grid = Grid::new([-1.6; 3], 0.1, [32; 3]).unwrap();
    let mut plan = Plan::new(backend, grid, options).unwrap();
    let first = plan.reconstruct(&cloud).unwrap();
    let second = plan.reconstruct(&cloud).unwrap();
    let method = |of: &isograd_gpu::host::Reconstruction<f32>| of.report().unwrap().orientation;
    assert_eq!([method(&first), method(&second)], ["auto", "previous"]);
    assert_eq!(first.sdf().unwrap(), second.sdf().unwrap());
    // A body that has turned by more than 60 degrees is looked at anew.
    let turned = |&[x, y, z]: &[f32; 3]| [x, -z, y];
    let turned = PointCloud::new(cloud.points().iter().map(turned).collect()).unwrap();
    let far = plan.reconstruct(&turned).unwrap();
    assert_eq!(far.report().unwrap().orientation, "auto");
    assert!(far.report().unwrap().surface.closed);
    // Another number of points is another cloud.
    let fewer = PointCloud::new(cloud.points()[..1400].to_vec()).unwrap();
    let third = plan.reconstruct(&fewer).unwrap();
    assert_eq!(third.report().unwrap().orientation, "auto");
    assert_eq!(third.normals().unwrap().len(), 1400);
}

fn a_call_with_other_points_finds_their_sides_anew(backend: Backend) {
    let cloud = bare::<f32>("torus", 1500);
    let reversed = cloud.points().iter().rev().copied().collect();
    let reversed = PointCloud::new(reversed).unwrap();
    let mut plan = Plan::new(backend, grid(&cloud), options()).unwrap();
    plan.reconstruct(&cloud).unwrap();
    let again = plan.reconstruct(&reversed).unwrap();
    assert!(again.report().unwrap().surface.closed);
}

fn sensors_tell_the_sides_as_on_the_cpu(backend: Backend) {
    let sensors = isograd::Sensors::Any(vec![[0.0, 0.0, 6.0], [0.0, 0.0, -6.0]]);
    let cloud = bare::<f32>("torus", 1500).with_sensors(sensors).unwrap();
    let options = options().orient(Method::Sensors);
    let grid = grid(&cloud);
    let mut plan = Plan::new(backend, grid, options.clone()).unwrap();
    let found = plan.reconstruct(&cloud).unwrap();
    assert_eq!(found.report().unwrap().orientation, "sensors");
    let mut plan = Reconstructor::new(grid, options).unwrap();
    let expected = plan.reconstruct(&cloud).unwrap();
    let phi = found.sdf().unwrap().values();
    assert!(relative(phi, expected.sdf().values()) < 2e-4);
}

fn given_normals_are_taken_and_have_cotangents(backend: Backend) {
    let cloud = bare::<f32>("torus", 2000);
    let grid = grid(&cloud);
    let options = options().orient(Method::Given);
    let mut plan = Plan::new(backend, grid, options.clone()).unwrap();
    let text = plan.reconstruct(&cloud).err().expect("refused").to_string();
    assert!(text.contains("no normals"), "{text}");
    // A little off, and of length 2.
    let samples = sampled::<f32>("torus", 2000);
    let given = samples.normals().unwrap().iter();
    let given = given.map(|&[x, y, z]| [2.0 * x + 0.1, 2.0 * y, 2.0 * z - 0.1]);
    let cloud = cloud.with_normals(given.collect()).unwrap();
    let found = plan.reconstruct(&cloud).unwrap();
    let mut plan = Reconstructor::new(grid, options).unwrap();
    let expected = plan.reconstruct(&cloud).unwrap();
    let sdf = expected.sdf().values();
    let difference = relative(found.sdf().unwrap().values(), sdf);
    assert!(difference < 2e-4, "{difference:e}");
    let near = |&phi: &f32| if phi.abs() < grid.spacing() { phi } else { 0.0 };
    let bar: Vec<f32> = sdf.iter().map(near).collect();
    let cotangent = only(|of| of.sdf = Some(&bar));
    let found = found.pullback(&cotangent).unwrap();
    let expected = expected.pullback(&cotangent).unwrap();
    for (found, expected) in [
        (&found.points, &expected.points),
        (&found.normals, &expected.normals),
    ] {
        let difference = relative(found.as_flattened(), expected.as_flattened());
        assert!(difference < 2e-3, "{difference:e}");
    }
}

fn a_result_is_found_again_from_its_normals(backend: Backend) {
    let given = sampled::<f32>("torus", 1500).normals().unwrap().to_vec();
    let bare = bare::<f32>("torus", 1500);
    let with_normals = bare.clone().with_normals(given).unwrap();
    for (cloud, orientation) in [
        (&bare, Method::Auto),
        (&with_normals, Method::Signs),
        (&with_normals, Method::Given),
    ] {
        let options = options().orient(orientation);
        let grid = grid(cloud);
        let mut plan = Plan::new(backend, grid, options.clone()).unwrap();
        let first = plan.reconstruct(cloud).unwrap();
        let (sdf, normals) = (first.sdf().unwrap().values(), first.normals().unwrap());
        // A plan that has never seen the cloud.
        let other = Plan::new(backend, grid, options).unwrap();
        let again = other.restore(cloud, normals).unwrap();
        assert_eq!(again.sdf().unwrap().values(), sdf, "{orientation:?}");
        assert_eq!(again.mesh().unwrap(), first.mesh().unwrap());
        let bar = only(|bar| bar.sdf = Some(sdf));
        let (a, b) = (again.pullback(&bar).unwrap(), first.pullback(&bar).unwrap());
        assert_eq!((&a.points, &a.normals), (&b.points, &b.normals));
        let refused = other.restore(cloud, &normals[1..]);
        assert!(matches!(refused, Err(Error::Restore(_))));
    }
}

fn what_devices_do_not_have_is_named(backend: Backend) {
    let cloud = bare::<f32>("torus", 500);
    let factor = SurfaceResolution::Factor(2.0);
    for (options, reason) in [
        (options().screening(-1.0), "0 or more"),
        (options().trim(Trim::Auto), "neither trim nor sheet"),
        (options().radius(Radius::Cut(0.1)), "cut:0.1"),
        (options().walls(Walls::Closed), "give 'free'"),
        (options().surface(factor), "on the grid of φ only"),
        (options().solve(Solve::Sparse), "no sparse solve"),
    ] {
        let refused = Plan::new(backend, grid(&cloud), options).err();
        let text = refused.expect("refused").to_string();
        assert!(text.contains(reason), "{text}");
    }
    let plan = Plan::new(Backend::Cpu, grid(&cloud), options());
    assert!(matches!(plan.err(), Some(Error::NoDevice(Backend::Cpu))));
}

#[test]
fn a_choice_that_is_left_to_the_program_never_fails() {
    let cloud = bare::<f32>("torus", 500);
    match choose(Backend::Auto, grid(&cloud), &options()) {
        Ok(Choice::Cpu(Some(note))) => {
            assert!(note.contains("Vulkan"), "{note}");
            #[cfg(not(feature = "cuda"))]
            assert!(
                note.contains("cuda is not built into this program"),
                "{note}"
            );
        }
        Ok(Choice::Cpu(None)) => panic!("no reason"),
        Ok(Choice::Device(plan)) => println!("there is a GPU: {}", plan.name()),
        Err(error) => panic!("{error}"),
    }
}

fn an_observer_that_breaks_stops_the_work(backend: Backend) {
    use std::ops::ControlFlow::{Break, Continue};
    let cloud = bare::<f32>("torus", 500);
    for stop in [Stage::Normals, Stage::Orient, Stage::Splat, Stage::Distance] {
        let mut plan = Plan::new(backend, grid(&cloud), options()).unwrap();
        let mut seen = Vec::new();
        let mut observer = |stage| {
            seen.push(stage);
            if stage == stop {
                Break(())
            } else {
                Continue(())
            }
        };
        let stopped = plan.reconstruct_observed(&cloud, &mut observer).err();
        assert!(matches!(stopped, Some(Error::Interrupted(stage)) if stage == stop));
        let place = Stage::ALL.iter().position(|&stage| stage == stop).unwrap();
        assert_eq!(seen, Stage::ALL[..=place]);
    }
}
