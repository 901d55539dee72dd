//! Cotangents of the radii to cotangents of the points.
//!
//! Normals and areas depend on the radius through quotients `d/R` alone, but for powers of `R` as factors. So a pullback that
//! has the `d̄_j` also has `R R̄ = p y ȳ − Σ ⟨d̄_j, d_j⟩`, for a `y` in units of length to the power `p`.

use super::cell_index::compare_points;
use super::growth::Growth;
use super::radius::{Neighborhoods, Radius};
use super::rule::AUTO_MARGIN;
use crate::{Real, parallel, vector};

/// Cotangents of the radii, in one over the unit of the points where the result has no unit.
#[derive(Clone, Debug, Default)]
pub struct RadiiCotangent {
    /// `R R̄` of the common radius.
    common: f64,
    /// `R R̄` of the automatic radius, whether it is the common one or another is given.
    automatic: f64,
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
        self.automatic = 0.0;
        self.grown.clear();
    }

    /// Adds `R R̄` of the common radius.
    pub fn add_common(&mut self, bar: f64) {
        self.common += bar;
    }

    /// Adds `s s̄` of the [spacing](Neighborhoods::spacing) of the samples.
    pub fn add_spacing(&mut self, bar: f64) {
        self.automatic += bar;
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
/// the automatic one, the points of the middle half and which sample is the 24th; for grown ones, which is the 8th,
/// and on which side of a line samples are.
pub fn pullback<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    radii_bar: &RadiiCotangent,
    points_bar: &mut [[T; 3]],
) {
    let index = &neighborhoods.index;
    let mut pairs = grown_pairs(neighborhoods, &radii_bar.grown);
    let of_common = match neighborhoods.rule {
        Radius::Auto => radii_bar.common,
        Radius::Fixed(_) | Radius::Cut(_) => 0.0,
    };
    let of_automatic = radii_bar.automatic + of_common;
    if of_automatic != 0.0 {
        pairs.extend(middle_pairs(neighborhoods, of_automatic));
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

/// Points whose radius has grown, each with the sample that it passes and the cotangent of the distance to it.
fn grown_pairs<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    grown: &[(u32, f64)],
) -> Vec<(u32, u32, f64)> {
    let Neighborhoods { index, radius, .. } = neighborhoods;
    let along_lines = neighborhoods.along_lines();
    parallel::map_with(Vec::new, grown.len(), |nearest, k| {
        let (i, bar) = grown[k];
        let position = neighborhoods.position()[i as usize] as usize;
        let growth = Growth::of(index, position, along_lines, nearest);
        let by_distance = growth.margin * bar / radius[i as usize].f64();
        (i, index.order()[growth.to], by_distance)
    })
}

/// The points whose distances the automatic radius is the mean of, each with its 24th sample and the cotangent of the
/// distance to it. Of several that are equally far it is the first by its coordinates.
fn middle_pairs<T: Real>(neighborhoods: &Neighborhoods<T>, bar: f64) -> Vec<(u32, u32, f64)> {
    let Neighborhoods { index, reach, .. } = neighborhoods;
    let Some([least, largest]) = neighborhoods.middle else {
        return Vec::new();
    };
    let middle = parallel::flat_map(reach.len(), |position| {
        (least <= reach[position] && reach[position] <= largest).then_some(position)
    });
    // Two samples may each be the other's 24th: of equal distances at either end a part may be in the middle half.
    let count = |is: &(dyn Fn(T) -> bool + Sync)| parallel::count(reach.len(), |k| is(reach[k]));
    let [at_least, at_largest] = [least, largest].map(|end| count(&|r| r == end));
    let below = count(&|r| T::zero() < r && r < least);
    let above = count(&|r| r > largest);
    let quarter = (below + middle.len() + above) / 4;
    let beyond = [quarter - below, quarter - above];
    let inside = middle.len() - beyond[0] - beyond[1];
    let weight = move |square: T| match (square == least, square == largest) {
        (true, true) => inside as f64 / at_least as f64,
        (true, false) => 1.0 - beyond[0] as f64 / at_least as f64,
        (false, true) => 1.0 - beyond[1] as f64 / at_largest as f64,
        (false, false) => 1.0,
    };
    let share = AUTO_MARGIN * bar / neighborhoods.automatic.f64() / inside as f64;
    let point = |j: u32| index.point(neighborhoods.position()[j as usize] as usize);
    parallel::map(middle.len(), |k| {
        let position = middle[k];
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
        (i, last.unwrap_or(i), share * weight(square))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::{forward, tests::Random};

    /// `R` of the automatic rule, and its derivative along `direction`.
    fn radius(points: &[[f64; 3]], direction: &[[f64; 3]]) -> (Neighborhoods<f64>, f64) {
        let mut found = Neighborhoods::default();
        forward(points, Radius::Auto, &mut found).expect("a radius");
        let mut bar = RadiiCotangent::default();
        bar.add_common(found.common_radius);
        let slope = pulled(&found, &bar, direction);
        (found, slope)
    }

    /// The derivative along `direction` of what has these cotangents of the radii.
    fn pulled(found: &Neighborhoods<f64>, bar: &RadiiCotangent, direction: &[[f64; 3]]) -> f64 {
        let mut points_bar = vec![[0.0; 3]; direction.len()];
        pullback(found, bar, &mut points_bar);
        let pairs = points_bar.iter().zip(direction);
        pairs.map(|(bar, d)| vector::dot(*bar, *d)).sum()
    }

    fn moved(points: &[[f64; 3]], direction: &[[f64; 3]], step: f64) -> Vec<[f64; 3]> {
        let pairs = points.iter().zip(direction);
        let pairs = pairs.map(|(x, d)| vector::add(*x, vector::scale(*d, step)));
        pairs.collect()
    }

    #[test]
    fn the_spacing_has_its_derivative_whatever_the_radius() {
        let mut random = Random::new(3);
        let mut vectors = |n| -> Vec<[f64; 3]> {
            let one = |_| [random.uniform(), random.uniform(), 0.1 * random.uniform()];
            (0..n).map(one).collect()
        };
        let (points, direction) = (vectors(300), vectors(300));
        for rule in [Radius::Auto, Radius::Fixed(0.2), Radius::Cut(0.3)] {
            let find = |step: f64| {
                let mut found = Neighborhoods::default();
                forward(&moved(&points, &direction, step), rule, &mut found).expect("a radius");
                found
            };
            let (found, step) = (find(0.0), 1e-7);
            let mut bar = RadiiCotangent::default();
            bar.add_spacing(found.spacing());
            let slope = pulled(&found, &bar, &direction);
            let difference = (find(step).spacing() - find(-step).spacing()) / (2.0 * step);
            assert!(
                (slope - difference).abs() < 1e-6 * difference.abs(),
                "{rule:?}: {slope} {difference}"
            );
        }
    }

    #[test]
    fn the_automatic_radius_has_its_derivative_where_equal_distances_lie_at_the_ends_of_the_half() {
        let mut split = 0;
        for seed in 0..60 {
            let mut random = Random::new(seed);
            let mut vectors = |n| -> Vec<[f64; 3]> {
                let one = |_| [random.uniform(), random.uniform(), 0.1 * random.uniform()];
                (0..n).map(one).collect()
            };
            let (points, direction) = (vectors(200), vectors(200));
            let (found, slope) = radius(&points, &direction);
            let [least, largest] = found.middle.expect("positive distances");
            let between = |r: &&f64| (least..=largest).contains(*r);
            split += usize::from(found.reach.iter().filter(between).count() > 100);
            let at = |step: f64| {
                radius(&moved(&points, &direction, step), &direction)
                    .0
                    .common_radius
            };
            let step = 1e-7;
            let difference = (at(step) - at(-step)) / (2.0 * step);
            assert!(
                (slope - difference).abs() < 1e-6,
                "{seed}: {slope} {difference}"
            );
        }
        // Two samples are each the other's 24th, and only one of the two distances is in the middle half.
        assert!(split > 0);
    }
}
