//! Members of clouds: closed bodies, in each other and beside each other, open ones, and heaps.

use isograd::Real;
use isograd_element::vector;
use isograd_gpu::Scalar;

use crate::clouds::{clouds, real};
use crate::devices::Numbers;

/// A cloud, some rows of which are members.
pub struct Body<T> {
    pub name: &'static str,
    pub members: Vec<u32>,
    pub points: Vec<[T; 3]>,
    pub axes: Vec<[f32; 3]>,
    /// In spacings.
    pub reach: Vec<f32>,
    pub spacing: f64,
    /// The least number of regions that are matter.
    pub matter: usize,
}

impl<T: Scalar> Body<T> {
    /// All points are members.
    pub fn new(
        name: &'static str,
        points: Vec<[T; 3]>,
        axis: impl Fn(usize) -> [f32; 3],
        reach: impl Fn(usize) -> f32,
        spacing: f64,
    ) -> Self {
        let n = points.len();
        Self {
            name,
            members: (0..n as u32).collect(),
            points,
            axes: (0..n).map(axis).collect(),
            reach: (0..n).map(reach).collect(),
            spacing,
            matter: 0,
        }
    }
}

/// Points on a sphere that are about evenly spread, on both sides of which its axes are.
fn sphere(n: usize, center: [f64; 3], radius: f64, numbers: &mut Numbers) -> Vec<[[f64; 3]; 2]> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let sample = |i: usize| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let (sine, cosine) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let normal = [r * cosine, r * sine, z];
        let side = if numbers.unit() < 0.5 { -1.0 } else { 1.0 };
        let point = vector::add(center, vector::scale(normal, radius));
        [point, vector::scale(normal, side)]
    };
    (0..n).map(sample).collect()
}

/// Samples whose neighbors are a spacing apart.
fn even<T: Scalar>(name: &'static str, samples: &[[[f64; 3]; 2]], spacing: f64) -> Body<T> {
    let mut numbers = Numbers(5);
    let reach: Vec<f32> = samples
        .iter()
        .map(|_| 1.2 + 0.2 * numbers.unit() as f32)
        .collect();
    Body::new(
        name,
        samples.iter().map(|s| s[0].map(real)).collect(),
        |i| samples[i][1].map(|x| x as f32),
        |i| reach[i],
        spacing,
    )
}

/// Spheres in each other: a body, its cavity, and a body in that, far from the origin.
fn nested<T: Scalar>() -> Body<T> {
    let mut numbers = Numbers(3);
    let spacing = 0.06;
    let mut samples = Vec::new();
    for radius in [1.0, 0.7, 0.4] {
        let n = 4.0 * std::f64::consts::PI * radius * radius / (spacing * spacing);
        let center = [1000.0, -700.0, 300.0];
        samples.extend(sphere(n as usize, center, radius, &mut numbers));
    }
    let mut body = even("nested spheres", &samples, spacing);
    body.matter = 2;
    // The cloud has others too, and another order.
    body.points.push([real(0.0); 3]);
    body.axes.push([0.0; 3]);
    body.reach.push(1.0);
    for i in (1..body.members.len()).rev() {
        let j = numbers.bits() as usize % (i + 1);
        body.members.swap(i, j);
    }
    body
}

/// Small spheres beside each other: more regions than a digit of a sort has values.
fn heap<T: Scalar>() -> Body<T> {
    let mut numbers = Numbers(9);
    let spacing = (4.0 * std::f64::consts::PI / 200.0).sqrt();
    let mut samples = Vec::new();
    for i in 0..64 {
        let center = [i / 16, i / 4 % 4, i % 4].map(|k| 2.8 * f64::from(k));
        samples.extend(sphere(200, center, 1.0, &mut numbers));
    }
    let mut body = even("64 spheres", &samples, spacing);
    body.matter = 64;
    body
}

/// A sphere with round holes, and the lower half of one.
fn open<T: Scalar>() -> [Body<T>; 2] {
    let mut numbers = Numbers(13);
    let samples = sphere(4000, [0.5, 0.25, -0.125], 1.0, &mut numbers);
    let spacing = (4.0 * std::f64::consts::PI / 4000.0).sqrt();
    let centers = sphere(12, [0.5, 0.25, -0.125], 1.0, &mut numbers);
    let far = |p: &[[f64; 3]; 2], c: &[[f64; 3]; 2]| vector::norm(vector::sub(p[0], c[0])) > 0.25;
    let kept = |p: &&[[f64; 3]; 2]| centers.iter().all(|c| far(p, c));
    let holes: Vec<_> = samples.iter().filter(kept).copied().collect();
    let half: Vec<_> = samples.iter().filter(|p| p[0][2] < 0.0).copied().collect();
    [
        even("sphere with holes", &holes, spacing),
        even("half a sphere", &half, spacing),
    ]
}

/// Both sides of a plate, some cells apart, which is flat in each direction in turn. Not quite: no ray is to end where a
/// cell does, and rounding to decide.
fn plates<T: Scalar>() -> [Body<T>; 3] {
    let plate = |flat: usize| {
        let (n, spacing) = (90, 0.01);
        let mut numbers = Numbers(17);
        let samples: Vec<_> = (0..2 * n * n)
            .map(|i| {
                let (u, v, side) = (i / 2 / n, i / 2 % n, i % 2);
                let mut point = [u as f64, v as f64, 3.1 * side as f64]
                    .map(|x| spacing * (x + 0.1 * numbers.signed()));
                point.rotate_right((flat + 1) % 3);
                let mut axis = [0.0; 3];
                axis[flat] = if u % 3 == 0 { 1.0 } else { -1.0 };
                [point, axis]
            })
            .collect();
        even("plate", &samples, spacing)
    };
    [plate(0), plate(1), plate(2)]
}

/// The distance to the sixth nearest sample, in spacings.
fn reach<T: Scalar>(points: &[[T; 3]], spacing: f64) -> Vec<f32> {
    let points: Vec<[f64; 3]> = points.iter().map(|&p| vector::to_f64(p)).collect();
    let reach = |&p: &[f64; 3]| {
        let square = |&q: &[f64; 3]| vector::norm_squared(vector::sub(p, q));
        let mut squares: Vec<f64> = points.iter().map(square).collect();
        let sixth = *squares.select_nth_unstable_by(6, f64::total_cmp).1;
        (sixth.sqrt() / spacing).min(1e6) as f32
    };
    points.iter().map(reach).collect()
}

/// All of them.
pub fn bodies<T: Scalar>() -> Vec<Body<T>> {
    let mut bodies = vec![nested(), heap()];
    bodies.extend(open());
    bodies.extend(plates());
    for cloud in clouds::<T>() {
        let spacing = Real::f64(cloud.near.spacing());
        let reach = reach(&cloud.points, spacing);
        let axes = cloud.axes.normals;
        let axis = |i: usize| vector::to_f64(axes[i]).map(|x| x as f32);
        bodies.push(Body::new(
            cloud.name,
            cloud.points,
            axis,
            |i| reach[i],
            spacing,
        ));
    }
    bodies
}
