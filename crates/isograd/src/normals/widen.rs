//! Wider neighborhoods for the axes of samples that scatter.
//!
//! How far an axis is off because its samples lie off their plane is, by first-order perturbation of the
//! eigenvectors of a covariance of `n` independent samples, an angle whose square is `q/n`, with the
//! *roughness* `q = λ₁λ₂/(λ₂−λ₁)² + λ₁λ₃/(λ₃−λ₁)²`. In twice the radius, noise is a quarter of the roughness;
//! two sheets of a thin body, which looks as thick as wide, less still. At an edge it stays, and where the
//! surface is curved it grows fourfold. So whether noise is what makes a neighborhood rough is seen from
//! wider ones.
//!
//! Source of the compromise between noise and curvature: N. Mitra, A. Nguyen, L. Guibas, "Estimating surface
//! normals in noisy point cloud data" (2004); here neither noise nor curvature need be known.

use pulp::Arch;
use rayon::prelude::*;

use super::forward::{Moments, find_planes, moments};
use super::{Plane, Residual};
use crate::element::plane;
use crate::neighbors::{Candidates, Census, Found as Sum, Neighborhoods, Radius, Search};
use crate::{Real, simd, vector};

/// Radii that are tried one after the other, in `R_i`.
pub const STEPS: [f64; 3] = [
    std::f64::consts::SQRT_2,
    2.0,
    2.0 * std::f64::consts::SQRT_2,
];

/// Roughness up to which an axis is left alone: with 24 samples, it is off by 4 degrees.
pub const ROUGH: f64 = 0.12;

/// A wider neighborhood is taken where its roughness is at most this share of the one at hand.
pub const GAIN: f64 = 0.5;

/// A neighborhood whose centroid is off its middle by this share of the radius is one-sided.
pub const RIM: f64 = 0.2;

/// Points of one task.
const TASK: usize = 256;

/// The axis of one sample in a neighborhood wider than its own.
#[derive(Clone, Copy, Debug)]
struct Found<T> {
    position: u32,
    radius: T,
    count: u32,
    normal: [T; 3],
    plane: Plane<T>,
}

/// Replaces the axes of rough neighborhoods by those of wider ones that are far less rough. A radius that was
/// given stays.
pub(super) fn choose<T: Real>(neighborhoods: &Neighborhoods<T>, out: &mut Residual<T>) {
    if neighborhoods.rule == Radius::Auto {
        let is_wanted = |i: usize| roughness(&out.planes[i]) > ROUGH;
        let positions = positions(neighborhoods, is_wanted);
        let planes = &out.planes;
        let found = in_tasks(&positions, |task| smoothest(neighborhoods, planes, task));
        write(neighborhoods, found, out);
    }
}

/// Replaces the axes of the samples whose radius is above that of their neighborhood by those within the radius.
pub(super) fn repeat<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    radius: &[T],
    out: &mut Residual<T>,
) {
    let positions = positions(neighborhoods, |i| radius[i] > neighborhoods.radius[i]);
    let found = in_tasks(&positions, |task| {
        find(
            neighborhoods,
            task,
            |i| radius[i],
            &mut Candidates::default(),
        )
    });
    write(neighborhoods, found, out);
}

/// `q`, see the [module](self); infinite where the axis is no better than another.
fn roughness<T: Real>(plane: &Plane<T>) -> f64 {
    let [first, others @ ..] = plane.eigenvalues.map(|value| value.f64());
    match first > 0.0 {
        true => others
            .map(|value| plane::roughness(first, value))
            .into_iter()
            .sum(),
        false => 0.0,
    }
}

/// Whether the samples found lie mostly on one side of the one in their middle, as at the rim of a plate, whose face
/// is another than that of the plate.
fn is_at_rim<T: Real>(found: &Found<T>) -> bool {
    let lateral = found
        .plane
        .tangents
        .map(|t| vector::dot(t, found.plane.centroid).f64());
    lateral[0].hypot(lateral[1]) > RIM * found.radius.f64()
}

/// Sorted positions of the points that are wanted, by input index.
fn positions<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<u32> {
    let order = neighborhoods.index.order().par_iter();
    let positions = (0u32..order.len() as u32).into_par_iter().zip(order);
    let wanted = positions.filter(|&(_, &i)| is_wanted(i as usize));
    wanted.map(|(position, _)| position).collect()
}

fn in_tasks<T: Real>(
    positions: &[u32],
    run: impl Fn(&[u32]) -> Vec<Found<T>> + Send + Sync,
) -> Vec<Found<T>> {
    let tasks = positions.par_chunks(TASK);
    tasks.flat_map_iter(run).collect()
}

/// For each point of a task that has one: the least rough of the wider neighborhoods.
fn smoothest<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    planes: &[Plane<T>],
    task: &[u32],
) -> Vec<Found<T>> {
    let mut candidates = Candidates::default();
    let input = |position: u32| neighborhoods.index.order()[position as usize] as usize;
    let mut best: Vec<(f64, Option<Found<T>>)> = task
        .iter()
        .map(|&position| (roughness(&planes[input(position)]), None))
        .collect();
    for step in STEPS {
        let rough = |(_, best): &(&u32, &mut (f64, Option<Found<T>>))| best.0 > ROUGH;
        let (positions, places): (Vec<u32>, Vec<_>) =
            task.iter().zip(&mut best).filter(rough).unzip();
        let radius = |i: usize| T::of(step) * neighborhoods.radius[i];
        let found = find(neighborhoods, &positions, radius, &mut candidates);
        for (place, found) in places.into_iter().zip(found) {
            let roughness = roughness(&found.plane);
            if roughness <= GAIN * place.0 && !is_at_rim(&found) {
                *place = (roughness, Some(found));
            }
        }
    }
    best.into_iter().filter_map(|(_, found)| found).collect()
}

/// The axes of the points at some sorted positions, within `radius(input index)` of each.
fn find<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    positions: &[u32],
    radius: impl Fn(usize) -> T,
    candidates: &mut Candidates<T>,
) -> Vec<Found<T>> {
    let (arch, index) = (Arch::new(), &neighborhoods.index);
    let radius = |position: u32| radius(index.order()[position as usize] as usize);
    let mut count = Vec::with_capacity(positions.len());
    let sums = positions.iter().map(|&position| {
        let (point, radius) = (index.point(position as usize), radius(position));
        let values = [];
        index.candidates(point, Search { radius, values }, candidates);
        count.push(Census::of(arch, point, radius, candidates).count);
        Sum::only(moments(arch, point, radius, candidates))
    });
    let sums: Vec<Sum<T, Moments<T>>> = sums.collect();
    let mut normals = vec![[T::zero(); 3]; sums.len()];
    let mut planes = vec![Plane::default(); sums.len()];
    let all: Vec<u32> = (0..sums.len() as u32).collect();
    simd::vectorized!(arch, find_planes(&sums, &all, &mut normals, &mut planes));
    let found = positions
        .iter()
        .zip(count)
        .zip(normals.into_iter().zip(planes));
    let found = found.map(|((&position, count), (normal, plane))| Found {
        position,
        radius: radius(position),
        count,
        normal,
        plane,
    });
    found.collect()
}

fn write<T: Real>(neighborhoods: &Neighborhoods<T>, found: Vec<Found<T>>, out: &mut Residual<T>) {
    for found in found {
        let i = neighborhoods.index.order()[found.position as usize] as usize;
        out.radius[i] = found.radius;
        out.count[i] = found.count;
        out.normals[i] = found.normal;
        out.planes[i] = found.plane;
    }
}
