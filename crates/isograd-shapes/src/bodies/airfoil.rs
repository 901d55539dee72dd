//! NACA four-digit sections with a closed trailing edge.

use crate::jet::Jet;

/// Factors of `√x, x, x², x³, x⁴` in the half-thickness `5t(…)` of a NACA four-digit section, the last
/// one −0.1036 (not −0.1015), which closes the trailing edge.
pub(crate) const NACA: [f64; 5] = [0.2969, -0.1260, -0.3516, 0.2843, -0.1036];

/// Half-thickness of a section of unit chord and thickness `t` at `x = root²`. Smooth in `root`.
pub(crate) fn half_thickness(t: Jet, root: Jet) -> Jet {
    let x = root.squared();
    let rest = (((x * NACA[4] + NACA[3]) * x + NACA[2]) * x + NACA[1]) * x;
    (root * NACA[0] + rest) * t * 5.0
}

/// Value of [`half_thickness`] at `x`.
pub(crate) fn half_thickness_at(t: f64, x: f64) -> f64 {
    half_thickness(Jet::constant(t), Jet::constant(x.max(0.0).sqrt())).value
}

/// Camber line with its maximum `m` at `p`: two parabolas that join there.
pub(crate) fn camber(m: Jet, p: f64, x: Jet) -> Jet {
    if x.value < p {
        m * (x * (2.0 * p) - x.squared()) / (p * p)
    } else {
        m * (x * (2.0 * p) - x.squared() + (1.0 - 2.0 * p)) / ((1.0 - p) * (1.0 - p))
    }
}

/// Area of a section of unit chord and unit thickness, and the `x` of its centroid.
pub(crate) fn area_and_centroid() -> (f64, f64) {
    const POWERS: [f64; 5] = [0.5, 1.0, 2.0, 3.0, 4.0];
    let moment = |order: f64| -> f64 {
        let terms = NACA.iter().zip(POWERS);
        terms
            .map(|(c, power)| 10.0 * c / (power + order + 1.0))
            .sum()
    };
    (moment(0.0), moment(1.0) / moment(0.0))
}
