//! Text forms of the options, as the command line, Python and JSON write them: a choice is its name, a number is itself,
//! `auto` and `full` are words.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use serde::de::{Deserialize, Deserializer, Error, Visitor};

use super::{Solve, SurfaceResolution};
use crate::backend::Backend;
use crate::data::Outliers;
use crate::distance::Band;
use crate::isosurface::Level;
use crate::isosurface::trim::Trim;
use crate::neighbors::Radius;
use crate::orient::{Method, ParityOptions};
use crate::poisson::{Smoothing, Walls};
use crate::sheet::Sheet;
use crate::splat::Weights;

/// A text that is no value of an option.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{option} is '{text}'; give {expected}")]
pub struct ParseOptionError {
    option: &'static str,
    text: String,
    expected: &'static str,
}

/// Implements `FromStr` for an option with named values and, optionally, numbers in a range.
macro_rules! from_str {
    ($type:ty, $option:literal, $expected:literal, { $($name:literal => $value:expr,)+ } $(, $range:expr => $number:expr)?) => {
        impl FromStr for $type {
            type Err = ParseOptionError;

            fn from_str(text: &str) -> Result<Self, ParseOptionError> {
                match text {
                    $($name => return Ok($value),)+
                    _ => {}
                }
                $(if let Ok(number) = text.trim().parse::<f64>() && number.is_finite() && $range(number) {
                    return Ok($number(number));
                })?
                Err(ParseOptionError { option: $option, text: text.into(), expected: $expected })
            }
        }
    };
}

impl FromStr for Radius {
    type Err = ParseOptionError;

    fn from_str(text: &str) -> Result<Self, ParseOptionError> {
        let length = |text: &str| {
            let length = text.trim().parse::<f64>().ok();
            length.filter(|&r| r > 0.0 && r.is_finite())
        };
        let value = match (text, text.strip_prefix("cut:")) {
            ("auto", _) => Some(Self::Auto),
            (_, Some(radius)) => length(radius).map(Self::Cut),
            (radius, None) => length(radius).map(Self::Fixed),
        };
        value.ok_or(ParseOptionError {
            option: "radius",
            text: text.into(),
            expected: "a finite length above 0, or 'auto'; 'cut:' before the length for the paper's weights",
        })
    }
}

from_str!(Method, "orient", "'auto', 'parity', 'given', 'signs', 'sensors' or 'previous'", {
    "auto" => Self::Auto,
    "parity" => Self::Parity(ParityOptions::default()),
    "given" => Self::Given,
    "signs" => Self::Signs,
    "sensors" => Self::Sensors,
    "previous" => Self::Previous,
});
from_str!(Weights, "splat", "'bspline' or 'paper'", {
    "bspline" => Self::BSpline,
    "paper" => Self::Paper,
});
from_str!(Smoothing, "smoothing", "0 or more cells, or 'auto'", {
    "auto" => Self::Auto,
}, |cells: f64| cells >= 0.0 => Self::Cells);
from_str!(Level, "level", "'thin', 'local' or 'mean'", {
    "local" => Self::Local,
    "thin" => Self::Thin,
    "mean" => Self::Mean,
});
from_str!(Solve, "solve", "'auto', 'dense' or 'sparse'", {
    "auto" => Self::Auto,
    "dense" => Self::Dense,
    "sparse" => Self::Sparse,
});
impl FromStr for SurfaceResolution {
    type Err = ParseOptionError;

    fn from_str(text: &str) -> Result<Self, ParseOptionError> {
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let value = match text {
            "grid" => Some(Self::Grid),
            "auto" => Some(Self::Auto),
            _ => match text.strip_suffix('x') {
                Some(factor) => number(factor).map(Self::Factor),
                None => number(text).map(Self::Spacing),
            },
        };
        value.filter(|v| v.is_valid()).ok_or(ParseOptionError {
            option: "surface",
            text: text.into(),
            expected: "'grid', 'auto', a cell size above 0 in the cloud's unit, or how many times as fine as the grid of φ, from 1/64 to 64, such as 2x",
        })
    }
}

from_str!(Walls, "walls", "'auto', 'free' or 'closed'", {
    "auto" => Self::Auto,
    "free" => Self::Free,
    "closed" => Self::Closed,
});
from_str!(Trim, "trim", "a finite distance above 0, 'auto' or 'off'", {
    "off" => Self::Off,
    "auto" => Self::Auto,
}, |distance: f64| distance > 0.0 => Self::Distance);
from_str!(Sheet, "sheet", "a finite thickness above 0, or 'off'", {
    "off" => Self::Off,
}, |thickness: f64| thickness > 0.0 => Self::Thickness);
from_str!(Outliers, "outliers", "'ignore' or 'keep'", {
    "ignore" => Self::Ignore,
    "keep" => Self::Keep,
});
from_str!(Band, "band", "a finite length above 0, or 'full'", {
    "full" => Self::Full,
}, |length: f64| length > 0.0 => Self::Within);

/// Reads a text or a number through `FromStr`.
struct TextVisitor<V>(PhantomData<V>);

impl<V: FromStr<Err: fmt::Display>> Visitor<'_> for TextVisitor<V> {
    type Value = V;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a text or a number")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<V, E> {
        text.parse().map_err(E::custom)
    }

    // The text of a number reads back to the same bits.
    fn visit_f64<E: Error>(self, number: f64) -> Result<V, E> {
        self.visit_str(&number.to_string())
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<V, E> {
        self.visit_str(&number.to_string())
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<V, E> {
        self.visit_str(&number.to_string())
    }
}

macro_rules! deserialize {
    ($($type:ty),+) => {$(
        impl<'de> Deserialize<'de> for $type {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                from.deserialize_any(TextVisitor(PhantomData))
            }
        }
    )+};
}
deserialize!(
    Radius,
    Method,
    Weights,
    Smoothing,
    Level,
    SurfaceResolution,
    Solve,
    Walls,
    Trim,
    Sheet,
    Outliers,
    Band,
    Backend
);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Options;

    #[test]
    fn options_read_from_json_with_the_names_of_the_command_line() {
        let text = r#"{"radius": 0.1, "orient": "signs", "splat": "paper", "area": false, "smoothing": 0,
            "screening": 4, "level": "thin", "surface": "1.5x", "solve": "sparse", "walls": "free", "trim": 0.5, "sheet": 1,
            "outliers": "keep", "band": 0.30000000000000004, "checks": false}"#;
        let options: Options = serde_json::from_str(text).expect("valid");
        let expected = Options::default()
            .radius(Radius::Fixed(0.1))
            .orient(Method::Signs)
            .splat(Weights::Paper)
            .area(false)
            .smoothing(Smoothing::Cells(0.0))
            .screening(4.0)
            .level(Level::Thin)
            .surface(SurfaceResolution::Factor(1.5))
            .solve(Solve::Sparse)
            .walls(Walls::Free)
            .trim(Trim::Distance(0.5))
            .sheet(Sheet::Thickness(1.0))
            .outliers(Outliers::Keep)
            .band(Band::Within(0.1 + 0.2))
            .checks(false);
        assert_eq!(options, expected);
        let text = r#"{"radius": "auto", "smoothing": "auto", "surface": "auto", "band": "full"}"#;
        let options: Options = serde_json::from_str(text).expect("valid");
        assert_eq!(options, Options::default());
        let options: Options = serde_json::from_str(r#"{"radius": "cut:0.5"}"#).expect("valid");
        assert_eq!(options.radius, Radius::Cut(0.5));
    }

    #[test]
    fn an_invalid_option_is_an_error_that_names_it() {
        for (text, message) in [
            (
                r#"{"radius": 0}"#,
                "radius is '0'; give a finite length above 0, or 'auto'; 'cut:' before the length for the paper's weights",
            ),
            (r#"{"radius": "wide"}"#, "radius is 'wide'"),
            (r#"{"radius": "cut:-1"}"#, "radius is 'cut:-1'"),
            (
                r#"{"smoothing": -1}"#,
                "smoothing is '-1'; give 0 or more cells",
            ),
            (r#"{"band": 1e999}"#, "number out of range"),
            (
                r#"{"surface": "65x"}"#,
                "surface is '65x'; give 'grid', 'auto'",
            ),
            (r#"{"surface": -1}"#, "surface is '-1'"),
            (r#"{"solve": "fast"}"#, "give 'auto', 'dense' or 'sparse'"),
            (r#"{"level": "global"}"#, "give 'thin', 'local' or 'mean'"),
            (r#"{"smothing": 1}"#, "unknown field `smothing`"),
        ] {
            let error = serde_json::from_str::<Options>(text).expect_err(text);
            assert!(error.to_string().contains(message), "{error}");
        }
    }
}
