//! Faces with many corners: their triangles cover them, and nothing else.

use std::fmt::Write;

use isograd_element::vector::{add, cross, dot, norm, scale, sub};
use isograd_io::{Format, Geometry};

use crate::files::geometry;
use crate::mutations::Random;

type Outline = Vec<[f64; 2]>;

/// A number from 0 to 1.
fn unit(random: &mut Random) -> f64 {
    random.below(1 << 20) as f64 / f64::from(1 << 20)
}

/// Corners at random distances around the origin.
fn star(n: usize, random: &mut Random) -> Outline {
    let corner = |i: usize| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
        let radius = 0.1 + unit(random);
        [radius * cos, radius * sin]
    };
    (0..n).map(corner).collect()
}

/// Teeth of random heights, with gaps of random depths, on a bar whose lower side has corners on a line.
fn comb(teeth: usize, random: &mut Random) -> Outline {
    let bar = (0..=teeth).map(|i| [2.0 * i as f64, -1.0]);
    let mut outline: Outline = bar.collect();
    for tooth in (0..teeth).rev() {
        let (x, height) = (2.0 * tooth as f64, 0.5 + 9.0 * unit(random));
        let [right, left] = [(); 2].map(|()| 0.4 * unit(random));
        outline.extend([
            [x + 1.9, right],
            [x + 1.5, height],
            [x + 0.5, height],
            [x + 0.1, left],
        ]);
    }
    outline
}

/// A band around the origin, of two and a half turns.
fn spiral(steps: usize, random: &mut Random) -> Outline {
    let width = 0.1 + 0.7 * unit(random);
    let side = |width: f64| {
        (0..steps).map(move |i| {
            let turns = 2.5 * i as f64 / (steps - 1) as f64;
            let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
            let radius = 1.0 + turns + width;
            [radius * cos, radius * sin]
        })
    };
    side(width).chain(side(0.0).rev()).collect()
}

/// The outline that begins at another corner, and runs the other way around if `reversed`.
fn turned(outline: &Outline, first: usize, reversed: bool) -> Outline {
    let mut outline = outline.clone();
    outline.rotate_left(first);
    if reversed {
        outline.reverse();
    }
    outline
}

/// An OBJ with one face, in a plane that is not along the axes.
fn read(outline: &Outline) -> Geometry {
    let (u, v) = ([0.6, 0.48, 0.64], [-0.8, 0.36, 0.48]);
    let mut text = String::new();
    for &[x, y] in outline {
        let [x, y, z] = add([5.0, -3.0, 1.0], add(scale(u, x), scale(v, y)));
        writeln!(text, "v {x:?} {y:?} {z:?}").expect("text");
    }
    let corners: Vec<String> = (1..=outline.len())
        .map(|corner| corner.to_string())
        .collect();
    geometry(Format::Obj, format!("{text}f {}\n", corners.join(" ")))
}

/// Twice the signed area.
fn area(outline: &[[f64; 2]]) -> f64 {
    let after = outline.iter().cycle().skip(1);
    let parts = outline
        .iter()
        .zip(after)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0]);
    parts.sum()
}

/// Whether a place is inside of an outline, by the number of edges to its right.
fn is_inside(outline: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let after = outline.iter().cycle().skip(1);
    let crossed = outline.iter().zip(after).filter(|(a, b)| {
        (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    });
    crossed.count() % 2 == 1
}

/// Checks that the triangles of an outline that does not cross itself cover it once, with its winding.
fn assert_covers(outline: &Outline, random: &mut Random) {
    let file = read(outline);
    let n = outline.len();
    assert_eq!(file.faces.len(), n - 2);
    let whole = area(outline);
    let triangles: Vec<[[f64; 2]; 3]> = file
        .faces
        .iter()
        .map(|face| face.map(|corner| outline[corner as usize]))
        .collect();
    let mut sum = 0.0;
    for triangle in &triangles {
        let area = area(triangle);
        assert!(area * whole > 0.0, "{triangle:?} of {n} corners");
        sum += area;
    }
    // Roundings of some dozen terms.
    assert!((sum - whole).abs() <= 1e-12 * whole.abs(), "{sum} {whole}");
    for _ in 0..20 {
        let size = outline
            .as_flattened()
            .iter()
            .fold(0.0f64, |m, x| m.max(x.abs()));
        let place = [(); 2].map(|()| size * (2.0 * unit(random) - 1.0));
        let covered = triangles
            .iter()
            .filter(|triangle| is_inside(&triangle[..], place));
        let expected = usize::from(is_inside(outline, place));
        assert_eq!(covered.count(), expected, "{place:?} in {n} corners");
    }
}

#[test]
fn triangles_cover_a_polygon_once_from_every_first_corner_and_with_both_windings() {
    let mut random = Random(7);
    for case in 0..24 {
        let outlines = [
            star(4 + case, &mut random),
            comb(2 + case % 7, &mut random),
            spiral(40 + case, &mut random),
        ];
        for outline in &outlines {
            for first in 0..outline.len() {
                for reversed in [false, true] {
                    assert_covers(&turned(outline, first, reversed), &mut random);
                }
            }
        }
    }
}

#[test]
fn convex_polygons_keep_the_fan_around_their_first_corner() {
    let mut random = Random(8);
    let fan = |n: u32| (1..n - 1).map(|i| [0, i, i + 1]).collect::<Vec<_>>();
    for n in 3..40 {
        // Corners as they are rounded to single precision, one of them between two others.
        let single = |value: f64| f64::from(value as f32);
        let corner = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
            [single(cos), single(sin)]
        };
        let mut outline: Outline = (0..n).map(corner).collect();
        let [a, b] = [outline[0], outline[1]];
        outline.insert(1, [0, 1].map(|axis| single(0.5 * (a[axis] + b[axis]))));
        let first = random.below(n);
        for reversed in [false, true] {
            let file = read(&turned(&outline, first, reversed));
            assert_eq!(file.faces, fan(n as u32 + 1), "{n} {first}");
        }
    }
}

#[test]
fn polygons_that_meet_or_cross_themselves_have_triangles_nonetheless() {
    let twice = |mut outline: Outline| {
        outline = outline
            .into_iter()
            .flat_map(|corner| [corner, corner])
            .collect();
        outline
    };
    let l = vec![
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ];
    // A square with a hole, which two edges in one place lead to.
    let hole = vec![
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 3.0],
        [0.0, 3.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [2.0, 2.0],
        [2.0, 1.0],
        [1.0, 1.0],
    ];
    let spike = vec![
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [5.0, 1.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ];
    for (outline, whole) in [
        (twice(l.clone()), 6.0),
        (twice(hole.clone()), 16.0),
        (hole, 16.0),
        (spike, 6.0),
    ] {
        for first in 0..outline.len() {
            for reversed in [false, true] {
                let outline = turned(&outline, first, reversed);
                let file = read(&outline);
                assert_eq!(file.faces.len(), outline.len() - 2);
                let areas = file
                    .faces
                    .iter()
                    .map(|f| area(&f.map(|c| outline[c as usize])).abs());
                // Eight digits of corners that lie on one another.
                assert!(
                    (areas.sum::<f64>() - whole).abs() < 1e-8,
                    "{outline:?} {:?}",
                    file.faces
                );
            }
        }
    }
    let mut random = Random(9);
    let star = |step: usize| {
        (0..7)
            .map(|i| {
                let (sin, cos) = (std::f64::consts::TAU * (i * step) as f64 / 7.0).sin_cos();
                [cos, sin]
            })
            .collect()
    };
    let mut wild = vec![
        star(2),
        star(3),
        vec![[1.0; 2]; 9],
        vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]],
    ];
    wild.push((0..9).map(|i| [i as f64, 2.0 * i as f64]).collect());
    for size in [1e-300, 1.0, 1e300] {
        let corner = |random: &mut Random| [(); 2].map(|()| size * random.below(5) as f64);
        wild.extend((0..300).map(|case| (0..4 + case % 20).map(|_| corner(&mut random)).collect()));
    }
    for outline in &wild {
        let file = read(outline);
        assert_eq!(file.faces.len(), outline.len() - 2);
        assert!(
            file.faces
                .as_flattened()
                .iter()
                .all(|&corner| (corner as usize) < outline.len())
        );
    }
}

#[test]
fn a_polygon_of_very_many_corners_takes_no_quadratic_time() {
    // Clipping the ears of such a polygon would take hours.
    let outline = comb(100_000, &mut Random(10));
    assert_eq!(read(&outline).faces.len(), outline.len() - 2);
    let outline = comb(800, &mut Random(10));
    assert_covers(&outline, &mut Random(11));
}

/// Area and volume of a closed mesh.
fn measure(file: &Geometry) -> [f64; 2] {
    file.faces.iter().fold([0.0; 2], |[area, volume], face| {
        let [a, b, c] = face.map(|corner| file.points[corner as usize]);
        let vector = cross(sub(b, a), sub(c, a));
        [area + norm(vector) / 2.0, volume + dot(a, vector) / 6.0]
    })
}

#[test]
fn a_prism_with_a_concave_base_is_right_in_every_format_from_every_first_corner() {
    let base = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]];
    for first in 0..6 {
        let mut faces: Vec<Vec<usize>> = vec![(0..6).rev().collect(), (6..12).collect()];
        faces.extend((0..6).map(|i| vec![i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6]));
        let rows = |prefix: &str, offset: usize| {
            let mut text = String::new();
            for face in &mut faces.clone() {
                let turns = first % face.len();
                face.rotate_left(turns);
                let corners: Vec<String> = face.iter().map(|c| (c + offset).to_string()).collect();
                let prefix = prefix.replace('N', &face.len().to_string());
                writeln!(text, "{prefix} {}", corners.join(" ")).expect("text");
            }
            text
        };
        let points = |prefix: &str| {
            let all = (0..2).flat_map(|z| base.map(|[x, y]| format!("{prefix}{x} {y} {z}\n")));
            all.collect::<String>()
        };
        let head = |elements: [&str; 2]| {
            let of = |name: &str| match name {
                "vertex" => {
                    "element vertex 12\nproperty float x\nproperty float y\nproperty float z\n"
                }
                _ => "element face 8\nproperty list uchar int vertex_indices\n",
            };
            format!(
                "ply\nformat ascii 1.0\n{}{}end_header\n",
                of(elements[0]),
                of(elements[1])
            )
        };
        for (format, text) in [
            (Format::Obj, points("v ") + &rows("f", 1)),
            (Format::Obj, rows("f", 1) + &points("v ")),
            (
                Format::Off,
                format!("OFF\n12 8 0\n{}{}", points(""), rows("N", 0)),
            ),
            (
                Format::Ply,
                head(["vertex", "face"]) + &points("") + &rows("N", 0),
            ),
            (
                Format::Ply,
                head(["face", "vertex"]) + &rows("N", 0) + &points(""),
            ),
        ] {
            let file = geometry(format, text);
            assert_eq!(
                (measure(&file), file.faces.len()),
                ([14.0, 3.0], 20),
                "{format:?}"
            );
        }
    }
}
