//! The pullback.

use super::pair::{displacement, pull_pair, pull_sums};
use super::{Inputs, Sums};
use crate::splat::SampleCotangent;
use crate::vector::{add, dot, of_f64, scale, sub, to_f64};
use crate::{Real, parallel};

/// Cotangents of a sample from its pairs.
#[derive(Clone, Copy, Default)]
struct Share {
    point: [f64; 3],
    normal: [f64; 3],
    area: f64,
    /// `d̄·d` of the pairs that it is the first of.
    length: f64,
}

/// Adds the cotangents of the samples, from those `(N, 3)` of the moved points. Returns the cotangents of `ℓ` and `T`.
pub(crate) fn pullback<T: Real>(
    inputs: Inputs<'_, T>,
    sums: &[Sums],
    moved_bar: &[[T; 3]],
    out: &mut SampleCotangent<T>,
) -> [f64; 2] {
    let Inputs { width, least, .. } = inputs;
    let bar_along = |i: usize| dot(to_f64(moved_bar[i]), to_f64(inputs.samples.normals[i]));
    let of_sums = parallel::map(sums.len(), |i| {
        pull_sums(&sums[i], width, least, bar_along(i))
    });
    let (of_sums, of_least): (Vec<Sums>, Vec<f64>) = of_sums.into_iter().unzip();
    let none = Sums::default();
    let moved = inputs.sorted(|i| T::of(f64::from(u8::from(of_sums[i] != none))));
    let is_near = inputs.any_near([&moved], &|_, [moved]| moved > T::zero());
    let shares = parallel::map(sums.len(), |i| match is_near[i] {
        true => gather(inputs, &of_sums, i),
        false => Share::default(),
    });
    let bar = |i: usize| to_f64(moved_bar[i]);
    parallel::for_each(&mut out.points, |i, point| {
        *point = of_f64(add(to_f64(*point), add(bar(i), shares[i].point)));
    });
    parallel::for_each(&mut out.normals, |i, normal| {
        let moved = scale(bar(i), displacement(&sums[i], width, least));
        *normal = of_f64(add(to_f64(*normal), add(moved, shares[i].normal)));
    });
    parallel::for_each(&mut out.areas, |i, area| {
        *area = T::of(area.f64() + shares[i].area);
    });
    let [by_length, least_bar] = parallel::sum_array(sums.len(), |i| {
        let moved = displacement(&sums[i], width, least) * bar_along(i);
        let area = 2.0 * shares[i].area * inputs.samples.areas[i].f64();
        [moved - shares[i].length - area, of_least[i]]
    });
    [by_length / width, least_bar]
}

/// Sum over the pairs of sample `i`, and those of which it is the second: nothing unless one of them is moved.
fn gather<T: Real>(inputs: Inputs<'_, T>, of_sums: &[Sums], i: usize) -> Share {
    let (own, mut share) = (inputs.sample(i), Share::default());
    let none = Sums::default();
    share.area = of_sums[i].own;
    inputs.for_each_near(i, |j| {
        if of_sums[i] == none && of_sums[j] == none {
            return;
        }
        let other = inputs.sample(j);
        let first = pull_pair(&own, &other, inputs.width, &of_sums[i]);
        let second = pull_pair(&other, &own, inputs.width, &of_sums[j]);
        share.point = add(share.point, sub(first.offset, second.offset));
        share.normal = add(share.normal, add(first.normals[0], second.normals[1]));
        share.area += second.area;
        share.length += first.length;
    });
    share
}
