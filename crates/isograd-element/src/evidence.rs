//! What speaks for the sign of one axis, from −1 to 1, in the automatic orientation: see `isograd::orient`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// What the evidence of a second sheet weighs.
const SHEET: f32 = 4.0;

/// What the side weighs on which a sample lies in a layer that scatters.
const SLAB: f32 = 2.0;

/// Evidence of a second sheet below this makes no difference.
const SLIGHT: f32 = 0.05;

/// A view with at least this cosine decides by itself. It is 14 degrees off the surface; the axes of noisy
/// samples are 5 to 15 degrees off.
const CLEAR_VIEW: f32 = 0.25;

/// Within −1..1.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn held<F: Element>(x: F) -> F {
    let mut held = x;
    if x > F::new(1.0) {
        held = F::new(1.0);
    }
    if x < F::new(-1.0) {
        held = F::new(-1.0);
    }
    held
}

/// The magnitude.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn size<F: Element>(x: F) -> F {
    let mut size = x;
    if x < F::new(0.0) {
        size = -x;
    }
    size
}

/// In 0..1, how open the side is on which the light is this: −1 in matter, 1 in the open air.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn openness<F: Element>(light: F) -> F {
    let mut open = held::<F>(F::new(1.0) + light);
    if open < F::new(0.0) {
        open = F::new(0.0);
    }
    open
}

/// The evidence of a sample: what the fills say, a second `sheet` as far as the side is `open` that it makes the
/// outer one, the side of its layer that it lies on (`slab` says how much of a layer that is, `side` how clearly it
/// lies there), and before all these what sensors have `seen`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weighed<F: Element>(filled: F, sheet: F, open: F, slab: F, side: F, seen: F) -> F {
    let found = filled + F::new(SHEET) * open * sheet + F::new(SLAB) * slab * side;
    seen + (F::new(1.0) - size::<F>(seen)) * held::<F>(found)
}

/// Whether it matters if a second sheet is on the far side of a thin body or of a narrow gap.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn differs<F: Element>(sheet: F, open: F) -> bool {
    (F::new(1.0) - open) * size::<F>(sheet) > F::new(SLIGHT)
}

/// Whether a view decides alone.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn is_clear<F: Element>(view: F) -> bool {
    size::<F>(view) >= F::new(CLEAR_VIEW)
}

/// What a view adds to the evidence for the sign of an axis: all but all of it for a clear one.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn of_view<F: Element>(view: F) -> F {
    held::<F>(view / F::new(CLEAR_VIEW))
}

/// Of two views by sensors of which it is not known which one saw the sample: the more grazing one, or none where
/// they are on different sides.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn agreed<F: Element>(a: F, b: F) -> F {
    let mut agreed = b;
    if size::<F>(a) <= size::<F>(b) {
        agreed = a;
    }
    if a * b <= F::new(0.0) {
        agreed = F::new(0.0);
    }
    agreed
}
