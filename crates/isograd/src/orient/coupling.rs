//! Coupling of the signs of two neighboring axes, and the beliefs that spread along it: see
//! [`crate::orient::graph`]. Lengths are in sample spacings, so that single precision serves any unit.

/// Neighbors of a point in the graph.
pub const NEIGHBORS: usize = 16;

/// The reach of a sample is its distance to this neighbor: the first ring around it.
pub(super) const RING: usize = 6;

/// Rounds of belief propagation, in each of which a point takes the mean of its own evidence and its neighbors' beliefs.
pub(super) const ROUNDS: usize = 60;

/// A sample reaches at most this many times as far as its neighbors do at the median: an outlier
/// stands for no more surface than the samples that are nearest to it.
const REACH_GROWTH: f32 = 1.5;

/// Share of the reach below which the direction of an offset is mostly noise.
const BLUNT: f32 = 0.22;

/// A sample lies off a sheet from this many times as far as the samples of the sheet scatter.
const APART: f32 = 3.0;

/// Least mean share of [interleaved](super::sheets::interleaved) neighbors of two samples whose sheets lie over each
/// other.
const INTERLEAVED: f32 = 0.3;

/// Share up to which two sheets are, the less it is, steps beside each other instead, as rounded coordinates make them of
/// a slanting face: their samples have one side.
const STEPPED: f32 = 0.25;

/// Cosines between the axes of two such sheets from which on their reflection is not full, and is as without sheets:
/// 26 and 46 degrees.
const FULL: f32 = 0.9;
const NONE: f32 = 0.7;

/// A sample stands for at most this many times the median area: outliers far apart are no surface.
const MOST_AREA: f32 = 16.0;

/// Gap of an unknown sheet: no length reaches it.
const UNKNOWN: f32 = f32::MAX;

/// A neighbor of a coupling above this along the same direction lies on the same sheet; and the least share
/// of the neighbors that do.
const SAME_SHEET: f32 = 0.1;
const LEAST_SHARE: f32 = 1.0 / 3.0;

/// Samples of the graph around one, itself included; and those of the ring, the last of them half.
const ALL: f32 = NEIGHBORS as f32 + 1.0;
const IN_RING: f32 = RING as f32 + 0.5;
const PI: f32 = std::f32::consts::PI;
const SOURCES: f32 = NEIGHBORS as f32;

/// Factor of the product of the spreads of two samples in the blur of their reflection.
const NOISE: f32 = 4.0;

/// How soon it is clear on which side of a plane a sample lies, by its height in spreads.
const SIDE: f32 = 2.0;

/// How far the patch extends that a sample stands for, from its own ring and the median of those around it.
#[inline(always)]
pub(super) fn reach(ring: f32, median: f32) -> f32 {
    ring.min(REACH_GROWTH * median)
}

/// In −1..1, the side of a plane on which a sample lies; `height` in spreads.
#[inline(always)]
pub(super) fn side(height: f32) -> f32 {
    (SIDE * height).tanh()
}

/// The square of the height from which on one of two samples lies off the sheet of the other, whose sheets
/// scatter so much; as good as infinite where a sheet is not known.
#[inline(always)]
pub(super) fn least_gap(a: f32, b: f32) -> f32 {
    if a > 0.0 && b > 0.0 {
        let height = largest_height(a.max(b));
        height * height
    } else {
        UNKNOWN
    }
}

/// Height up to which a sample lies on a sheet that scatters so much.
#[inline(always)]
pub(super) fn largest_height(scatter: f32) -> f32 {
    APART * scatter
}

/// How far the reflection of two samples of known sheets is full, in 0..1: near 1 for parallel sheets, and for all acute
/// angles where the samples of the two sheets are mixed. Where one sheet bends slightly, or has steps, they are not.
#[inline(always)]
fn facing(parallel: f32, interleaved: f32) -> f32 {
    if interleaved > INTERLEAVED {
        ((parallel.abs() - NONE) / (FULL - NONE)).clamp(0.0, 1.0)
    } else {
        let second = parallel * parallel;
        let fourth = second * second;
        fourth * fourth * (interleaved / STEPPED).min(1.0)
    }
}

/// Blur that is added to the square of the distance between two samples: their `spreads` and `thicknesses` are
/// products of those of the two.
#[inline(always)]
pub(super) fn blur(reach: f32, spreads: f32, thicknesses: f32, gap: f32) -> f32 {
    let blunt = BLUNT * reach;
    let noise = NOISE * spreads;
    // Where sheets are told apart, it is not noise.
    let rough = match gap >= UNKNOWN {
        true => thicknesses.max(noise),
        false => thicknesses,
    };
    blunt * blunt + rough
}

/// Coupling of the signs of two neighboring axes `a` and `b`, `d` apart: `a` is reflected at the
/// plane half-way between the two samples and compared with `b`. Along a sheet that is `a·b`; around an
/// edge it turns with the surface; and two sheets that face each other, whether matter or air is
/// between them, have opposite outward normals. A [`blur`] takes the reflection back
/// where `d` is too short to tell. Two parallel sheets much closer to each other than their samples are
/// face each other although `d` runs along them: there the reflection is full from the height whose square
/// is `gap` on. So do the two sides of a wedge, near its edge: there the samples of both are mixed, of which
/// `interleaved` is the mean share at the two samples.
///
/// `parallel` is `a·b`, `heights` is `(a·d)(b·d)`, and `square` is `|d|²` and the blur.
///
/// Source: the reflected transfer of H. Xie, K. McDonnell, H. Qin, "Surface reconstruction of noisy
/// and defective data sets" (2004).
#[inline(always)]
pub(super) fn coupled(parallel: f32, heights: f32, square: f32, gap: f32, interleaved: f32) -> f32 {
    let mut divisor = square;
    if gap < square && heights * parallel > 0.0 {
        let share = facing(parallel, interleaved);
        divisor = square.min(share * (heights.abs() + gap) + (1.0 - share) * square);
    }
    match divisor > 0.0 {
        true => (parallel - 2.0 * heights / divisor).clamp(-1.0, 1.0),
        false => parallel.clamp(-1.0, 1.0),
    }
}

/// A coupling for a [tie](coupled), its fifth power: a half-hearted one, as between a sample of one sheet and one
/// slantwise across on the other, is mostly wrong, and must not count for half.
#[inline(always)]
pub(super) fn trusted(tie: f32) -> f32 {
    let square = tie * tie;
    tie * (square * square)
}

/// The coupling of two samples in a layer that has air on both sides, as far as it has (`both`, in 0..1): they hang
/// together as they lie, on one side of the middle or on both. `parallel` as in [`coupled`].
#[inline(always)]
pub(super) fn parted(coupling: f32, both: f32, parallel: f32, side: f32, other: f32) -> f32 {
    coupling + both * (trusted(parallel * side * other) - coupling)
}

/// Whether a neighbor takes a share of the area of a sample: it lies on the same sheet or beyond an edge, and does not face
/// it.
#[inline(always)]
pub(super) fn on_same_surface(coupling: f32, parallel: f32) -> bool {
    coupling * parallel > -SAME_SHEET
}

/// The area that a sample stands for, from how many of its neighbors are on the same surface, and the distance to the
/// farthest of all.
#[inline(always)]
pub(super) fn area(farthest: f32, same: f32) -> f32 {
    PI * farthest * farthest / same.max(LEAST_SHARE * SOURCES)
}

/// Whether a neighbor of a sample that scatters lies on the same sheet.
#[inline(always)]
pub(super) fn on_same_sheet(coupling: f32, parallel: f32) -> bool {
    coupling * parallel > SAME_SHEET
}

/// The area that a sample that scatters stands for with so many neighbors on the same sheet: far neighbors are on any.
#[inline(always)]
pub(super) fn scattered_area(reach: f32, same: f32) -> f32 {
    let share = ((1.0 + same) / ALL).max(LEAST_SHARE);
    PI * reach * reach / (IN_RING * share)
}

/// The area of a sample, limited by the median of all.
#[inline(always)]
pub(super) fn bounded_area(area: f32, median: f32) -> f32 {
    area.min(MOST_AREA * median)
}

/// How much a neighbor lies off the sheet of a sample: above 0 where its `height`, along the axis, is. `square` is
/// its squared distance, above 0.
#[inline(always)]
pub(super) fn across(height: f32, square: f32, parallel: f32, gap: f32) -> f32 {
    let sine = height.abs() / f32::sqrt(square);
    let off = match gap < UNKNOWN {
        true => height * height / (height * height + gap),
        false => sine * sine * sine,
    };
    let off = off.copysign(height);
    let second = parallel * parallel;
    off * (second * second)
}

/// Evidence for the sign of an axis from what lies [`across`] a second sheet close by: its sum, and that of its
/// magnitudes. Positive where the axis points away from that sheet.
#[inline(always)]
pub(super) fn sheet_evidence(signed: f32, total: f32) -> f32 {
    if total > 0.0 {
        -signed * signed.abs() / (total * SOURCES)
    } else {
        0.0
    }
}

/// Contribution of a point's own evidence to the sum of beliefs, weighted by its strength.
#[inline(always)]
pub(super) fn held(own: f32) -> f32 {
    own * own.abs()
}

/// The mean of evidence and beliefs; 0 where nothing has weight.
#[inline(always)]
pub(super) fn belief(sum: f32, weight: f32) -> f32 {
    if weight > 0.0 { sum / weight } else { 0.0 }
}
