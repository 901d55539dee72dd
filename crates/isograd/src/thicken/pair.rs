//! Two samples, and the displacement of one from its sums.

use super::{BLEND, REACH, Sums};
use crate::vector::{add, dot, norm_squared, scale, sub};

/// A sample.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub point: [f64; 3],
    pub normal: [f64; 3],
    pub area: f64,
}

/// A pair `(i, j)`: a weight without the area of `j`, and its derivatives.
struct Weight {
    value: f64,
    by_cosine: f64,
    by_depth: f64,
    by_square: f64,
}

/// Cotangents of the inputs of a pair.
#[derive(Clone, Copy, Default)]
pub(super) struct PairCotangent {
    /// Of the offset `x_i − x_j`.
    pub offset: [f64; 3],
    /// Of `n_i`, `n_j` and `a_j`.
    pub normals: [[f64; 3]; 2],
    pub area: f64,
    /// `d̄·d`.
    pub length: f64,
}

/// Offset, cosine of the normals and `1 − |d|²/r²` of a pair.
#[derive(Clone, Copy)]
struct Pair {
    offset: [f64; 3],
    cosine: f64,
    near: f64,
    width: f64,
}

impl Pair {
    #[inline(always)]
    fn new(i: &Sample, j: &Sample, width: f64) -> Self {
        let offset = sub(i.point, j.point);
        let near = 1.0 - norm_squared(offset) / (REACH * width).powi(2);
        Self {
            offset,
            cosine: dot(i.normal, j.normal),
            near: near.max(0.0),
            width,
        }
    }

    /// `v/a_j`, for samples of one face.
    #[inline(always)]
    fn own(&self) -> Weight {
        let facing = (2.0 * self.cosine - 1.0).max(0.0);
        let (e, k) = (facing * facing, self.near * self.near);
        Weight {
            value: e * k,
            by_cosine: 4.0 * facing * k,
            by_depth: 0.0,
            by_square: -2.0 * e * self.near / (REACH * self.width).powi(2),
        }
    }

    /// `w/a_j`, for samples of opposite faces.
    #[inline(always)]
    fn opposite(&self, depth: f64) -> Weight {
        let facing = (-1.0 - 2.0 * self.cosine).max(0.0);
        let rise = (1.0 + 4.0 * depth / self.width).clamp(0.0, 1.0);
        let below = rise * rise * (3.0 - 2.0 * rise);
        let (o, k) = (facing * facing, self.near * self.near);
        Weight {
            value: o * k * below,
            by_cosine: -4.0 * facing * k * below,
            by_depth: o * k * 6.0 * rise * (1.0 - rise) * 4.0 / self.width,
            by_square: -2.0 * o * self.near * below / (REACH * self.width).powi(2),
        }
    }
}

/// Adds the pair `(i, j)` to the sums of `i`.
#[inline(always)]
pub(super) fn add_pair(i: &Sample, j: &Sample, width: f64, sums: &mut Sums) {
    let pair = Pair::new(i, j, width);
    if pair.cosine > 0.0 {
        sums.own += j.area * pair.own().value;
        return;
    }
    let depth = dot(i.normal, pair.offset);
    let weight = j.area * pair.opposite(depth).value;
    sums.weight += weight;
    sums.depth += weight * depth;
}

/// Cotangents of the pair `(i, j)` from those of the sums of `i`.
#[inline(always)]
pub(super) fn pull_pair(i: &Sample, j: &Sample, width: f64, bar: &Sums) -> PairCotangent {
    let pair = Pair::new(i, j, width);
    let depth = dot(i.normal, pair.offset);
    let (weight, weight_bar, mut depth_bar) = if pair.cosine > 0.0 {
        let weight = pair.own();
        (weight, bar.own, 0.0)
    } else {
        let weight = pair.opposite(depth);
        let weight_bar = bar.weight + bar.depth * depth;
        let direct = bar.depth * j.area * weight.value;
        (weight, weight_bar, direct)
    };
    let scaled = weight_bar * j.area;
    depth_bar += scaled * weight.by_depth;
    let along = scale(i.normal, depth_bar);
    let offset = add(along, scale(pair.offset, 2.0 * scaled * weight.by_square));
    let cosine_bar = scaled * weight.by_cosine;
    PairCotangent {
        offset,
        normals: [
            add(scale(pair.offset, depth_bar), scale(j.normal, cosine_bar)),
            scale(i.normal, cosine_bar),
        ],
        area: weight_bar * weight.value,
        length: dot(offset, pair.offset),
    }
}

/// Share of the other face below which the thickness is not defined, and samples stay where they are.
const NO_SHARE: f64 = 1e-12;

/// `t/ℓ`, and `s` up to 1, where there is another face. Where areas are 0, `Σ v` may be.
fn thickness_and_share(sums: &Sums, width: f64) -> Option<[f64; 2]> {
    if !(sums.weight > NO_SHARE * sums.own) {
        return None;
    }
    let share = match sums.weight < sums.own {
        true => sums.weight / sums.own,
        false => 1.0,
    };
    Some([sums.depth / sums.weight / width, share])
}

/// `f` and its derivative.
fn lack(t: f64, least: f64) -> [f64; 2] {
    if t < least - BLEND {
        [least - t, -1.0]
    } else {
        let rest = (least + BLEND - t).max(0.0);
        [rest * rest / (4.0 * BLEND), -rest / (2.0 * BLEND)]
    }
}

/// `c` and its derivative.
fn credit(s: f64) -> [f64; 2] {
    let rest = (1.0 - s).max(0.0);
    [1.0 - rest * rest, 2.0 * rest]
}

/// Displacement along the normal, `½ ℓ f c`, in the unit of the points.
pub(super) fn displacement(sums: &Sums, width: f64, least: f64) -> f64 {
    let found = thickness_and_share(sums, width);
    found.map_or(0.0, |[t, s]| 0.5 * width * lack(t, least)[0] * credit(s)[0])
}

/// Cotangents of the sums and of `T`, from that of the displacement.
pub(super) fn pull_sums(sums: &Sums, width: f64, least: f64, bar: f64) -> (Sums, f64) {
    let Some([t, s]) = thickness_and_share(sums, width) else {
        return Default::default();
    };
    let ([f, slope], [c, rise]) = (lack(t, least), credit(s));
    let half = 0.5 * width * bar;
    let depth = half * c * slope / (sums.weight * width);
    let by_share = match s < 1.0 {
        true => half * f * rise / sums.own,
        false => 0.0,
    };
    let bars = Sums {
        weight: by_share - depth * t * width,
        depth,
        own: -by_share * s,
    };
    (bars, -half * c * slope)
}
