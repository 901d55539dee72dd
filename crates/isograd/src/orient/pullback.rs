//! Cotangents of the outward normals to cotangents of the axes, or of the given normals.

use super::Orientation;
use crate::parallel::{self, CHUNK};
use crate::vector::{dot, norm, normalized, scale, sub, to_f64};
use crate::{Real, vector};

/// Turns cotangents of `normals` into those of the `axes` that they are, up to sign: `s_i n̄_i`, in place.
pub fn axes_pullback<T: Real>(normals: &[[T; 3]], axes: &[[T; 3]], bars: &mut [[T; 3]]) {
    let chunks = normals.chunks(CHUNK).zip(axes.chunks(CHUNK));
    parallel::each(
        bars.chunks_mut(CHUNK).zip(chunks),
        |_, (bars, (normals, axes))| {
            for (bar, (&normal, &axis)) in bars.iter_mut().zip(normals.iter().zip(axes)) {
                if vector::dot(normal, axis) < T::zero() {
                    *bar = bar.map(|x| -x);
                }
            }
        },
    );
}

/// The axes with the signs that `held` has: what [`axes_pullback`] is the pullback of.
pub(crate) fn hold<T: Real>(axes: &[[T; 3]], held: &Orientation<T>, out: &mut Orientation<T>) {
    out.clone_from(held);
    for ((normal, &axis), &before) in out.normals.iter_mut().zip(axes).zip(&held.normals) {
        let flip = vector::dot(before, axis) < T::zero();
        *normal = if flip { axis.map(|x| -x) } else { axis };
    }
}

/// Turns cotangents of unit normals into those of the `given` vectors that were divided by their lengths:
/// `(n̄_i − n_i (n_i·n̄_i)) / |g_i|`, in place. Finite for every vector that the forward map takes: returns how many
/// numbers are larger than the type can hold, and were replaced by the largest.
pub fn given_pullback<T: Real>(given: &[[T; 3]], bars: &mut [[T; 3]]) -> usize {
    let most = T::max_value().f64();
    let pull = |(bar, &g): (&mut [T; 3], &[T; 3])| {
        let (g, n_bar) = (to_f64(g), to_f64(*bar));
        let Some(n) = normalized(g) else {
            *bar = [T::zero(); 3];
            return 0;
        };
        let tangential = sub(n_bar, scale(n, dot(n, n_bar)));
        // A vector so short that its square is 0 in double precision still has a length, and so has one so short that
        // one over it is not finite.
        let largest = g.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let inverse = 1.0 / largest;
        let length = match inverse.is_finite() {
            true => largest * norm(scale(g, inverse)),
            false => largest * norm(g.map(|x| x / largest)),
        };
        let exact = tangential.map(|x| x / length);
        *bar = exact.map(|x| T::of(x.clamp(-most, most)));
        exact.iter().filter(|x| x.abs() > most).count()
    };
    let chunks = bars.chunks_mut(CHUNK).zip(given.chunks(CHUNK));
    let replaced = parallel::map_each(chunks, |_, (bars, given)| {
        bars.iter_mut().zip(given).map(pull).sum::<usize>()
    });
    replaced.into_iter().sum()
}
