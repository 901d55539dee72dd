//! Straight lines through measured values.

/// Exponent `k` of the power law `y = c x^k` that fits best: least squares of the logarithms. `NaN` for fewer than
/// two different `x`.
pub fn exponent(pairs: &[[f64; 2]]) -> f64 {
    let logarithms: Vec<[f64; 2]> = pairs.iter().map(|pair| pair.map(f64::ln)).collect();
    let n = logarithms.len() as f64;
    let mean = |a: usize| logarithms.iter().map(|pair| pair[a]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let moment = |a: usize, b: usize| -> f64 {
        let terms = logarithms.iter().map(|pair| {
            let off = [pair[0] - x, pair[1] - y];
            off[a] * off[b]
        });
        terms.sum()
    };
    moment(0, 1) / moment(0, 0)
}

#[cfg(test)]
mod tests {
    use super::exponent;

    #[test]
    fn the_exponent_of_a_power_is_found_and_that_of_one_point_is_none() {
        let power = |x: f64| [x, 3.0 * x.powf(1.25)];
        let found = exponent(&[1e4, 1e5, 3e6].map(power));
        assert!((found - 1.25).abs() < 1e-12, "{found}");
        assert!(exponent(&[[1.0, 2.0]]).is_nan());
    }
}
