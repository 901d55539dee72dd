//! A frame with ticks and labels around a piece of a picture.

use super::axis::{label, step, ticks};
use super::canvas::{Anchor, Canvas, FAINT, INK};

/// Height of letters, in pixels.
pub const LETTERS: f32 = 21.0;
const TICK: f32 = 6.0;

/// One axis of a panel: its name, and the values at its two ends.
#[derive(Clone, Debug)]
pub struct Axis {
    pub name: String,
    pub low: f64,
    pub high: f64,
}

/// A box of a picture, `(left, top, right, bottom)` in pixels, and its axes.
#[derive(Clone, Debug)]
pub struct Panel {
    pub place: [f32; 4],
    pub across: Axis,
    pub up: Axis,
}

impl Panel {
    /// Pixel column of a value of the horizontal axis.
    pub fn x(&self, value: f64) -> f32 {
        let [left, _, right, _] = self.place;
        left + (right - left) * fraction(&self.across, value)
    }

    /// Pixel row of a value of the vertical axis.
    pub fn y(&self, value: f64) -> f32 {
        let [_, top, _, bottom] = self.place;
        bottom - (bottom - top) * fraction(&self.up, value)
    }

    /// Faint lines at the ticks of the vertical axis, to be drawn before the content.
    pub fn grid_lines(&self, canvas: &mut Canvas) {
        let [left, top, right, bottom] = self.place;
        for tick in ticks(self.up.low, self.up.high, rows(bottom - top)) {
            let y = self.y(tick);
            canvas.line([left, y], [right, y], 1.0, FAINT, 1.0);
        }
    }

    /// The frame, ticks, numbers and names, to be drawn over the content.
    pub fn axes(&self, canvas: &mut Canvas) {
        let [left, top, right, bottom] = self.place;
        canvas.frame(self.place, 1.4, INK);
        let count = columns(right - left);
        let across_step = step(self.across.high - self.across.low, count);
        for tick in ticks(self.across.low, self.across.high, count) {
            let x = self.x(tick);
            canvas.line([x, bottom], [x, bottom + TICK], 1.4, INK, 1.0);
            let text = label(tick, across_step);
            canvas.text(
                &text,
                [x, bottom + TICK + 0.75 * LETTERS],
                Anchor::Middle,
                0.9 * LETTERS,
            );
        }
        let name_row = bottom + TICK + 2.0 * LETTERS;
        canvas.text(
            &self.across.name,
            [0.5 * (left + right), name_row],
            Anchor::Middle,
            LETTERS,
        );
        let widest = self.vertical_axis(canvas);
        let column = left - TICK - widest - 1.0 * LETTERS;
        canvas.text_upward(
            &self.up.name,
            [column, 0.5 * (top + bottom)],
            Anchor::Middle,
            LETTERS,
        );
    }

    /// Ticks and numbers on the left; the width of the widest number.
    fn vertical_axis(&self, canvas: &mut Canvas) -> f32 {
        let [left, top, _, bottom] = self.place;
        let count = rows(bottom - top);
        let up_step = step(self.up.high - self.up.low, count);
        let mut widest = 0f32;
        for tick in ticks(self.up.low, self.up.high, count) {
            let y = self.y(tick);
            canvas.line([left - TICK, y], [left, y], 1.4, INK, 1.0);
            let text = label(tick, up_step);
            widest = widest.max(super::canvas::text_length(&text, 0.9 * LETTERS));
            canvas.text(&text, [left - TICK - 4.0, y], Anchor::End, 0.9 * LETTERS);
        }
        widest
    }

    /// A title above the frame.
    pub fn title(&self, canvas: &mut Canvas, text: &str) {
        let [left, top, right, _] = self.place;
        canvas.text(
            text,
            [0.5 * (left + right), top - 0.8 * LETTERS],
            Anchor::Middle,
            LETTERS,
        );
    }
}

fn fraction(axis: &Axis, value: f64) -> f32 {
    ((value - axis.low) / (axis.high - axis.low)) as f32
}

/// Numbers that fit side by side.
fn columns(pixels: f32) -> usize {
    (pixels / 85.0).clamp(3.0, 9.0) as usize
}

/// Numbers that fit above one another.
fn rows(pixels: f32) -> usize {
    (pixels / 52.0).clamp(3.0, 9.0) as usize
}
