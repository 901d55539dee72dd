//! A growing sphere: derivatives of area, volume and φ against their closed forms.

use std::f64::consts::PI;

use isograd::isosurface::Level;
use isograd::isosurface::measure_pullback;
use isograd::{Cotangent, Options, Reconstructor, SurfaceResolution};
use isograd_element::vector::dot;
use serde::Serialize;

use crate::output::Outcome;
use crate::sampling::{Body, Draw, Sampled, points_only};

/// Relative errors on one grid.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Sphere {
    /// Cells along each axis.
    pub cells: usize,
    /// Number of samples.
    pub samples: usize,
    /// Distribution of the samples.
    pub draw: Draw,
    /// Error of `d(area)/dr = 8πr`.
    pub area: f64,
    /// Error of `d(volume)/dr = 4πr²`.
    pub volume: f64,
    /// Error of the mean over all cells of `dφ/dr = −1`.
    pub phi: f64,
}

/// Measures a sphere whose points move along their exact normals.
pub fn measure(cells: usize, samples: usize, draw: Draw) -> Outcome<Sphere> {
    let body = Body {
        name: "sphere",
        shape: [cells; 3],
        samples,
    };
    let sampled = body.sample(draw)?;
    let radius = sampled.shape.get("radius")?;
    let cloud = points_only(sampled.cloud.points())?;
    let options = Options::default()
        .surface(SurfaceResolution::Grid)
        .level(Level::Local)
        .checks(false);
    let mut plan = Reconstructor::new(sampled.grid, options)?;
    let result = plan.reconstruct(&cloud)?;
    let grown = |cotangent: &Cotangent<'_, f64>| -> Outcome<f64> {
        let out = result.pullback(cotangent)?;
        along_normals(&out.points, &sampled)
    };
    let of_mesh = |area: f64, volume: f64| -> Outcome<f64> {
        let mut vertices = Vec::new();
        measure_pullback(result.mesh(), area, volume, &mut vertices);
        grown(&Cotangent {
            vertices: Some(&vertices),
            ..Cotangent::default()
        })
    };
    let mean = vec![1.0 / result.sdf().values().len() as f64; result.sdf().values().len()];
    let phi = grown(&Cotangent {
        sdf: Some(&mean),
        ..Cotangent::default()
    })?;
    Ok(Sphere {
        cells,
        samples,
        draw,
        area: of_mesh(1.0, 0.0)? / (8.0 * PI * radius) - 1.0,
        volume: of_mesh(0.0, 1.0)? / (4.0 * PI * radius * radius) - 1.0,
        phi: -phi - 1.0,
    })
}

fn along_normals(bar: &[[f64; 3]], sampled: &Sampled) -> Outcome<f64> {
    let normals = sampled.cloud.normals().ok_or("samples without normals")?;
    Ok(bar.iter().zip(normals).map(|(&bar, &n)| dot(bar, n)).sum())
}
