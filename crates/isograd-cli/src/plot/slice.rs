//! One plane of a field as a picture: colors, contour lines, and the zero contour drawn boldly.

use isograd::{Field, Grid, Real};

use super::axis::step;
use super::canvas::{BLACK, Canvas, Color, WHITE};
use super::color::Range;

/// A plane of cell centers.
#[derive(Clone, Debug)]
pub struct Slice {
    /// The axis across the plane.
    pub normal: usize,
    /// The axes of the picture: rightward and upward.
    pub axes: [usize; 2],
    /// Where the plane lies along `normal`, in the field's unit.
    pub position: f64,
    /// Center of the first cell along the two axes.
    pub origin: [f64; 2],
    /// Cell size.
    pub spacing: f64,
    /// Number of cells along the two axes.
    pub shape: [usize; 2],
    /// Values, the first axis the slower.
    values: Vec<f64>,
}

/// How a slice is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    /// The color scale.
    pub range: Range,
    /// Distance between contour lines, inside and outside; 0 for none.
    pub contour_steps: [f64; 2],
    /// Pixels per cell.
    pub scale: f64,
    /// Width of the zero contour, in pixels.
    pub zero_width: f32,
}

impl Style {
    /// A style with round contour lines for values in `range`.
    pub fn new(range: Range, scale: f64, zero_width: f32) -> Self {
        Self {
            range,
            contour_steps: [step(range.inside, 4), step(range.outside, 14)],
            scale,
            zero_width,
        }
    }
}

impl Slice {
    /// The plane across `normal` with the most cells inside: the one that shows most of the body.
    pub fn fullest<T: Real>(field: &Field<T>, normal: usize) -> Self {
        let grid = field.grid();
        let mut inside = vec![0usize; grid.shape()[normal]];
        for (index, &value) in field.values().iter().enumerate() {
            inside[grid.cell(index)[normal]] += usize::from(value < T::zero());
        }
        // Of several, the one nearest the middle.
        let off_middle = |layer: usize| (2 * layer).abs_diff(inside.len() - 1);
        let fullest = (0..inside.len())
            .max_by_key(|&layer| (inside[layer], std::cmp::Reverse(off_middle(layer))));
        let mut cell = [0; 3];
        cell[normal] = fullest.unwrap_or(0);
        Self::new(field, normal, grid.center_f64(cell)[normal])
    }

    /// The plane of cells across `normal` that is nearest to `position`.
    pub fn new<T: Real>(field: &Field<T>, normal: usize, position: f64) -> Self {
        let grid = field.grid();
        let (axes, shape) = plane(grid, normal);
        let origin = grid.center_f64([0; 3]);
        let spacing = grid.spacing().f64();
        let last = grid.shape()[normal] - 1;
        let layer = ((position - origin[normal]) / spacing).round();
        let layer = (layer.max(0.0) as usize).min(last);
        let mut values = Vec::with_capacity(shape[0] * shape[1]);
        for i in 0..shape[0] {
            for j in 0..shape[1] {
                let mut cell = [layer; 3];
                cell[axes[0]] = i;
                cell[axes[1]] = j;
                values.push(field.at(cell).f64());
            }
        }
        Self {
            normal,
            axes,
            position: origin[normal] + spacing * layer as f64,
            origin: [origin[axes[0]], origin[axes[1]]],
            spacing,
            shape,
            values,
        }
    }

    /// Least and greatest finite value.
    pub fn range(&self) -> (f64, f64) {
        let finite = self.values.iter().filter(|v| v.is_finite());
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        })
    }

    /// Value at a place in cells from the first cell's center, bilinear.
    fn at(&self, [u, v]: [f64; 2]) -> f64 {
        let split = |x: f64, n: usize| {
            let x = x.clamp(0.0, (n - 1) as f64);
            let low = (x as usize).min(n.saturating_sub(2));
            (low, x - low as f64)
        };
        let [n, m] = self.shape;
        let ((i, s), (j, t)) = (split(u, n), split(v, m));
        let value = |i: usize, j: usize| self.values[i.min(n - 1) * m + j.min(m - 1)];
        let low = value(i, j) + t * (value(i, j + 1) - value(i, j));
        let high = value(i + 1, j) + t * (value(i + 1, j + 1) - value(i + 1, j));
        low + s * (high - low)
    }

    /// The picture.
    pub fn draw(&self, style: &Style) -> Canvas {
        let size = self
            .shape
            .map(|n| ((n as f64 * style.scale) as usize).max(1));
        let mut canvas = Canvas::new(size[0], size[1], WHITE);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let [value, slope] = self.at_pixel([x, y], size[1], style.scale);
                let mut color = style.range.color(value);
                let step = style.contour_steps[usize::from(value >= 0.0)];
                if step > 0.0 {
                    let nearest = (value / step).round() * step;
                    mix(&mut color, BLACK, 0.28 * cover(value - nearest, slope, 1.0));
                }
                if style.zero_width > 0.0 {
                    mix(&mut color, BLACK, cover(value, slope, style.zero_width));
                }
                canvas.blend(x as i64, y as i64, color, 1.0);
            }
        }
        canvas
    }

    /// Draws the zero contour alone over a picture of the same plane at the same scale.
    pub fn outline(&self, canvas: &mut Canvas, scale: f64, width: f32, color: Color) {
        let height = canvas.height();
        for y in 0..height {
            for x in 0..canvas.width() {
                let [value, slope] = self.at_pixel([x, y], height, scale);
                canvas.blend(x as i64, y as i64, color, cover(value, slope, width));
            }
        }
    }

    /// The value at a pixel of a picture `height` pixels high, and how much it changes from pixel to pixel.
    fn at_pixel(&self, [x, y]: [usize; 2], height: usize, scale: f64) -> [f64; 2] {
        let place = |x: f64, y: f64| {
            let up = height as f64 - y;
            self.at([(x + 0.5) / scale - 0.5, (up - 0.5) / scale - 0.5])
        };
        let (column, row) = (x as f64, y as f64);
        let across = place(column + 1.0, row) - place(column - 1.0, row);
        let down = place(column, row + 1.0) - place(column, row - 1.0);
        [place(column, row), 0.5 * across.hypot(down)]
    }
}

/// How much of a pixel a line covers whose level is `off` away, where values change by `slope` a pixel.
fn cover(off: f64, slope: f64, width: f32) -> f32 {
    let distance = (off / slope).abs() as f32;
    let reach = 0.5 * width + 0.5;
    // NaN, from 0/0 on a plateau at the level, covers nothing.
    if distance < reach {
        (reach - distance).min(1.0)
    } else {
        0.0
    }
}

fn mix(color: &mut Color, over: Color, alpha: f32) {
    for (c, o) in color.iter_mut().zip(over) {
        *c += alpha * (o - *c);
    }
}

/// The axes of the plane across `normal`, rightward and upward, and its cells.
fn plane<T: Real>(grid: &Grid<T>, normal: usize) -> ([usize; 2], [usize; 2]) {
    let axes = [[1, 2], [0, 2], [0, 1]][normal.min(2)];
    (axes, axes.map(|a| grid.shape()[a]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere() -> Field<f64> {
        let grid = Grid::new([-1.0; 3], 0.1, [20, 22, 24]).expect("valid");
        let mut field = Field::zeros(grid);
        for cell in 0..grid.cells() {
            let x = grid.center(grid.cell(cell));
            field.values_mut()[cell] = isograd_element::vector::norm(x) - 0.5;
        }
        field
    }

    #[test]
    fn a_slice_holds_the_values_of_its_plane() {
        let field = sphere();
        let slice = Slice::new(&field, 1, 0.02);
        assert_eq!((slice.axes, slice.shape), ([0, 2], [20, 24]));
        assert!((slice.position - 0.05).abs() < 1e-12);
        assert_eq!(slice.at([3.0, 5.0]), field.at([3, 10, 5]));
        let between = 0.5 * (field.at([3, 10, 5]) + field.at([3, 10, 6]));
        assert!((slice.at([3.0, 5.5]) - between).abs() < 1e-12);
        assert_eq!(slice.at([-4.0, 99.0]), field.at([0, 10, 23]));
    }

    #[test]
    fn the_fullest_plane_of_a_sphere_goes_through_its_center() {
        // Along z the center lies between the cells 9 and 10, and the grid's middle is at 11.5.
        let slice = Slice::fullest(&sphere(), 2);
        assert!(
            (slice.position.abs() - 0.05).abs() < 1e-12,
            "{}",
            slice.position
        );
    }

    #[test]
    fn the_zero_contour_is_black_and_lies_on_the_sphere() {
        let style = Style {
            range: Range::new(-0.5, 0.5),
            contour_steps: [0.0; 2],
            scale: 10.0,
            zero_width: 2.0,
        };
        let picture = Slice::new(&sphere(), 2, 0.0).draw(&style);
        assert_eq!((picture.width(), picture.height()), (200, 220));
        let dark = |x: usize| {
            picture
                .pixel(x, 120)
                .is_some_and(|c| c[0] < 0.3 && c[2] < 0.3)
        };
        // Row 120 from the top is 10 cells up: y = 0; the sphere is at x = ±0.5, 5 cells from the middle.
        assert!(dark(50) || dark(49), "left");
        assert!(dark(150) || dark(149), "right");
        assert!(!dark(100) && !dark(20), "elsewhere");
    }
}
