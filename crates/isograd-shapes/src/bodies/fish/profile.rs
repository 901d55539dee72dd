//! Half-widths and half-heights of the sections along a fish, in lengths of its body.

use super::spline::cubic;
use crate::jet::Jet;
use crate::surface::between;

/// Height control values (`height1` to `height8`) that give the fish the heights of the eel. With them
/// and its default widths, the fish has the eel's widths and heights within 0.0025 of its length (least
/// squares over the spline's variable).
pub const EEL_HEIGHTS: [f64; 8] = [
    0.0108, 0.0316, 0.0578, 0.0754, 0.0827, 0.0739, 0.0540, 0.0242,
];

/// One section of the body, in lengths of the body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// Distance from the nose along the midline.
    pub station: Jet,
    pub half_width: Jet,
    pub half_height: Jet,
}

#[derive(Debug)]
pub(super) enum Profile {
    Spline(Box<Spline>),
    Eel(Box<Eel>),
}

/// Cubic B-splines in a variable `q` with `s = q²(3 − q)/2`: as `√s` at the nose, which is therefore
/// round, and as `s` at the tail. Widths are 0 at both ends, heights at the nose alone.
#[derive(Debug)]
pub(super) struct Spline {
    pub widths: [Jet; 6],
    pub heights: [Jet; 8],
}

/// Kern & Koumoutsakos 2006 as in CubismUP_3D: a round head, a parabola, a wedge; heights are half
/// an ellipse cut short by the tail.
#[derive(Debug)]
pub(super) struct Eel {
    pub head: Jet,
    pub tail_start: Jet,
    pub tail_width: Jet,
    pub height: Jet,
    pub height_at: Jet,
}

impl Profile {
    /// Pieces along the body, each smooth.
    pub fn patches(&self) -> usize {
        match self {
            Profile::Spline(_) => 1,
            Profile::Eel(_) => 3,
        }
    }

    /// The section at `q` in `[0, 1]` of a patch, from nose to tail.
    pub fn section(&self, patch: usize, q: Jet) -> Section {
        match self {
            Profile::Spline(spline) => spline.section(q),
            Profile::Eel(eel) => eel.section(patch, q),
        }
    }

    /// Half-width and half-height at a distance from the nose; `None` outside the body.
    pub fn at_station(&self, station: f64) -> Option<(f64, f64)> {
        if !(station > 0.0 && station < 1.0) {
            return None;
        }
        let at = |patch, q| self.section(patch, Jet::constant(q));
        let patch = (0..self.patches()).find(|&patch| station <= at(patch, 1.0).station.value)?;
        let (mut low, mut high) = (0.0, 1.0);
        // One bisection per bit of the mantissa.
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (low + high);
            if at(patch, middle).station.value < station {
                low = middle
            } else {
                high = middle
            }
        }
        let section = at(patch, 0.5 * (low + high));
        Some((section.half_width.value, section.half_height.value))
    }

    /// Largest half-width.
    pub fn max_half_width(&self) -> f64 {
        let along = (0..self.patches()).flat_map(|patch| (0..=100).map(move |k| (patch, k)));
        let width = |(patch, k)| {
            self.section(patch, Jet::constant(f64::from(k) / 100.0))
                .half_width
                .value
        };
        along.map(width).fold(0.0, f64::max)
    }
}

impl Spline {
    fn section(&self, q: Jet) -> Section {
        let mut w = [Jet::constant(0.0); 8];
        let mut h = [Jet::constant(0.0); 9];
        w[1..7].copy_from_slice(&self.widths);
        h[1..9].copy_from_slice(&self.heights);
        Section {
            station: q.squared() * (3.0 - q) * 0.5,
            half_width: cubic(&w, q),
            half_height: cubic(&h, q),
        }
    }
}

impl Eel {
    fn section(&self, patch: usize, q: Jet) -> Section {
        let Self {
            head,
            tail_start,
            tail_width,
            ..
        } = *self;
        let (station, half_width) = match patch {
            0 => (head * q.squared(), head * q * (2.0 - q.squared()).sqrt()),
            1 => (
                between(q, head, tail_start),
                head - (head - tail_width) * q.squared(),
            ),
            _ => (
                between(q, tail_start, Jet::constant(1.0)),
                tail_width * (1.0 - q),
            ),
        };
        // On the head √s is written as √head·q, which is smooth at the nose.
        let root = if patch == 0 {
            q * head.sqrt()
        } else {
            station.sqrt()
        };
        let rest = (self.height_at * 2.0 - station).sqrt();
        Section {
            station,
            half_width,
            half_height: self.height / self.height_at * root * rest,
        }
    }
}
