//! Round numbers for ticks.

/// Round values from `low` to `high`, at most about `count` of them: steps of 1, 2 or 5 times a power of
/// ten.
pub fn ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let span = high - low;
    if !(span > 0.0) || !span.is_finite() || count == 0 {
        return Vec::new();
    }
    let step = step(span, count);
    let first = (low / step - 1e-6).ceil();
    let last = (high / step + 1e-6).floor();
    // Far from 0 the steps may be lost in rounding: then there is nothing to mark.
    if !(last - first <= 2.0 * count as f64) {
        return Vec::new();
    }
    (0..=(last - first).max(0.0) as usize)
        .map(|i| (first + i as f64) * step)
        .collect()
}

/// The round step that parts `span` into at most `count`.
pub fn step(span: f64, count: usize) -> f64 {
    let raw = span / count.max(1) as f64;
    let power = 10f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|f| f * power >= raw * 0.999);
    factor.unwrap_or(10.0) * power
}

/// A tick's label, with no more digits than the step between ticks needs.
pub fn label(value: f64, step: f64) -> String {
    let size = value.abs().max(step);
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.1e}").replace('-', "−");
    }
    let digits = (-(step * 1.001).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    let is_zero = text
        .trim_start_matches('-')
        .chars()
        .all(|c| "0.".contains(c));
    if is_zero {
        "0".into()
    } else {
        text.replace('-', "−")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(0.0, 1.0, 5).len(), 6);
        assert_eq!(
            ticks(-0.31, 0.29, 6),
            [-0.30000000000000004, -0.2, -0.1, 0.0, 0.1, 0.2]
        );
        assert!(
            ticks(1e6, 1e6 + 1.0, 4)
                .iter()
                .all(|t| (1e6..=1e6 + 1.0).contains(t))
        );
        assert!(ticks(1.0, 1.0, 5).is_empty() && ticks(0.0, f64::NAN, 5).is_empty());
        assert!(ticks(1e30, 1e30 + 1e14, 5).len() < 20);
    }

    #[test]
    fn labels_have_the_digits_of_their_step() {
        assert_eq!(label(0.25, 0.05), "0.25");
        assert_eq!(label(-0.2, 0.1), "−0.2");
        assert_eq!(label(-1e-17, 0.1), "0");
        assert_eq!(label(200.0, 100.0), "200");
        assert_eq!(label(1000000.5, 0.5), "1.0e6");
    }
}
