use std::f64::consts::PI;

use super::midline::Midline;
use super::profile::EEL_HEIGHTS;
use crate::jet::{Jet, U};
use crate::{Shape, SurfaceCoordinate, by_name};

/// Half-width and half-height of the eel, written out from the paper's formulas.
fn eel(s: f64) -> (f64, f64) {
    let (wh, st, wt) = (0.04, 0.95, 0.01);
    let w = if s < wh {
        (2.0 * wh * s - s * s).sqrt()
    } else if s < st {
        wh - (wh - wt) * ((s - wh) / (st - wh)).powi(2)
    } else {
        wt * (1.0 - s) / (1.0 - st)
    };
    (w, 0.08 * (1.0 - ((s - 0.51) / 0.51).powi(2)).sqrt())
}

/// Station, half-width and half-height of a straight fish at `v` of a patch.
fn section(shape: &Shape, patch: u32, v: f64) -> (f64, f64, f64) {
    let at = |u| {
        shape
            .at(SurfaceCoordinate { patch, u, v })
            .expect("a patch")
            .position
    };
    (at(0.0)[0], at(0.0)[1], at(0.25)[2])
}

#[test]
fn the_eel_has_the_widths_and_heights_of_the_formulas() {
    let shape = by_name("eel").expect("a shape");
    for patch in 0..3 {
        for k in 0..=50 {
            let (s, w, h) = section(&shape, patch, f64::from(k) / 50.0);
            let (width, height) = eel(s);
            assert!(
                (w - width).abs() < 1e-15 && (h - height).abs() < 1e-15,
                "{s}: {w} {h}"
            );
        }
    }
}

#[test]
fn the_control_values_of_the_fish_fit_the_eel() {
    let mut fish = by_name("fish").expect("a shape");
    let names: Vec<String> = (1..=8).map(|i| format!("height{i}")).collect();
    fish.set_all(names.iter().map(String::as_str).zip(EEL_HEIGHTS))
        .expect("heights");
    for k in 0..=400 {
        let (s, w, h) = section(&fish, 0, f64::from(k) / 400.0);
        let (width, height) = eel(s);
        // The bound in the documentation of EEL_HEIGHTS.
        assert!(
            (w - width).abs() < 0.0025 && (h - height).abs() < 0.0025,
            "{s}: {w} {h}"
        );
    }
}

#[test]
fn the_nose_is_round_and_the_tail_is_an_edge() {
    let fish = by_name("fish").expect("a shape");
    let (s, w, h) = section(&fish, 0, 1e-4);
    // Round: widths go as √s, so w²/s is of order one of a length, not of s.
    assert!(w * w / s > 0.01 && h * h / s > 0.001, "{s} {w} {h}");
    let (s, w, h) = section(&fish, 0, 1.0);
    assert_eq!((s, w), (1.0, 0.0));
    assert!((h - 0.1052).abs() < 1e-15, "{h}");
}

#[test]
fn bending_keeps_the_volume() {
    for name in ["fish", "eel"] {
        let mut fish = by_name(name).expect("a shape");
        let straight = fish.volume();
        let mut sections = 0.0;
        let n = 4000;
        for patch in 0..fish.patches() as u32 {
            for k in 0..n {
                let place = |k: f64| section(&fish, patch, k / f64::from(n));
                let ((a, ..), (b, ..)) = (place(f64::from(k)), place(f64::from(k + 1)));
                let (_, w, h) = place(f64::from(k) + 0.5);
                sections += PI * w * h * (b - a);
            }
        }
        // The midpoint rule over 4000 sections, against the divergence theorem.
        assert!(
            (straight / sections - 1.0).abs() < 1e-6,
            "{name}: {straight} {sections}"
        );
        fish.set_all([("amplitude", 0.125), ("time", 0.2)])
            .expect("swims");
        assert!(
            (fish.volume() / straight - 1.0).abs() < 1e-9,
            "{name}: {}",
            fish.volume()
        );
    }
}

#[test]
fn the_midline_does_not_stretch_and_follows_carling() {
    let constant = Jet::constant;
    let midline = Midline::new(constant(0.125), constant(1.0), constant(0.0), constant(0.3));
    for k in 1..100 {
        let s = f64::from(k) / 100.0;
        let point = midline.at(Jet::variable(s, U));
        let y = 0.125 * (s + 0.03125) / 1.03125 * (2.0 * PI * (s - 0.3)).sin();
        assert!((point.y.value - y).abs() < 1e-15);
        let (dx, dy) = (point.x.slope[U], point.y.slope[U]);
        // The slope of x is that of a quadrature, exact to rounding.
        assert!((dx.hypot(dy) - 1.0).abs() < 1e-12, "{s}: {dx} {dy}");
        assert!((point.direction[0].value - dx).abs() < 1e-12);
        assert!((point.direction[1].value - dy).abs() < 1e-12);
    }
}

#[test]
fn a_whole_number_of_periods_later_the_fish_is_the_same() {
    let at = |time: f64| {
        let mut fish = by_name("fish").expect("a shape");
        fish.set_all([("amplitude", 0.125), ("time", time)])
            .expect("swims");
        fish.at(SurfaceCoordinate {
            patch: 0,
            u: 0.3,
            v: 0.8,
        })
        .expect("a patch")
        .position
    };
    assert_eq!(at(0.25), at(1_000_000.25));
}
