//! Swimming fish: elliptic sections along an inextensible midline.

mod midline;
mod profile;
mod spline;
#[cfg(test)]
mod tests;

pub use profile::EEL_HEIGHTS;

use crate::jet::{Jet, JetVector};
use crate::kind::{
    Kind, POSITIVE, Parameter, ShapeError, UNIT_OF_LENGTH, concat, parameters, require,
};
use crate::surface::{Surface, turn};
use midline::Midline;
use profile::{Eel, Profile, Spline};

/// Unit of lengths relative to the body.
const OF_LENGTH: &str = "length of the body";

const WIDTH: &str = "control value of the half-widths, from the nose to the tail";
const HEIGHT: &str = "control value of the half-heights, from the nose to the tail";

const LENGTH: [Parameter; 1] = parameters! {
    "length" = 1.0 in POSITIVE, UNIT_OF_LENGTH, "length along the midline";
};

const MOTION: [Parameter; 5] = parameters! {
    "amplitude" = 0.0 in (0.0, 0.5), OF_LENGTH,
        "amplitude of the tail; 0 is straight, 0.125 swims as Carling's eel";
    "wavelength" = 1.0 in (0.2, 10.0), OF_LENGTH, "wavelength of the body wave";
    "carangiform" = 0.0 in (0.0, 1.0), "",
        "amplitude envelope: 0 is Carling's eel, 1 is carangiform, between is a mixture";
    "period" = 1.0 in (1e-6, 1e6), "unit time", "period of the tail beat";
    "time" = 0.0 in (-1e9, 1e9), "unit time", "time at which the body is drawn";
};

const FISH_BODY: [Parameter; 14] = parameters! {
    "width1" = 0.0303 in (1e-4, 0.4), OF_LENGTH, WIDTH;
    "width2" = 0.0450 in (1e-4, 0.4), OF_LENGTH, WIDTH;
    "width3" = 0.0371 in (1e-4, 0.4), OF_LENGTH, WIDTH;
    "width4" = 0.0374 in (1e-4, 0.4), OF_LENGTH, WIDTH;
    "width5" = 0.0226 in (1e-4, 0.4), OF_LENGTH, WIDTH;
    "width6" = 0.0174 in (1e-4, 0.4), OF_LENGTH, WIDTH;
    "height1" = 0.0132 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
    "height2" = 0.0338 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
    "height3" = 0.0668 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
    "height4" = 0.0761 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
    "height5" = 0.0906 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
    "height6" = 0.0158 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
    "height7" = 0.0333 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
    "height8" = 0.1052 in (1e-4, 0.4), OF_LENGTH, HEIGHT;
};

/// Fish with 6 widths and 8 heights as control values of cubic B-splines.
pub(crate) const FISH: Kind = Kind {
    name: "fish",
    summary: "swimming fish along x: 6 widths and 8 heights on B-splines, a tail fin that closes in a \
              sharp edge; velocity; area and volume by quadrature",
    parameters: &concat::<20>(&[&LENGTH, &FISH_BODY, &MOTION]),
    time: Some(19),
    build: |p| {
        let profile = Profile::Spline(Box::new(Spline {
            widths: std::array::from_fn(|i| p[1 + i]),
            heights: std::array::from_fn(|i| p[7 + i]),
        }));
        Fish::build("fish", p[0], profile, std::array::from_fn(|i| p[15 + i]))
    },
};

const EEL_BODY: [Parameter; 5] = parameters! {
    "head" = 0.04 in (0.005, 0.2), OF_LENGTH, "half-width of the head, and where it is reached";
    "tail_start" = 0.95 in (0.5, 0.99), OF_LENGTH, "where the tail begins to close";
    "tail_width" = 0.01 in (1e-4, 0.4), OF_LENGTH, "half-width where the tail begins to close";
    "height" = 0.08 in (1e-3, 0.4), OF_LENGTH, "greatest half-height";
    "height_at" = 0.51 in (0.505, 0.9), OF_LENGTH, "where the body is highest";
};

/// The anguilliform swimmer of Kern & Koumoutsakos (2006).
pub(crate) const EEL: Kind = Kind {
    name: "eel",
    summary: "swimming eel of Kern & Koumoutsakos 2006 along x, thin tail that closes in a sharp edge; \
              velocity; area and volume by quadrature",
    parameters: &concat::<11>(&[&LENGTH, &EEL_BODY, &MOTION]),
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
        let widest = profile.max_half_width();
        let (slope, curvature) = midline.max_slope_and_curvature();
        let refuse = |problem: &str| format!("{name}: {problem}, or raise wavelength");
        require(
            slope <= 0.95,
            &refuse("the midline is too steep for its length; lower amplitude"),
        )?;
        require(
            curvature * widest <= 0.95,
            &refuse("the body folds into itself; lower amplitude or the widths"),
        )?;
        Ok(Box::new(Self {
            length,
            profile,
            midline,
        }))
    }
}

impl Surface for Fish {
    fn patches(&self) -> usize {
        self.profile.patches()
    }

    /// `u` around the section, `v` along the body.
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
