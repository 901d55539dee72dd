//! The clouds of the suite.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::body::{Body, RANDOM, shell, terrain, wing};
use super::parts;
use crate::sampling::Draw;

/// Extension of the files of real clouds.
const EXTENSION: &str = ".points.ply";

/// Samples of most clouds.
const SAMPLES: usize = 50_000;

/// Kind of difficulty of a cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Samples of real shapes.
    Real,
    /// Different samplings of built-in shapes.
    Sampled,
    /// Holes, noise and outliers.
    Degraded,
    /// Sheets close to each other.
    Thin,
    /// Coordinates of few digits, and voxels.
    Rounded,
    /// Samples along lines.
    Lines,
    /// Bodies that touch, cavities and open surfaces.
    Joined,
    /// Parts with sharp edges, ribs and gaps, some with holes.
    Parts,
}

/// A cloud of the suite, generated on demand.
pub struct Cloud {
    /// Name, as in docs/orientation.md and on the command line.
    pub name: String,
    /// Kind of difficulty.
    pub family: Family,
    make: Box<dyn Fn() -> Body>,
}

impl Cloud {
    /// Generates the cloud.
    pub fn body(&self) -> Body {
        (self.make)()
    }
}

/// All generated clouds, by family.
pub fn generated() -> Vec<Cloud> {
    let mut suite = Suite::default();
    suite.add_sampled();
    suite.add_degraded();
    suite.add_sheets();
    suite.add_wings();
    suite.add_rounded();
    suite.add_lines();
    suite.add_cavities();
    suite.add_boxes();
    suite.add_parts();
    suite.clouds
}

/// The generated cloud with this name.
pub fn by_name(name: &str) -> Option<Cloud> {
    generated().into_iter().find(|cloud| cloud.name == name)
}

/// The real clouds in a folder, from `NAME.points.ply`, sorted by name.
pub fn real(folder: &Path) -> Vec<Cloud> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.sort();
    let cloud = |path: PathBuf| {
        let name = path.file_name()?.to_str()?.strip_suffix(EXTENSION)?;
        Some(Cloud {
            name: name.into(),
            family: Family::Real,
            make: Box::new(move || read(&path)),
        })
    };
    paths.into_iter().filter_map(cloud).collect()
}

/// Reads a real cloud; `NAME` holds the clean samples of `NAME.noise005`, whose noise is 0.005 longest sides.
fn read(path: &Path) -> Body {
    let body = Body::read(path);
    let name = path.file_name().and_then(|name| name.to_str());
    let parts = name.and_then(|name| name.strip_suffix(EXTENSION)?.split_once(".noise"));
    match parts.and_then(|(clean, digits)| Some((clean, format!("0.{digits}").parse().ok()?))) {
        Some((clean, deviation)) => {
            let clean = path.with_file_name(format!("{clean}{EXTENSION}"));
            body.with_clean(Body::read(&clean), deviation)
        }
        None => body,
    }
}

#[derive(Default)]
struct Suite {
    clouds: Vec<Cloud>,
}

impl Suite {
    fn add(&mut self, family: Family, name: impl Into<String>, make: impl Fn() -> Body + 'static) {
        self.clouds.push(Cloud {
            name: name.into(),
            family,
            make: Box::new(make),
        });
    }

    /// Built-in shapes: random and even samples, few samples, and a density gradient of 10:1.
    fn add_sampled(&mut self) {
        let bodies = [
            "sphere", "torus", "knot", "fish", "airliner", "car", "nacelle", "vessels",
        ];
        for body in bodies {
            self.add(Family::Sampled, body, move || {
                Body::of(body, &[], SAMPLES, &RANDOM, 1)
            });
        }
        for body in ["fish", "airliner", "nacelle"] {
            for (what, samples, sampling, seed) in [
                ("even", SAMPLES, Draw::Even.sampling(), 2),
                ("8k", 8_000, RANDOM, 3),
                ("density", SAMPLES, Draw::Density10.sampling(), 4),
            ] {
                self.add(Family::Sampled, format!("{body} {what}"), move || {
                    Body::of(body, &[], samples, &sampling, seed)
                });
            }
        }
    }

    /// Holes, noise and outliers.
    fn add_degraded(&mut self) {
        for body in ["torus", "knot", "fish", "airliner", "car", "vessels"] {
            let sampled = move || Body::of(body, &[], 30_000, &RANDOM, 5);
            self.add(Family::Degraded, format!("{body} holes"), move || {
                sampled().with_holes(0.7, 6)
            });
            for noise in [0.0025, 0.005, 0.01] {
                self.add(
                    Family::Degraded,
                    format!("{body} noise {noise}"),
                    move || sampled().noisy(noise, 6),
                );
            }
        }
        self.add(Family::Degraded, "outliers 1%", || {
            Body::sphere(1.0, SAMPLES, 20).with_outliers(0.01, 21)
        });
        self.add(Family::Degraded, "outliers knot 2%", || {
            Body::of("knot", &[], SAMPLES, &RANDOM, 20).with_outliers(0.02, 21)
        });
    }

    /// Two sheets `k` spacings apart, with the inside or the outside between them.
    fn add_sheets(&mut self) {
        for k in [1.0, 1.5, 2.0, 3.0, 4.0] {
            self.add(Family::Thin, format!("shell {k}"), move || {
                shell(k * spacing(8.0 * PI), SAMPLES, 7)
            });
            self.add(Family::Thin, format!("plate {k}"), move || {
                Body::cuboid([1.0, 1.0, k * spacing(2.0)], SAMPLES, 8)
            });
            self.add(Family::Thin, format!("gap {k}"), move || {
                let inner = 0.5;
                let wall = inner + k * spacing(3.0 * PI);
                Body::sphere(inner, SAMPLES / 3, 10)
                    .with(Body::sphere(wall, SAMPLES / 3, 11).inside_out())
                    .with(Body::sphere(1.0, SAMPLES, 12))
            });
            self.add(Family::Thin, format!("boxes apart {k}"), move || {
                two_boxes([1.0 + k * spacing(12.0), 0.2, 0.1], 13)
            });
            self.add(Family::Thin, format!("box shell {k}"), move || {
                let inner = 1.0 - 2.0 * k * spacing(12.0);
                Body::cuboid([1.0; 3], SAMPLES / 2, 13)
                    .with(Body::cuboid([inner; 3], SAMPLES / 2, 14).inside_out())
            });
        }
    }

    /// Wings a few spacings thick, with a sharp trailing edge.
    fn add_wings(&mut self) {
        for t in [0.01, 0.02, 0.04] {
            self.add(Family::Thin, format!("wing {t}"), move || {
                wing(t, SAMPLES, 22)
            });
            self.add(Family::Thin, format!("wing {t} 10k"), move || {
                wing(t, 10_000, 22)
            });
            self.add(Family::Thin, format!("wing {t} noise"), move || {
                wing(t, 30_000, 22).noisy(0.002, 23)
            });
        }
    }

    /// Coordinates rounded to steps from a small share of a spacing to several spacings.
    fn add_rounded(&mut self) {
        for step in [0.001, 0.003, 0.01] {
            self.add(Family::Rounded, format!("box slanting {step}"), move || {
                let cube = Body::cuboid([1.0; 3], SAMPLES, 26);
                cube.turned(25.0).rounded(step)
            });
            for body in ["knot", "fish", "airliner", "car", "vessels"] {
                self.add(Family::Rounded, format!("{body} {step}"), move || {
                    Body::of(body, &[], SAMPLES, &RANDOM, 27).rounded(step)
                });
            }
        }
    }

    /// Scan lines two to eight times as far apart as the samples on them.
    fn add_lines(&mut self) {
        for ratio in [2, 4, 8] {
            for body in ["knot", "fish", "airliner", "car", "vessels"] {
                self.add(Family::Lines, format!("{body} lines {ratio}"), move || {
                    Body::on_lines(body, f64::from(ratio), SAMPLES, 28)
                });
            }
        }
    }

    /// Nested bodies, and open surfaces.
    fn add_cavities(&mut self) {
        let hollow = || {
            Body::sphere(1.0, SAMPLES / 2, 15).with(Body::sphere(0.7, SAMPLES / 4, 16).inside_out())
        };
        self.add(Family::Joined, "nested", hollow);
        self.add(Family::Joined, "nested ball", move || {
            hollow().with(Body::sphere(0.35, SAMPLES / 8, 17))
        });
        self.add(Family::Joined, "hemisphere", || {
            Body::sphere(1.0, SAMPLES, 24).filtered(|x| x[2] > 0.0)
        });
        for slope in [0.5, 1.0, 1.5] {
            self.add(Family::Joined, format!("terrain {slope}"), move || {
                terrain(slope, SAMPLES, 25)
            });
        }
    }

    /// Two boxes that touch, or overlap.
    fn add_boxes(&mut self) {
        self.add(Family::Joined, "boxes union", || {
            let is_inside_second = |x: [f64; 3]| x[0] > 0.5 - 1e-9 && x[1] > -0.3 && x[2] > -0.4;
            let is_inside_first = |x: [f64; 3]| x[0] < 0.5 + 1e-9 && x[1] < 0.5 && x[2] < 0.5;
            let second = Body::cuboid([1.0; 3], SAMPLES / 2, 19).moved([1.0, 0.2, 0.1]);
            Body::cuboid([1.0; 3], SAMPLES / 2, 18)
                .filtered(|x| !is_inside_second(x))
                .with(second.filtered(|x| !is_inside_first(x)))
        });
        for (what, offset) in [
            ("face", [1.0, 0.0, 0.0]),
            ("face offset", [1.0, 0.5, 0.5]),
            ("edge", [1.0, 1.0, 0.1]),
            ("corner", [1.0; 3]),
        ] {
            self.add(Family::Joined, format!("boxes {what}"), move || {
                two_boxes(offset, 18)
            });
        }
    }

    /// Ribbed plates, gratings, discs, stacks, rotors, blades, bundles of tubes, and brackets with and without holes.
    fn add_parts(&mut self) {
        for thickness in [0.01, 0.02] {
            self.add(Family::Parts, format!("ribs {thickness}"), move || {
                parts::union(&parts::ribbed_plate(thickness), SAMPLES, 31)
            });
        }
        for thickness in [0.02, 0.03] {
            for (name, prisms) in [
                ("grating", parts::grating(thickness)),
                ("discs", parts::discs(thickness, 2.0 * thickness)),
                ("stack", parts::discs(thickness, 0.01)),
                ("rotor", parts::rotor(thickness)),
            ] {
                self.add(Family::Parts, format!("{name} {thickness}"), move || {
                    parts::union(&prisms, SAMPLES, 34)
                });
            }
        }
        for thickness in [0.02, 0.05, 0.1] {
            self.add(Family::Parts, format!("blade {thickness}"), move || {
                parts::union(&[parts::blade(thickness)], 20_000, 32)
            });
        }
        for gap in [0.01, 0.03] {
            self.add(Family::Parts, format!("tubes {gap}"), move || {
                parts::union(&parts::bundle(gap), SAMPLES, 33)
            });
        }
        for seed in 1..=6 {
            let bracket = move || parts::union(&parts::bracket(seed), 30_000, seed);
            self.add(Family::Parts, format!("bracket {seed}"), bracket);
            self.add(Family::Parts, format!("bracket {seed} holes"), move || {
                bracket().with_holes(0.7, 40 + seed)
            });
        }
    }
}

/// Two unit cubes, the second displaced by `offset`. Samples where they touch have no defined sign and are excluded.
fn two_boxes(offset: [f64; 3], seed: u64) -> Body {
    let second = Body::cuboid([1.0; 3], SAMPLES / 2, seed + 1).moved(offset);
    let is_on_both = |x: [f64; 3]| {
        let on = |center: [f64; 3]| (0..3).all(|a| (x[a] - center[a]).abs() < 0.5 + 1e-9);
        on([0.0; 3]) && on(offset)
    };
    Body::cuboid([1.0; 3], SAMPLES / 2, seed)
        .with(second)
        .excluding(is_on_both)
}

/// Sample spacing of `SAMPLES` on this area.
fn spacing(area: f64) -> f64 {
    (area / SAMPLES as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_normals_have_unit_length() {
        let clouds = generated();
        for (k, cloud) in clouds.iter().enumerate() {
            assert!(clouds[..k].iter().all(|other| other.name != cloud.name));
        }
        for name in [
            "torus",
            "shell 2",
            "boxes face",
            "wing 0.02 noise",
            "outliers 1%",
        ] {
            let body = by_name(name).expect("in the suite").body();
            assert_eq!(body.points.len(), body.normals.len());
            for n in body.normals {
                let length = isograd_element::vector::norm(n);
                assert!(length == 0.0 || (length - 1.0).abs() < 1e-9, "{name}");
            }
        }
    }
}
