//! Groups of bars side by side, with a few words above each group.

use isograd_cli::plot::canvas::{Anchor, Canvas, Color, INK};

use crate::chart::{Axis, Chart, LETTERS};

/// Share of a group's width that its bars take.
const FILL: f64 = 0.72;
/// Room for the words, in heights of the tallest bar.
const ROOM: f64 = 0.14;
/// Lines across the chart, about.
const TICKS: usize = 6;

/// Bars that stand together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Written below.
    pub name: String,
    /// One for each bar.
    pub values: Vec<f64>,
    /// Written above.
    pub note: String,
}

/// A box of a picture, `(left, top, right, bottom)` in pixels, with groups of bars.
#[derive(Clone, Debug)]
pub struct Bars {
    /// The box.
    pub place: [f32; 4],
    /// Written above it.
    pub title: String,
    /// What the groups are.
    pub across: &'static str,
    /// What the values are.
    pub up: &'static str,
    /// From left to right.
    pub groups: Vec<Group>,
}

impl Bars {
    /// Frame, axes, bars and words. Bar `k` of every group has color `k`.
    pub fn draw(&self, canvas: &mut Canvas, colors: &[Color]) {
        let chart = Chart {
            place: self.place,
            title: self.title.clone(),
            across: self.across_axis(),
            up: self.up_axis(),
        };
        chart.draw(canvas, &[]);
        for (place, group) in self.groups.iter().enumerate() {
            for (bar, &value) in group.values.iter().enumerate() {
                let [left, right] = side(place, bar, group.values.len());
                let ends = [chart.pixel([left, 0.0]), chart.pixel([right, value])];
                if let [Some([x0, y0]), Some([x1, y1])] = ends
                    && let Some(&color) = colors.get(bar)
                {
                    canvas.rectangle([x0, y0.min(y1), x1, y0.max(y1)], color);
                }
            }
            let top = group.values.iter().copied().fold(0.0, f64::max);
            if let Some([x, y]) = chart.pixel([place as f64 + 0.5, top]) {
                let above = [x, y - 0.6 * LETTERS];
                canvas.text(&group.note, above, Anchor::Middle, 0.75 * LETTERS);
            }
        }
        let zero = [0.0, self.groups.len() as f64].map(|x| chart.pixel([x, 0.0]));
        if let [Some(from), Some(to)] = zero {
            canvas.line(from, to, 1.4, INK, 1.0);
        }
    }

    fn across_axis(&self) -> Axis {
        let names = self.groups.iter().enumerate();
        Axis {
            name: self.across,
            low: 0.0,
            high: self.groups.len().max(1) as f64,
            ticks: names
                .map(|(place, group)| (place as f64 + 0.5, group.name.clone()))
                .collect(),
            logarithmic: false,
        }
    }

    fn up_axis(&self) -> Axis {
        let [low, high] = ends(self.groups.iter().flat_map(|group| &group.values));
        let step = round_step((high - low) / TICKS as f64);
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        Axis {
            name: self.up,
            low,
            high,
            ticks: (first..=last)
                .map(|k| (k as f64 * step, tick(k as f64 * step, step)))
                .collect(),
            logarithmic: false,
        }
    }
}

/// Squares and names, one below the other from `at` on.
pub fn legend(canvas: &mut Canvas, entries: &[(&str, Color)], [x, y]: [f32; 2]) {
    let half = 0.4 * LETTERS;
    for (row, (name, color)) in entries.iter().enumerate() {
        let y = y + 1.4 * LETTERS * row as f32;
        canvas.rectangle([x, y - half, x + 2.0 * half, y + half], *color);
        canvas.text(name, [x + 1.4 * LETTERS, y], Anchor::Start, 0.9 * LETTERS);
    }
}

/// Left and right end of bar `bar` of `bars` in group `place`.
fn side(place: usize, bar: usize, bars: usize) -> [f64; 2] {
    let width = FILL / bars.max(1) as f64;
    let left = place as f64 + 0.5 * (1.0 - FILL) + width * bar as f64;
    [left, left + width]
}

/// Ends of an axis that has zero, all values, and room for words above them.
fn ends<'a>(values: impl Iterator<Item = &'a f64>) -> [f64; 2] {
    let finite = values.copied().filter(|value| value.is_finite());
    let [low, high] = finite.fold([0.0f64; 2], |[low, high], v| [low.min(v), high.max(v)]);
    let span = high - low;
    if span == 0.0 {
        return [-1.0, 1.0];
    }
    let below = if low < 0.0 { 0.5 * ROOM * span } else { 0.0 };
    [low - below, high + ROOM * span]
}

/// 1, 2 or 5 times a power of ten, about as large as `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let digit = match step / power {
        x if x < 1.5 => 1.0,
        x if x < 3.5 => 2.0,
        x if x < 7.5 => 5.0,
        _ => 10.0,
    };
    digit * power
}

/// A value on an axis, with the decimals that its step has.
fn tick(value: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;
    use isograd_cli::plot::canvas::WHITE;

    #[test]
    fn an_axis_of_bars_has_zero_and_room_above() {
        assert_eq!(ends([2.0, 10.0].iter()), [0.0, 11.4]);
        let [low, high] = ends([-3.0, 5.0, f64::NAN].iter());
        assert!(low < -3.0 && high > 5.0);
        assert_eq!(ends([].iter()), [-1.0, 1.0]);
    }

    #[test]
    fn steps_are_round() {
        let shown = [0.0131, 0.3, 4.4, 80.0].map(|x| tick(3.0 * round_step(x), round_step(x)));
        assert_eq!(shown, ["0.03", "0.6", "15", "300"]);
    }

    #[test]
    fn a_bar_is_as_high_as_its_value() {
        let bars = Bars {
            place: [20.0, 20.0, 220.0, 248.0],
            title: String::new(),
            across: "",
            up: "",
            groups: vec![Group {
                name: String::new(),
                values: vec![1.0, 0.5],
                note: String::new(),
            }],
        };
        let mut canvas = Canvas::new(240, 260, WHITE);
        let colors = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        bars.draw(&mut canvas, &colors);
        let height = |color: Color| {
            let column = |x: usize| {
                (0..260)
                    .filter(|&y| canvas.pixel(x, y) == Some(color))
                    .count()
            };
            (0..240).map(column).max().unwrap_or(0)
        };
        // 228 pixels are 1.14: a value of 1 is 200, but for what the lines at its ends cover.
        assert!(
            height(colors[0]).abs_diff(200) <= 4,
            "{}",
            height(colors[0])
        );
        assert!(
            height(colors[1]).abs_diff(100) <= 4,
            "{}",
            height(colors[1])
        );
    }
}
