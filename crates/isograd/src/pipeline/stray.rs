//! Samples that lie apart from the surface and from one another, and were not left out: there are too many of them, they are in
//! sheets, or they are to be kept. Each stands for as much area as it has room, so a few of them outweigh the surface.

use crate::neighbors::Neighborhoods;
use crate::report::{TOLERATED_SHARE, Warning};
use crate::{Real, parallel, splat};

/// Share of the samples apart that must be off the surface; at borders and corners of sparse parts some are, too.
const MOST: f64 = 0.5;
/// Share of the area up to which they do not matter.
const TOLERATED: f64 = 0.1 * TOLERATED_SHARE;

/// The warning about samples that lie apart, if there are any that are no part of a surface.
pub(super) fn stray<T: Real>(neighborhoods: &Neighborhoods<T>) -> Option<Warning> {
    let apart = neighborhoods.apart();
    let off = apart.iter().filter(|sample| sample.is_off).count();
    if apart.is_empty() || (off as f64) < MOST * apart.len() as f64 {
        return None;
    }
    let area = |i: usize| splat::area::at(neighborhoods, i).f64();
    let [all] = parallel::sum_array(neighborhoods.radius.len(), |i| [area(i)]);
    let [of_apart] = parallel::sum_array(apart.len(), |k| [area(apart[k].index as usize)]);
    let (samples, share) = (apart.len(), of_apart / all);
    (share > TOLERATED).then_some(Warning::Stray { samples, share })
}
