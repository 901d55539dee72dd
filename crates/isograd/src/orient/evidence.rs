//! Evidence for the sign of one axis, from −1 to 1, in the automatic orientation: see [`crate::orient`].

/// Weight of the evidence of a second sheet.
const SHEET: f32 = 4.0;

/// Weight of the side on which a sample lies in a layer that scatters.
const SLAB: f32 = 2.0;

/// Evidence of a second sheet below this makes no difference.
const SLIGHT: f32 = 0.05;

/// Light on the darker side of a sample up to which that side is taken for the inside of a body, and from which on for
/// open air. Inside half a sphere it is 0.26 to 0.38, on either side of rolling terrain 0.38 to 0.54.
const DIM: f32 = 0.25;
const OPEN: f32 = 0.4;

/// Share of its evidence that a sample with open air on both sides keeps.
const KEPT: f32 = 0.3;

/// Evidence of a second sheet from which on a sample lies on a thin body, whose other side is lit from behind.
const THIN: f32 = 0.25;

/// A view with at least this cosine decides by itself. It is 14 degrees off the surface; the axes of noisy
/// samples are 5 to 15 degrees off.
const CLEAR_VIEW: f32 = 0.25;

/// `x` limited to −1..1.
#[inline(always)]
fn limited(x: f32) -> f32 {
    x.clamp(-1.0, 1.0)
}

/// Openness of a side, in 0..1, from the light there: −1 in matter, 1 in the open air.
#[inline(always)]
pub(super) fn openness(light: f32) -> f32 {
    let mut open = limited(1.0 + light);
    if open < 0.0 {
        open = 0.0;
    }
    open
}

/// In 0..1, how far a sample of an open sheet has air on both sides, from the light on the `darker` one and the evidence of
/// a second `sheet` close by.
pub(super) fn exposed(darker: f32, sheet: f32) -> f32 {
    let lit = ((darker - DIM) / (OPEN - DIM)).clamp(0.0, 1.0);
    lit * (1.0 - sheet.abs() / THIN).max(0.0)
}

/// Share of its evidence that a sample keeps which is so far [`exposed`]: the brighter of two sides in the open air tells
/// valleys from hills, not the outside of a body from its inside.
pub(super) fn kept(exposed: f32) -> f32 {
    1.0 - (1.0 - KEPT) * exposed
}

/// Evidence of a sample: that of the fills, of a second `sheet` (weighted by how `open` the side is that it makes the
/// outer one), and of the side of the layer on which the sample lies (`slab` is how much of a layer there is, `side` how
/// clearly the sample lies on one side), limited to −1..1.
#[inline(always)]
pub(super) fn weighed(filled: f32, sheet: f32, open: f32, slab: f32, side: f32) -> f32 {
    limited(filled + SHEET * open * sheet + SLAB * slab * side)
}

/// Evidence of a sample with that of a view of a sensor, which takes precedence.
#[inline(always)]
pub(super) fn with_view(found: f32, seen: f32) -> f32 {
    seen + (1.0 - seen.abs()) * found
}

/// Whether it matters if a second sheet is on the far side of a thin body or of a narrow gap.
#[inline(always)]
pub(super) fn differs(sheet: f32, open: f32) -> bool {
    (1.0 - open) * sheet.abs() > SLIGHT
}

/// Whether a view decides alone.
#[inline(always)]
pub(super) fn is_clear(view: f32) -> bool {
    view.abs() >= CLEAR_VIEW
}

/// Evidence of a view for the sign of an axis; a clear view decides alone.
#[inline(always)]
pub(super) fn of_view(view: f32) -> f32 {
    limited(view / CLEAR_VIEW)
}

/// Combined view of two sensors, either of which may have seen the sample: the more grazing one, or 0 if they are on
/// different sides.
#[inline(always)]
pub(super) fn agreed(a: f32, b: f32) -> f32 {
    let mut agreed = b;
    if a.abs() <= b.abs() {
        agreed = a;
    }
    if a * b <= 0.0 {
        agreed = 0.0;
    }
    agreed
}
