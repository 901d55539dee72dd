//! The midline of a swimming fish: a traveling wave of an inextensible line, in lengths of the body.
//!
//! `y(s, t) = a e(s) sin(2π(s/λ − t/T))` and `dx = √(ds² − dy²)` from the nose, which stays at `x = 0`.
//! The envelope `e`, 1 at the tail, is Carling's `(s + 0.03125)/1.03125` (Carling, Williams & Bowtell
//! 1998; Kern & Koumoutsakos 2006, amplitude 0.125), the carangiform
//! `1 − 0.825(s − 1) + 1.625(s² − 1)` (Maertens, Gao & Triantafyllou 2017, amplitude 0.1), or a mixture.

use std::f64::consts::PI;

use crate::jet::{Jet, U};
use crate::measure::GAUSS;

/// Pieces of the precomputed integral `x(s)`.
const PIECES: usize = 60;

/// A point of the midline and the direction of the line there.
#[derive(Clone, Copy, Debug)]
pub(super) struct MidlinePoint {
    pub x: Jet,
    pub y: Jet,
    /// Cosine and sine of its angle with the x axis.
    pub direction: [Jet; 2],
}

#[derive(Debug)]
pub(super) struct Midline {
    amplitude: Jet,
    /// `2π/λ`.
    wave_number: Jet,
    carangiform: Jet,
    /// `t/T`.
    phase: Jet,
    /// `x` at the ends of the pieces; empty if the line is straight.
    nodes: Vec<Jet>,
}

impl Midline {
    pub fn new(amplitude: Jet, wavelength: Jet, carangiform: Jet, phase: Jet) -> Self {
        let mut midline = Self {
            amplitude,
            wave_number: Jet::constant(2.0 * PI) / wavelength,
            carangiform,
            // Whole periods are removed: far from t = 0 the sine would lose precision.
            phase: phase - phase.value.floor(),
            nodes: Vec::new(),
        };
        if amplitude != Jet::constant(0.0) {
            midline.nodes = midline.integrated();
        }
        midline
    }

    pub fn is_straight(&self) -> bool {
        self.amplitude.value == 0.0
    }

    /// The point at arc length `station`, in `[0, 1]`.
    pub fn at(&self, station: Jet) -> MidlinePoint {
        if self.nodes.is_empty() {
            let (zero, one) = (Jet::constant(0.0), Jet::constant(1.0));
            return MidlinePoint {
                x: station,
                y: zero,
                direction: [one, zero],
            };
        }
        let piece = ((station.value * PIECES as f64) as usize).min(PIECES - 1);
        let from = Jet::constant(piece as f64 / PIECES as f64);
        let [y, slope] = self.wave(station);
        MidlinePoint {
            x: self.nodes[piece] + self.advance(from, station),
            y,
            direction: [(1.0 - slope.squared()).sqrt(), slope],
        }
    }

    /// `y` and `dy/ds`.
    fn wave(&self, s: Jet) -> [Jet; 2] {
        let mix = self.carangiform;
        let eel = (s + 0.031_25) / 1.031_25;
        let other = (s * 1.625 - 0.825) * s + 0.2;
        let envelope = eel + mix * (other - eel);
        let envelope_slope = mix * (s * 3.25 - (0.825 + 1.0 / 1.031_25)) + 1.0 / 1.031_25;
        let (sin, cos) = (self.wave_number * s - self.phase * (2.0 * PI)).sin_cos();
        [
            self.amplitude * envelope * sin,
            self.amplitude * (envelope_slope * sin + envelope * self.wave_number * cos),
        ]
    }

    /// `∫ √(1 − y'²) ds` by Gauss quadrature, exact to rounding over one piece.
    fn advance(&self, from: Jet, to: Jet) -> Jet {
        let half = (to - from) * 0.5;
        let terms = GAUSS.map(|(node, weight)| {
            let [_, slope] = self.wave(from + half * (1.0 + node));
            (1.0 - slope.squared()).sqrt() * weight
        });
        terms
            .into_iter()
            .fold(Jet::constant(0.0), |sum, term| sum + term)
            * half
    }

    fn integrated(&self) -> Vec<Jet> {
        let mut x = Jet::constant(0.0);
        let mut nodes = vec![x];
        for piece in 0..PIECES {
            let ends = [piece, piece + 1].map(|k| Jet::constant(k as f64 / PIECES as f64));
            x = x + self.advance(ends[0], ends[1]);
            nodes.push(x);
        }
        nodes
    }

    /// Largest `|dy/ds|` and largest curvature over the body and the period: whether a motion is valid
    /// does not depend on the time.
    pub fn max_slope_and_curvature(&self) -> (f64, f64) {
        let (mut max_slope, mut max_curvature) = (0.0f64, 0.0f64);
        for phase in 0..24 {
            // Constants, so that the derivative in slot U is that along the body.
            let at = Self {
                amplitude: Jet::constant(self.amplitude.value),
                wave_number: Jet::constant(self.wave_number.value),
                carangiform: Jet::constant(self.carangiform.value),
                phase: Jet::constant(f64::from(phase) / 24.0),
                nodes: vec![],
            };
            for station in 0..=200 {
                let [_, slope] = at.wave(Jet::variable(f64::from(station) / 200.0, U));
                max_slope = max_slope.max(slope.value.abs());
                let cos = (1.0 - slope.value.powi(2)).max(1e-12).sqrt();
                max_curvature = max_curvature.max((slope.slope[U] / cos).abs());
            }
        }
        (max_slope, max_curvature)
    }
}
