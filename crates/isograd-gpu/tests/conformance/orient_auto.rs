//! The automatic orientation beside that of the CPU.

use cubecl::prelude::Runtime;
use isograd::Real;
use isograd::orient::{self as cpu, Orientation, Scratch};
use isograd_element::vector;
use isograd_element::vector::{add, dot, scale};
use isograd_gpu::orient::{self, Axes, Method};
use isograd_gpu::{Device, Scalar, neighbors, normals};
use isograd_shapes::{Layout, Sampling};

use crate::clouds::{Cloud, clouds, real};
use crate::devices::{Numbers, in_each_number, on_each_device};

/// What was found, of one cloud.
struct Found<T> {
    normals: Vec<[T; 3]>,
    confidence: Vec<T>,
    decided: orient::Decided,
}

fn on_device<R: Runtime, T: Scalar>(device: &Device<R>, cloud: &Cloud<T>) -> Found<T> {
    let radii = device.upload(&cloud.near.radius).unwrap();
    let near = neighbors::forward(device, &cloud.upload(device), &radii).unwrap();
    let wider = device.upload(&cloud.axes.radius).unwrap();
    let wider = neighbors::with_radii(device, &near, &wider).unwrap();
    let (axes, residual) = normals::forward(device, &wider).unwrap();
    let axes = Axes {
        normals: &axes,
        residual: Some(&residual),
        spacing: cloud.near.spacing(),
    };
    let found = orient::forward(device, &near, &axes, &Method::Auto).unwrap();
    Found {
        normals: device
            .download(&found.normals)
            .unwrap()
            .as_chunks()
            .0
            .to_vec(),
        confidence: device.download(&found.confidence).unwrap(),
        decided: found.decided,
    }
}

fn on_cpu<T: Scalar>(cloud: &Cloud<T>) -> Orientation<T> {
    let mut found = Orientation::default();
    let (points, axes, near) = (&cloud.points, &cloud.axes, &cloud.near);
    let method = &cpu::Method::Auto;
    let scratch = &mut Scratch::default();
    cpu::forward(points, axes, near, None, method, scratch, &mut found).unwrap();
    found
}

/// Random directions, scaled.
fn sphere(n: usize, radius: f64, numbers: &mut Numbers) -> Vec<[f64; 3]> {
    let mut direction = || loop {
        let v = [(); 3].map(|()| numbers.signed());
        if let Some(unit) = vector::normalized(v).filter(|_| vector::norm(v) < 1.0) {
            return scale(unit, radius);
        }
    };
    (0..n).map(|_| direction()).collect()
}

/// Bodies that are hard each in its own way.
fn bodies<T: Scalar>() -> Vec<Cloud<T>> {
    let mut numbers = Numbers(3);
    let of =
        |name, points: Vec<[f64; 3]>| Cloud::of(name, points.iter().map(|p| p.map(real)).collect());
    let sampling = Sampling {
        layout: Layout::Random,
        ..Sampling::default()
    };
    let sample = |name: &str, n: usize| {
        let shape = isograd_shapes::by_name(name).unwrap();
        let samples = shape.sample::<f64>(n, &sampling, 5).unwrap();
        samples.cloud.points().to_vec()
    };
    let mut nested = sphere(4000, 1.0, &mut numbers);
    nested.extend(sphere(1500, 0.5, &mut numbers));
    let mut bowl = sphere(4000, 1.0, &mut numbers);
    bowl.retain(|p| p[2] < 0.3);
    // A plate of a spacing and a half.
    let plate = |_| {
        let [x, y, side] = [(); 3].map(|()| numbers.signed());
        [x, y, 0.035f64.copysign(side)]
    };
    let plate: Vec<[f64; 3]> = (0..4000).map(plate).collect();
    let mut noisy = sample("torus", 3000);
    for x in noisy.as_flattened_mut() {
        *x += 0.03 * numbers.signed();
    }
    let mut far = sample("fish", 2000);
    far.extend(sample("torus", 1000).iter().map(|&p| add(p, [1e3; 3])));
    vec![
        of("torus knot", sample("knot", 5000)),
        of("nacelle", sample("nacelle", 4000)),
        of("airliner", sample("airliner", 6000)),
        of("sphere within a sphere", nested),
        of("bowl", bowl),
        of("thin plate", plate),
        of("torus with noise", noisy),
        of("fish and a torus far away", far),
    ]
}

#[test]
fn automatic_signs_are_those_of_the_cpu() {
    in_each_number!(check_signs);
}

/// Rounding may turn a choice between two planes or two regions, and a domain with it where little speaks for it.
fn check_signs<R: Runtime, T: Scalar>(device: &Device<R>) {
    let (mut points, mut others) = (0, 0);
    for cloud in bodies::<T>() {
        let (found, wanted) = (on_device(device, &cloud), on_cpu(&cloud));
        let n = cloud.points.len();
        let cosines = found.normals.iter().zip(&wanted.normals);
        let cosines = cosines.map(|(&a, &b)| Real::f64(dot(a, b)));
        let turned = cosines.filter(|c| *c < 0.0).count();
        let sure = found.confidence.iter().zip(&wanted.confidence);
        let off = |(a, b): &(&T, &T)| (Real::f64(**a) - Real::f64(**b)).abs() > 1e-3;
        let unsure = sure.filter(off).count();
        println!(
            "{}, {}: {turned} signs of {n} differ, {unsure} confidences by over 0.001; {:?}, {:?}",
            cloud.name,
            T::NAME,
            found.decided,
            wanted.decided
        );
        assert!(100 * turned <= n, "{}: {turned} of {n}", cloud.name);
        assert!(20 * unsure <= n, "{}: {unsure} of {n}", cloud.name);
        points += n;
        others += turned;
        let same = |a: usize, b: usize| a.abs_diff(b) <= n.div_ceil(100);
        assert!(same(found.decided.evidence, wanted.decided.evidence));
        assert!(same(found.decided.rule, wanted.decided.rule));
    }
    assert!(1000 * others <= points, "{others} of {points}");
}

#[test]
fn hard_clouds_are_oriented_twice_the_same() {
    on_each_device!(check_twice);
}

fn check_twice<R: Runtime>(device: &Device<R>) {
    let mut hard = clouds::<f32>();
    let line = (0..5).map(|i| [i as f32, 0.1 * (i % 2) as f32, 0.0]);
    hard.push(Cloud::of("five points", line.collect()));
    for cloud in hard {
        let [a, b] = [on_device(device, &cloud), on_device(device, &cloud)];
        assert_eq!(a.normals, b.normals, "{}", cloud.name);
        assert_eq!(a.confidence, b.confidence, "{}", cloud.name);
        let all = a.decided.evidence + a.decided.neighbors + a.decided.rule;
        assert_eq!(all, cloud.points.len(), "{}", cloud.name);
        assert!(a.confidence.iter().all(|c| (0.0..=1.0).contains(c)));
    }
}
