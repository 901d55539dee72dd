//! Clamped uniform cubic B-spline.

use crate::jet::Jet;

/// The spline with control values `controls` at `q` in `[0, 1]`; knots in equal steps, the first and
/// last control value are met. At least 4 control values. De Boor's algorithm.
pub(super) fn cubic(controls: &[Jet], q: Jet) -> Jet {
    let spans = controls.len() - 3;
    let knot = |i: usize| (i.saturating_sub(3) as f64 / spans as f64).min(1.0);
    let span = ((q.value * spans as f64).max(0.0) as usize).min(spans - 1);
    let mut d = [0, 1, 2, 3].map(|i| controls[span + i]);
    for level in 1..=3 {
        for i in (level..=3).rev() {
            let (low, high) = (knot(span + i), knot(span + i + 4 - level));
            let t = (q - low) / (high - low);
            d[i] = d[i - 1] + t * (d[i] - d[i - 1]);
        }
    }
    d[3]
}
