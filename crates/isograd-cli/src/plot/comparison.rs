//! A body beside its target: a view of both surfaces, two sections of the field with both zero contours, and
//! the error in the same sections (the paper's figures of shape optimization).

use isograd::{Field, Mesh, Real};
use isograd_element::vector::to_f64;

use super::axis::{label, step};
use super::canvas::{Anchor, Canvas, Color, WHITE};
use super::color::Range;
use super::scene::{Camera, Scene, View};
use super::slice::{Slice, Style};

const WIDTH: usize = 620;
const MARGIN: usize = 18;
const LETTERS: f32 = 21.0;
/// Height of a line of text with the room around it.
const LINE: usize = 32;
const TALLEST: f64 = 300.0;
const FITTED: Color = [0.10, 0.22, 0.48];
const TARGET: Color = [0.82, 0.83, 0.84];
/// Of the target's contour.
const CONTOUR: Color = [0.93, 0.55, 0.05];
/// How much of the target's surface covers what is behind it.
const TRANSLUCENT: f32 = 0.42;
const NAMES: [&str; 3] = ["x", "y", "z"];
/// Across y: the paper's x–z plane; across x: its y–z plane.
const NORMALS: [usize; 2] = [1, 0];

/// A target, ready to be compared with.
pub struct Comparison {
    sdf: Field<f64>,
    vertices: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    view: View,
    sections: [Slice; 2],
}

impl Comparison {
    /// The target's field and its surface.
    pub fn new(sdf: &Field<f64>, surface: &Mesh<f64>, camera: Camera) -> Self {
        Self {
            view: View::new(camera, surface.vertices()),
            vertices: surface.vertices().to_vec(),
            faces: surface.faces().to_vec(),
            sections: NORMALS.map(|normal| Slice::fullest(sdf, normal)),
            sdf: sdf.clone(),
        }
    }

    /// The picture of a body: its surface and its field, which is on the target's grid.
    pub fn draw<T: Real>(&self, mesh: &Mesh<T>, sdf: &Field<T>, title: &str) -> Canvas {
        let h = self.sdf.grid().spacing();
        let mut error = self.sdf.clone();
        for (target, value) in error.values_mut().iter_mut().zip(sdf.values()) {
            *target = (value.f64() - *target) / h;
        }
        let mut pictures = vec![(title.to_string(), self.surfaces(mesh))];
        for target in &self.sections {
            let section = Slice::new(sdf, target.normal, target.position);
            pictures.push((caption("φ", target), drawn(&section, target)));
        }
        for target in &self.sections {
            let off = Slice::new(&error, target.normal, target.position);
            let (low, high) = off.range();
            let most = low.abs().max(high.abs());
            let caption = caption("error", target);
            let range = format!("{caption}, up to {} cells", label(most, 0.02 * most));
            pictures.push((range, drawn_error(&off, target, most)));
        }
        stacked(&pictures)
    }

    /// The body in dark blue, the target translucent over it.
    fn surfaces<T: Real>(&self, mesh: &Mesh<T>) -> Canvas {
        let height = (WIDTH as f64 * self.view.aspect().clamp(0.3, 0.8)) as usize;
        let mut scene = Scene::new(WIDTH, height, &self.view);
        let vertices: Vec<[f64; 3]> = mesh.vertices().iter().map(|&v| to_f64(v)).collect();
        scene.surface(&vertices, mesh.faces(), FITTED);
        scene.translucent(&self.vertices, &self.faces, TARGET, TRANSLUCENT);
        scene.finish()
    }
}

fn caption(what: &str, slice: &Slice) -> String {
    let extent = slice.spacing * slice.shape[0].max(slice.shape[1]) as f64;
    let at = label(slice.position, step(extent, 100));
    format!("{what} at {} = {at}", NAMES[slice.normal])
}

/// Pixels per cell, so that the section fills its place.
fn scale(slice: &Slice) -> f64 {
    let [n, m] = slice.shape.map(|n| n as f64);
    (WIDTH as f64 / n).min(TALLEST / m)
}

/// Colors and contours of a section, and the target's zero contour over its own.
fn drawn(section: &Slice, target: &Slice) -> Canvas {
    let (low, high) = target.range();
    let style = Style::new(Range::new(low, high), scale(section), 2.6);
    let mut picture = section.draw(&style);
    target.outline(&mut picture, style.scale, 1.5, CONTOUR);
    picture
}

/// Colors of an error of at most `most`, and the target's zero contour.
fn drawn_error(off: &Slice, target: &Slice, most: f64) -> Canvas {
    let style = Style {
        range: Range::new(-most, most),
        contour_steps: [0.0; 2],
        scale: scale(off),
        zero_width: 0.0,
    };
    let mut picture = off.draw(&style);
    target.outline(&mut picture, style.scale, 1.5, [0.35; 3]);
    picture
}

/// Pictures below one another, each with a line of text above it.
fn stacked(pictures: &[(String, Canvas)]) -> Canvas {
    let heights = pictures.iter().map(|(_, p)| p.height() + LINE + MARGIN);
    let height = heights.sum::<usize>() + MARGIN;
    let mut canvas = Canvas::new(WIDTH + 2 * MARGIN, height, WHITE);
    let mut top = MARGIN;
    for (text, picture) in pictures {
        let middle = [0.5 * canvas.width() as f32, (top + LINE / 2) as f32];
        canvas.text(text, middle, Anchor::Middle, LETTERS);
        let left = MARGIN + (WIDTH - picture.width().min(WIDTH)) / 2;
        canvas.paste(picture, left, top + LINE);
        top += LINE + picture.height() + MARGIN;
    }
    canvas
}

/// Pictures in a row.
pub fn side_by_side(pictures: &[&Canvas]) -> Canvas {
    let width: usize = pictures.iter().map(|p| p.width()).sum();
    let height = pictures.iter().map(|p| p.height()).max();
    let mut canvas = Canvas::new(width.max(1), height.unwrap_or(1), WHITE);
    let mut left = 0;
    for picture in pictures {
        canvas.paste(picture, left, 0);
        left += picture.width();
    }
    canvas
}
