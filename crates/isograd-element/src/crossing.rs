//! Where a level lies between the values at the two ends of a lattice edge, and the difference that its
//! derivatives divide by.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// Where the level lies between two values, `η = (level − p)/(q − p)` in `[0, 1]`. The values are finite
/// and on different sides of the level, so they differ; in IEEE arithmetic their difference is then not
/// zero either.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn crossing<F: Element>(p: F, q: F, level: F) -> F {
    let difference = q - p;
    let large = F::new(1e38);
    let half = F::new(0.5);
    if difference < large && -difference < large {
        (level - p) / difference
    } else {
        // The difference may overflow. Halves of numbers as far apart as this are far from underflow.
        (half * level - half * p) / (half * q - half * p)
    }
}

/// A difference, made as large as `smallest` where it is less, with its sign.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn bounded<F: Element>(difference: F, smallest: F) -> F {
    if difference < smallest && -difference < smallest {
        if difference < F::new(0.0) {
            -smallest
        } else {
            smallest
        }
    } else {
        difference
    }
}
