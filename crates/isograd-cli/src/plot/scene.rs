//! Three-dimensional views: shaded triangles and points with a depth buffer.

use isograd_element::vector::{self, cross, dot, scale, sub};

use super::canvas::{Canvas, Color, WHITE};

/// Pixels drawn for each pixel shown, along each axis.
const SUPERSAMPLING: usize = 3;

/// Depth, in pixels drawn, over which something translucent comes to cover what is behind it.
const FADE: f64 = 8.0;

/// Where the viewer stands: a parallel projection, z upward.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Turn about z, in degrees: 0 looks along +y, with x to the right.
    pub azimuth: f64,
    /// Height above the horizon, in degrees.
    pub elevation: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            azimuth: 25.0,
            elevation: 22.0,
        }
    }
}

impl Camera {
    /// Right, up and toward the viewer, as unit vectors.
    fn axes(&self) -> [[f64; 3]; 3] {
        let (sin_a, cos_a) = self.azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = self.elevation.to_radians().sin_cos();
        let right = [cos_a, sin_a, 0.0];
        let toward = [sin_a * cos_e, -cos_a * cos_e, sin_e];
        [right, cross(toward, right), toward]
    }
}

/// A camera, and the box on its screen that some points fill.
#[derive(Clone, Copy, Debug)]
pub struct View {
    axes: [[f64; 3]; 3],
    center: [f64; 3],
    /// Width and height, in the points' unit.
    size: [f64; 2],
}

impl View {
    /// The view of `points`.
    pub fn new(camera: Camera, points: &[[f64; 3]]) -> Self {
        let axes = camera.axes();
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for &point in points {
            for a in 0..3 {
                let x = dot(axes[a], point);
                low[a] = low[a].min(x);
                high[a] = high[a].max(x);
            }
        }
        if points.is_empty() {
            (low, high) = ([-1.0; 3], [1.0; 3]);
        }
        let middle: [f64; 3] = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
        let center = (0..3).fold([0.0; 3], |c, a| vector::add(c, scale(axes[a], middle[a])));
        Self {
            axes,
            center,
            size: [high[0] - low[0], high[1] - low[1]],
        }
    }

    /// Height over width.
    pub fn aspect(&self) -> f64 {
        let ratio = self.size[1] / self.size[0];
        if ratio.is_finite() { ratio } else { 1.0 }
    }
}

/// A picture being drawn.
pub struct Scene {
    canvas: Canvas,
    depth: Vec<f64>,
    axes: [[f64; 3]; 3],
    center: [f64; 3],
    /// Pixels per unit length.
    zoom: f64,
    lights: Lights,
}

/// Directions to the lights.
#[derive(Clone, Copy)]
struct Lights {
    key: [f64; 3],
    fill: [f64; 3],
    /// Normal of a surface that mirrors the key light to the viewer.
    half: [f64; 3],
}

impl Lights {
    fn new([right, up, toward]: [[f64; 3]; 3]) -> Self {
        let light = |r: f64, u: f64, t: f64| {
            let direction: [f64; 3] =
                std::array::from_fn(|a| r * right[a] + u * up[a] + t * toward[a]);
            vector::normalized(direction).unwrap_or(toward)
        };
        let key = light(-0.5, 0.8, 0.7);
        Self {
            key,
            fill: light(0.9, 0.1, 0.5),
            half: vector::normalized(vector::add(key, toward)).unwrap_or(toward),
        }
    }
}

impl Scene {
    /// An empty scene of `width` by `height` pixels that the view fills.
    pub fn new(width: usize, height: usize, view: &View) -> Self {
        let size = [width * SUPERSAMPLING, height * SUPERSAMPLING];
        let room = |pixels: usize, length: f64| 0.97 * pixels as f64 / length.max(1e-300);
        Self {
            canvas: Canvas::new(size[0], size[1], WHITE),
            depth: vec![f64::NEG_INFINITY; size[0] * size[1]],
            zoom: room(size[0], view.size[0]).min(room(size[1], view.size[1])),
            center: view.center,
            axes: view.axes,
            lights: Lights::new(view.axes),
        }
    }

    /// Position on the screen, in pixels from the top left, and the depth, which grows toward the
    /// viewer.
    fn project(&self, point: [f64; 3]) -> [f64; 3] {
        let from = sub(point, self.center);
        let [x, y, z] = self.axes.map(|axis| self.zoom * dot(axis, from));
        let (width, height) = (self.canvas.width() as f64, self.canvas.height() as f64);
        [0.5 * width + x, 0.5 * height - y, z]
    }

    fn put(&mut self, x: usize, y: usize, depth: f64, color: Color) {
        let place = y * self.canvas.width() + x;
        if depth > self.depth[place] {
            self.depth[place] = depth;
            self.canvas.blend(x as i64, y as i64, color, 1.0);
        }
    }

    /// Triangles with smooth shading: normals at the vertices are area-weighted means of the faces'.
    pub fn surface(&mut self, vertices: &[[f64; 3]], faces: &[[u32; 3]], color: Color) {
        let normals = vertex_normals(vertices, faces);
        let screen: Vec<[f64; 3]> = vertices.iter().map(|&v| self.project(v)).collect();
        for face in faces {
            let corners = face.map(|v| screen[v as usize]);
            let shades = face.map(|v| normals[v as usize]);
            self.triangle(corners, shades, color);
        }
    }

    /// A translucent surface: it covers `alpha` of what is behind its front, and nothing of what is in front of it.
    pub fn translucent(
        &mut self,
        vertices: &[[f64; 3]],
        faces: &[[u32; 3]],
        color: Color,
        alpha: f32,
    ) {
        let (width, height) = (self.canvas.width(), self.canvas.height());
        let mut layer = Self {
            canvas: Canvas::new(width, height, WHITE),
            depth: vec![f64::NEG_INFINITY; self.depth.len()],
            ..*self
        };
        layer.surface(vertices, faces, color);
        for (place, &depth) in layer.depth.iter().enumerate() {
            let (x, y) = (place % width, place / width);
            if depth > self.depth[place]
                && let Some(seen) = layer.canvas.pixel(x, y)
            {
                // Where two surfaces all but coincide, which is in front means nothing.
                let clear = ((depth - self.depth[place]) / FADE).min(1.0) as f32;
                self.canvas.blend(x as i64, y as i64, seen, alpha * clear);
            }
        }
    }

    fn triangle(&mut self, corners: [[f64; 3]; 3], normals: [[f64; 3]; 3], color: Color) {
        let [a, b, c] = corners;
        let doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if !(doubled.abs() > 1e-12) {
            return;
        }
        let [columns, rows] = self.pixels_of(corners);
        for y in rows {
            for x in columns.clone() {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let weight = |q: [f64; 3], r: [f64; 3]| {
                    ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / doubled
                };
                let w = [weight(b, c), weight(c, a), weight(a, b)];
                if w.iter().all(|&w| w >= 0.0) {
                    let mean = |of: [f64; 3]| w[0] * of[0] + w[1] * of[1] + w[2] * of[2];
                    let depth = mean(corners.map(|corner| corner[2]));
                    let normal = std::array::from_fn(|a| mean(normals.map(|n| n[a])));
                    let shaded = self.shade(normal, color);
                    self.put(x, y, depth, shaded);
                }
            }
        }
    }

    /// The pixels of the box around a triangle, within the canvas.
    fn pixels_of(&self, corners: [[f64; 3]; 3]) -> [std::ops::Range<usize>; 2] {
        let sizes = [self.canvas.width(), self.canvas.height()];
        std::array::from_fn(|axis| {
            let values = corners.map(|corner| corner[axis]);
            let low = values[0].min(values[1]).min(values[2]);
            let high = values[0].max(values[1]).max(values[2]);
            // A negative number becomes 0.
            (low.floor() as usize).min(sizes[axis])..(high.ceil() as usize).min(sizes[axis])
        })
    }

    /// Points as little spheres of `radius` pixels, lit by their normals where there are any; those whose
    /// normals face away from the viewer are left out, as a solid body would hide them.
    pub fn points(
        &mut self,
        points: &[[f64; 3]],
        normals: Option<&[[f64; 3]]>,
        radius: f64,
        color: Color,
    ) {
        let radius = radius * SUPERSAMPLING as f64;
        for (i, &point) in points.iter().enumerate() {
            let [x, y, depth] = self.project(point);
            let normal = normals.map_or(self.axes[2], |normals| normals[i]);
            if !(dot(normal, self.axes[2]) >= 0.0) {
                continue;
            }
            let shaded = self.shade(normal, color);
            let (low, high) = ([x - radius, y - radius, 0.0], [x + radius, y + radius, 0.0]);
            let [columns, rows] = self.pixels_of([low, high, high]);
            for py in rows {
                for px in columns.clone() {
                    let (dx, dy) = (px as f64 + 0.5 - x, py as f64 + 0.5 - y);
                    let up = radius * radius - dx * dx - dy * dy;
                    if up > 0.0 {
                        let rim = (up.sqrt() / radius) as f32;
                        let darker = shaded.map(|c| c * (0.72 + 0.28 * rim));
                        self.put(px, py, depth + 0.5 * up.sqrt(), darker);
                    }
                }
            }
        }
    }

    /// A key light from above left, a weaker one from the right, light from everywhere, and a highlight.
    fn shade(&self, normal: [f64; 3], color: Color) -> Color {
        let Some(normal) = vector::normalized(normal) else {
            return color;
        };
        // Seen from behind, a surface is lit as from the front.
        let side = if dot(normal, self.axes[2]) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let normal = scale(normal, side);
        let Lights { key, fill, half } = self.lights;
        let diffuse = 0.36 + 0.58 * dot(normal, key).max(0.0) + 0.16 * dot(normal, fill).max(0.0);
        let highlight = 0.16 * dot(normal, half).max(0.0).powi(40);
        color.map(|c| (c * diffuse as f32 + highlight as f32).min(1.0))
    }

    /// The picture, at the size that was asked for.
    pub fn finish(self) -> Canvas {
        self.canvas.shrunk(SUPERSAMPLING)
    }
}

/// Area-weighted means of the faces' normals, smoothed a little: an isosurface has slivers whose normals
/// are noise, and in a highlight it shows.
fn vertex_normals(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> Vec<[f64; 3]> {
    const SMOOTHING: usize = 3;
    let mut normals = vec![[0.0; 3]; vertices.len()];
    for face in faces {
        let [a, b, c] = face.map(|v| vertices[v as usize]);
        let area = cross(sub(b, a), sub(c, a));
        for &v in face {
            normals[v as usize] = vector::add(normals[v as usize], area);
        }
    }
    for _ in 0..SMOOTHING {
        normals = smoothed(&normals, faces);
    }
    normals
}

/// The mean of each vertex' unit normal and those of its neighbors.
fn smoothed(normals: &[[f64; 3]], faces: &[[u32; 3]]) -> Vec<[f64; 3]> {
    let units: Vec<[f64; 3]> = normals
        .iter()
        .map(|&n| vector::normalized(n).unwrap_or_default())
        .collect();
    let mut sums = units.clone();
    for face in faces {
        let [a, b, c] = face.map(|v| units[v as usize]);
        let sum = vector::add(a, vector::add(b, c));
        for &v in face {
            sums[v as usize] = vector::add(sums[v as usize], sum);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<[f64; 3]> {
        let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 1 { 1.0 } else { -1.0 });
        (0..8).map(corner).collect()
    }

    #[test]
    fn the_camera_is_a_right_handed_frame() {
        for azimuth in [-70.0, 0.0, 25.0, 180.0] {
            let [right, up, toward] = Camera {
                azimuth,
                elevation: 30.0,
            }
            .axes();
            let third = cross(right, up);
            for a in 0..3 {
                assert!((third[a] - toward[a]).abs() < 1e-12);
            }
            assert!(up[2] > 0.0, "z points upwards on the screen");
        }
    }

    #[test]
    fn the_nearer_triangle_hides_the_farther_whatever_the_order() {
        let camera = Camera {
            azimuth: 0.0,
            elevation: 0.0,
        };
        let triangle = |y: f64| [[-1.0, y, -1.0], [1.0, y, -1.0], [0.0, y, 1.0]];
        let faces = [[0, 1, 2]];
        let (red, green) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        for flipped in [false, true] {
            let mut scene = Scene::new(40, 40, &View::new(camera, &corners()));
            // The viewer is at −y.
            let mut both = [(-0.5, red), (0.5, green)];
            if flipped {
                both.reverse();
            }
            for (y, color) in both {
                scene.surface(&triangle(y), &faces, color);
            }
            let middle = scene.finish().pixel(20, 20).expect("inside");
            assert!(middle[0] > 0.3 && middle[1] < 0.3, "{middle:?}");
        }
    }

    #[test]
    fn what_is_translucent_tints_what_is_behind_it_alone() {
        let camera = Camera {
            azimuth: 0.0,
            elevation: 0.0,
        };
        let triangle = |y: f64| [[-1.0, y, -1.0], [1.0, y, -1.0], [0.0, y, 1.0]];
        let seen = |y: f64, alpha: f32| {
            let mut scene = Scene::new(40, 40, &View::new(camera, &corners()));
            scene.surface(&triangle(0.0), &[[0, 1, 2]], [1.0, 0.0, 0.0]);
            scene.translucent(&triangle(y), &[[0, 1, 2]], [0.0, 1.0, 0.0], alpha);
            scene.finish().pixel(20, 20).expect("inside")
        };
        let (red, behind) = (seen(-0.5, 0.0), seen(0.5, 0.5));
        assert_eq!(red, behind);
        let before = seen(-0.5, 0.5);
        assert!(
            before[0] < 0.6 * red[0] && before[1] > red[1] + 0.2,
            "{before:?}"
        );
    }

    #[test]
    fn the_view_shows_all_points_and_little_else() {
        let view = View::new(Camera::default(), &corners());
        let scene = Scene::new(60, 30, &view);
        let screen: Vec<[f64; 3]> = corners().iter().map(|&c| scene.project(c)).collect();
        let range = |a: usize| {
            let values = screen.iter().map(|p| p[a]);
            values.fold((f64::INFINITY, 0.0f64), |(l, h), x| (l.min(x), h.max(x)))
        };
        let ((left, right), (top, bottom)) = (range(0), range(1));
        assert!(left >= 0.0 && right <= 180.0 && top >= 0.0 && bottom <= 90.0);
        assert!(bottom - top > 85.0, "the height is what limits it");
        assert!((left + right - 180.0).abs() < 1e-9, "centered");
        assert!(
            View::new(Camera::default(), &[[1.0; 3]])
                .aspect()
                .is_finite()
        );
        assert!(View::new(Camera::default(), &[]).aspect().is_finite());
    }
}
