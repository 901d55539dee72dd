//! Signs taken over from the step before, compared with the CPU.

use cubecl::prelude::Runtime;
use isograd::neighbors::Radius;
use isograd::orient::{self as cpu, MethodUsed, Orientation, Scratch};
use isograd::{PointCloud, Real};
use isograd_element::vector;
use isograd_gpu::orient::previous::{self, Before};
use isograd_gpu::pipeline::{RadiiAndSigns, Reconstructor};
use isograd_gpu::{Device, Scalar, neighbors};

use crate::clouds::{Cloud, clouds, real, relative, sampled};
use crate::devices::{tests, tolerance};

tests! {
    in_each_number: sides_of_the_step_before_are_those_of_the_cpu;
    on_each_device: a_body_that_turns_keeps_its_sides_on_the_device;
}

/// The body as it is, and with one in fifty of its points swapped with points elsewhere.
fn moved<T: Scalar>(cloud: &Cloud<T>) -> Cloud<T> {
    let mut points = cloud.points.clone();
    let n = points.len();
    for i in (0..n).step_by(100) {
        points.swap(i, (i + n / 2 + 1) % n);
    }
    Cloud::of(cloud.name, points)
}

fn sides_of_the_step_before_are_those_of_the_cpu<R: Runtime, T: Scalar>(device: &Device<R>) {
    let mut all_turned = 0;
    for cloud in &clouds::<T>()[..3] {
        let name = cloud.name;
        let mut scratch = Scratch::default();
        let mut step = |cloud: &Cloud<T>| {
            let mut found = Orientation::default();
            let (points, axes, near) = (&cloud.points, &cloud.axes, &cloud.near);
            let method = &cpu::Method::Previous;
            cpu::forward(points, axes, near, None, method, &mut scratch, &mut found).unwrap();
            found
        };
        let first = step(cloud);
        let now = moved(cloud);
        let wanted = step(&now);
        let MethodUsed::Previous { turned } = wanted.method else {
            panic!("{name}: {:?}", wanted.method);
        };
        all_turned += turned;
        // The CPU keeps single precision.
        let single = |x: &T| real::<T>(f64::from(Real::f64(*x) as f32));
        let outward: Vec<T> = first.normals.as_flattened().iter().map(single).collect();
        let before: Vec<T> = first.confidence.iter().map(single).collect();
        let radii = device.upload(&now.near.radius).unwrap();
        let near = neighbors::forward(device, &now.upload(device), &radii).unwrap();
        let axes = device.upload(now.axes.normals.as_flattened()).unwrap();
        let run = || {
            let before = Before {
                outward: &device.upload(&outward).unwrap(),
                confidence: &device.upload(&before).unwrap(),
            };
            let found = previous::forward(device, &near, &radii, &axes, before).unwrap();
            let normals = device.download(&found.normals).unwrap();
            let confidence = device.download(&found.confidence).unwrap();
            let kept = device.download(&found.kept).unwrap();
            let turned = device.download(&found.turned).unwrap();
            (normals, confidence, kept, turned)
        };
        let (normals, confidence, kept, count) = run();
        assert_eq!(count, [turned as u32], "{name}");
        let expected = wanted.normals.as_flattened();
        let others = normals.iter().zip(expected).filter(|(a, b)| a != b);
        assert_eq!(others.count(), 0, "{name}");
        let difference = relative(&confidence, &wanted.confidence);
        println!(
            "{name}, {}: {turned} turned, confidence within {difference:.1e}",
            T::NAME
        );
        assert!(
            difference < 0.1 * tolerance::<f32>(),
            "{name}: {difference:e}"
        );
        let is_far = |&i: &usize| kept[i] != before[i];
        let far: Vec<usize> = (0..kept.len()).filter(is_far).collect();
        assert!(far.len() <= turned && far.iter().all(|&i| kept[i] == confidence[i]));
        assert_eq!(run(), (normals, confidence, kept, count));
    }
    assert!(all_turned > 20, "{all_turned}");
}

fn a_body_that_turns_keeps_its_sides_on_the_device<R: Runtime>(device: &Device<R>) {
    let cloud = sampled::<f32>("torus", 2000);
    let turned = |angle: f32, vectors: &[[f32; 3]]| -> Vec<[f32; 3]> {
        let (sine, cosine) = angle.sin_cos();
        let turn = |&[x, y, z]: &[f32; 3]| [x, cosine * y - sine * z, sine * y + cosine * z];
        vectors.iter().map(turn).collect()
    };
    let truth = cloud.normals().unwrap();
    let start = PointCloud::new(cloud.points().to_vec()).unwrap();
    let grid = isograd::Grid::new([-1.6; 3], 0.1, [32; 3]).unwrap();
    let plan = Reconstructor::new(device.clone(), grid, Default::default()).unwrap();
    let mut held = RadiiAndSigns::find(device, &start, Radius::Auto, &cpu::Method::Auto).unwrap();
    for step in 0..8 {
        let angle = 0.5 * step as f32;
        let points = turned(angle, cloud.points());
        let points = device.upload(points.as_flattened()).unwrap();
        let result = plan.reconstruct(&points, &held).unwrap();
        assert_eq!(device.download(&result.turned).unwrap(), [0], "step {step}");
        let normals = device.download(&result.normals).unwrap();
        let inward = normals.as_chunks::<3>().0.iter().zip(turned(angle, truth));
        let inward = inward.filter(|&(&n, t)| vector::dot(n, t) < 0.0).count();
        assert_eq!(inward, 0, "step {step}");
        held = held.after(&result).unwrap();
    }
    // All sides at once by more than 60 degrees: these are found to have turned, and not to be trusted.
    let points = device
        .upload(turned(5.0, cloud.points()).as_flattened())
        .unwrap();
    let result = plan.reconstruct(&points, &held).unwrap();
    let count = device.download(&result.turned).unwrap()[0];
    assert!(count > 400, "{count}");
}
