//! Cotangents of the outward normals to cotangents of the axes, or of the given normals.

use rayon::prelude::*;

use super::Orientation;
use crate::vector::{dot, norm, normalized, scale, sub, to_f64};
use crate::{Real, vector};

/// Turns cotangents of `normals` into those of the `axes` that they are, up to sign: `s_i n̄_i`, in place.
pub fn axes_pullback<T: Real>(normals: &[[T; 3]], axes: &[[T; 3]], bars: &mut [[T; 3]]) {
    let flipped = |(n, axis): (&[T; 3], &[T; 3])| vector::dot(*n, *axis) < T::zero();
    bars.par_iter_mut()
        .zip(normals.par_iter().zip(axes))
        .filter(|(_, pair)| flipped(*pair))
        .for_each(|(bar, _)| *bar = bar.map(|x| -x));
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
/// `(n̄_i − n_i (n_i·n̄_i)) / |g_i|`, in place. Finite for every vector that the forward map takes, as far as
/// the number type holds it.
pub fn given_pullback<T: Real>(given: &[[T; 3]], bars: &mut [[T; 3]]) {
    bars.par_iter_mut().zip(given).for_each(|(bar, &g)| {
        let (g, n_bar) = (to_f64(g), to_f64(*bar));
        let Some(n) = normalized(g) else {
            *bar = [T::zero(); 3];
            return;
        };
        let tangential = sub(n_bar, scale(n, dot(n, n_bar)));
        let most = T::max_value().f64();
        // A vector so short that its square is 0 in double precision still has a length.
        let largest = g.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let length = largest * norm(scale(g, 1.0 / largest));
        *bar = tangential.map(|x| T::of((x / length).clamp(-most, most)));
    });
}
