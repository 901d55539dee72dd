//! Random clouds: samples of shapes, degenerate sets of points, and both with outliers, duplicates and extreme scales.

use isograd_shapes::{Layout, Sampling, Shape};

use crate::random::Random;

/// Points, or vectors at them.
pub type Rows = Vec<[f64; 3]>;

/// Exponents of scales that numbers of a type can hold the squares of.
#[derive(Clone, Copy, Debug)]
pub struct Scales {
    /// Moderate powers of ten.
    pub moderate: f64,
    /// Powers of ten near the ends of the range.
    pub extreme: f64,
}

/// Draws a cloud and describes it.
pub fn cloud(shapes: &[Shape], scales: Scales, random: &mut Random) -> (Rows, String) {
    let n = match random.below(8) {
        0 => random.below(20),
        1..6 => 20 + random.below(400),
        _ => 20 + random.below(2000),
    };
    let (name, mut points) = base(n, shapes, random);
    let mut history = vec![format!("{n} points: {name}")];
    while random.one_in(2) && !points.is_empty() {
        history.push(change(&mut points, scales, random));
    }
    (points, history.join(", "))
}

fn base(n: usize, shapes: &[Shape], random: &mut Random) -> (&'static str, Rows) {
    let kind = random.below(10);
    let mut rows = |point: fn(&mut Random) -> [f64; 3]| -> Rows {
        (0..n).map(|_| point(&mut *random)).collect()
    };
    match kind {
        0 => ("in a box", rows(|r| [(); 3].map(|()| r.between(-1.0, 1.0)))),
        1 => ("on a line", rows(|r| [r.between(-1.0, 1.0); 3])),
        2 => (
            "on a plane",
            rows(|r| [r.between(0.0, 1.0), r.between(0.0, 1.0), 0.5]),
        ),
        3 => (
            "on a lattice",
            rows(|r| [(); 3].map(|()| r.below(6) as f64)),
        ),
        4 => ("on a sphere", rows(sphere)),
        5 => ("one place", rows(|_| [1.0, 2.0, 3.0])),
        _ => sampled(n, shapes, random),
    }
}

fn sphere(random: &mut Random) -> [f64; 3] {
    let (z, turn) = (
        random.between(-1.0, 1.0),
        random.between(0.0, std::f64::consts::TAU),
    );
    let r = (1.0 - z * z).sqrt();
    [r * turn.cos(), r * turn.sin(), z]
}

fn sampled(n: usize, shapes: &[Shape], random: &mut Random) -> (&'static str, Rows) {
    let shape = &shapes[random.below(shapes.len())];
    let layout = match n < 300 {
        true => Layout::Even,
        false => Layout::Random,
    };
    let sampling = Sampling {
        layout,
        ..Sampling::default()
    };
    match shape.sample::<f64>(n, &sampling, random.next()) {
        Ok(samples) => (shape.name(), samples.cloud.points().to_vec()),
        Err(_) => ("no points", Rows::new()),
    }
}

/// Changes a cloud that has points, and says how.
fn change(points: &mut Rows, scales: Scales, random: &mut Random) -> String {
    let exponent = match random.below(4) {
        0 => random.between(-scales.extreme, scales.extreme),
        _ => random.between(-scales.moderate, scales.moderate),
    };
    let (size, axis) = (10f64.powf(exponent), random.below(3));
    let n = points.len();
    match random.below(8) {
        0 => {
            points.iter_mut().flatten().for_each(|x| *x *= size);
            format!("times {size:e}")
        }
        1 => {
            points.iter_mut().for_each(|p| p[axis] += size);
            format!("moved by {size:e} along {axis}")
        }
        2 => {
            points.iter_mut().for_each(|p| p[axis] *= size.min(1.0));
            format!("axis {axis} times {:e}", size.min(1.0))
        }
        3 => {
            let count = 1 + random.below(3);
            for _ in 0..count {
                points.push(sphere(random).map(|x| x * size));
            }
            format!("{count} outliers at {size:e}")
        }
        4 => {
            let copies = points.clone();
            points.extend(copies.iter().take(1 + random.below(n)));
            format!("{} duplicates", points.len() - n)
        }
        5 => {
            let mut body = points.clone();
            body.iter_mut().for_each(|p| p[axis] += size);
            points.extend(body);
            format!("a second body {size:e} away along {axis}")
        }
        6 => {
            let cell = random.power(-4.0, -0.5);
            points
                .iter_mut()
                .flatten()
                .for_each(|x| *x = (*x / cell).round() * cell);
            format!("rounded to {cell:e}")
        }
        _ => {
            let noise = random.power(-6.0, 0.0);
            for p in points.iter_mut() {
                *p = p.map(|x| x + random.between(-noise, noise));
            }
            format!("noise {noise:e}")
        }
    }
}

/// Vectors of a random kind, one for each of `n` points: unit, zero, tiny, huge, or mixed.
pub fn vectors(n: usize, scales: Scales, random: &mut Random) -> Rows {
    let exponent = random.pick(&[0.0, 0.0, -scales.extreme, scales.extreme, -scales.moderate]);
    let is_mixed = random.one_in(4);
    let mut vector = |_| {
        let exponent = if is_mixed {
            random.between(-scales.extreme, scales.extreme)
        } else {
            exponent
        };
        let size = if is_mixed && random.one_in(50) {
            0.0
        } else {
            10f64.powf(exponent)
        };
        sphere(random).map(|x| x * size)
    };
    (0..n).map(&mut vector).collect()
}
