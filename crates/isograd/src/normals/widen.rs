//! Wider neighborhoods for the axes of samples that scatter.
//!
//! How far an axis is off because its samples lie off their plane is, by first-order perturbation of the
//! eigenvectors of a covariance of `n` independent samples, an angle whose square is `q/n`, with the
//! *roughness* `q = λ₁λ₂/(λ₂−λ₁)² + λ₁λ₃/(λ₃−λ₁)²`. In twice the radius, noise is a quarter of the roughness;
//! two sheets of a thin body, which looks as thick as wide, less still. At an edge it stays, and where the
//! surface is curved it grows fourfold. So whether noise is what makes a neighborhood rough is seen from
//! wider ones. Neither term counts as more than `Q = 16`, `1/(1/q + 1/Q)` instead of `q`: from there on the axis says nothing,
//! and by how much it says nothing must not count, nor be differentiated.
//!
//! Source of the compromise between noise and curvature: N. Mitra, A. Nguyen, L. Guibas, "Estimating surface
//! normals in noisy point cloud data" (2004); here neither noise nor curvature need be known.

use pulp::Arch;

use super::forward::{Moments, find_planes, moments};
use super::{Plane, Residual};
use crate::element::plane;
use crate::neighbors::{Candidates, Census, Found as Sum, Neighborhoods, Radius, Search};
use crate::{Real, parallel, simd, vector};

/// Radii that are tried one after the other, in `R_i`.
pub const STEPS: [f64; 3] = [1.55, 2.2, 3.1];

/// Roughness up to which an axis is left alone, and from which a wider neighborhood is taken: with 24 samples, it is
/// off by 4 degrees at 0.12. A share of the widening is taken between the two numbers, here and below, so that
/// axes are continuous in the points.
pub const ROUGH: [f64; 2] = [0.1, 0.14];

/// Roughness, as a share of the one at hand, up to which a wider neighborhood is taken, and from which it is not.
pub const GAIN: [f64; 2] = [0.4, 0.6];

/// A neighborhood whose centroid is off its middle by this share of the radius is one-sided: up to which a wider one
/// is taken, and from which it is not.
pub const RIM: [f64; 2] = [0.17, 0.23];

/// Points of one task.
pub(super) const TASK: usize = 256;

/// The axis of one sample in a neighborhood wider than its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found<T> {
    position: u32,
    /// Of the point's own radius.
    factor: T,
    pub radius: T,
    count: u32,
    pub normal: [T; 3],
    pub plane: Plane<T>,
}

/// Replaces the axes of rough neighborhoods by those of wider ones that are far less rough. A radius that was
/// given stays.
pub(super) fn choose<T: Real>(neighborhoods: &Neighborhoods<T>, out: &mut Residual<T>) {
    if neighborhoods.rule == Radius::Auto {
        let is_wanted = |i: usize| roughness(&out.planes[i]) > ROUGH[0];
        let positions = positions(neighborhoods, is_wanted);
        let planes = &out.planes;
        let found = in_tasks(&positions, |task| smoothest(neighborhoods, planes, task));
        write(neighborhoods, found, out);
    }
}

/// `q`, see the [module](self).
pub(super) fn roughness<T: Real>(plane: &Plane<T>) -> f64 {
    let [first, others @ ..] = plane.eigenvalues.map(|value| value.f64());
    match first > 0.0 {
        true => others
            .map(|value| plane::roughness(first, value))
            .into_iter()
            .sum(),
        false => 0.0,
    }
}

/// How far the samples found lie on one side of the one in their middle, along the two tangents; much at the rim of a plate,
/// whose face is another than that of the plate.
pub(super) fn lateral<T: Real>(found: &Found<T>) -> [f64; 2] {
    let Plane {
        tangents, centroid, ..
    } = found.plane;
    tangents.map(|tangent| vector::dot(tangent, centroid).f64())
}

/// Sorted positions of the points that are wanted, by input index.
fn positions<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<u32> {
    let order = neighborhoods.index.order();
    parallel::flat_map(order.len(), |position| {
        is_wanted(order[position] as usize).then_some(position as u32)
    })
}

fn in_tasks<T: Real>(
    positions: &[u32],
    run: impl Fn(&[u32]) -> Vec<Found<T>> + Send + Sync,
) -> Vec<Found<T>> {
    parallel::map_each(positions.chunks(TASK), |_, task| run(task)).concat()
}

/// How far a neighborhood is widened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Widening<T> {
    position: u32,
    pub roughness: f64,
    /// Of the radius.
    pub factor: f64,
    /// The axis with that factor, if it was tried.
    found: Option<Found<T>>,
}

impl<T: Real> Widening<T> {
    pub(super) fn new(position: u32, own: &Plane<T>) -> Self {
        Self {
            position,
            roughness: roughness(own),
            factor: 1.0,
            found: None,
        }
    }

    /// Takes the share of a wider neighborhood that it deserves.
    fn take(&mut self, found: Found<T>) {
        let (own, wider) = (self.roughness, roughness(&found.plane));
        let [rough, gain, rim] = parts_of_share(own, &found);
        let share = rough * gain * rim;
        if share > 0.0 {
            self.roughness = share * wider + (1.0 - share) * own;
            self.factor = share * found.factor.f64() + (1.0 - share) * self.factor;
            self.found = (share == 1.0).then_some(found);
        }
    }
}

/// The share of a wider neighborhood that is taken where the roughness at hand is `own` is the product of these, by
/// [`ROUGH`], [`GAIN`] and [`RIM`].
pub(super) fn parts_of_share<T: Real>(own: f64, found: &Found<T>) -> [f64; 3] {
    let falling = |x, [from, to]: [f64; 2]| plane::falling(x, from, to);
    let [x, y] = lateral(found);
    let rough = 1.0 - falling(own, ROUGH);
    let gain = falling(roughness(&found.plane) / own, GAIN);
    let rim = falling(x.hypot(y) / found.radius.f64(), RIM);
    [rough, gain, rim]
}

/// Tries wider neighborhoods, one step after the other, for those that are still rough. `tried(step, which, widening before,
/// found)` is called for each.
pub(super) fn try_wider<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    all: &mut [Widening<T>],
    candidates: &mut Candidates<T>,
    mut tried: impl FnMut(usize, usize, Widening<T>, Found<T>),
) {
    for (step, factor) in STEPS.into_iter().enumerate() {
        let rough = (0..all.len()).filter(|&k| all[k].roughness > ROUGH[0]);
        let rough: Vec<usize> = rough.collect();
        let wide: Vec<(u32, T)> = rough
            .iter()
            .map(|&k| (all[k].position, T::of(factor)))
            .collect();
        for (k, found) in rough
            .into_iter()
            .zip(find(neighborhoods, &wide, candidates))
        {
            tried(step, k, all[k], found);
            all[k].take(found);
        }
    }
}

/// For each point of a task that has one: the axis in the wider neighborhood.
fn smoothest<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    planes: &[Plane<T>],
    task: &[u32],
) -> Vec<Found<T>> {
    let mut candidates = Candidates::default();
    let order = neighborhoods.index.order();
    let begin = |&position: &u32| {
        let own = &planes[order[position as usize] as usize];
        Widening::new(position, own)
    };
    let mut all: Vec<Widening<T>> = task.iter().map(begin).collect();
    try_wider(neighborhoods, &mut all, &mut candidates, |_, _, _, _| ());
    let between = |w: &&Widening<T>| w.found.is_none() && w.factor > 1.0;
    let wide = all.iter().filter(between);
    let wide: Vec<(u32, T)> = wide.map(|w| (w.position, T::of(w.factor))).collect();
    let mut found = find(neighborhoods, &wide, &mut candidates);
    found.extend(all.into_iter().filter_map(|w| w.found));
    found
}

/// The axes of the points at some sorted positions, in neighborhoods wider than their own by some factors.
pub(super) fn find<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    wide: &[(u32, T)],
    candidates: &mut Candidates<T>,
) -> Vec<Found<T>> {
    let (arch, index, rule) = (Arch::new(), &neighborhoods.index, neighborhoods.rule);
    let own = |position: u32| neighborhoods.radius[index.order()[position as usize] as usize];
    let mut count = Vec::with_capacity(wide.len());
    let sums = wide.iter().map(|&(position, factor)| {
        let (point, radius) = (index.point(position as usize), factor * own(position));
        let values = [];
        index.candidates(point, Search { radius, values }, candidates);
        count.push(Census::of(arch, point, radius, candidates).count);
        Sum::only(moments(arch, rule, point, radius, candidates))
    });
    let sums: Vec<Sum<T, Moments<T>>> = sums.collect();
    let mut normals = vec![[T::zero(); 3]; sums.len()];
    let mut planes = vec![Plane::default(); sums.len()];
    let all: Vec<u32> = (0..sums.len() as u32).collect();
    simd::vectorized!(arch, find_planes(&sums, &all, &mut normals, &mut planes));
    let found = wide.iter().zip(count).zip(normals.into_iter().zip(planes));
    let found = found.map(|((&(position, factor), count), (normal, plane))| Found {
        position,
        factor,
        radius: factor * own(position),
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
