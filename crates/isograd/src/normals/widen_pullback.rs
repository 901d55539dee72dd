//! The pullback of how far a neighborhood is widened.
//!
//! The factor `F` of a radius is a chain of steps, `F ← s f + (1 − s) F` and `q ← s q' + (1 − s) q` with the factor `f` of the
//! step, the share `s` and the roughness `q'` found there. Backwards, the cotangent of `F` goes to the shares, and through
//! them to the roughness and the one-sidedness of each neighborhood: functions of its eigenvalues `λ_k`, its axis `n` and its
//! centroid `m`. With `B = Σ_k λ̄_k v_k v_kᵀ + (g nᵀ + n gᵀ)/2`, `g` from `n̄` as in [`super`], and `e = d_j − m`,
//! ```text
//! d̄_j = (w_j/W)(2 B e + m̄) + (w_j'/W)(eᵀ B e + m̄·e) d_j/r_j
//! ```
//! since `Σ_k λ̄_k λ_k = 0` for a function of quotients of them. Nothing depends on the unit of length, so
//! `R_i R̄_i = −Σ_j ⟨d̄_j, d_j⟩`.

use super::forward::{EPSILON, SMALLEST_GAP};
use super::widen::{
    Found, GAIN, RIM, ROUGH, STEPS, TASK, Widening, find, lateral, parts_of_share, roughness,
    try_wider,
};
use crate::element::plane;
use crate::neighbors::{Candidates, Neighborhoods, RadiiCotangent, rule};
use crate::vector::{add, dot, norm, scale, sub, to_f64};
use crate::{Real, parallel, vector};

/// Pulls `(N,)` cotangents `R_i R̄_i` of the radii that axes were found with back to the radii of the neighborhoods, in
/// `radii_bar`, and through how far each radius is `widened` beyond its `own`, both `(N,)`, to the `(N, 3)` `points_bar`. Adds
/// to both. The [pullback of the axes](super::pullback) includes it.
pub fn radii_pullback<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    [widened, own]: [&[T]; 2],
    bars: &[T],
    points_bar: &mut [[T; 3]],
    radii_bar: &mut RadiiCotangent,
) {
    let mut of_widened = Vec::new();
    for (i, bar) in bars.iter().enumerate() {
        radii_bar.add(neighborhoods, i, bar.f64());
        if widened[i] > own[i] && *bar != T::zero() {
            of_widened.push((i as u32, bar.f64()));
        }
    }
    pullback(neighborhoods, &of_widened, points_bar, radii_bar);
}

/// Pulls cotangents of widened radii back through how far they are widened, to the `(N, 3)` `points_bar` and to `radii_bar`,
/// the radii of the neighborhoods. Adds to both. `bars` are points whose radius `R` is wider than that of their neighborhood,
/// and `R R̄`.
pub(super) fn pullback<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    bars: &[(u32, f64)],
    points_bar: &mut [[T; 3]],
    radii_bar: &mut RadiiCotangent,
) {
    // Rounds of a fixed number of tasks, so that the lists stay short.
    for round in bars.chunks(64 * TASK) {
        let tasks =
            parallel::map_each(round.chunks(TASK), |_, task| pull_task(neighborhoods, task));
        for (j, bar) in tasks.iter().flat_map(|task| &task.points) {
            let sum = &mut points_bar[*j as usize];
            *sum = vector::add(*sum, vector::of_f64(*bar));
        }
        for &(i, bar) in tasks.iter().flat_map(|task| &task.radii) {
            radii_bar.add(neighborhoods, i as usize, bar);
        }
    }
}

/// Parts of the cotangents of points and radii.
#[derive(Default)]
struct Contributions {
    points: Vec<(u32, [f64; 3])>,
    radii: Vec<(u32, f64)>,
}

fn pull_task<T: Real>(neighborhoods: &Neighborhoods<T>, task: &[(u32, f64)]) -> Contributions {
    let (position, candidates) = (neighborhoods.position(), &mut Candidates::default());
    let own: Vec<(u32, T)> = task
        .iter()
        .map(|&(i, _)| (position[i as usize], T::one()))
        .collect();
    let own = find(neighborhoods, &own, candidates);
    let begin = |(found, &(i, _)): (&Found<T>, &(u32, f64))| {
        Widening::new(position[i as usize], &found.plane)
    };
    let mut all: Vec<Widening<T>> = own.iter().zip(task).map(begin).collect();
    let mut steps = vec![[None; STEPS.len()]; task.len()];
    try_wider(
        neighborhoods,
        &mut all,
        candidates,
        |step, k, before, found| {
            steps[k][step] = Some((before, found));
        },
    );
    let mut out = Contributions::default();
    for (k, &(i, bar)) in task.iter().enumerate() {
        let mut bars = Bars {
            factor: bar / all[k].factor,
            roughness: 0.0,
        };
        for (step, tried) in steps[k].iter().enumerate().rev() {
            if let Some((before, found)) = tried {
                let [of_roughness, of_rim] = bars.pull(before, found, STEPS[step]);
                add_plane(neighborhoods, i, found, [of_roughness, of_rim], &mut out);
            }
        }
        add_plane(neighborhoods, i, &own[k], [bars.roughness, 0.0], &mut out);
    }
    out
}

/// Cotangents of a [`Widening`].
struct Bars {
    factor: f64,
    roughness: f64,
}

impl Bars {
    /// From the widening after a step to that before it; returns the cotangents of the roughness and of the one-sidedness of
    /// the neighborhood that was tried.
    fn pull<T: Real>(&mut self, before: &Widening<T>, found: &Found<T>, factor: f64) -> [f64; 2] {
        let (own, wider) = (before.roughness, roughness(&found.plane));
        let [rough, gain, rim] = parts_of_share(own, found);
        let share = rough * gain * rim;
        let share_bar = self.factor * (factor - before.factor) + self.roughness * (wider - own);
        let mut wider_bar = share * self.roughness;
        self.roughness *= 1.0 - share;
        self.factor *= 1.0 - share;
        if is_between(rough) {
            self.roughness += share_bar * gain * rim / (ROUGH[1] - ROUGH[0]);
        }
        if is_between(gain) {
            let bar = -share_bar * rough * rim / (GAIN[1] - GAIN[0]);
            wider_bar += bar / own;
            self.roughness -= bar * wider / (own * own);
        }
        let rim_bar = match is_between(rim) {
            true => -share_bar * rough * gain / (RIM[1] - RIM[0]),
            false => 0.0,
        };
        [wider_bar, rim_bar]
    }
}

fn is_between(part: f64) -> bool {
    0.0 < part && part < 1.0
}

/// Adds the cotangents of the points of a neighborhood, and of its radius, from those of its roughness and its one-sidedness.
fn add_plane<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    i: u32,
    found: &Found<T>,
    bars: [f64; 2],
    out: &mut Contributions,
) {
    if bars == [0.0; 2] {
        return;
    }
    let adjoint = Adjoint::new(found, bars, rule::steepness(neighborhoods.rule));
    let radius = found.radius.f64();
    let (mut total, mut along) = ([0.0; 3], 0.0);
    neighborhoods.for_each_offset(i as usize, found.radius, |j, offset| {
        let offset = scale(to_f64(offset), 1.0 / radius);
        let bar = adjoint.offset_bar(offset);
        along += dot(bar, offset);
        let bar = scale(bar, 1.0 / radius);
        total = sub(total, bar);
        out.points.push((j as u32, bar));
    });
    out.points.push((i, total));
    out.radii.push((i, -along));
}

/// Cotangents of the moments of a neighborhood, all lengths in units of its radius.
struct Adjoint {
    steepness: f64,
    /// `W`.
    weight: f64,
    /// `m`, `m̄`.
    mean: [f64; 3],
    mean_bar: [f64; 3],
    /// `n`, `v₂`, `v₃`, and `λ̄_k` of each.
    axes: [[f64; 3]; 3],
    values_bar: [f64; 3],
    /// `g`.
    slope: [f64; 3],
}

impl Adjoint {
    fn new<T: Real>(found: &Found<T>, [roughness_bar, rim_bar]: [f64; 2], steepness: f64) -> Self {
        let (plane, radius) = (&found.plane, found.radius.f64());
        let [v2, v3] = plane.tangents.map(to_f64);
        let values = plane.eigenvalues.map(|value| value.f64() / radius / radius);
        let normal = to_f64(found.normal);
        let mean = scale(to_f64(plane.centroid), 1.0 / radius);
        let (mut mean_bar, mut slope) = ([0.0; 3], [0.0; 3]);
        let [x, y] = lateral(found);
        let aside = x.hypot(y);
        if rim_bar != 0.0 && aside > 0.0 {
            mean_bar = scale(add(scale(v2, x), scale(v3, y)), rim_bar / aside);
            let normal_bar = scale(mean_bar, -dot(normal, mean));
            for (v, value) in [(v2, values[1]), (v3, values[2])] {
                let gap = (value - values[0]).max(SMALLEST_GAP * values[2]);
                slope = sub(slope, scale(v, dot(v, normal_bar) / gap));
            }
        }
        Self {
            steepness,
            weight: plane.weight.f64() * radius,
            mean,
            mean_bar,
            axes: [normal, v2, v3],
            values_bar: values_bar(values, roughness_bar),
            slope,
        }
    }

    /// `d̄` of an offset `d`.
    fn offset_bar(&self, d: [f64; 3]) -> [f64; 3] {
        let r = norm(d);
        let weight = plane::weight(r, EPSILON, self.steepness) / self.weight;
        let fall = plane::weight_fall(r, EPSILON, self.steepness) / self.weight;
        let e = sub(d, self.mean);
        let [normal, ..] = self.axes;
        let (of_slope, of_normal) = (scale(normal, dot(self.slope, e)), dot(normal, e));
        let mut both = add(of_slope, scale(self.slope, of_normal));
        for (axis, bar) in self.axes.iter().zip(self.values_bar) {
            both = add(both, scale(*axis, 2.0 * bar * dot(*axis, e)));
        }
        let by_weight = 0.5 * dot(both, e) + dot(self.mean_bar, e);
        let radial = match r > 0.0 {
            true => scale(d, -fall * by_weight / r),
            false => [0.0; 3],
        };
        add(scale(add(both, self.mean_bar), weight), radial)
    }
}

/// `λ̄_k` of the roughness `Σ_k λ₁ λ_k/D_k`, with `D_k = (λ_k − λ₁)² + λ₁λ_k/Q`.
fn values_bar([first, others @ ..]: [f64; 3], bar: f64) -> [f64; 3] {
    let mut bars = [0.0; 3];
    if bar == 0.0 || !(first > 0.0) {
        return bars;
    }
    for (k, value) in others.into_iter().enumerate() {
        let roughness = plane::roughness(first, value);
        let divisor = first * value / roughness;
        let common = bar * (value + first) * (value - first) / (divisor * divisor);
        bars[0] += value * common;
        bars[k + 1] = -first * common;
    }
    bars
}
