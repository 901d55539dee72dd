//! Random clouds, units, options and cotangents, at the ends of what the number types hold.

use isograd::distance::Band;
use isograd::isosurface::Level;
use isograd::neighbors::Radius;
use isograd::orient::{Method, ParityOptions};
use isograd::poisson::{Smoothing, Walls};
use isograd::splat::Weights;
use isograd::{
    Attribute, CloudCotangent, Cotangent, ExtensionCotangent, Grid, Options, Pipeline, PointCloud,
    Reconstruction, Reconstructor, Resolution, SurfaceResolution,
};

use crate::common::Uniform;

/// Stream of choices and numbers.
pub struct Draw(pub Uniform);

impl Draw {
    fn below(&mut self, n: usize) -> usize {
        (self.0.next() * n as f64) as usize
    }

    fn chance(&mut self, share: f64) -> bool {
        self.0.next() < share
    }

    fn signed(&mut self) -> f64 {
        2.0 * self.0.next() - 1.0
    }

    fn vector(&mut self) -> [f64; 3] {
        [0; 3].map(|_| self.signed())
    }

    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = self.vector();
            let square: f64 = v.iter().map(|x| x * x).sum();
            if (0.01..1.0).contains(&square) {
                return v.map(|x| x / square.sqrt());
            }
        }
    }

    /// Power of ten, between 1 and the ends of the number type; the ends themselves are as likely as all between them.
    fn scale<T: Pipeline>(&mut self, least: f64, greatest: f64) -> f64 {
        let (least, greatest) = (least * digits::<T>(), greatest * digits::<T>());
        let exponent = match self.below(4) {
            0 => 0.0,
            1 => least,
            2 => greatest,
            _ => least + self.0.next() * (greatest - least),
        };
        10f64.powf(exponent)
    }
}

/// Powers of ten that the number type spans on either side of 1.
fn digits<T: Pipeline>() -> f64 {
    T::max_value().f64().log10().floor()
}

pub fn times(s: f64, v: [f64; 3]) -> [f64; 3] {
    v.map(|x| s * x)
}

pub fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Points about the size of 1.
fn shape(draw: &mut Draw) -> Vec<[f64; 3]> {
    let n = 4 + draw.below(300);
    let kind = draw.below(9);
    let centers: Vec<[f64; 3]> = (0..5).map(|_| draw.vector()).collect();
    let thin = 10f64.powf(-12.0 * draw.0.next());
    let point = |i: usize, draw: &mut Draw| match kind {
        0 | 1 => draw.direction(),
        2 => times(1e-3 * draw.signed() + 1.0, draw.direction()),
        3 => [draw.signed(), draw.signed(), thin * draw.signed()],
        4 => [draw.signed(), thin * draw.signed(), thin * draw.signed()],
        5 => draw.vector(),
        6 => [i % 6, i / 6 % 6, i / 36].map(|k| k as f64 / 5.0),
        7 => plus(centers[draw.below(5)], times(thin, draw.vector())),
        _ => centers[draw.below(5)],
    };
    (0..n).map(|i| point(i, draw)).collect()
}

/// Points and the box that the grid is fitted to.
fn points<T: Pipeline>(draw: &mut Draw) -> (Vec<[T; 3]>, bool) {
    let mut points = shape(draw);
    let own_grid = draw.chance(0.25);
    match draw.below(6) {
        // A second one, far away.
        0 => {
            let far = times(draw.scale::<T>(0.0, 0.45), draw.direction());
            let others: Vec<_> = points.iter().map(|&p| plus(p, far)).collect();
            points.extend(others);
        }
        // A few points, far away.
        1 => {
            let far = draw.scale::<T>(0.0, 0.45);
            points.extend((0..1 + draw.below(3)).map(|_| times(far, draw.direction())));
        }
        // A tiny one inside.
        2 => {
            let tiny = draw.scale::<T>(-0.5, 0.0);
            let others: Vec<_> = shape(draw).iter().map(|&p| times(tiny, p)).collect();
            points.extend(others);
        }
        3 if own_grid => {
            let tiny = draw.scale::<T>(-0.5, 0.0);
            points.iter_mut().for_each(|p| *p = times(tiny, *p));
        }
        _ => {}
    }
    let unit = if draw.chance(0.5) {
        1.0
    } else {
        draw.scale::<T>(-0.5, 0.5)
    };
    let away = if draw.chance(0.2) {
        times(1e3, draw.direction())
    } else {
        [0.0; 3]
    };
    let points = points
        .iter()
        .map(|&p| times(unit, plus(p, away)).map(T::of));
    (points.collect(), own_grid)
}

fn normals<T: Pipeline>(points: &[[T; 3]], draw: &mut Draw) -> Vec<[T; 3]> {
    let length = draw.scale::<T>(-1.0, 0.99);
    let spread = draw.chance(0.5);
    let normal = |p: &[T; 3]| {
        let length = if spread {
            length.powf(draw.0.next())
        } else {
            length
        };
        let out = p.map(T::f64);
        let square: f64 = out.iter().map(|x| x * x).sum();
        let out = if square > 0.0 && square.is_finite() && draw.chance(0.9) {
            out.map(|x| x / square.sqrt())
        } else {
            draw.direction()
        };
        out.map(|x| T::of(length * x))
    };
    points.iter().map(normal).collect()
}

fn options<T: Pipeline>(size: f64, draw: &mut Draw) -> Options {
    let mut options = Options::default();
    if draw.chance(0.2) {
        let radius = size * 10f64.powf(-3.0 + 4.0 * draw.0.next());
        options = options.radius(Radius::Fixed(radius));
    }
    options.orient = match draw.below(6) {
        0 | 1 => Method::Given,
        2 => Method::Signs,
        3 => Method::Parity(ParityOptions {
            gamma: draw.scale::<f64>(0.0, 1.0),
            ..ParityOptions::default()
        }),
        _ => Method::Auto,
    };
    if draw.chance(0.2) {
        options = options.splat(Weights::Paper);
    }
    options.area = draw.chance(0.75);
    options.smoothing = match draw.below(4) {
        0 => Smoothing::Cells(10f64.powf(-2.0 + 3.0 * draw.0.next())),
        1 => Smoothing::Cells(0.0),
        _ => Smoothing::Auto,
    };
    if draw.chance(0.1) {
        options = options.screening(draw.scale::<T>(-0.2, 0.2));
    }
    options.level = [Level::Mean, Level::Local, Level::Thin][draw.below(3)];
    if draw.chance(0.2) {
        options.band = Band::Within(size * draw.0.next());
    }
    options.surface = match draw.below(4) {
        0 => SurfaceResolution::Auto,
        1 => SurfaceResolution::Factor(1.0 + 2.0 * draw.0.next()),
        _ => SurfaceResolution::Grid,
    };
    options.walls = [Walls::Auto, Walls::Free, Walls::Closed][draw.below(3)];
    options.checks = draw.chance(0.2);
    options
}

/// Numbers of one size, or of all sizes up to it.
fn bars<T: Pipeline>(n: usize, draw: &mut Draw) -> Option<Vec<T>> {
    if draw.chance(0.4) {
        return None;
    }
    let size = draw.scale::<T>(-1.0, 0.99);
    let spread = draw.chance(0.3);
    let number = |_| {
        let size = if spread {
            size.powf(draw.0.next())
        } else {
            size
        };
        T::of(size * draw.signed())
    };
    Some((0..n).map(number).collect())
}

fn triples<T: Copy>(values: Option<Vec<T>>) -> Option<Vec<[T; 3]>> {
    values.map(|values| values.as_chunks().0.to_vec())
}

fn not_finite<'a, T: Pipeline>(values: impl IntoIterator<Item = &'a T>) -> usize {
    values.into_iter().filter(|x| !x.is_finite()).count()
}

/// Names and numbers of the entries that are not finite.
pub type Bad = Vec<(&'static str, usize)>;

fn of_result<T: Pipeline>(result: &Reconstruction<T>) -> Bad {
    vec![
        ("φ", not_finite(result.sdf().values())),
        ("χ", not_finite(result.indicator().values())),
        ("iso-value", not_finite([&result.iso_value()])),
        (
            "vertices",
            not_finite(result.mesh().vertices().iter().flatten()),
        ),
        ("normals", not_finite(result.normals().iter().flatten())),
        ("confidence", not_finite(result.confidence())),
        ("areas", not_finite(result.areas())),
    ]
}

pub fn of_gradients<T: Pipeline>(bar: &CloudCotangent<T>) -> Bad {
    vec![
        ("points", not_finite(bar.points.iter().flatten())),
        ("given normals", not_finite(bar.normals.iter().flatten())),
        ("attributes", not_finite(bar.attributes.iter().flatten())),
        (
            "grid",
            not_finite(bar.grid.lower.iter().chain([&bar.grid.spacing])),
        ),
    ]
}

/// Outcome of a case.
pub struct Outcome {
    /// Cloud and options, for messages.
    pub text: String,
    pub bad: Bad,
    /// Gradients that were replaced or bounded, as reported.
    pub guarded: usize,
    /// Gradients that are the largest number of their type.
    pub maxima: usize,
}

fn extent<T: Pipeline>(points: &[[T; 3]]) -> f64 {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let size = |a: usize| {
        let coordinates = points.iter().map(|p| p[a].f64());
        let [low, high] = coordinates.fold(none, |[l, h], x| [l.min(x), h.max(x)]);
        high - low
    };
    (0..3).map(size).fold(0.0, f64::max)
}

/// Why something was refused.
fn refused(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// A random cloud, reconstructed and pulled back; `Err` where it is refused.
pub fn case<T: Pipeline>(seed: u64) -> Result<Outcome, String> {
    let draw = &mut Draw(Uniform::new(seed));
    let (points, own_grid) = points::<T>(draw);
    let normals = normals(&points, draw);
    let size = extent(&points);
    let options = options::<T>(size, draw);
    let n = 2 * points.len();
    let attribute = Attribute {
        name: "a".into(),
        components: 2,
        values: bars(n, draw).unwrap_or_else(|| vec![T::one(); n]),
    };
    let cloud = PointCloud::new(points).map_err(refused)?;
    let cloud = cloud.with_normals(normals).map_err(refused)?;
    let cells = 10 + draw.below(12);
    let grid = if own_grid {
        Grid::new([T::of(-4.0); 3], T::of(8.0 / cells as f64), [cells; 3])
    } else {
        Grid::fit(&cloud, Resolution::Cells(cells), T::of(0.1))
    };
    let grid = grid.map_err(refused)?;
    let text = format!("{} points, {options:?}, {grid:?}", cloud.len());
    let mut plan = Reconstructor::new(grid, options).map_err(refused)?;
    let result = plan.reconstruct(&cloud).map_err(refused)?;
    let mut bad = of_result(result);
    let bar = pulled(result, &attribute, 0.1 * size, &mut bad, draw)?;
    bad.extend(of_gradients(&bar));
    let all = bar.points.iter().chain(&bar.normals).flatten();
    Ok(Outcome {
        text,
        bad,
        guarded: bar.guarded,
        maxima: all.filter(|x| x.abs() == T::max_value()).count(),
    })
}

/// Gradients of random cotangents; adds what is not finite of an extension to `bad`.
fn pulled<T: Pipeline>(
    result: &Reconstruction<T>,
    attribute: &Attribute<T>,
    band: f64,
    bad: &mut Bad,
    draw: &mut Draw,
) -> Result<CloudCotangent<T>, String> {
    let fields = [result.sdf(), result.indicator()];
    let [sdf, indicator] = fields.map(|field| bars(field.values().len(), draw));
    let samples = result.areas().len();
    let (areas, iso_value) = (bars(samples, draw), bars(1, draw));
    let vertices = triples(bars(3 * result.mesh().vertices().len(), draw));
    let normals = triples(bars(3 * samples, draw));
    let extended = draw
        .chance(0.3)
        .then(|| result.extend_with_residual(attribute, band));
    let extended = extended.and_then(Result::ok);
    let extended = extended.map(|(extension, residual)| {
        let values = extension.vertices.iter().chain(&extension.values);
        bad.push(("extension", not_finite(values)));
        let at_vertices = bars(extension.vertices.len(), draw);
        let in_band = bars(extension.values.len(), draw);
        (extension, residual, at_vertices, in_band)
    });
    let extensions = extended.iter();
    let extensions: Vec<ExtensionCotangent<'_, T>> = extensions
        .map(
            |(extension, residual, vertices, values)| ExtensionCotangent {
                attribute,
                extension,
                residual,
                vertices: vertices.as_deref(),
                values: values.as_deref(),
            },
        )
        .collect();
    let cotangent = Cotangent {
        sdf: sdf.as_deref(),
        indicator: indicator.as_deref(),
        iso_value: iso_value.map_or(T::zero(), |x| x[0]),
        vertices: vertices.as_deref(),
        normals: normals.as_deref(),
        areas: areas.as_deref(),
        extensions: &extensions,
    };
    result.pullback(&cotangent).map_err(refused)
}
