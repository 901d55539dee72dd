//! Clamped uniform cubic B-spline.

use crate::jet::Jet;

/// Evaluates the spline at `q` in `[0, 1]` by De Boor's algorithm: at least 4 control values, uniform knots; the
/// spline interpolates the first and last control value.
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
