//! Area and volume by quadrature over the patches.

use isograd_element::vector::{dot, norm};
use rayon::prelude::*;

use crate::shape::evaluate;
use crate::surface::Surface;

/// Nodes in `(−1, 1)` and weights of the five-point Gauss–Legendre rule.
pub(crate) const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Cells along each side of a patch of a single body. A multiple of 5 and 6, so that the knots of the
/// fish's splines lie on cell borders.
const CELLS: usize = 60;

/// Cells of all patches of a union together, before those on an intersection are subdivided.
const CELLS_OF_UNION: usize = 20_000;

/// Levels of subdivision of a cell on the intersection of two parts of a union.
const LEVELS: usize = 7;

/// Area and volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Measure {
    pub area: f64,
    /// `⅓ ∮ x·n dA`, by the divergence theorem.
    pub volume: f64,
}

impl Measure {
    fn plus(self, other: Measure) -> Measure {
        Measure {
            area: self.area + other.area,
            volume: self.volume + other.volume,
        }
    }
}

/// A square of a patch: lower corner and side.
#[derive(Clone, Copy)]
struct Square {
    u: f64,
    v: f64,
    side: f64,
}

/// Area and volume of the exposed surface. Patches are integrated in parallel and summed in order.
pub(crate) fn measure(surface: &dyn Surface) -> Measure {
    let patches: Vec<Measure> = (0..surface.patches())
        .into_par_iter()
        .map(|patch| measure_patch(surface, patch))
        .collect();
    patches.into_iter().fold(Measure::default(), Measure::plus)
}

fn measure_patch(surface: &dyn Surface, patch: usize) -> Measure {
    let cells = if surface.is_union() {
        ((CELLS_OF_UNION / surface.patches()) as f64).sqrt().ceil() as usize
    } else {
        CELLS
    };
    let side = 1.0 / cells as f64;
    let squares = (0..cells * cells).map(|i| Square {
        u: (i / cells) as f64 * side,
        v: (i % cells) as f64 * side,
        side,
    });
    let measures = squares.map(|square| match surface.is_union() {
        true => over_cut_square(surface, patch, square, LEVELS),
        false => over_square(surface, patch, square, |_| true),
    });
    measures.fold(Measure::default(), Measure::plus)
}

/// Integrates over a square of a union, subdivided while only a part of it is exposed.
fn over_cut_square(surface: &dyn Surface, patch: usize, square: Square, levels: usize) -> Measure {
    let exposed = exposed_of_nine(surface, patch, square);
    if exposed == 0 {
        return Measure::default();
    }
    if exposed == 9 {
        return over_square(surface, patch, square, |_| true);
    }
    if levels == 0 {
        return over_square(surface, patch, square, |x| surface.exposed(patch, x));
    }
    let side = 0.5 * square.side;
    let mut total = Measure::default();
    for quarter in 0..4 {
        let part = Square {
            u: square.u + side * (quarter / 2) as f64,
            v: square.v + side * (quarter % 2) as f64,
            side,
        };
        total = total.plus(over_cut_square(surface, patch, part, levels - 1));
    }
    total
}

/// Number of exposed points among the corners, edge midpoints and center of a square.
fn exposed_of_nine(surface: &dyn Surface, patch: usize, square: Square) -> usize {
    // Away from the edge of the patch, where a map may not be smooth.
    let coordinate =
        |low: f64, k: usize| (low + 0.5 * square.side * k as f64).clamp(1e-9, 1.0 - 1e-9);
    let exposed = |k: usize| {
        let (u, v) = (coordinate(square.u, k / 3), coordinate(square.v, k % 3));
        surface.exposed(patch, evaluate(surface, patch, u, v).position)
    };
    (0..9).filter(|&k| exposed(k)).count()
}

/// Gauss quadrature over the points of a square for which `counts` is true.
fn over_square(
    surface: &dyn Surface,
    patch: usize,
    square: Square,
    counts: impl Fn([f64; 3]) -> bool,
) -> Measure {
    let half = 0.5 * square.side;
    let mut total = Measure::default();
    for (a, wa) in GAUSS {
        for (b, wb) in GAUSS {
            let (u, v) = (square.u + half * (1.0 + a), square.v + half * (1.0 + b));
            let point = evaluate(surface, patch, u, v);
            if counts(point.position) {
                let (weight, normal) = (wa * wb * half * half, point.area_vector());
                total.area += weight * norm(normal);
                total.volume += weight * dot(point.position, normal) / 3.0;
            }
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Shape, by_name};

    fn with(name: &str, values: &[(&str, f64)]) -> Shape {
        let mut shape = by_name(name).expect("a shape");
        shape.set_all(values.iter().copied()).expect("good values");
        shape
    }

    #[test]
    fn quadrature_agrees_with_every_closed_form() {
        let bodies = [
            by_name("sphere").expect("a shape"),
            by_name("torus").expect("a shape"),
            by_name("ellipsoid").expect("a shape"),
            by_name("box").expect("a shape"),
            by_name("car").expect("a shape"),
            with("car", &[("slant", 35.0), ("front_radius", 0.05)]),
            with("nacelle", &[("incidence", 10.0)]),
        ];
        for shape in bodies {
            let seen = measure(&*shape.surface);
            // Smooth patches: the rule has order 10, and 60 cells are plenty.
            let volume = shape.surface.volume().expect("closed form");
            assert!(
                (seen.volume / volume - 1.0).abs() < 1e-12,
                "{shape:?}: {seen:?} {volume}"
            );
            if let Some(area) = shape.surface.area() {
                assert!(
                    (seen.area / area - 1.0).abs() < 1e-12,
                    "{shape:?}: {seen:?} {area}"
                );
            }
        }
    }

    #[test]
    fn unions_are_measured_to_what_their_documentation_says() {
        let plain = measure(&*with("car", &[]).surface);
        let car = with("car", &[("stilts", 0.05)]);
        let (seen, volume) = (measure(&*car.surface), car.volume());
        assert!(
            (seen.volume / volume - 1.0).abs() < 1e-5,
            "{seen:?} {volume}"
        );
        // A stilt hides as much of the floor as its foot shows: only its wall is added.
        let walls = 4.0 * std::f64::consts::TAU * 0.015 * 0.05;
        assert!(
            ((seen.area - plain.area) / walls - 1.0).abs() < 1e-3,
            "{seen:?} {plain:?}"
        );
    }

    #[test]
    fn a_union_in_which_nothing_is_buried_is_exact() {
        let values = [
            ("generations", 1.0),
            ("taper", 1.0),
            ("radius", 0.5),
            ("branch_length", 4.0),
        ];
        let seen = measure(&*with("vessels", &values).surface);
        let pi = std::f64::consts::PI;
        // A capsule of radius ½ and length 2.
        assert!(
            (seen.volume / (pi * 0.5 + pi / 6.0) - 1.0).abs() < 1e-12,
            "{seen:?}"
        );
        assert!(
            (seen.area / (pi * 2.0 + pi) - 1.0).abs() < 1e-12,
            "{seen:?}"
        );
    }

    #[test]
    fn the_volume_near_a_joint_is_that_of_the_points_inside() {
        let shape = with("vessels", &[("generations", 2.0), ("radius", 0.2)]);
        let (seen, mut inside, n) = (measure(&*shape.surface), 0u32, 200_000u32);
        // Halton points in a box around the tree.
        let halton = |mut i: u32, base: u32| {
            let (mut f, mut x) = (1.0, 0.0);
            while i > 0 {
                f /= f64::from(base);
                x += f * f64::from(i % base);
                i /= base;
            }
            x
        };
        let (low, size) = ([-1.4, -1.4, -0.4], [2.8, 2.8, 3.2]);
        for i in 1..=n {
            let p = std::array::from_fn(|a| low[a] + size[a] * halton(i, [2, 3, 5][a]));
            inside += u32::from(shape.contains(p) == Some(true));
        }
        let volume = f64::from(inside) / f64::from(n) * 2.8 * 2.8 * 3.2;
        // Discrepancy of 200,000 Halton points for a body of a fiftieth of the box.
        assert!(
            (seen.volume / volume - 1.0).abs() < 5e-3,
            "{seen:?} {volume}"
        );
    }
}
