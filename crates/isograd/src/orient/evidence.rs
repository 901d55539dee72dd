//! Evidence for the sign of one axis, from −1 to 1, in the automatic orientation: see [`crate::orient`].

/// Weight of the evidence of a second sheet.
const SHEET: f32 = 4.0;

/// Weight of the side on which a sample lies in a layer that scatters.
const SLAB: f32 = 2.0;

/// Evidence of a second sheet below this makes no difference.
const SLIGHT: f32 = 0.05;

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

/// Evidence of a sample: that of the fills, of a second `sheet` (weighted by how `open` the side is that it makes the
/// outer one), and of the side of the layer on which the sample lies (`slab` is how much of a layer there is, `side` how
/// clearly the sample lies on one side). Views of sensors (`seen`) take precedence.
#[inline(always)]
pub(super) fn weighed(filled: f32, sheet: f32, open: f32, slab: f32, side: f32, seen: f32) -> f32 {
    let found = filled + SHEET * open * sheet + SLAB * slab * side;
    seen + (1.0 - seen.abs()) * limited(found)
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
