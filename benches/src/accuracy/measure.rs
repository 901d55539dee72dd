//! Errors of one reconstruction against the exact distance of its body.

use isograd::differential::{self, Bins, Differential, EikonalOptions, eikonal};
use isograd::isosurface::Measures;
use isograd::{Field, Mesh, Pipeline, PointCloud, Reconstruction, Reconstructor};
use isograd_element::vector;
use isograd_shapes::Shape;
use serde::Serialize;

use super::case::{Case, Normals};
use super::exact::Exact;
use crate::output::Outcome;
use crate::statistics::Spread;

/// φ is compared where the exact distance is below this many cells.
pub const BAND: f64 = 3.0;

/// Bins of the histograms of `|∇φ|`.
pub const BINS: Bins = Bins {
    lower: 0.0,
    upper: 1.25,
    count: 125,
};

/// Errors of a surface. Lengths are in cells.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Surface {
    /// |Distance to the body| of the vertices.
    pub vertices: Spread,
    /// |Distance to the body| of the centroids of the faces.
    pub faces: Spread,
    /// Relative error of the area, with its sign.
    pub area: f64,
    /// Relative error of the volume, with its sign.
    pub volume: f64,
    /// Whether the surface is closed.
    pub closed: bool,
    /// Number of connected components.
    pub components: usize,
}

/// Errors of estimated normals against those of the body at the samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NormalErrors {
    /// Angle between axis and axis, in degrees.
    pub degrees: Spread,
    /// Fraction of the samples whose sign is wrong.
    pub wrong_signs: f64,
}

/// Distribution of `|∇φ|` over some cells.
#[derive(Clone, Debug, Serialize)]
pub struct Slope {
    /// Mean.
    pub mean: f64,
    /// 5th percentile.
    pub p05: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Fraction of the cells in each of the [`BINS`].
    #[serde(skip)]
    pub shares: Vec<f64>,
}

/// Errors of the gradient of the field.
#[derive(Clone, Debug, Serialize)]
pub struct FieldErrors {
    /// Angle between ∇φ and the exact normal, at the samples, in degrees.
    pub gradient: Spread,
    /// `|∇φ|` over all cells.
    pub slope_all: Slope,
    /// `|∇φ|` over the cells with |φ| below 3 cells.
    pub slope_near: Slope,
}

/// Errors of one case.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Cell size, in the body's unit.
    pub cell: f64,
    /// Sample spacing, in cells.
    pub sample_spacing: f64,
    /// The zero set.
    pub surface: Surface,
    /// |Error of φ| where the exact |φ| is below 3 cells, in cells.
    pub band: Spread,
    /// Errors of the normals, if they were estimated.
    pub normal_errors: Option<NormalErrors>,
    /// Errors of the gradient, if φ was computed in all cells.
    pub field: Option<FieldErrors>,
}

/// Reconstructs one case and measures its errors. `cloud` has the exact normals.
pub fn measure<T: Pipeline>(
    case: &Case,
    shape: &Shape,
    exact: &Exact,
    plan: &mut Reconstructor<T>,
    cloud: &PointCloud<T>,
) -> Outcome<Measured> {
    let result = plan.reconstruct(cloud)?;
    let cell = result.sdf().grid().spacing().f64();
    let truth = cloud
        .normals()
        .ok_or("the cloud has no normals to compare with")?;
    let normal_errors =
        (case.normals == Normals::Estimated).then(|| normal_errors(result.normals(), truth));
    let field = case
        .is_default()
        .then(|| field_errors(result, cloud.points(), truth));
    Ok(Measured {
        cell,
        sample_spacing: result.report().sample_spacing / cell,
        surface: surface_errors(result.mesh(), shape, cell),
        band: band_errors(result.sdf(), exact),
        normal_errors,
        field: field.transpose()?,
    })
}

/// Errors of a mesh that approximates the surface of `shape`.
pub fn surface_errors<T: Pipeline>(mesh: &Mesh<T>, shape: &Shape, cell: f64) -> Surface {
    let distance = |x: [f64; 3]| shape.distance(x).unwrap_or(f64::NAN) / cell;
    let vertices = mesh.vertices();
    let centroid = |face: usize| {
        let [a, b, c] = mesh.corners(face).map(vector::to_f64);
        vector::scale(vector::add(vector::add(a, b), c), 1.0 / 3.0)
    };
    let measures = Measures::of(mesh);
    Surface {
        vertices: Spread::of(vertices.len(), |i| distance(vector::to_f64(vertices[i]))),
        faces: Spread::of(mesh.faces().len(), |f| distance(centroid(f))),
        area: measures.area / shape.area() - 1.0,
        volume: measures.volume / shape.volume() - 1.0,
        closed: measures.closed,
        components: measures.components,
    }
}

fn normal_errors<T: Pipeline>(estimated: &[[T; 3]], truth: &[[T; 3]]) -> NormalErrors {
    let along = |i: usize| vector::dot(estimated[i], truth[i]);
    let wrong = (0..truth.len()).filter(|&i| along(i) < T::zero()).count();
    let axis = |i: usize| {
        let degrees = angle(vector::to_f64(estimated[i]), vector::to_f64(truth[i]));
        degrees.min(180.0 - degrees)
    };
    NormalErrors {
        degrees: Spread::of(truth.len(), axis),
        wrong_signs: wrong as f64 / truth.len().max(1) as f64,
    }
}

fn band_errors<T: Pipeline>(phi: &Field<T>, exact: &Exact) -> Spread {
    let (near, cell) = (exact.near(), phi.grid().spacing().f64());
    Spread::of(near.len(), |i| {
        (phi.values()[near[i]].f64() - exact.at(near[i])) / cell
    })
}

fn field_errors<T: Pipeline>(
    result: &Reconstruction<T>,
    points: &[[T; 3]],
    truth: &[[T; 3]],
) -> Outcome<FieldErrors> {
    let phi = result.sdf();
    let [slope_all, slope_near] = slopes(phi)?;
    Ok(FieldErrors {
        gradient: gradient_errors(phi, points, truth)?,
        slope_all,
        slope_near,
    })
}

/// Samples lie on the exact surface, and their exact normals are `∇φ` there.
fn gradient_errors<T: Pipeline>(
    phi: &Field<T>,
    points: &[[T; 3]],
    truth: &[[T; 3]],
) -> Outcome<Spread> {
    let mut local = Vec::new();
    Differential::new(phi, &differential::Options::default()).at_points(points, &mut local)?;
    Ok(Spread::of(points.len(), |i| {
        angle(vector::to_f64(local[i].gradient), vector::to_f64(truth[i]))
    }))
}

/// `|∇φ|` over all cells, and near the surface.
fn slopes<T: Pipeline>(phi: &Field<T>) -> Outcome<[Slope; 2]> {
    let spread = eikonal(
        phi,
        &EikonalOptions {
            near: BAND,
            bins: BINS,
        },
    );
    let slope = |spread: Option<differential::Spread>| {
        let spread = spread.ok_or("no cell of φ has a gradient")?;
        let share = |&count: &u64| count as f64 / spread.cells as f64;
        Ok::<_, &str>(Slope {
            mean: spread.mean,
            p05: spread.p05,
            p95: spread.p95,
            shares: spread.histogram.iter().map(share).collect(),
        })
    };
    Ok([slope(spread.all)?, slope(spread.near)?])
}

/// Angle between two directions in degrees, accurate for small ones too.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let across = vector::norm(vector::cross(a, b));
    across.atan2(vector::dot(a, b)).to_degrees()
}
