//! Cotangents of the radii to cotangents of the points.
//!
//! What depends on the radius depends on it through quotients `d/R` alone, but for powers of `R` as factors; so a
//! pullback that has the `d̄_j` has `R R̄ = p y ȳ − Σ ⟨d̄_j, d_j⟩` as well, for a `y` in units of length to the power `p`.

use rayon::prelude::*;

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
    let index = &neighborhoods.index;
    let point = |i: u32| index.point(neighborhoods.position()[i as usize] as usize);
    let grown = radii_bar.grown.par_iter().map(|&(i, bar)| {
        let mut nearest = Vec::new();
        index.nearest(point(i), FEWEST_NEIGHBORS, &mut nearest);
        let &(j, _) = nearest.last()?;
        let by_distance = GROWTH_MARGIN * bar / neighborhoods.radius[i as usize].f64();
        Some((i, j, by_distance))
    });
    let grown: Vec<Option<(u32, u32, f64)>> = grown.collect();
    let automatic = match neighborhoods.rule {
        Radius::Auto if radii_bar.common != 0.0 => middle_pairs(neighborhoods, radii_bar.common),
        _ => Vec::new(),
    };
    for (i, j, by_distance) in grown.into_iter().flatten().chain(automatic) {
        let offset = vector::sub(point(j), point(i));
        let length = vector::norm(offset);
        if length > T::zero() {
            let bar = vector::scale(offset, T::of(by_distance) / length);
            points_bar[j as usize] = vector::add(points_bar[j as usize], bar);
            points_bar[i as usize] = vector::sub(points_bar[i as usize], bar);
        }
    }
}

/// Pairs of points whose distances the automatic radius is the mean of, with the cotangent of each distance: a point of
/// the middle half, and its 24th sample. Where several are equally far, each has a share.
fn middle_pairs<T: Real>(neighborhoods: &Neighborhoods<T>, bar: f64) -> Vec<(u32, u32, f64)> {
    let Neighborhoods { index, reach, .. } = neighborhoods;
    let Some([least, largest]) = neighborhoods.middle else {
        return Vec::new();
    };
    let is_middle = |&position: &usize| least <= reach[position] && reach[position] <= largest;
    let positions = (0..reach.len()).into_par_iter();
    let middle: Vec<usize> = positions.filter(is_middle).collect();
    let share = AUTO_MARGIN * bar / (neighborhoods.common_radius.f64() * middle.len() as f64);
    let pairs = middle.par_iter().flat_map_iter(|&position| {
        let square = reach[position];
        let (center, mut last) = (index.order()[position], Vec::new());
        // Rounding of the root must not leave the last one out.
        let radius = square.sqrt() * (T::one() + T::of(4.0) * T::epsilon());
        index.for_each_within(index.point(position), radius, |j, d2| {
            if d2 == square {
                last.push(j as u32);
            }
        });
        let share = share / last.len() as f64;
        last.into_iter().map(move |j| (center, j, share))
    });
    pairs.collect()
}
