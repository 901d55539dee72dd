//! Pictures of charts side by side, and the colors of their lines.

use isograd_cli::plot::canvas::Color;

use crate::chart::Stroke;

/// Width of a picture, in pixels.
pub const WIDTH: f32 = 1720.0;
/// Height of a picture, in pixels.
pub const HEIGHT: f32 = 640.0;
const LEFT: f32 = 110.0;
const GAP: f32 = 120.0;
const RIGHT: f32 = 30.0;
const TOP: f32 = 60.0;
const BOTTOM: f32 = 560.0;

/// Colors that can be told apart, whatever one's eyes.
pub const COLORS: [Color; 5] = [
    [0.12, 0.36, 0.65],
    [0.85, 0.37, 0.05],
    [0.17, 0.55, 0.28],
    [0.55, 0.25, 0.60],
    [0.72, 0.12, 0.18],
];

/// Places of `count` charts side by side.
pub fn places(count: usize) -> Vec<[f32; 4]> {
    let width = (WIDTH - LEFT - RIGHT - GAP * (count - 1) as f32) / count as f32;
    let left = |i: usize| LEFT + i as f32 * (width + GAP);
    (0..count)
        .map(|i| [left(i), TOP, left(i) + width, BOTTOM])
        .collect()
}

/// A line with marks, in one of the colors.
pub fn solid(color: usize) -> Stroke {
    Stroke {
        color: COLORS[color % COLORS.len()],
        dashed: false,
        marked: true,
    }
}

/// A broken line.
pub fn dashed(color: Color) -> Stroke {
    Stroke {
        color,
        dashed: true,
        marked: false,
    }
}
