//! Properties of every shape, at its defaults and with other parameters.

use isograd_element::vector::{add, cross, dot, norm, normalized, scale, sub};
use isograd_shapes::{Sampling, Shape, SurfaceCoordinate, all};

use super::{RANDOM, shape, with};

/// Every shape at its defaults, and some with other parameters.
fn shapes() -> Vec<Shape> {
    let mut shapes = all();
    shapes.extend([
        with("box", &[("radius", 0.0)]),
        with("box", &[("radius", 0.3)]),
        with("ellipsoid", &[("a", 0.3), ("b", 0.3), ("c", 0.9)]),
        with("fish", &SWIMMING),
        with("eel", &CARANGIFORM),
        with("airliner", &SWEPT_FORWARD),
        with("car", &[("stilts", 0.05), ("slant", 35.0)]),
        with("nacelle", &[("incidence", -8.0), ("thickness", 0.2)]),
        with("vessels", &TREE),
    ]);
    shapes
}

const SWIMMING: [(&str, f64); 3] = [("amplitude", 0.125), ("time", 0.3), ("length", 2.0)];
const CARANGIFORM: [(&str, f64); 4] = [
    ("amplitude", 0.1),
    ("carangiform", 1.0),
    ("time", 5.7),
    ("period", 2.0),
];
const SWEPT_FORWARD: [(&str, f64); 3] = [("dihedral", -4.0), ("sweep", -20.0), ("camber", 0.05)];
const TREE: [(&str, f64); 3] = [("generations", 3.0), ("taper", 0.8), ("asymmetry", 0.6)];

fn size(points: &[[f64; 3]]) -> f64 {
    let extent = |a: usize| {
        let along = points.iter().map(|p| p[a]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    };
    extent(0).max(extent(1)).max(extent(2))
}

fn position(shape: &Shape, patch: u32, u: f64, v: f64) -> [f64; 3] {
    shape
        .at(SurfaceCoordinate { patch, u, v })
        .expect("a patch")
        .position
}

/// Points, normals and coordinates of `n` random samples.
fn samples(
    shape: &Shape,
    n: usize,
    seed: u64,
) -> (Vec<[f64; 3]>, Vec<[f64; 3]>, Vec<SurfaceCoordinate>) {
    let s = shape.sample::<f64>(n, &RANDOM, seed).expect("samples");
    let normals = s.cloud.normals().expect("normals").to_vec();
    (s.cloud.points().to_vec(), normals, s.coordinates)
}

#[test]
fn every_kind_is_listed_and_sampled_with_the_requested_number() {
    let names: Vec<_> = all().iter().map(Shape::name).collect();
    let expected = "sphere ellipsoid torus knot box fish eel airliner car nacelle vessels";
    assert_eq!(names.join(" "), expected);
    for shape in shapes() {
        for n in [0, 1, 7, 500] {
            for sampling in [RANDOM, Sampling::default()] {
                let s = shape.sample::<f32>(n, &sampling, 3).expect("samples");
                assert_eq!(s.cloud.len(), n, "{shape:?}");
                assert_eq!(s.coordinates.len(), n);
            }
        }
    }
}

#[test]
fn normals_are_unit_and_perpendicular_to_finite_differences_of_the_map() {
    for shape in shapes() {
        let (points, normals, coordinates) = samples(&shape, 300, 5);
        let size = size(&points);
        for ((x, n), c) in points.iter().zip(&normals).zip(coordinates) {
            assert!((norm(*n) - 1.0).abs() < 1e-14);
            assert_eq!(
                position(&shape, c.patch, c.u, c.v),
                *x,
                "the coordinate gives the sample"
            );
            let e = 1e-5 * c.u.min(1.0 - c.u).min(c.v).min(1.0 - c.v);
            let along = |du: f64, dv: f64| {
                let to = position(&shape, c.patch, c.u + du, c.v + dv);
                sub(to, position(&shape, c.patch, c.u - du, c.v - dv))
            };
            let by_differences = normalized(cross(along(e, 0.0), along(0.0, e)));
            // Rounding of coordinates of the size of the body over steps of e.
            let tolerance = 1e-6 + 1e-14 * size / e;
            if let Some(m) = by_differences {
                assert!(norm(sub(m, *n)) < tolerance, "{shape:?} {c:?} {n:?} {m:?}");
            }
        }
    }
}

#[test]
fn samples_have_distance_zero_and_the_distance_grows_along_their_normals() {
    for shape in shapes() {
        let (points, normals, _) = samples(&shape, 400, 7);
        if shape.distance(points[0]).is_none() {
            continue;
        }
        let size = size(&points);
        for (x, n) in points.iter().zip(&normals) {
            // 1e-12 is the bound of the nacelle; the others are exact to rounding.
            let on = shape
                .distance(*x)
                .expect("known outside and on the surface");
            assert!(on.abs() < 1e-12 * size, "{shape:?} {x:?}: {on}");
            let step = 1e-3 * size;
            let off = shape
                .distance(add(*x, scale(*n, step)))
                .expect("known outside");
            // Near concave regions another part may be closer: within a thousandth of the size only at the
            // sharp joints of the vessels.
            let exact = (off - step).abs() < 1e-12 * size;
            assert!(
                exact || shape.name() == "vessels" && off < step,
                "{shape:?} {x:?}: {off}"
            );
        }
    }
}

#[test]
fn distance_is_the_least_to_a_dense_sampling() {
    for shape in shapes() {
        let n = 8_000;
        let s = shape
            .sample::<f64>(n, &Sampling::default(), 31)
            .expect("samples");
        let points = s.cloud.points();
        if shape.distance(points[0]).is_none() {
            continue;
        }
        // No hole of an even sampling is wider than a few mean spacings.
        let hole = 3.0 * (shape.area() / n as f64).sqrt();
        let mut known = 0;
        for (a, b) in points.iter().zip(points.iter().rev()).step_by(60) {
            // Inside and outside, near and far, without symmetry.
            let p = add(scale(*a, 0.8), scale(*b, 0.3));
            let Some(d) = shape.distance(p) else { continue };
            let seen = points
                .iter()
                .map(|x| norm(sub(*x, p)))
                .fold(f64::INFINITY, f64::min);
            let most = d.abs().hypot(hole).min(d.abs() + hole);
            assert!(
                seen > d.abs() * (1.0 - 1e-12) && seen < most,
                "{shape:?} {p:?}: {d} {seen}"
            );
            assert_eq!(shape.contains(p), Some(d < 0.0));
            known += 1;
        }
        assert!(known > 100, "{shape:?}: {known}");
    }
}

#[test]
fn distance_has_lipschitz_constant_one() {
    for shape in shapes() {
        let (points, ..) = samples(&shape, 200, 11);
        let size = size(&points);
        for (a, b) in points.iter().zip(points.iter().rev()) {
            let (p, q) = (scale(*a, 1.4), scale(*b, 0.7));
            if let (Some(d), Some(e)) = (shape.distance(p), shape.distance(q)) {
                assert!(
                    (d - e).abs() <= norm(sub(p, q)) + 1e-12 * size,
                    "{shape:?} {p:?} {q:?}"
                );
            }
        }
    }
}

#[test]
fn a_step_inward_is_inside_and_a_step_outward_is_outside_of_every_part() {
    for shape in shapes() {
        let (points, normals, _) = samples(&shape, 3000, 13);
        if shape.contains(points[0]).is_none() {
            continue;
        }
        let step = 1e-7 * size(&points);
        for (x, n) in points.iter().zip(&normals) {
            assert_eq!(
                shape.contains(sub(*x, scale(*n, step))),
                Some(true),
                "{shape:?} {x:?}"
            );
            assert_eq!(
                shape.contains(add(*x, scale(*n, step))),
                Some(false),
                "{shape:?} {x:?}"
            );
        }
    }
}

/// Mean of `f` over the samples and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    (mean, (variance / n).sqrt())
}

#[test]
fn random_samples_give_the_volume_by_the_divergence_theorem() {
    for shape in shapes() {
        let (points, normals, _) = samples(&shape, 20_000, 17);
        let (area, volume) = (shape.area(), shape.volume());
        let middle = scale(
            points.iter().copied().fold([0.0; 3], add),
            1.0 / points.len() as f64,
        );
        let flux: Vec<f64> = points
            .iter()
            .zip(&normals)
            .map(|(x, n)| dot(sub(*x, middle), *n))
            .collect();
        let (flux, error) = mean(&flux);
        let seen = area * flux / 3.0;
        // Four standard errors; 1e-5 is the bound of the quadrature of unions.
        let tolerance = 4.0 * area * error / 3.0 + 1e-5 * volume;
        assert!(
            (seen - volume).abs() < tolerance,
            "{shape:?}: {seen} {volume} ± {tolerance}"
        );
        assert!(
            tolerance < 0.1 * volume,
            "{shape:?}: the tolerance is too large"
        );
        // The area vectors of a closed surface sum to zero.
        for axis in 0..3 {
            let (net, error) = mean(&normals.iter().map(|n| n[axis]).collect::<Vec<_>>());
            assert!(
                net.abs() < 4.5 * error + 1e-12,
                "{shape:?}: {net} ± {error}"
            );
        }
    }
}

/// Area of the low half of a patch in `u`, and of the whole, by the midpoint rule.
fn patch_area(shape: &Shape, patch: u32) -> [f64; 2] {
    let n = 200;
    let mut halves = [0.0; 2];
    for k in 0..n * n {
        let (u, v) = ((k / n) as f64 + 0.5, (k % n) as f64 + 0.5);
        let at = SurfaceCoordinate {
            patch,
            u: u / n as f64,
            v: v / n as f64,
        };
        let element = norm(shape.at(at).expect("a patch").area_vector());
        halves[2 * (k / n) / n] += element / (n * n) as f64;
    }
    [halves[0], halves[0] + halves[1]]
}

#[test]
fn random_samples_fall_on_patches_in_proportion_to_their_areas() {
    let n = 20_000;
    let single = all().into_iter();
    for shape in single.filter(|s| !["airliner", "vessels"].contains(&s.name())) {
        let name = shape.name();
        let (_, _, coordinates) = samples(&shape, n, 19);
        let areas: Vec<_> = (0..shape.patches() as u32)
            .map(|p| patch_area(&shape, p))
            .collect();
        let total: f64 = areas.iter().map(|a| a[1]).sum();
        // The midpoint rule on 200 × 200 cells is good to 1e-4.
        assert!(
            (total - shape.area()).abs() < 1e-4 * total,
            "{name}: {total} {}",
            shape.area()
        );
        for (patch, [low, whole]) in areas.into_iter().enumerate() {
            let on = |c: &&SurfaceCoordinate| c.patch as usize == patch;
            let seen = coordinates.iter().filter(on).count() as f64;
            let seen_low = coordinates.iter().filter(on).filter(|c| c.u < 0.5).count() as f64;
            for (seen, area) in [(seen, whole), (seen_low, low)] {
                let expected = n as f64 * area / total;
                // Four and a half standard deviations of a count, over some hundred counts.
                assert!(
                    (seen - expected).abs() < 4.5 * expected.sqrt() + 1.0,
                    "{name} {patch}: {seen} {expected}"
                );
            }
        }
    }
}

#[test]
fn equal_seeds_give_equal_samples() {
    for shape in shapes() {
        for sampling in [RANDOM, Sampling::default()] {
            let draw = |seed| shape.sample::<f64>(300, &sampling, seed).expect("samples");
            assert_eq!(draw(1), draw(1), "{shape:?}");
            assert_ne!(draw(1).cloud, draw(2).cloud, "{shape:?}");
        }
    }
}

#[test]
fn single_precision_is_the_rounded_double() {
    for shape in shapes() {
        let wide = shape.sample::<f64>(200, &RANDOM, 4).expect("samples").cloud;
        let narrow = shape.sample::<f32>(200, &RANDOM, 4).expect("samples").cloud;
        for (a, b) in wide.points().iter().zip(narrow.points()) {
            assert_eq!(a.map(|x| x as f32), *b);
        }
    }
}

#[test]
fn tangents_are_finite_differences_at_fixed_coordinates() {
    for shape in shapes() {
        let (points, _, coordinates) = samples(&shape, 60, 23);
        let size = size(&points);
        let parameters: Vec<_> = shape.parameters().collect();
        for (parameter, value) in parameters.into_iter().filter(|(p, _)| !p.whole) {
            let step = 1e-6 * value.abs().max(1e-2);
            let moved = |by: f64| {
                let mut shape = shape.clone();
                shape.set(parameter.name, value + by).ok()?;
                Some(
                    coordinates
                        .iter()
                        .map(|c| shape.at(*c).map_or([0.0; 3], |p| p.position))
                        .collect::<Vec<_>>(),
                )
            };
            // No central difference at the end of a range.
            let (Some(after), Some(before)) = (moved(step), moved(-step)) else {
                continue;
            };
            let tangent = shape
                .tangent(parameter.name, &coordinates)
                .expect("a parameter");
            for ((a, b), t) in after.iter().zip(&before).zip(&tangent) {
                let difference = scale(sub(*a, *b), 0.5 / step);
                // Truncation step², rounding 1e-16·size/step.
                let tolerance = 1e-6 * norm(*t) + 1e-14 * size / step + 1e-7 * size;
                assert!(
                    norm(sub(difference, *t)) < tolerance,
                    "{shape:?} {}: {difference:?} {t:?}",
                    parameter.name
                );
            }
        }
    }
}

#[test]
fn velocity_is_the_rate_of_the_points_at_fixed_coordinates() {
    for name in ["fish", "eel"] {
        let at = |time: f64| {
            with(
                name,
                &[("amplitude", 0.12), ("time", time), ("length", 1.5)],
            )
        };
        let s = at(0.4).sample::<f64>(200, &RANDOM, 29).expect("samples");
        let velocity = &s.cloud.attributes()[0];
        assert_eq!(
            (velocity.name.as_str(), velocity.components),
            ("velocity", 3)
        );
        let e = 1e-5;
        let (before, after) = (at(0.4 - e), at(0.4 + e));
        let mut fastest = 0.0f64;
        for (c, v) in s.coordinates.iter().zip(velocity.values.as_chunks::<3>().0) {
            let points = [&before, &after].map(|shape| shape.at(*c).expect("a patch").position);
            let rate = scale(sub(points[1], points[0]), 0.5 / e);
            // Third derivatives are (2π)³ of the amplitude: 50 e² = 5e-9.
            assert!(norm(sub(rate, *v)) < 2e-8, "{name} {c:?}: {rate:?} {v:?}");
            fastest = fastest.max(norm(*v));
        }
        // The tail sweeps at up to 2π·0.12·1.5.
        assert!(fastest > 0.8 && fastest < 1.3, "{name}: {fastest}");
    }
    let rigid = shape("torus").sample::<f64>(5, &RANDOM, 1);
    assert!(rigid.expect("samples").cloud.attributes().is_empty());
}
