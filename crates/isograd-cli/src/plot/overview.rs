//! A cloud, the surface through it and a slice of its field, side by side.

use isograd::{Field, Mesh, PointCloud, Real};
use isograd_element::vector::to_f64;

use super::canvas::{Canvas, Color, WHITE};
use super::color::Range;
use super::scene::{Camera, Scene, View};
use super::slice::{Slice, Style};

const MARGIN: usize = 24;
/// More can't be told apart in a picture.
const MOST_POINTS: usize = 7000;
const CLOUD: Color = [0.30, 0.47, 0.62];
const SURFACE: Color = [0.80, 0.80, 0.78];

/// Draws `cloud`, `mesh` and the slice of `field` that shows most of the body, `width` pixels in all.
pub fn overview<T: Real>(
    cloud: &PointCloud<T>,
    mesh: &Mesh<T>,
    field: &Field<T>,
    camera: Camera,
    width: usize,
) -> Canvas {
    let points: Vec<[f64; 3]> = cloud.points().iter().map(|&p| to_f64(p)).collect();
    let view = View::new(camera, &points);
    let slice = Slice::fullest(field, flattest(cloud));
    let panel = (width.saturating_sub(4 * MARGIN) / 3).max(16);
    let of_slice = slice.shape[1] as f64 / slice.shape[0] as f64;
    // Tall enough for the views and for the slice, and no taller than wide.
    let height = (panel as f64 * view.aspect().max(of_slice).clamp(0.3, 1.0)) as usize;
    let mut canvas = Canvas::new(panel * 3 + 4 * MARGIN, height + 2 * MARGIN, WHITE);
    let pictures = [
        draw_cloud(cloud, &points, &view, panel, height),
        draw_surface(mesh, &view, panel, height),
        draw_slice(&slice, panel, height),
    ];
    for (i, picture) in pictures.iter().enumerate() {
        let x = MARGIN + i * (panel + MARGIN) + (panel - picture.width().min(panel)) / 2;
        let y = MARGIN + (height - picture.height().min(height)) / 2;
        canvas.paste(picture, x, y);
    }
    canvas
}

/// The axis along which the cloud is shortest: a slice across it shows most.
fn flattest<T: Real>(cloud: &PointCloud<T>) -> usize {
    let Some((low, high)) = cloud.bounds() else {
        return 2;
    };
    let length = |a: usize| (high[a] - low[a]).f64();
    let by_length = |a: &usize, b: &usize| length(*a).total_cmp(&length(*b));
    (0..3).min_by(by_length).unwrap_or(2)
}

fn draw_cloud<T: Real>(
    cloud: &PointCloud<T>,
    points: &[[f64; 3]],
    view: &View,
    width: usize,
    height: usize,
) -> Canvas {
    let mut scene = Scene::new(width, height, view);
    // Every so many, so that single samples can be seen.
    let stride = points.len().div_ceil(MOST_POINTS).max(1);
    let shown: Vec<[f64; 3]> = points.iter().step_by(stride).copied().collect();
    let normals: Option<Vec<[f64; 3]>> = cloud
        .normals()
        .map(|normals| normals.iter().step_by(stride).map(|&n| to_f64(n)).collect());
    let radius = (0.1 * (width * height) as f64 / shown.len().max(1) as f64).sqrt();
    scene.points(&shown, normals.as_deref(), radius.clamp(0.8, 3.0), CLOUD);
    scene.finish()
}

fn draw_surface<T: Real>(mesh: &Mesh<T>, view: &View, width: usize, height: usize) -> Canvas {
    let mut scene = Scene::new(width, height, view);
    let vertices: Vec<[f64; 3]> = mesh.vertices().iter().map(|&v| to_f64(v)).collect();
    scene.surface(&vertices, mesh.faces(), SURFACE);
    scene.finish()
}

fn draw_slice(slice: &Slice, width: usize, height: usize) -> Canvas {
    let (low, high) = slice.range();
    let [n, m] = slice.shape.map(|n| n as f64);
    let scale = (width as f64 / n).min(height as f64 / m);
    slice.draw(&Style::new(Range::new(low, high), scale, 2.6))
}
