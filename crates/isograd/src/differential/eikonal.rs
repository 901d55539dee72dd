//! How close `|∇φ|` is to 1, its value for a distance.

use pulp::Arch;

use super::rows::{self, Rows};
use crate::data::Field;
use crate::{Real, parallel};

/// Equal bins from `lower` to `upper`. What lies beyond an end is counted in the bin at that end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bins {
    /// Low end of the first bin.
    pub lower: f64,
    /// High end of the last bin.
    pub upper: f64,
    /// Number of bins; 0 makes no histogram.
    pub count: usize,
}

impl Default for Bins {
    /// 100 bins from 0 to 2.
    fn default() -> Self {
        Self {
            lower: 0.0,
            upper: 2.0,
            count: 100,
        }
    }
}

impl Bins {
    /// The bin of a value; `count` is not 0.
    fn place(&self, value: f64) -> usize {
        let fraction = (value - self.lower) / (self.upper - self.lower);
        // A cast of a negative number or of NaN gives 0.
        ((fraction * self.count as f64) as usize).min(self.count - 1)
    }
}

/// Options of [`eikonal`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EikonalOptions {
    /// Cells with `|φ|` below this many cell sizes are near the surface. Default 3.
    pub near: f64,
    /// Bins of the histograms.
    pub bins: Bins,
}

impl Default for EikonalOptions {
    fn default() -> Self {
        Self {
            near: 3.0,
            bins: Bins::default(),
        }
    }
}

/// Distribution of `|∇φ|` over a set of cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spread {
    /// Number of cells.
    pub cells: usize,
    /// Mean.
    pub mean: f64,
    /// The value that 5 % of the cells do not exceed (nearest rank).
    pub p05: f64,
    /// The value that 95 % of the cells do not exceed (nearest rank).
    pub p95: f64,
    /// Number of cells in each bin; they add up to [`cells`](Self::cells).
    pub histogram: Vec<u64>,
}

/// `|∇φ|` in all cells, walls included, and near the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Eikonal {
    /// Over all cells; `None` if no gradient is finite.
    pub all: Option<Spread>,
    /// Over the cells near the surface; `None` if there are none.
    pub near: Option<Spread>,
}

/// Statistics of `|∇φ|`. Gradients that are not finite are left out. A `φ` that is limited to a band is
/// flat beyond it: only `near` is then meaningful. Allocates nothing that grows with the grid:
/// percentiles are computed by three passes over the field, exactly (in single precision).
pub fn eikonal<T: Real>(phi: &Field<T>, options: &EikonalOptions) -> Eikonal {
    let near = options.near * phi.grid().spacing().f64();
    let moments = moments(phi, near, &options.bins);
    let counts = [moments[0].cells, moments[1].cells];
    let percentiles = percentiles(phi, near, counts);
    let mut groups = moments.into_iter().zip(percentiles).map(|(m, [p05, p95])| {
        (m.cells > 0).then(|| Spread {
            cells: m.cells,
            mean: m.sum / m.cells as f64,
            p05,
            p95,
            histogram: m.histogram,
        })
    });
    let all = groups.next().flatten();
    Eikonal {
        all,
        near: groups.next().flatten(),
    }
}

/// Calls `visit(|∇φ|, near)` for each cell of plane `i` with a finite gradient.
#[inline(always)]
fn for_each_in_plane<T: Real>(phi: &Field<T>, i: usize, near: f64, mut visit: impl FnMut(T, bool)) {
    let rows = Rows::of(phi);
    let [_, ny, nz] = rows.shape;
    let mut g = rows::buffers::<T, 3>(nz);
    let [mut magnitude] = rows::buffers::<T, 1>(nz);
    let near = T::of(near);
    crate::simd::vectorized!(Arch::new(), {
        for j in 0..ny {
            rows.gradient([i, j], &mut g);
            let [x, y, z] = g.each_ref().map(|g| &g[..nz]);
            for (k, m) in magnitude.iter_mut().enumerate() {
                *m = (x[k] * x[k] + y[k] * y[k] + z[k] * z[k]).sqrt();
            }
            for (&m, &value) in magnitude.iter().zip(rows.row([i, j])) {
                if m.is_finite() {
                    visit(m, value.abs() < near);
                }
            }
        }
    });
}

/// Count, sum and histogram of one group of cells.
#[derive(Clone, Debug, Default)]
struct Moments {
    cells: usize,
    sum: f64,
    histogram: Vec<u64>,
}

impl Moments {
    fn new(bins: &Bins) -> Self {
        Self {
            histogram: vec![0; bins.count],
            ..Self::default()
        }
    }

    #[inline(always)]
    fn count(&mut self, value: f64, bins: &Bins) {
        self.cells += 1;
        self.sum += value;
        if bins.count > 0 {
            self.histogram[bins.place(value)] += 1;
        }
    }

    fn add(&mut self, other: &Self) {
        self.cells += other.cells;
        self.sum += other.sum;
        for (a, b) in self.histogram.iter_mut().zip(&other.histogram) {
            *a += b;
        }
    }
}

/// Of all cells and of those near the surface. Planes are added up in their order.
fn moments<T: Real>(phi: &Field<T>, near: f64, bins: &Bins) -> [Moments; 2] {
    let planes = parallel::map_each(0..phi.grid().shape()[0], |_, i| {
        let mut groups = [Moments::new(bins), Moments::new(bins)];
        for_each_in_plane(phi, i, near, |m, is_near| {
            groups[0].count(m.f64(), bins);
            if is_near {
                groups[1].count(m.f64(), bins);
            }
        });
        groups
    });
    let mut total = [Moments::new(bins), Moments::new(bins)];
    for plane in planes {
        total[0].add(&plane[0]);
        total[1].add(&plane[1]);
    }
    total
}

/// Planes whose digits are counted together.
const SLAB: usize = 8;

/// Bits of a key that one pass looks at.
const DIGIT: u32 = 11;

/// An order statistic in a radix search: the prefix of its key, and its rank among the keys with that prefix.
#[derive(Clone, Copy, Debug)]
struct Target {
    prefix: u32,
    rank: u64,
}

/// The 5th and 95th percentile of each group: 0 where a group is empty. The bits of a positive float, read
/// as an integer, are in its order; digit by digit, from the highest, cells are counted by the next digit
/// of their key, and the digit at which the count passes the rank is the next one of the result.
fn percentiles<T: Real>(phi: &Field<T>, near: f64, cells: [usize; 2]) -> [[f64; 2]; 2] {
    let rank = |n: usize, p: f64| ((p * n as f64).ceil() as u64).max(1) - 1;
    let mut targets = cells.map(|n| {
        [0.05, 0.95].map(|p| Target {
            prefix: 0,
            rank: rank(n, p),
        })
    });
    for shift in [2 * DIGIT, DIGIT, 0] {
        let counts = count_digits(phi, near, &targets, shift);
        for (target, counts) in targets
            .iter_mut()
            .flatten()
            .zip(counts.chunks_exact(1 << DIGIT))
        {
            target.descend(counts);
        }
    }
    targets.map(|group| group.map(|t| f64::from(f32::from_bits(t.prefix))))
}

impl Target {
    #[inline(always)]
    fn matches(&self, key: u32, shift: u32) -> bool {
        u64::from(key) >> (shift + DIGIT) == u64::from(self.prefix)
    }

    fn descend(&mut self, counts: &[u64]) {
        let mut digit = 0;
        while digit + 1 < counts.len() && self.rank >= counts[digit] {
            self.rank -= counts[digit];
            digit += 1;
        }
        self.prefix = self.prefix << DIGIT | digit as u32;
    }
}

/// For each target one after the other, how many of its cells have each digit.
fn count_digits<T: Real>(
    phi: &Field<T>,
    near: f64,
    targets: &[[Target; 2]; 2],
    shift: u32,
) -> Vec<u64> {
    let planes = phi.grid().shape()[0];
    let slabs = parallel::map_each((0..planes).step_by(SLAB), |_, first| {
        let mut counts = vec![0u64; 4 << DIGIT];
        for i in first..planes.min(first + SLAB) {
            for_each_in_plane(phi, i, near, |m, is_near| {
                let key = (m.f64() as f32).to_bits();
                let digit = (key >> shift) as usize & ((1 << DIGIT) - 1);
                for (group, targets) in targets.iter().enumerate().take(1 + usize::from(is_near)) {
                    for (t, target) in targets.iter().enumerate() {
                        let place = (2 * group + t) << DIGIT | digit;
                        counts[place] += u64::from(target.matches(key, shift));
                    }
                }
            });
        }
        counts
    });
    let mut total = vec![0; 4 << DIGIT];
    for counts in slabs {
        total.iter_mut().zip(counts).for_each(|(a, b)| *a += b);
    }
    total
}

#[cfg(test)]
mod tests {
    use super::super::gradient;
    use super::super::tests::{cube, field, sphere, torus};
    use super::*;
    use crate::vector;

    /// Sorted magnitudes of the gradient, over all cells and near the surface.
    fn magnitudes<T: Real>(phi: &Field<T>) -> [Vec<f64>; 2] {
        let mut g = Vec::new();
        gradient(phi, &mut g);
        let near = T::of(3.0 * phi.grid().spacing().f64());
        let mut all: Vec<_> = g.iter().map(|&g| vector::norm(g).f64()).collect();
        let mut close: Vec<_> = (0..all.len())
            .filter(|&at| phi.values()[at].abs() < near)
            .map(|at| all[at])
            .collect();
        all.sort_by(f64::total_cmp);
        close.sort_by(f64::total_cmp);
        [all, close]
    }

    #[test]
    fn eikonal_statistics_are_those_of_the_sorted_values() {
        for n in [5, 12, 33] {
            let phi = field(cube::<f32>(n), |x| {
                torus(x) * (1.0 + 0.3 * (5.0 * x[0]).sin())
            });
            let found = eikonal(&phi, &EikonalOptions::default());
            for (values, spread) in magnitudes(&phi).iter().zip([found.all, found.near]) {
                let spread = spread.expect("cells");
                let rank = |p: f64| values[(p * values.len() as f64).ceil() as usize - 1];
                assert_eq!(
                    (spread.cells, spread.p05, spread.p95),
                    (values.len(), rank(0.05), rank(0.95))
                );
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                assert!((spread.mean - mean).abs() < 1e-12);
                for (bin, &count) in spread.histogram.iter().enumerate() {
                    let here = |v: &&f64| ((*v * 50.0) as usize).min(99) == bin;
                    assert_eq!(
                        count,
                        values.iter().filter(here).count() as u64,
                        "bin {bin}"
                    );
                }
            }
        }
    }

    #[test]
    fn eikonal_is_one_on_a_distance_and_nothing_where_there_is_nothing() {
        let phi = field(cube::<f64>(64), sphere);
        let near = eikonal(&phi, &EikonalOptions::default())
            .near
            .expect("cells near the surface");
        // Second order: (h/r)²/6 = 5e-4, more on the inner side.
        assert!(
            (near.mean - 1.0).abs() < 2e-3 && near.p05 > 0.99 && near.p95 < 1.001,
            "{near:?}"
        );
        let far = field(cube::<f64>(9), |x| 10.0 + x[0]);
        assert_eq!(eikonal(&far, &EikonalOptions::default()).near, None);
        let broken = field(cube::<f64>(9), |_| f64::NAN);
        let none = Bins {
            count: 0,
            ..Bins::default()
        };
        let found = eikonal(
            &broken,
            &EikonalOptions {
                bins: none,
                ..EikonalOptions::default()
            },
        );
        assert_eq!(
            found,
            Eikonal {
                all: None,
                near: None
            }
        );
        let cut = field(cube::<f64>(9), |x| {
            if x[0] > 0.5 { f64::INFINITY } else { x[0] }
        });
        let all = eikonal(
            &cut,
            &EikonalOptions {
                bins: none,
                ..EikonalOptions::default()
            },
        )
        .all;
        let all = all.expect("some are finite");
        assert!(
            all.histogram.is_empty() && (all.mean - 1.0).abs() < 1e-12,
            "{all:?}"
        );
    }
}
