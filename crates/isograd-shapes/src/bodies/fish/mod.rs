//! Swimming fish: elliptic sections along an inextensible midline.

mod midline;
mod profile;
mod spline;
#[cfg(test)]
mod tests;

pub use profile::EEL_HEIGHTS;

use crate::jet::{Jet, JetVector};
use crate::kind::{Kind, Parameter, ShapeError, length, number};
use crate::surface::{Surface, turn};
use midline::Midline;
use profile::{Eel, Profile, Spline};

/// Share of the body's length.
const OF_LENGTH: &str = "length of the body";

/// A half-width or half-height.
const fn half(name: &'static str, meaning: &'static str, default: f64) -> Parameter {
    number(name, meaning, OF_LENGTH, default, (1e-4, 0.4))
}

const WIDTH: &str = "control value of the half-widths, from the nose to the tail";
const HEIGHT: &str = "control value of the half-heights, from the nose to the tail";

const LENGTH: Parameter = length("length", "length along the midline", 1.0);
const AMPLITUDE: Parameter = number(
    "amplitude",
    "amplitude of the tail; 0 is straight, 0.125 swims as Carling's eel",
    OF_LENGTH,
    0.0,
    (0.0, 0.5),
);
const WAVELENGTH: Parameter = number(
    "wavelength",
    "wavelength of the body wave",
    OF_LENGTH,
    1.0,
    (0.2, 10.0),
);
const CARANGIFORM: Parameter = number(
    "carangiform",
    "amplitude envelope: 0 is Carling's eel, 1 is carangiform, between is a mixture",
    "",
    0.0,
    (0.0, 1.0),
);
const PERIOD: Parameter = number(
    "period",
    "period of the tail beat",
    "unit time",
    1.0,
    (1e-6, 1e6),
);
const TIME: Parameter = number(
    "time",
    "time at which the body is drawn",
    "unit time",
    0.0,
    (-1e9, 1e9),
);

/// Fish with 6 widths and 8 heights as control values of cubic B-splines.
pub(crate) const FISH: Kind = Kind {
    name: "fish",
    summary: "swimming fish along x: 6 widths and 8 heights on B-splines, a tail fin that closes in a \
              sharp edge; velocity; area and volume by quadrature",
    parameters: &[
        LENGTH,
        half("width1", WIDTH, 0.0303),
        half("width2", WIDTH, 0.0450),
        half("width3", WIDTH, 0.0371),
        half("width4", WIDTH, 0.0374),
        half("width5", WIDTH, 0.0226),
        half("width6", WIDTH, 0.0174),
        half("height1", HEIGHT, 0.0132),
        half("height2", HEIGHT, 0.0338),
        half("height3", HEIGHT, 0.0668),
        half("height4", HEIGHT, 0.0761),
        half("height5", HEIGHT, 0.0906),
        half("height6", HEIGHT, 0.0158),
        half("height7", HEIGHT, 0.0333),
        half("height8", HEIGHT, 0.1052),
        AMPLITUDE,
        WAVELENGTH,
        CARANGIFORM,
        PERIOD,
        TIME,
    ],
    time: Some(19),
    build: |p| {
        let profile = Profile::Spline(Box::new(Spline {
            widths: std::array::from_fn(|i| p[1 + i]),
            heights: std::array::from_fn(|i| p[7 + i]),
        }));
        Fish::build("fish", p[0], profile, std::array::from_fn(|i| p[15 + i]))
    },
};

/// The anguilliform swimmer of Kern & Koumoutsakos (2006).
pub(crate) const EEL: Kind = Kind {
    name: "eel",
    summary: "swimming eel of Kern & Koumoutsakos 2006 along x, thin tail that closes in a sharp edge; \
              velocity; area and volume by quadrature",
    parameters: &[
        LENGTH,
        number(
            "head",
            "half-width of the head, and where it is reached",
            OF_LENGTH,
            0.04,
            (0.005, 0.2),
        ),
        number(
            "tail_start",
            "where the tail begins to close",
            OF_LENGTH,
            0.95,
            (0.5, 0.99),
        ),
        half(
            "tail_width",
            "half-width where the tail begins to close",
            0.01,
        ),
        number(
            "height",
            "greatest half-height",
            OF_LENGTH,
            0.08,
            (1e-3, 0.4),
        ),
        number(
            "height_at",
            "where the body is highest",
            OF_LENGTH,
            0.51,
            (0.505, 0.9),
        ),
        AMPLITUDE,
        WAVELENGTH,
        CARANGIFORM,
        PERIOD,
        TIME,
    ],
    time: Some(10),
    build: |p| {
        let profile = Profile::Eel(Box::new(Eel {
            head: p[1],
            tail_start: p[2],
            tail_width: p[3],
            height: p[4],
            height_at: p[5],
        }));
        Fish::build("eel", p[0], profile, std::array::from_fn(|i| p[6 + i]))
    },
};

/// A body of elliptic sections: nose at the origin, `x` toward the tail, `y` sideways, `z` up.
#[derive(Debug)]
struct Fish {
    length: Jet,
    profile: Profile,
    midline: Midline,
}

impl Fish {
    fn build(
        name: &str,
        length: Jet,
        profile: Profile,
        [amplitude, wavelength, carangiform, period, time]: [Jet; 5],
    ) -> Result<Box<dyn Surface>, ShapeError> {
        let phase = time / period;
        let midline = Midline::new(amplitude, wavelength, carangiform, phase);
        let widest = profile.widest();
        match midline.steepest_and_sharpest() {
            (steepest, _) if steepest > 0.95 => Err(ShapeError::Combination(format!(
                "{name}: the midline is too steep for its length; lower amplitude or raise wavelength"
            ))),
            (_, sharpest) if sharpest * widest > 0.95 => Err(ShapeError::Combination(format!(
                "{name}: the body folds into itself; lower amplitude or the widths, or raise wavelength"
            ))),
            _ => Ok(Box::new(Self {
                length,
                profile,
                midline,
            })),
        }
    }
}

impl Surface for Fish {
    fn patches(&self) -> usize {
        self.profile.patches()
    }

    /// `u` round the section, `v` along the body.
    fn map(&self, patch: usize, u: Jet, v: Jet) -> JetVector {
        let section = self.profile.section(patch, v);
        let (sideways, up) = turn(u);
        let center = self.midline.at(section.station);
        let across = section.half_width * sideways;
        let [cos, sin] = center.direction;
        [
            (center.x - across * sin) * self.length,
            (center.y + across * cos) * self.length,
            section.half_height * up * self.length,
        ]
    }

    /// Known for the straight fish.
    fn contains(&self, point: [f64; 3]) -> Option<bool> {
        if !self.midline.is_straight() {
            return None;
        }
        let [station, y, z] = point.map(|x| x / self.length.value);
        let Some((width, height)) = self.profile.at_station(station) else {
            return Some(false);
        };
        Some((y / width).powi(2) + (z / height).powi(2) < 1.0)
    }
}
