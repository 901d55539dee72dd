//! How much the indicator is smoothed.

/// Cells of smoothing for each cell of distance between samples. Errors of the vertices of a torus, in cells, mean
/// and maximum, with the local iso-value:
///
/// | samples apart | no smoothing | 0.8 of that | 1.2 of that |
/// |---|---|---|---|
/// | 0.32 cells | 0.0097, 0.036 | 0.0092, 0.032 | 0.0086, 0.028 |
/// | 0.64 cells | 0.0081, 0.062 | 0.0061, 0.044 | 0.0050, 0.032 |
/// | 1.28 cells | 0.0147, 0.144 | 0.0045, 0.041 | 0.0031, 0.046 |
///
/// More would smooth thin parts away where noise keeps the iso-value from following the samples.
const PER_SPACING: f64 = 0.8;

/// Width `σ` of the Gaussian that the indicator is smoothed with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Smoothing {
    /// 0.8 of the typical distance between samples: what is between them is not known, and ripples otherwise.
    #[default]
    Auto,
    /// This many cells; 0 for none.
    Cells(f64),
}

impl Smoothing {
    /// `σ` in cells, for samples that are `spacing` cells apart.
    pub fn cells(self, spacing: f64) -> f64 {
        match self {
            Self::Auto if spacing.is_finite() => PER_SPACING * spacing,
            Self::Auto => 0.0,
            Self::Cells(cells) => cells,
        }
    }

    /// Whether it is a width: finite, and 0 or more.
    pub fn is_valid(self) -> bool {
        match self {
            Self::Auto => true,
            Self::Cells(cells) => cells >= 0.0 && cells.is_finite(),
        }
    }
}
