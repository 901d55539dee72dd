//! Names, ranges and refused values.

use isograd_shapes::{Density, Sampling, Shape, ShapeError, all, by_name};
use proptest::prelude::*;

use super::shape;

#[test]
fn an_unknown_shape_is_refused_with_the_known_names() {
    let message = by_name("dodo").expect_err("no such shape").to_string();
    for shape in all() {
        assert!(message.contains(shape.name()), "{message}");
    }
}

#[test]
fn an_unknown_parameter_is_refused_with_the_known_names() {
    let mut torus = shape("torus");
    let message = torus.set("hole", 1.0).expect_err("unknown").to_string();
    assert!(message.contains("major, minor"), "{message}");
    assert!(torus.get("hole").is_err());
    assert!(torus.tangent("hole", &[]).is_err());
}

#[test]
fn a_refused_value_changes_nothing() {
    let mut torus = shape("torus");
    let before = torus.values().to_vec();
    for value in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e9] {
        let error = torus.set("minor", value).expect_err("out of range");
        let is_minor = matches!(error, ShapeError::OutOfRange { name: "minor", .. });
        assert!(is_minor, "{error}");
    }
    let error = torus.set("minor", 0.8).expect_err("too large");
    assert!(matches!(error, ShapeError::Combination(_)), "{error}");
    assert_eq!(torus.values(), before);
    let error = shape("vessels")
        .set("generations", 2.5)
        .expect_err("a fraction");
    assert!(matches!(error, ShapeError::NotWhole { .. }), "{error}");
}

#[test]
fn values_that_fit_only_together_are_set_together() {
    let mut torus = shape("torus");
    assert!(torus.set("minor", 2.0).is_err());
    let values = [("minor", 2.0), ("major", 5.0)];
    torus.set_all(values).expect("a torus");
    assert_eq!(torus.get("minor"), Ok(2.0));
}

#[test]
fn bodies_that_intersect_themselves_are_refused_with_a_reason() {
    let folded = [("amplitude", 0.03), ("wavelength", 0.25), ("head", 0.2)];
    for (name, values, word) in [
        ("box", &[("radius", 0.31)][..], "half"),
        ("fish", &[("amplitude", 0.3)], "steep"),
        ("eel", &folded, "folds"),
        ("airliner", &[("nose", 30.0)], "longer"),
        ("car", &[("front_radius", 0.2)], "half"),
        ("car", &[("slant_length", 1.2)], "front"),
        ("car", &[("stilts", 0.05), ("stilt_radius", 0.05)], "fit"),
        ("nacelle", &[("radius", 0.01)], "axis"),
    ] {
        let error = shape(name).set_all(values.iter().copied());
        let message = error.expect_err("refused").to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn defaults_are_in_their_ranges_and_names_are_unique() {
    for shape in all() {
        let parameters: Vec<_> = shape.parameters().map(|(p, _)| p).collect();
        for (i, p) in parameters.iter().enumerate() {
            assert!(
                p.min < p.max && (p.min..=p.max).contains(&p.default),
                "{p:?}"
            );
            assert!(parameters[..i].iter().all(|q| q.name != p.name), "{p:?}");
            let is_allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            assert!(
                !p.meaning.is_empty() && p.name.chars().all(is_allowed),
                "{p:?}"
            );
        }
    }
}

#[test]
fn invalid_samplings_are_refused() {
    let sphere = shape("sphere");
    let refused = |n, density, word: &str| {
        let layout = Sampling::default().layout;
        let samples = sphere.sample::<f32>(n, &Sampling { layout, density }, 1);
        let message = samples.expect_err("refused").to_string();
        assert!(message.contains(word), "{message}");
    };
    refused(usize::MAX, Density::Uniform, "fewer");
    for (axis, ratio) in [(3, 2.0), (0, 0.0), (0, f64::NAN), (1, -1.0), (2, 1e9)] {
        refused(5, Density::Gradient { axis, ratio }, "ratio");
    }
}

/// A value of a parameter: its default times a power of ten, or anything in its range.
fn value(min: f64, max: f64, default: f64, kind: u8, share: f64) -> f64 {
    match kind {
        0 => (default * 10f64.powf(2.0 * share - 1.0)).clamp(min, max),
        1 => min + share * (max - min),
        2 => min,
        3 => max,
        _ => default,
    }
}

fn changed(index: usize, kinds: &[u8], shares: &[f64]) -> Option<Shape> {
    let mut shape = all().swap_remove(index);
    let parameters: Vec<_> = shape.parameters().map(|(p, _)| *p).collect();
    let rows = parameters.iter().zip(kinds).zip(shares);
    let changes = rows.map(|((p, &kind), &share)| {
        // Eight generations are 255 branches: valid, but slow to sample.
        let max = if p.whole { 3.0 } else { p.max };
        let value = value(p.min, max, p.default, kind, share);
        (p.name, if p.whole { value.round() } else { value })
    });
    shape.set_all(changes).ok().map(|()| shape)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]
    #[test]
    fn any_values_are_refused_or_give_finite_samples_with_unit_normals(
        index in 0usize..10,
        kinds in prop::collection::vec(0u8..7, 24),
        shares in prop::collection::vec(0.0f64..1.0, 24),
    ) {
        if let Some(shape) = changed(index, &kinds, &shares)
            && let Ok(samples) = shape.sample::<f64>(40, &Sampling::default(), 1)
        {
            prop_assert_eq!(samples.cloud.len(), 40);
            for (x, n) in samples.cloud.points().iter().zip(samples.cloud.normals().unwrap_or(&[])) {
                prop_assert!(x.iter().all(|c| c.is_finite()));
                prop_assert!((isograd_element::vector::norm(*n) - 1.0).abs() < 1e-12);
                shape.distance(*x);
                shape.contains(*x);
            }
        }
    }
}
