//! The map.

use super::pair::{add_pair, displacement};
use super::{Inputs, Sums};
use crate::vector::{add, dot, of_f64, scale, to_f64};
use crate::{Real, parallel};

/// Results of the stage; empty where no sample is moved, nor would be by a small change of the cloud.
#[derive(Clone, Debug, Default)]
pub(crate) struct Thickened<T> {
    /// `(N, 3)` `x'`.
    pub points: Vec<[T; 3]>,
    /// `(N,)` the residual.
    pub sums: Vec<Sums>,
}

/// Fills `out`, in the memory of the last one. The same bits for any number of threads.
pub(crate) fn forward<T: Real>(inputs: Inputs<'_, T>, out: &mut Thickened<T>) {
    let Thickened { points, sums } = out;
    let old = inputs.samples.points;
    let is_thin = near_others(inputs);
    parallel::fill(sums, old.len(), |i| {
        let own = inputs.sample(i);
        let mut sums = Sums {
            own: own.area,
            ..Sums::default()
        };
        if !is_thin[i] {
            return sums;
        }
        inputs.for_each_near(i, |j| {
            add_pair(&own, &inputs.sample(j), inputs.width, &mut sums);
        });
        sums
    });
    let away = |i: usize| displacement(&sums[i], inputs.width, inputs.least);
    if parallel::first(old.len(), |i| away(i) != 0.0).is_none() {
        *out = Thickened::default();
        return;
    }
    parallel::fill(points, old.len(), |i| {
        let away = away(i);
        if away == 0.0 {
            return old[i];
        }
        let normal = to_f64(inputs.samples.normals[i]);
        of_f64(add(to_f64(old[i]), scale(normal, away)))
    });
}

/// `(N,)` whether a sample has others of the opposite face within reach, in whose pairs alone a thickness shows.
pub(super) fn near_others<T: Real>(inputs: Inputs<'_, T>) -> Vec<bool> {
    let normals = inputs.samples.normals;
    let [x, y, z] = [0, 1, 2].map(|a| inputs.sorted(|i| normals[i][a]));
    // Those of no weight do not matter.
    let limit = T::of(-0.499);
    inputs.any_near([&x, &y, &z], &|position, other| {
        dot([x[position], y[position], z[position]], other) < limit
    })
}
