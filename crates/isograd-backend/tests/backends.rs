//! A plan on the CPU and on a device, beside the CPU's own.

use std::ops::ControlFlow;

use isograd::poisson::Walls;
use isograd::{
    Attribute, Backend, Cotangent, ExtensionCotangent, Grid, Options, PointCloud, Reconstructor,
    Resolution, Saved, Stage, SurfaceResolution,
};
use isograd_backend::{Error, Plan, View};

/// Samples of a sphere of radius 1.
fn cloud() -> PointCloud<f32> {
    let points = (0..1200).map(|i| {
        let (z, turn) = ((2 * i + 1) as f32 / 1200.0 - 1.0, i as f32 * 2.399_963);
        let r = (1.0 - z * z).sqrt();
        [r * turn.cos(), r * turn.sin(), z]
    });
    PointCloud::new(points.collect()).unwrap()
}

fn grid(cloud: &PointCloud<f32>) -> Grid<f32> {
    Grid::fit(cloud, Resolution::Cells(24), 0.1).unwrap()
}

/// A plan, unless there is no such device.
fn plan(backend: Backend) -> Option<Plan<f32>> {
    match Plan::new(
        backend,
        grid(&cloud()),
        Options::default()
            .surface(SurfaceResolution::Grid)
            .walls(Walls::Free),
    ) {
        Ok(plan) => Some(plan),
        Err(error) if error.is_of_device() => {
            println!("SKIPPED {backend}: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// The largest difference, of the largest number.
fn off(found: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    let pairs = found.iter().zip(expected);
    pairs.fold(0.0f32, |m, (a, b)| m.max((a - b).abs())) / largest
}

/// Height, and its square.
fn attribute(cloud: &PointCloud<f32>) -> Attribute<f32> {
    Attribute {
        name: "heights".into(),
        components: 2,
        values: (cloud.points().iter())
            .flat_map(|p| [p[2], p[2] * p[2]])
            .collect(),
    }
}

/// All that a view gives is what the CPU gives, as far as the tolerance goes; with 0, to the bit.
fn check(view: View<'_, f32>, cloud: &PointCloud<f32>, tolerance: f32) {
    let mut plan = Reconstructor::new(
        grid(cloud),
        Options::default()
            .surface(SurfaceResolution::Grid)
            .walls(Walls::Free),
    )
    .unwrap();
    let expected = plan.reconstruct(cloud).unwrap();
    let close = |what: &str, found: &[f32], wanted: &[f32]| {
        let off = off(found, wanted);
        assert!(off <= tolerance, "{what}: {off:e}");
    };
    assert_eq!(view.grid(), expected.sdf().grid());
    let sdf = expected.sdf().values();
    close("φ", view.sdf().unwrap().values(), sdf);
    let chi = view.indicator().unwrap().values();
    close("χ", chi, expected.indicator().values());
    close("c", &[view.iso_value().unwrap()], &[expected.iso_value()]);
    let (mesh, wanted) = (view.mesh().unwrap(), expected.mesh());
    assert_eq!(mesh.faces(), wanted.faces());
    close(
        "vertices",
        mesh.vertices().as_flattened(),
        wanted.vertices().as_flattened(),
    );
    let normals = view.normals().unwrap().as_flattened();
    close("normals", normals, expected.normals().as_flattened());
    close("areas", view.areas().unwrap(), expected.areas());
    close(
        "confidence",
        view.confidence().unwrap(),
        expected.confidence(),
    );
    assert_eq!(view.closest().unwrap().len(), sdf.len());
    assert_eq!(view.neighbor_counts().unwrap().len(), cloud.len());
    let report = view.report().unwrap();
    assert_eq!(report.warnings, expected.report().warnings);

    let attribute = attribute(cloud);
    let band = 2.0 * f64::from(expected.sdf().grid().spacing());
    let (extension, residual) = view.extend(&attribute, band).unwrap();
    let (of_cpu, residual_of_cpu) = expected.extend_with_residual(&attribute, band).unwrap();
    close("extension", &extension.vertices, &of_cpu.vertices);
    let bars = |extension, residual| ExtensionCotangent {
        attribute: &attribute,
        extension,
        residual,
        vertices: Some(&of_cpu.vertices),
        values: None,
    };
    let pulled = |extensions| Cotangent {
        sdf: Some(sdf),
        extensions,
        ..Cotangent::default()
    };
    let (of_view, of_plan) = (
        [bars(&extension, &residual)],
        [bars(&of_cpu, &residual_of_cpu)],
    );
    let found = view.pullback(&pulled(&of_view));
    let wanted = expected.pullback(&pulled(&of_plan));
    let (found, wanted) = (found.unwrap(), wanted.unwrap());
    let of_values = off(&found.attributes[0], &wanted.attributes[0]);
    let of_points = off(found.points.as_flattened(), wanted.points.as_flattened());
    // The whole, and back: ten times what a stage may be off.
    assert!(
        of_values.max(of_points) <= 10.0 * tolerance,
        "{of_values:e} {of_points:e}"
    );
}

#[test]
fn the_cpu_gives_what_its_own_plan_gives() {
    let mut plan = plan(Backend::Cpu).expect("always there");
    assert_eq!((plan.name(), plan.note()), ("cpu", None));
    let cloud = cloud();
    check(plan.reconstruct(&cloud).unwrap(), &cloud, 0.0);
}

#[test]
fn a_device_gives_what_the_cpu_gives() {
    let Some(mut plan) = plan(Backend::Vulkan) else {
        return;
    };
    assert!(plan.name().starts_with("vulkan: "), "{}", plan.name());
    let cloud = cloud();
    check(plan.reconstruct(&cloud).unwrap(), &cloud, 2e-4);
}

#[test]
fn results_to_keep_and_results_found_again_are_the_same() {
    for backend in [Backend::Cpu, Backend::Vulkan] {
        let Some(mut plan) = plan(backend) else {
            continue;
        };
        let (cloud, mut stages) = (cloud(), Vec::new());
        let mut observer = |stage: Stage| {
            stages.push(stage);
            ControlFlow::Continue(())
        };
        let made = plan.make(&cloud, &mut observer).unwrap();
        assert!(stages.starts_with(&[Stage::Normals, Stage::Orient, Stage::Splat]));
        let kept = made.view();
        assert_eq!(kept.backend(), plan.name());
        let sdf = plan.reconstruct(&cloud).unwrap().sdf().unwrap().clone();
        assert_eq!(kept.sdf().unwrap(), &sdf);
        let saved = Saved {
            sdf: sdf.values(),
            closest: kept.closest().unwrap(),
            normals: kept.normals().unwrap(),
        };
        let mut other = self::plan(backend).expect("there is one");
        let again = other.restore(&cloud, &saved).unwrap();
        assert_eq!(again.sdf().unwrap(), &sdf);
        assert_eq!(again.mesh().unwrap(), kept.mesh().unwrap());
        // The last result of the plan, and one that another came after.
        let last = plan.restore(&cloud, &saved).unwrap();
        assert_eq!(last.sdf().unwrap(), &sdf);
        let moved = cloud.points().iter().map(|&[x, y, z]| [x, y, 0.9 * z]);
        let other = PointCloud::new(moved.collect()).unwrap();
        assert_ne!(plan.reconstruct(&other).unwrap().sdf().unwrap(), &sdf);
        let again = plan.restore(&cloud, &saved).unwrap();
        assert_eq!(again.sdf().unwrap(), &sdf);
        let short = Saved {
            closest: &saved.closest[1..],
            ..saved
        };
        assert!(matches!(
            plan.restore(&cloud, &short),
            Err(Error::Restore(_))
        ));
        let mut stop = |_| ControlFlow::Break(());
        let stopped = plan.make(&cloud, &mut stop).err().expect("stopped");
        assert!(stopped.to_string().starts_with("stopped before"));
    }
}

#[test]
fn auto_is_a_gpu_or_says_once_why_not() {
    let mut plan = plan(Backend::Auto).expect("always there");
    match plan.name() {
        "cpu" => {
            let note = plan.take_note().expect("why");
            assert!(note.starts_with("computed on the CPU: "), "{note}");
            assert_eq!(plan.note(), None);
        }
        device => println!("there is a GPU: {device}"),
    }
}

#[test]
fn errors_of_devices_are_told_from_those_of_clouds() {
    let grid = grid(&cloud());
    let missing = Plan::new(
        Backend::Cuda(77),
        grid,
        Options::default()
            .surface(SurfaceResolution::Grid)
            .walls(Walls::Free),
    );
    let missing = missing.err().expect("there are 78 CUDA devices");
    assert!(missing.is_of_device(), "{missing}");
    let far = PointCloud::new(
        cloud()
            .points()
            .iter()
            .map(|p| p.map(|x| x + 9.0))
            .collect(),
    );
    for backend in [Backend::Cpu, Backend::Vulkan] {
        let Some(mut plan) = plan(backend) else {
            continue;
        };
        let outside = plan.reconstruct(far.as_ref().unwrap()).err();
        let outside = outside.expect("nothing is on the grid");
        assert!(!outside.is_of_device(), "{outside}");
        assert!(outside.to_string().contains("larger bounds"), "{outside}");
    }
}
