//! Cotangents of the radii to cotangents of the points.
//!
//! What depends on the radius depends on it through quotients `d/R` alone, but for powers of `R` as factors; so a
//! pullback that has the `d̄_j` has `R R̄ = p y ȳ − Σ ⟨d̄_j, d_j⟩` as well, for a `y` in units of length to the power `p`.

use rayon::prelude::*;

use super::radius::{Neighborhoods, Radius};
use super::rule::{AUTO_MARGIN, AUTO_NEIGHBORS, FEWEST_NEIGHBORS, GROWTH_MARGIN};
use crate::{Real, vector};

/// Cotangents of the radii, in one over the unit of the points where the result has no unit.
#[derive(Clone, Debug, Default)]
pub struct RadiiCotangent {
    /// `R R̄` of the common radius.
    common: f64,
    /// `R_i R̄_i` of points whose radius has grown.
    grown: Vec<(u32, f64)>,
}

impl RadiiCotangent {
    /// From `(N,)` `R_i R̄_i`, in input order.
    pub fn of<T: Real>(neighborhoods: &Neighborhoods<T>, bars: &[T]) -> Self {
        let mut out = Self::default();
        for (i, bar) in bars.iter().enumerate() {
            out.add(neighborhoods, i, bar.f64());
        }
        out
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.common = 0.0;
        self.grown.clear();
    }

    /// Adds `R R̄` of the common radius.
    pub(crate) fn add_common(&mut self, bar: f64) {
        self.common += bar;
    }

    /// Adds `R_i R̄_i` of a point.
    pub(crate) fn add<T: Real>(&mut self, neighborhoods: &Neighborhoods<T>, i: usize, bar: f64) {
        match neighborhoods.has_grown(i) {
            true => self.grown.push((i as u32, bar)),
            false => self.common += bar,
        }
    }
}

/// Adds what the cotangents of the radii mean for the `(N, 3)` points. A radius that was given is constant, as are, for
/// the automatic one, the points of the middle half and which sample is the 24th; for grown ones, which is the 8th.
pub fn pullback<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    radii_bar: &RadiiCotangent,
    points_bar: &mut [[T; 3]],
) {
    let Neighborhoods { index, radius, .. } = neighborhoods;
    let mut pairs = pairs(neighborhoods, &radii_bar.grown, FEWEST_NEIGHBORS);
    for (i, _, bar) in &mut pairs {
        *bar *= GROWTH_MARGIN / radius[*i as usize].f64();
    }
    if neighborhoods.rule == Radius::Auto && radii_bar.common != 0.0 {
        let middle = middle_half(neighborhoods);
        let share = AUTO_MARGIN * radii_bar.common / neighborhoods.common_radius.f64();
        let bar = share / middle.len() as f64;
        let middle: Vec<(u32, f64)> = middle.into_iter().map(|i| (i, bar)).collect();
        pairs.extend(self::pairs(neighborhoods, &middle, AUTO_NEIGHBORS));
    }
    let point = |i: u32| index.point(neighborhoods.position()[i as usize] as usize);
    for (i, j, by_distance) in pairs {
        let offset = vector::sub(point(j), point(i));
        let length = vector::norm(offset);
        if length > T::zero() {
            let bar = vector::scale(offset, T::of(by_distance) / length);
            points_bar[j as usize] = vector::add(points_bar[j as usize], bar);
            points_bar[i as usize] = vector::sub(points_bar[i as usize], bar);
        }
    }
}

/// The points whose distances the automatic radius is the mean of.
fn middle_half<T: Real>(neighborhoods: &Neighborhoods<T>) -> Vec<u32> {
    let Neighborhoods { index, reach, .. } = neighborhoods;
    let Some([least, largest]) = neighborhoods.middle else {
        return Vec::new();
    };
    let samples = index.order().par_iter().zip(reach);
    let middle = samples.filter(|&(_, &square)| least <= square && square <= largest);
    middle.map(|(&i, _)| i).collect()
}

/// Each of the points with its `k`-th sample and its number.
fn pairs<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    points: &[(u32, f64)],
    k: usize,
) -> Vec<(u32, u32, f64)> {
    let index = &neighborhoods.index;
    let pair = |nearest: &mut Vec<(u32, T)>, &(i, bar): &(u32, f64)| {
        let point = index.point(neighborhoods.position()[i as usize] as usize);
        index.nearest(point, k, nearest);
        (i, nearest.last().map_or(i, |&(j, _)| j), bar)
    };
    points.par_iter().map_init(Vec::new, pair).collect()
}
