//! Cotangents of the radii to cotangents of the points.
//!
//! Normals and areas depend on the radius through quotients `d/R` alone, but for powers of `R` as factors. So a pullback that
//! has the `d̄_j` also has `R R̄ = p y ȳ − Σ ⟨d̄_j, d_j⟩`, for a `y` in units of length to the power `p`.

use rayon::prelude::*;

use super::cell_index::compare_points;
use super::radius::{Neighborhoods, Radius};
use super::rule::{AUTO_MARGIN, FEWEST_NEIGHBORS, GROWTH_MARGIN};
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
    pub fn add_common(&mut self, bar: f64) {
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
    let index = &neighborhoods.index;
    let mut pairs = grown_pairs(neighborhoods, &radii_bar.grown);
    if neighborhoods.rule == Radius::Auto && radii_bar.common != 0.0 {
        pairs.extend(middle_pairs(neighborhoods, radii_bar.common));
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

/// Points whose radius has grown, each with its 8th sample and the cotangent of the distance to it.
fn grown_pairs<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    grown: &[(u32, f64)],
) -> Vec<(u32, u32, f64)> {
    let Neighborhoods { index, radius, .. } = neighborhoods;
    let pair = |nearest: &mut Vec<(u32, T)>, &(i, bar): &(u32, f64)| {
        let position = neighborhoods.position()[i as usize] as usize;
        index.nearest(index.point(position), FEWEST_NEIGHBORS, nearest);
        let j = nearest.last().map_or(i, |&(j, _)| j);
        (i, j, GROWTH_MARGIN * bar / radius[i as usize].f64())
    };
    grown.par_iter().map_init(Vec::new, pair).collect()
}

/// The points whose distances the automatic radius is the mean of, each with its 24th sample and the cotangent of the
/// distance to it. Of several that are equally far it is the first by its coordinates.
fn middle_pairs<T: Real>(neighborhoods: &Neighborhoods<T>, bar: f64) -> Vec<(u32, u32, f64)> {
    let Neighborhoods { index, reach, .. } = neighborhoods;
    let Some([least, largest]) = neighborhoods.middle else {
        return Vec::new();
    };
    let is_middle = |&position: &usize| least <= reach[position] && reach[position] <= largest;
    let positions = (0..reach.len()).into_par_iter();
    let middle: Vec<usize> = positions.filter(is_middle).collect();
    let share = AUTO_MARGIN * bar / neighborhoods.common_radius.f64();
    let share = share / middle.len() as f64;
    let point = |j: u32| index.point(neighborhoods.position()[j as usize] as usize);
    let pair = |&position: &usize| {
        let (i, square) = (index.order()[position], reach[position]);
        let mut last = None;
        // Rounding of the root must not leave the sample out.
        let radius = square.sqrt() * (T::one() + T::of(4.0) * T::epsilon());
        index.for_each_within(index.point(position), radius, |j, d2| {
            let j = j as u32;
            let comes_before = |last: u32| {
                let by_place = compare_points(point(j), point(last));
                by_place.then(j.cmp(&last)).is_lt()
            };
            if d2 == square && last.is_none_or(comes_before) {
                last = Some(j);
            }
        });
        (i, last.unwrap_or(i), share)
    };
    middle.par_iter().map(pair).collect()
}
