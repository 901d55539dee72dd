//! How a fit went: loss and error against the epoch, on a scale of powers of ten.

use super::canvas::{Canvas, Color, WHITE};
use super::panel::{Axis, Panel};

const WIDTH: f32 = 1500.0;
const HEIGHT: f32 = 520.0;
const LEFT: f32 = 130.0;
const TOP: f32 = 60.0;
const BELOW: f32 = 90.0;
const LINE: Color = [0.13, 0.32, 0.60];

/// `(loss, mean error)` of every epoch, the start first.
pub fn losses(epochs: &[[f64; 2]]) -> Canvas {
    let mut canvas = Canvas::new(WIDTH as usize, HEIGHT as usize, WHITE);
    let half = 0.5 * WIDTH;
    for (side, name, title) in [
        (0, "powers of ten", "loss, cells²"),
        (1, "powers of ten", "mean |Δφ|, cells"),
    ] {
        let values: Vec<f64> = epochs.iter().map(|epoch| epoch[side].log10()).collect();
        let left = side as f32 * half;
        let place = [left + LEFT, TOP, left + half - 20.0, HEIGHT - BELOW];
        draw(&mut canvas, place, &values, name, title);
    }
    canvas
}

fn draw(canvas: &mut Canvas, place: [f32; 4], values: &[f64], name: &str, title: &str) {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let low = finite.clone().fold(f64::INFINITY, f64::min);
    let high = finite.fold(f64::NEG_INFINITY, f64::max);
    let (low, high) = if low <= high {
        (low, high)
    } else {
        (-1.0, 0.0)
    };
    let axis = |name: &str, low: f64, high: f64| Axis {
        name: name.into(),
        low,
        high,
    };
    let room = 0.05 * (high - low).max(0.2);
    let panel = Panel {
        place,
        across: axis("epoch", 0.0, (values.len().max(2) - 1) as f64),
        up: axis(name, low - room, high + room),
    };
    panel.grid_lines(canvas);
    let point = |(epoch, value): (usize, &f64)| [panel.x(epoch as f64), panel.y(*value)];
    let points: Vec<[f32; 2]> = values.iter().enumerate().map(point).collect();
    for pair in points.windows(2) {
        // A loss of 0 has no logarithm, and no line.
        if pair.iter().flatten().all(|c| c.is_finite()) {
            canvas.line(pair[0], pair[1], 2.4, LINE, 1.0);
        }
    }
    panel.axes(canvas);
    panel.title(canvas, title);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_history_can_be_drawn() {
        let dark = |canvas: &Canvas| {
            let columns = 0..canvas.width();
            columns
                .flat_map(|x| (0..canvas.height()).filter_map(move |y| canvas.pixel(x, y)))
                .filter(|c| c[2] > c[0] + 0.3)
                .count()
        };
        let falling: Vec<[f64; 2]> = (0..50).map(|i| [0.5f64.powi(i), 0.7f64.powi(i)]).collect();
        assert!(dark(&losses(&falling)) > 1000);
        assert_eq!(dark(&losses(&[])), 0);
        assert_eq!(dark(&losses(&[[1.0, 1.0]])), 0);
        losses(&[[0.0, 0.0], [f64::NAN, 1.0], [1.0, f64::INFINITY]]);
    }
}
