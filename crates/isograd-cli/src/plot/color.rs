//! Colors of signed distances.

use super::canvas::Color;

/// From blue (inside) through white (the surface) to red (outside): anchors of a diverging scale whose
/// lightness falls evenly on both sides, after ColorBrewer's RdBu.
const SCALE: [Color; 9] = [
    [0.02, 0.19, 0.38],
    [0.13, 0.40, 0.67],
    [0.36, 0.64, 0.81],
    [0.70, 0.84, 0.92],
    [0.97, 0.97, 0.97],
    [0.99, 0.82, 0.72],
    [0.93, 0.58, 0.45],
    [0.80, 0.30, 0.27],
    [0.58, 0.07, 0.14],
];

/// Of cells without a value (outside the band).
pub const NO_VALUE: Color = [0.90, 0.90, 0.91];

/// The values at the two ends of the scale. Inside and outside have scales of their own: a body is often
/// much thinner than the room around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Depth at the blue end, positive.
    pub inside: f64,
    /// Distance at the red end.
    pub outside: f64,
}

impl Range {
    /// The range of values from `low` to `high`; a side without values gets the other's scale.
    pub fn new(low: f64, high: f64) -> Self {
        let (inside, outside) = (-low.min(0.0), high.max(0.0));
        let or = |side: f64, other: f64| match (side > 0.0, other > 0.0) {
            (true, _) => side,
            (false, true) => other,
            (false, false) => 1.0,
        };
        Self {
            inside: or(inside, outside),
            outside: or(outside, inside),
        }
    }

    /// The color of a value.
    pub fn color(&self, value: f64) -> Color {
        if !value.is_finite() {
            return NO_VALUE;
        }
        let side = if value < 0.0 {
            self.inside
        } else {
            self.outside
        };
        let last = (SCALE.len() - 1) as f64;
        let place = (0.5 * (value / side + 1.0) * last).clamp(0.0, last);
        let low = (place as usize).min(SCALE.len() - 2);
        let t = (place - low as f64) as f32;
        std::array::from_fn(|c| (1.0 - t) * SCALE[low][c] + t * SCALE[low + 1][c])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_has_its_own_end_and_both_meet_at_zero() {
        let range = Range::new(-0.1, 2.0);
        assert_eq!(range.color(-0.1), SCALE[0]);
        assert_eq!(range.color(-5.0), SCALE[0]);
        assert_eq!(range.color(0.0), SCALE[4]);
        assert_eq!(range.color(1.0), SCALE[6]);
        assert_eq!(range.color(3.0), SCALE[8]);
        assert_eq!(range.color(f64::NAN), NO_VALUE);
    }

    #[test]
    fn a_side_without_values_is_no_division_by_zero() {
        assert_eq!(
            Range::new(0.5, 2.0),
            Range {
                inside: 2.0,
                outside: 2.0
            }
        );
        assert_eq!(
            Range::new(f64::INFINITY, f64::NEG_INFINITY),
            Range {
                inside: 1.0,
                outside: 1.0
            }
        );
    }
}
