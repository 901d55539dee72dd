//! The picture of a field: three slices, and how `|∇φ|` is spread (the paper's figures 4 and 6).

use isograd::differential::{Bins, EikonalOptions, Spread, eikonal};
use isograd::{Field, Real};

use super::axis::{label, step, ticks};
use super::canvas::{Anchor, Canvas, Color, INK, WHITE};
use super::color::Range;
use super::panel::{Axis, LETTERS, Panel};
use super::slice::{Slice, Style};

const WIDTH: f32 = 1720.0;
/// Left of each panel: numbers and a name.
const LEFT: f32 = 112.0;
const TOP: f32 = 66.0;
/// Below each panel: numbers and a name.
const BELOW: f32 = 86.0;
/// Right of the slices: the color bar.
const BAR: f32 = 170.0;
const TALLEST: f64 = 620.0;
const HISTOGRAM_HEIGHT: f32 = 300.0;
const BINS: Bins = Bins {
    lower: 0.0,
    upper: 1.5,
    count: 150,
};
const FILL: Color = [0.27, 0.49, 0.69];
const NAMES: [&str; 3] = ["x", "y", "z"];

/// Three slices through the middle of a field, with contour lines, the zero contour drawn boldly and a
/// color bar; below them the density of `|∇φ|` over all cells and over those with `|φ| < 3h`.
pub fn slices<T: Real>(field: &Field<T>) -> Canvas {
    let grid = field.grid();
    let (low, high) = (grid.lower(), grid.upper());
    let planes: [Slice; 3] = [2, 1, 0].map(|normal| {
        Slice::new(
            field,
            normal,
            0.5 * (low[normal].f64() + high[normal].f64()),
        )
    });
    let style = style(&planes);
    let tallest = planes.iter().map(|p| p.shape[1]).max().unwrap_or(1) as f64;
    let row_height = (style.scale * tallest) as f32;
    let height = TOP + row_height + BELOW + TOP + HISTOGRAM_HEIGHT + BELOW;
    let mut canvas = Canvas::new(WIDTH as usize, height as usize, WHITE);

    let widths = planes
        .iter()
        .map(|p| (style.scale * p.shape[0] as f64) as f32);
    let gap = (WIDTH - BAR - widths.sum::<f32>() - 3.0 * LEFT).max(0.0) / 3.0;
    let mut left = LEFT + 0.5 * gap;
    for plane in &planes {
        let picture = plane.draw(&style);
        let top = TOP + 0.5 * (row_height - picture.height() as f32);
        draw_slice(&mut canvas, plane, &picture, [left.floor(), top.floor()]);
        left += picture.width() as f32 + LEFT + gap;
    }
    let bar_height = row_height.max(180.0).min(row_height + 60.0);
    let bar_top = TOP + 0.5 * (row_height - bar_height);
    draw_color_bar(
        &mut canvas,
        &style,
        [WIDTH - BAR + 40.0, bar_top],
        bar_height,
    );
    draw_histograms(&mut canvas, field, TOP + row_height + BELOW + TOP);
    canvas
}

/// One scale of colors, contours and lengths for all planes.
fn style(planes: &[Slice; 3]) -> Style {
    let (low, high) = planes
        .iter()
        .map(Slice::range)
        .fold((0.0f64, 0.0f64), |all, range| {
            (all.0.min(range.0), all.1.max(range.1))
        });
    // The inside of a thin body would be pale if the far outside set the scale alone.
    let across: usize = planes.iter().map(|p| p.shape[0]).sum();
    let tallest = planes.iter().map(|p| p.shape[1]).max().unwrap_or(1);
    let room = f64::from(WIDTH - BAR - 3.0 * LEFT);
    let scale = (room / across as f64).min(TALLEST / tallest as f64);
    Style::new(Range::new(low, high), scale, 3.2)
}

fn draw_slice(canvas: &mut Canvas, plane: &Slice, picture: &Canvas, [left, top]: [f32; 2]) {
    canvas.paste(picture, left as usize, top as usize);
    let axis = |side: usize| {
        let low = plane.origin[side] - 0.5 * plane.spacing;
        Axis {
            name: NAMES[plane.axes[side]].into(),
            low,
            high: low + plane.spacing * plane.shape[side] as f64,
        }
    };
    let panel = Panel {
        place: [
            left,
            top,
            left + picture.width() as f32,
            top + picture.height() as f32,
        ],
        across: axis(0),
        up: axis(1),
    };
    panel.axes(canvas);
    let extent = plane.spacing * plane.shape[0].max(plane.shape[1]) as f64;
    let position = label(plane.position, step(extent, 100));
    panel.title(
        canvas,
        &format!("φ at {} = {position}", NAMES[plane.normal]),
    );
}

/// The scale of colors: inside and outside each have half of it.
fn draw_color_bar(canvas: &mut Canvas, style: &Style, [left, top]: [f32; 2], height: f32) {
    const BAR_WIDTH: f32 = 26.0;
    let (right, bottom) = (left + BAR_WIDTH, top + height);
    let (middle, half) = (0.5 * (top + bottom), 0.5 * height);
    let Range { inside, outside } = style.range;
    for y in top as usize..bottom as usize {
        let up = f64::from((middle - (y as f32 + 0.5)) / half);
        let value = up * if up < 0.0 { inside } else { outside };
        let y = y as f32;
        canvas.rectangle([left, y, right, y + 1.0], style.range.color(value));
    }
    canvas.frame([left, top, right, bottom], 1.4, INK);
    canvas.line([left, middle], [right, middle], 2.4, INK, 1.0);
    let count = ((half / 36.0) as usize).clamp(2, 5);
    let mut mark = |value: f64, side: f64, step: f64| {
        let y = middle - half * (value / side) as f32;
        canvas.line([right, y], [right + 6.0, y], 1.4, INK, 1.0);
        canvas.text(
            &label(value, step),
            [right + 11.0, y],
            Anchor::Start,
            0.9 * LETTERS,
        );
    };
    mark(0.0, outside, outside);
    for (low, high, side) in [(-inside, 0.0, inside), (0.0, outside, outside)] {
        for tick in ticks(low, high, count)
            .into_iter()
            .filter(|t| t.abs() > 0.1 * side)
        {
            mark(tick, side, step(side, count));
        }
    }
    let name = [0.5 * (left + right), top - 0.9 * LETTERS];
    canvas.text("φ", name, Anchor::Middle, 1.15 * LETTERS);
}

fn draw_histograms<T: Real>(canvas: &mut Canvas, field: &Field<T>, top: f32) {
    let spread = eikonal(
        field,
        &EikonalOptions {
            near: 3.0,
            bins: BINS,
        },
    );
    let width = 0.5 * (WIDTH - 2.0 * LEFT - 90.0);
    let sides = [
        (LEFT, "all cells", spread.all),
        (
            LEFT + width + LEFT,
            "cells near the surface, |φ| < 3h",
            spread.near,
        ),
    ];
    for (left, cells, spread) in sides {
        let place = [left, top, left + width, top + HISTOGRAM_HEIGHT];
        draw_histogram(canvas, place, cells, spread.as_ref());
    }
}

fn draw_histogram(canvas: &mut Canvas, place: [f32; 4], cells: &str, spread: Option<&Spread>) {
    let bin = (BINS.upper - BINS.lower) / BINS.count as f64;
    let density: Vec<f64> = spread.map_or_else(Vec::new, |spread| {
        let total = bin * spread.cells as f64;
        spread.histogram.iter().map(|&n| n as f64 / total).collect()
    });
    let highest = density.iter().fold(0.0f64, |m, &d| m.max(d));
    let axis = |name: &str, low: f64, high: f64| Axis {
        name: name.into(),
        low,
        high,
    };
    let panel = Panel {
        place,
        across: axis("|∇φ|", BINS.lower, BINS.upper),
        up: axis(
            "density",
            0.0,
            if highest > 0.0 { 1.08 * highest } else { 1.0 },
        ),
    };
    panel.grid_lines(canvas);
    for (i, &d) in density.iter().enumerate() {
        let low = BINS.lower + bin * i as f64;
        let columns = [panel.x(low), panel.x(low + bin)];
        canvas.rectangle([columns[0], panel.y(d), columns[1], panel.y(0.0)], FILL);
    }
    panel.axes(canvas);
    panel.title(canvas, &format!("|∇φ|, {cells}"));
    let Some(spread) = spread else {
        let middle = [0.5 * (place[0] + place[2]), 0.5 * (place[1] + place[3])];
        return canvas.text("no such cells", middle, Anchor::Middle, LETTERS);
    };
    let lines = [
        format!("{} cells", spread.cells),
        format!("mean {:.4}", spread.mean),
        format!("5 % below {:.4}", spread.p05),
        format!("95 % below {:.4}", spread.p95),
    ];
    for (i, text) in lines.iter().enumerate() {
        let row = place[1] + (1.2 + 1.35 * i as f32) * LETTERS;
        canvas.text(text, [place[0] + 20.0, row], Anchor::Start, LETTERS);
    }
}
