//! Fits whose reconstructions a device makes.

use std::ops::ControlFlow;

use isograd::{Backend, Grid, Resolution, SurfaceResolution};
use isograd_fit::{Checkpoint, Error, Fit, Options, Outcome, ShapeParameters, Target, Variables};
use isograd_shapes::{Sampling, Shape, by_name};

const EPOCHS: usize = 6;

fn sphere(radius: f64) -> Shape {
    let mut sphere = by_name("sphere").unwrap();
    sphere.set("radius", radius).unwrap();
    sphere
}

fn target() -> Target {
    let samples = sphere(0.5).sample::<f64>(1500, &Sampling::default(), 7);
    let cloud = samples.unwrap().cloud;
    let grid = Grid::fit(&cloud, Resolution::Cells(20), 0.25).unwrap();
    Target::from_cloud(&cloud, grid, &isograd::Options::default()).unwrap()
}

fn variables() -> Variables {
    Variables::Shape(ShapeParameters {
        samples: 1200,
        ..ShapeParameters::new(sphere(0.4))
    })
}

fn options(backend: Backend) -> Options {
    Options {
        epochs: EPOCHS,
        backend,
        // The only cells that a device finds the surface on; a fit on the CPU would move the faces of thin parts as well.
        reconstruction: isograd::Options::default().surface(SurfaceResolution::Grid),
        ..Options::default()
    }
}

fn radius(fit: &Fit) -> f64 {
    fit.shape().unwrap().values()[0]
}

/// A fit at its start, unless there is no device that has `f64`.
fn begin(target: &Target, backend: Backend) -> Option<Fit> {
    match Fit::new(target, variables(), options(backend)) {
        Ok(fit) => Some(fit),
        Err(Error::Backend(error)) => {
            println!("SKIPPED a fit on {backend}: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_device_goes_the_way_of_the_cpu_and_can_be_resumed() {
    let target = target();
    let Some(mut fit) = begin(&target, Backend::Vulkan) else {
        return;
    };
    assert!(fit.backend().starts_with("vulkan: "), "{}", fit.backend());
    let mut kept = None;
    let outcome = fit.run(&mut |fit| {
        if fit.epoch() == 2 {
            kept = Some(fit.checkpoint());
        }
        ControlFlow::Continue(())
    });
    let outcome = outcome.unwrap();
    assert_ne!(outcome, Outcome::Stopped);
    assert!((radius(&fit) / 0.5 - 1.0).abs() < 0.01, "{}", radius(&fit));

    let mut on_cpu = begin(&target, Backend::Cpu).unwrap();
    on_cpu.run(&mut |_| ControlFlow::Continue(())).unwrap();
    for (a, b) in fit.history().iter().zip(on_cpu.history()) {
        let off = (a.loss - b.loss).abs() / on_cpu.history()[0].loss;
        assert!(off < 1e-6, "epoch {}: {} and {}", a.epoch, a.loss, b.loss);
    }
    assert!((radius(&fit) - radius(&on_cpu)).abs() < 1e-5);
    let sdf = fit.reconstruction().unwrap().sdf().unwrap().clone();
    let of_cpu = on_cpu.reconstruction().unwrap();
    let pairs = sdf.values().iter().zip(of_cpu.sdf().unwrap().values());
    assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-4));
    let mesh = fit.reconstruction().unwrap().mesh().unwrap().clone();
    assert_eq!(mesh.faces(), of_cpu.mesh().unwrap().faces());

    // The bits of an uninterrupted run; and the CPU refuses a checkpoint of the device.
    let kept: Checkpoint = kept.expect("two epochs");
    let resume = |backend| Fit::resume(&target, variables(), options(backend), kept.clone());
    let mut resumed = resume(Backend::Vulkan).unwrap();
    resumed.run(&mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(resumed.history(), fit.history());
    assert!(matches!(resume(Backend::Cpu), Err(Error::Resume { .. })));
}

#[test]
fn auto_is_a_gpu_or_the_cpu_with_a_reason() {
    let fit = begin(&target(), Backend::Auto).unwrap();
    match fit.backend() {
        "cpu" => assert!(
            fit.backend_note()
                .unwrap()
                .contains("computed on the CPU: ")
        ),
        device => println!("there is a GPU: {device}"),
    }
}
