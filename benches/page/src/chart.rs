//! Lines over two axes, each linear or logarithmic.

use isograd_cli::plot::canvas::{Anchor, Canvas, Color, FAINT, INK};

/// Height of letters, in pixels.
pub const LETTERS: f32 = 20.0;
const TICK: f32 = 6.0;
const MARKER: f32 = 9.0;
const DASH: f32 = 10.0;

/// One axis: its name, its two ends, and the values that are written at it.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Name.
    pub name: &'static str,
    /// Value at the left or lower end.
    pub low: f64,
    /// Value at the right or upper end.
    pub high: f64,
    /// Values to be marked, with their labels.
    pub ticks: Vec<(f64, String)>,
    /// Whether equal factors, not equal steps, are equally far apart.
    pub logarithmic: bool,
}

impl Axis {
    /// Where a value lies, from 0 to 1; beyond that, outside.
    fn place(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Logarithmic, with these marks; a little wider than they are.
    pub fn marked(name: &'static str, marks: &[f64]) -> Self {
        let (low, high) = (marks[0] / 1.15, marks[marks.len() - 1] * 1.15);
        let ticks = marks.iter().map(|&mark| (mark, mark.to_string()));
        Self {
            name,
            low,
            high,
            ticks: ticks.collect(),
            logarithmic: true,
        }
    }

    /// Powers of ten between the ends.
    pub fn powers(name: &'static str, low: f64, high: f64) -> Self {
        let exponents = low.log10().ceil() as i32..=high.log10().floor() as i32;
        let ticks = exponents.map(|e| (10f64.powi(e), power_of_ten(e)));
        Self {
            name,
            low,
            high,
            ticks: ticks.collect(),
            logarithmic: true,
        }
    }
}

/// `0.01`, or `10⁻⁶` where that is shorter.
fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0..=3 => format!("{}", 10i32.pow(exponent as u32)),
        -3..0 => format!("{:.*}", -exponent as usize, 10f64.powi(exponent)),
        _ => {
            let raised = |c: char| match c {
                '-' => '⁻',
                '0' => '⁰',
                '1' => '¹',
                '2' => '²',
                '3' => '³',
                digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
            };
            format!(
                "10{}",
                exponent.to_string().chars().map(raised).collect::<String>()
            )
        }
    }
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Stroke {
    /// Its color.
    pub color: Color,
    /// Whether it is broken.
    pub dashed: bool,
    /// Whether its points are marked.
    pub marked: bool,
}

/// A line and its name in the legend; no name, no entry.
#[derive(Clone, Debug)]
pub struct Line {
    /// Name.
    pub name: String,
    /// How it is drawn.
    pub stroke: Stroke,
    /// Its points. Those that are not numbers, or not positive on a logarithmic axis, break it.
    pub points: Vec<[f64; 2]>,
}

/// A box of a picture, `(left, top, right, bottom)` in pixels, with its axes.
#[derive(Clone, Debug)]
pub struct Chart {
    /// The box.
    pub place: [f32; 4],
    /// Written above it.
    pub title: String,
    /// From left to right.
    pub across: Axis,
    /// From bottom to top.
    pub up: Axis,
}

impl Chart {
    /// Frame, axes, lines.
    pub fn draw(&self, canvas: &mut Canvas, lines: &[Line]) {
        self.axes(canvas);
        for line in lines {
            self.line(canvas, line);
        }
        canvas.frame(self.place, 1.4, INK);
    }

    /// Pixel of a pair of values; `None` where it can't be drawn.
    pub fn pixel(&self, [x, y]: [f64; 2]) -> Option<[f32; 2]> {
        let [left, top, right, bottom] = self.place;
        let (x, y) = (self.across.place(x) as f32, self.up.place(y) as f32);
        let drawn = x.is_finite() && y.is_finite();
        drawn.then_some([left + x * (right - left), bottom - y * (bottom - top)])
    }

    fn axes(&self, canvas: &mut Canvas) {
        let [left, top, right, bottom] = self.place;
        let small = 0.9 * LETTERS;
        for (value, label) in &self.across.ticks {
            let x = left + (right - left) * self.across.place(*value) as f32;
            canvas.line([x, top], [x, bottom], 1.0, FAINT, 1.0);
            canvas.line([x, bottom], [x, bottom + TICK], 1.4, INK, 1.0);
            canvas.text(
                label,
                [x, bottom + TICK + 0.75 * LETTERS],
                Anchor::Middle,
                small,
            );
        }
        for (value, label) in &self.up.ticks {
            let y = bottom - (bottom - top) * self.up.place(*value) as f32;
            canvas.line([left, y], [right, y], 1.0, FAINT, 1.0);
            canvas.line([left - TICK, y], [left, y], 1.4, INK, 1.0);
            canvas.text(label, [left - TICK - 4.0, y], Anchor::End, small);
        }
        let middle = 0.5 * (left + right);
        canvas.text(
            self.across.name,
            [middle, bottom + TICK + 2.1 * LETTERS],
            Anchor::Middle,
            LETTERS,
        );
        let column = [left - 4.2 * LETTERS, 0.5 * (top + bottom)];
        canvas.text_upwards(self.up.name, column, Anchor::Middle, LETTERS);
        canvas.text(
            &self.title,
            [middle, top - 0.8 * LETTERS],
            Anchor::Middle,
            LETTERS,
        );
    }

    /// Writes a few words at the right end of a line.
    pub fn note(&self, canvas: &mut Canvas, line: &Line, text: &str) {
        if let Some([x, y]) = line.points.last().and_then(|&end| self.pixel(end)) {
            canvas.text(text, [x, y - 0.7 * LETTERS], Anchor::Middle, 0.8 * LETTERS);
        }
    }

    fn line(&self, canvas: &mut Canvas, line: &Line) {
        let pixels: Vec<_> = line.points.iter().map(|&p| self.pixel(p)).collect();
        for pair in pixels.windows(2) {
            if let [Some(from), Some(to)] = *pair
                && let Some((from, to)) = clipped(from, to, self.place)
            {
                stroke(canvas, from, to, line.stroke);
            }
        }
        if line.stroke.marked {
            for pixel in pixels
                .into_iter()
                .flatten()
                .filter(|p| within(*p, self.place))
            {
                marker(canvas, pixel, line.stroke.color);
            }
        }
    }
}

/// The legend of some lines, one below the other from `at` on.
pub fn legend(canvas: &mut Canvas, lines: &[Line], [x, y]: [f32; 2]) {
    for (row, line) in lines
        .iter()
        .filter(|line| !line.name.is_empty())
        .enumerate()
    {
        let y = y + 1.4 * LETTERS * row as f32;
        stroke(canvas, [x, y], [x + 40.0, y], line.stroke);
        if line.stroke.marked {
            marker(canvas, [x + 20.0, y], line.stroke.color);
        }
        canvas.text(&line.name, [x + 50.0, y], Anchor::Start, 0.9 * LETTERS);
    }
}

/// A disc, as a line with round ends and no length.
fn marker(canvas: &mut Canvas, at: [f32; 2], color: Color) {
    canvas.line(at, at, MARKER, color, 1.0);
}

fn stroke(canvas: &mut Canvas, from: [f32; 2], to: [f32; 2], stroke: Stroke) {
    if !stroke.dashed {
        return canvas.line(from, to, 2.4, stroke.color, 1.0);
    }
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let at = |way: f32| [0, 1].map(|a| from[a] + (to[a] - from[a]) * (way / length).min(1.0));
    let mut way = 0.0;
    while way < length {
        canvas.line(at(way), at(way + 0.55 * DASH), 1.8, stroke.color, 1.0);
        way += DASH;
    }
}

fn within([x, y]: [f32; 2], [left, top, right, bottom]: [f32; 4]) -> bool {
    // Half a pixel more, for points on the frame.
    x > left - 0.5 && x < right + 0.5 && y > top - 0.5 && y < bottom + 0.5
}

/// The part of a stretch that is in a box (Liang and Barsky).
fn clipped(from: [f32; 2], to: [f32; 2], place: [f32; 4]) -> Option<([f32; 2], [f32; 2])> {
    let (mut start, mut end) = (0f32, 1f32);
    for axis in 0..2 {
        let step = to[axis] - from[axis];
        for (sign, wall) in [(1.0, place[axis]), (-1.0, place[axis + 2])] {
            let (depth, slope) = (sign * (from[axis] - wall), sign * step);
            // In front of the wall where depth + t slope ≥ 0.
            if slope > 0.0 {
                start = start.max(-depth / slope);
            } else if slope < 0.0 {
                end = end.min(-depth / slope);
            } else if depth < 0.0 {
                return None;
            }
        }
    }
    let at = |t: f32| [0, 1].map(|a| from[a] + t * (to[a] - from[a]));
    (start <= end).then(|| (at(start), at(end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_ten_are_marked_and_lie_where_they_should() {
        let axis = Axis::powers("", 1e-5, 20.0);
        let labels: Vec<&str> = axis.ticks.iter().map(|(_, label)| label.as_str()).collect();
        assert_eq!(labels, ["10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1", "1", "10"]);
        assert_eq!(axis.place(1e-5), 0.0);
        let steps = |a: f64, b: f64| axis.place(b) - axis.place(a);
        assert!((steps(1e-5, 1e-4) - steps(1.0, 10.0)).abs() < 1e-12);
    }

    #[test]
    fn lines_end_at_the_frame() {
        let place = [0.0, 0.0, 10.0, 10.0];
        assert_eq!(
            clipped([-5.0, 5.0], [15.0, 5.0], place),
            Some(([0.0, 5.0], [10.0, 5.0]))
        );
        assert_eq!(
            clipped([2.0, 5.0], [2.0, 25.0], place),
            Some(([2.0, 5.0], [2.0, 10.0]))
        );
        assert_eq!(clipped([-5.0, 5.0], [-1.0, 5.0], place), None);
        assert_eq!(clipped([-5.0, 8.0], [5.0, 18.0], place), None);
    }
}
