//! What speaks for the sign of one axis, from −1 to 1, in the automatic orientation: see [`crate::orient`].

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
#[inline(always)]
fn held(x: f32) -> f32 {
    let mut held = x;
    if x > 1.0 {
        held = 1.0;
    }
    if x < -1.0 {
        held = -1.0;
    }
    held
}

/// The magnitude.
#[inline(always)]
fn size(x: f32) -> f32 {
    let mut size = x;
    if x < 0.0 {
        size = -x;
    }
    size
}

/// In 0..1, how open the side is on which the light is this: −1 in matter, 1 in the open air.
#[inline(always)]
pub(super) fn openness(light: f32) -> f32 {
    let mut open = held(1.0 + light);
    if open < 0.0 {
        open = 0.0;
    }
    open
}

/// The evidence of a sample: what the fills say, a second `sheet` as far as the side is `open` that it makes the
/// outer one, the side of its layer that it lies on (`slab` says how much of a layer that is, `side` how clearly it
/// lies there), and before all these what sensors have `seen`.
#[inline(always)]
pub(super) fn weighed(filled: f32, sheet: f32, open: f32, slab: f32, side: f32, seen: f32) -> f32 {
    let found = filled + SHEET * open * sheet + SLAB * slab * side;
    seen + (1.0 - size(seen)) * held(found)
}

/// Whether it matters if a second sheet is on the far side of a thin body or of a narrow gap.
#[inline(always)]
pub(super) fn differs(sheet: f32, open: f32) -> bool {
    (1.0 - open) * size(sheet) > SLIGHT
}

/// Whether a view decides alone.
#[inline(always)]
pub(super) fn is_clear(view: f32) -> bool {
    size(view) >= CLEAR_VIEW
}

/// What a view adds to the evidence for the sign of an axis: all but all of it for a clear one.
#[inline(always)]
pub(super) fn of_view(view: f32) -> f32 {
    held(view / CLEAR_VIEW)
}

/// Of two views by sensors of which it is not known which one saw the sample: the more grazing one, or none where
/// they are on different sides.
#[inline(always)]
pub(super) fn agreed(a: f32, b: f32) -> f32 {
    let mut agreed = b;
    if size(a) <= size(b) {
        agreed = a;
    }
    if a * b <= 0.0 {
        agreed = 0.0;
    }
    agreed
}
