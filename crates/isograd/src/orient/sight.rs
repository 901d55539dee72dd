//! Light that reaches a sample along a ray, and its evidence for the sign of the axis: see [`crate::orient::fill`]. Lengths in cells.

/// Places along a ray to the nearest free cell.
pub(super) const STEPS: usize = 8;

/// Rays from a cell that may be free.
pub(super) const RAYS: usize = 26;

/// How far along a ray a place is, by its number from 0.
#[inline(always)]
pub(super) fn distance(step: f32) -> f32 {
    0.75 + 0.5 * step
}

/// Light in a cell of the open air, of whose rays so many out of [`RAYS`] are free: 0.2 for none, 1 for all.
#[inline(always)]
pub(super) fn open_air(free: f32, rays: f32) -> f32 {
    let dark = 0.2;
    dark + (1.0 - dark) * (free / rays)
}

/// Light of a cell, dimmed by the number of [`STEPS`] along the ray to it.
#[inline(always)]
pub(super) fn dimmed(light: f32, step: f32, steps: f32) -> f32 {
    light * (1.0 - 0.5 * step / steps)
}

/// The first term of the evidence, from the light in front of a sample and behind it. The others are its differences
/// along four directions around the axis.
#[inline(always)]
pub(super) fn along_axis(front: f32, back: f32) -> f32 {
    2.0 * (front - back)
}

/// The evidence, in −1..1, from the sum of its terms.
#[inline(always)]
pub(super) fn evidence(sum: f32) -> f32 {
    sum / 12.0
}
