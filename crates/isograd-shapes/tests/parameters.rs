//! Names, ranges and what is refused.

use isograd_shapes::{Density, Sampling, Shape, ShapeError, all, by_name};
use proptest::prelude::*;

#[test]
fn an_unknown_shape_is_told_the_names() {
    let message = by_name("dodo").expect_err("no such shape").to_string();
    for shape in all() {
        assert!(message.contains(shape.name()), "{message}");
    }
}

#[test]
fn an_unknown_parameter_is_told_the_names() {
    let mut torus = by_name("torus").expect("a shape");
    let message = torus
        .set("hole", 1.0)
        .expect_err("no such parameter")
        .to_string();
    assert!(
        message.contains("major") && message.contains("minor"),
        "{message}"
    );
    assert!(torus.get("hole").is_err());
    assert!(torus.tangent("hole", &[]).is_err());
}

#[test]
fn a_refused_value_changes_nothing() {
    let mut torus = by_name("torus").expect("a shape");
    let before = torus.values().to_vec();
    for value in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e9] {
        let refused = torus.set("minor", value).expect_err("out of range");
        assert!(
            matches!(refused, ShapeError::OutOfRange { name: "minor", .. }),
            "{refused}"
        );
    }
    assert!(matches!(
        torus.set("minor", 0.8),
        Err(ShapeError::Combination(_))
    ));
    assert_eq!(torus.values(), before);
    let mut vessels = by_name("vessels").expect("a shape");
    assert!(matches!(
        vessels.set("generations", 2.5),
        Err(ShapeError::NotWhole { .. })
    ));
}

#[test]
fn values_that_fit_only_together_are_set_together() {
    let mut torus = by_name("torus").expect("a shape");
    assert!(torus.set("minor", 2.0).is_err());
    torus
        .set_all([("minor", 2.0), ("major", 5.0)])
        .expect("a torus");
    assert_eq!(torus.get("minor"), Ok(2.0));
}

#[test]
fn bodies_that_cut_themselves_are_refused_with_a_reason() {
    let refused = |name: &str, values: &[(&str, f64)], word: &str| {
        let mut shape = by_name(name).expect("a shape");
        let message = shape
            .set_all(values.iter().copied())
            .expect_err("refused")
            .to_string();
        assert!(message.contains(word), "{message}");
    };
    refused("box", &[("radius", 0.31)], "half");
    refused("fish", &[("amplitude", 0.3)], "steep");
    refused(
        "eel",
        &[("amplitude", 0.03), ("wavelength", 0.25), ("head", 0.2)],
        "folds",
    );
    refused("airliner", &[("nose", 30.0)], "longer");
    refused("car", &[("front_radius", 0.2)], "half");
    refused("car", &[("slant_length", 1.2)], "front");
    refused("car", &[("stilts", 0.05), ("stilt_radius", 0.05)], "fit");
    refused("nacelle", &[("radius", 0.01)], "axis");
}

#[test]
fn defaults_are_in_their_ranges_and_names_are_unique() {
    for shape in all() {
        let parameters: Vec<_> = shape.parameters().map(|(p, _)| p).collect();
        for (i, p) in parameters.iter().enumerate() {
            assert!(
                p.min < p.max && p.min <= p.default && p.default <= p.max,
                "{p:?}"
            );
            assert!(parameters[..i].iter().all(|q| q.name != p.name), "{p:?}");
            assert!(
                !p.meaning.is_empty()
                    && p.name
                        .chars()
                        .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
            );
        }
    }
}

#[test]
fn bad_samplings_are_refused() {
    let sphere = by_name("sphere").expect("a shape");
    let draw = |n, density| {
        let sampling = Sampling {
            density,
            ..Sampling::default()
        };
        sphere
            .sample::<f32>(n, &sampling, 1)
            .map(|s| s.cloud.len())
            .map_err(|e| e.to_string())
    };
    assert!(
        draw(usize::MAX, Density::Uniform)
            .expect_err("too many")
            .contains("fewer")
    );
    for (axis, ratio) in [(3, 2.0), (0, 0.0), (0, f64::NAN), (1, -1.0), (2, 1e9)] {
        assert!(
            draw(5, Density::Gradient { axis, ratio })
                .expect_err("refused")
                .contains("ratio")
        );
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
    let changes = parameters
        .iter()
        .zip(kinds)
        .zip(shares)
        .map(|((p, &kind), &share)| {
            // Eight generations are 255 branches: right, but slow to sample five hundred times.
            let value = value(
                p.min,
                if p.whole { 3.0 } else { p.max },
                p.default,
                kind,
                share,
            );
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
