//! The picture of the page: time and memory, over cells and over points.

use std::path::Path;

use isograd_cli::plot::canvas::{Canvas, WHITE};
use isograd_cli::plot::write;
use isograd_page::chart::{Axis, Chart, LETTERS, Line, legend};
use isograd_page::layout::{HEIGHT, WIDTH, places, solid};
use isograd_page::program::Outcome;

use crate::size::Size;
use crate::study::Results;

/// A number of a measured size.
type Measure = fn(&Size) -> f64;

/// Writes `scaling.png`: a row for cells and one for points, each with time and memory.
///
/// # Errors
/// What the operating system says.
pub fn draw(results: &Results, folder: &Path) -> Outcome {
    let mut canvas = Canvas::new(WIDTH as usize, 2 * HEIGHT as usize, WHITE);
    let rows: [(&str, &[Size], Measure); 2] = [
        ("cells", &results.cells, |size| size.cells() as f64),
        ("points", &results.points, |size| size.points as f64),
    ];
    for (row, (name, sizes, across)) in rows.into_iter().enumerate() {
        let lower = row as f32 * HEIGHT;
        let moved = places(2)
            .into_iter()
            .map(|[left, top, right, bottom]| [left, top + lower, right, bottom + lower]);
        let charts = [
            ("seconds", time(sizes, across)),
            ("bytes", memory(sizes, across)),
        ];
        for (place, (what, lines)) in moved.zip(charts) {
            chart(place, name, what, &lines).draw(&mut canvas, &lines);
            legend(&mut canvas, &lines, [place[0] + 20.0, place[1] + LETTERS]);
        }
    }
    Ok(write(&folder.join("scaling.png"), &canvas)?)
}

fn time(sizes: &[Size], across: Measure) -> Vec<Line> {
    let mut lines = vec![
        line("forward", 0, sizes, across, |size| size.forward),
        line("backward", 1, sizes, across, |size| size.backward),
    ];
    let stage = |name: &'static str, of: &Size| {
        let mut found = of.stages.iter().filter(|stage| stage.0 == name);
        found.next().map_or(f64::NAN, |stage| stage.1)
    };
    for (color, name) in [(2, "poisson"), (3, "distance"), (4, "orient")] {
        lines.push(line(name, color, sizes, across, |size| stage(name, size)));
    }
    lines
}

fn memory(sizes: &[Size], across: Measure) -> Vec<Line> {
    let bytes = |bytes: usize| bytes as f64;
    vec![
        line("forward, at most", 0, sizes, across, |size| {
            bytes(size.forward_bytes)
        }),
        line("with the pullback", 1, sizes, across, |size| {
            bytes(size.backward_bytes)
        }),
    ]
}

fn line(
    name: &str,
    color: usize,
    sizes: &[Size],
    across: Measure,
    up: impl Fn(&Size) -> f64,
) -> Line {
    Line {
        name: name.into(),
        stroke: solid(color),
        points: sizes.iter().map(|size| [across(size), up(size)]).collect(),
    }
}

/// With axes that hold all the lines, and room above them for the legend.
fn chart(place: [f32; 4], name: &'static str, what: &'static str, lines: &[Line]) -> Chart {
    let range = |a: usize| {
        let all = lines
            .iter()
            .flat_map(|line| &line.points)
            .map(|point| point[a]);
        let known = all.filter(|x| x.is_finite() && *x > 0.0);
        known.fold((f64::INFINITY, 0.0f64), |(low, high), x| {
            (low.min(x), high.max(x))
        })
    };
    let ((left, right), (low, high)) = (range(0), range(1));
    Chart {
        place,
        title: format!("{what} over {name}"),
        across: Axis::powers(name, left / 1.3, right * 1.3),
        up: Axis::powers(what, low / 1.5, high * 30.0),
    }
}
