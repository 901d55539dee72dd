//! The pictures of the page.

use std::path::Path;

use isograd_cli::plot::canvas::{Canvas, INK, WHITE};
use isograd_cli::plot::write;
use isograd_page::chart::{Axis, Chart, LETTERS, Line, Stroke, legend};
use isograd_page::layout::{HEIGHT, WIDTH, dashed, places, solid};
use isograd_page::text::thousands;

use crate::Outcome;
use crate::case::{Case, Draw, Normals, Splat};
use crate::measure::{BINS, Slope};
use crate::study::{Results, SMOOTHINGS, Study};

/// Writes all of them into `folder`.
///
/// # Errors
/// A case that was not measured, or what the operating system says.
pub fn draw(study: &Study, results: &Results, folder: &Path) -> Outcome {
    write(
        &folder.join("accuracy-convergence.png"),
        &convergence(study, results)?,
    )?;
    write(
        &folder.join("accuracy-weights.png"),
        &weights(study, results)?,
    )?;
    write(
        &folder.join("accuracy-gradient.png"),
        &gradient(study, results)?,
    )?;
    Ok(())
}

fn cells_axis(study: &Study) -> Axis {
    let ticks = study
        .cells
        .iter()
        .map(|&cells| (cells as f64, cells.to_string()));
    let (low, high) = (
        study.cells[0] as f64,
        study.cells[study.cells.len() - 1] as f64,
    );
    Axis {
        name: "cells on the longest side",
        low: 0.8 * low,
        high: 1.25 * high,
        ticks: ticks.collect(),
        logarithmic: true,
    }
}

/// A line through one value for each grid.
fn over_cells(
    study: &Study,
    name: &str,
    stroke: Stroke,
    value: impl Fn(usize) -> Outcome<f64>,
) -> Outcome<Line> {
    let point = |&cells: &usize| Ok([cells as f64, value(cells)?]);
    let points = study.cells.iter().map(point).collect::<Outcome<_>>()?;
    Ok(Line {
        name: name.into(),
        stroke,
        points,
    })
}

/// Mean error of the zero set over the number of cells: of all bodies as a length, and of the first in cells
/// for various samples.
fn convergence(study: &Study, results: &Results) -> Outcome<Canvas> {
    let fixed = lengths(study, results, &|body, cells| {
        study.default_case(body, cells)
    })?;
    let growing = lengths(study, results, &|body, cells| {
        study.proportional_case(body, Draw::Random, cells)
    })?;
    let titles = [
        format!("{} random samples", thousands(study.samples)),
        "as many random samples per cell".into(),
    ];
    let places = places(3);
    let mut canvas = Canvas::new(WIDTH as usize, HEIGHT as usize, WHITE);
    for ((place, title), mut lines) in places.iter().zip(titles).zip([fixed, growing]) {
        let up = Axis::powers(
            "mean |error of the zero set| / longest side of the grid",
            1.5e-6,
            1e-2,
        );
        let chart = Chart {
            place: *place,
            title,
            across: cells_axis(study),
            up,
        };
        let named = lines.len();
        lines.extend(slopes(study));
        chart.draw(&mut canvas, &lines);
        legend(&mut canvas, &lines[..named], above(place, named));
        for (line, name) in lines[named..].iter().zip(["order 1", "order 2"]) {
            chart.note(&mut canvas, line, name);
        }
    }
    let lines = in_cells(study, results)?;
    let up = Axis::marked(
        "mean |error of the zero set|, cells",
        &[0.005, 0.01, 0.02, 0.05, 0.1],
    );
    let title = format!("{}, {} samples", study.first(), thousands(study.samples));
    let chart = Chart {
        place: places[2],
        title,
        across: cells_axis(study),
        up,
    };
    chart.draw(&mut canvas, &lines);
    let [_, top, right, _] = places[2];
    legend(&mut canvas, &lines, [right - 260.0, top + LETTERS]);
    Ok(canvas)
}

/// Where a legend of `rows` begins that ends at the bottom of a chart.
fn above([left, _, _, bottom]: &[f32; 4], rows: usize) -> [f32; 2] {
    [left + 16.0, bottom - 1.4 * LETTERS * (rows as f32 - 0.3)]
}

/// Errors as a share of the longest side of the grid, of every body and of marching cubes alone.
fn lengths(
    study: &Study,
    results: &Results,
    case: &dyn Fn(&'static str, usize) -> Case,
) -> Outcome<Vec<Line>> {
    let mut lines = Vec::new();
    for (color, &body) in study.bodies.iter().enumerate() {
        lines.push(over_cells(study, body, solid(color), |cells| {
            Ok(results.row(&case(body, cells))?.surface.vertices.mean / cells as f64)
        })?);
    }
    let first = study.first();
    let name = format!("{first}, marching cubes of exact φ");
    lines.push(over_cells(study, &name, dashed(INK), |cells| {
        Ok(results.floor(first, cells)?.surface.vertices.mean / cells as f64)
    })?);
    Ok(lines)
}

/// Errors of the first body in cells, for every way of drawing samples, smoothed and not.
fn in_cells(study: &Study, results: &Results) -> Outcome<Vec<Line>> {
    let mut lines = Vec::new();
    for (color, draw) in Draw::ALL.into_iter().enumerate() {
        for smoothing in SMOOTHINGS {
            let plain = smoothing == Some(0.0);
            let name = if plain {
                "… not smoothed".into()
            } else {
                draw.to_string()
            };
            let stroke = Stroke {
                dashed: plain,
                ..solid(color)
            };
            lines.push(over_cells(study, &name, stroke, |cells| {
                let case = study.sampling_case(draw, Normals::Estimated, smoothing, cells);
                Ok(results.row(&case)?.surface.vertices.mean)
            })?);
        }
    }
    Ok(lines)
}

/// What errors of first and second order would look like.
fn slopes(study: &Study) -> Vec<Line> {
    let first = study.cells[0] as f64;
    let line = |order: i32| Line {
        name: String::new(),
        stroke: dashed([0.6, 0.6, 0.62]),
        points: study
            .cells
            .iter()
            .map(|&n| [n as f64, 5e-3 * (first / n as f64).powi(order)])
            .collect(),
    };
    vec![line(1), line(2)]
}

/// Mean error in cells for every choice of the splat, for each way of drawing samples.
fn weights(study: &Study, results: &Results) -> Outcome<Canvas> {
    let mut canvas = Canvas::new(WIDTH as usize, HEIGHT as usize, WHITE);
    for (place, draw) in places(3).into_iter().zip(Draw::ALL) {
        let mut lines = Vec::new();
        for (color, splat) in Splat::ALL.into_iter().enumerate() {
            for area in [true, false] {
                let name = format!("{splat}, area weights {}", if area { "on" } else { "off" });
                let stroke = Stroke {
                    dashed: !area,
                    ..solid(color)
                };
                lines.push(over_cells(study, &name, stroke, |cells| {
                    let row = results.row(&study.splat_case(draw, splat, area, cells))?;
                    Ok(row.surface.vertices.mean)
                })?);
            }
        }
        let up = Axis::powers("mean |error of the zero set|, cells", 5e-3, 2.0);
        let chart = Chart {
            place,
            title: format!("{}, {draw}", study.first()),
            across: cells_axis(study),
            up,
        };
        chart.draw(&mut canvas, &lines);
        if draw == Draw::ALL[0] {
            legend(&mut canvas, &lines, [place[0] + 16.0, place[1] + LETTERS]);
        }
    }
    Ok(canvas)
}

/// The spread of `|∇φ|` over all cells and near the surface.
fn gradient(study: &Study, results: &Results) -> Outcome<Canvas> {
    let cells = study.middle_cells();
    let mut canvas = Canvas::new(WIDTH as usize, HEIGHT as usize, WHITE);
    let titles = [
        format!("all cells, {cells} on the longest side"),
        "cells with |φ| < 3h".to_string(),
    ];
    for (side, (place, title)) in places(2).into_iter().zip(titles).enumerate() {
        let mut lines = Vec::new();
        for (color, &body) in study.bodies.iter().enumerate() {
            let row = results.row(&study.default_case(body, cells))?;
            let field = row
                .field
                .as_ref()
                .ok_or("the default case is measured in full")?;
            let slope = [&field.slope_all, &field.slope_near][side];
            lines.push(histogram(body, color, slope));
        }
        let ticks = (0..=6)
            .map(|i| 0.2 * f64::from(i))
            .map(|x| (x, format!("{x:.1}")));
        let across = Axis {
            name: "|∇φ|",
            low: BINS.lower,
            high: BINS.upper,
            ticks: ticks.collect(),
            logarithmic: false,
        };
        let up = Axis::powers("density", 1e-4, 2e2);
        Chart {
            place,
            title,
            across,
            up,
        }
        .draw(&mut canvas, &lines);
        if side == 0 {
            legend(&mut canvas, &lines, [place[0] + 16.0, place[1] + LETTERS]);
        }
    }
    Ok(canvas)
}

/// A histogram as stairs.
fn histogram(name: &str, color: usize, slope: &Slope) -> Line {
    let width = (BINS.upper - BINS.lower) / BINS.count as f64;
    let stairs = slope.shares.iter().enumerate().flat_map(|(i, share)| {
        let left = BINS.lower + width * i as f64;
        // What is empty lies below the chart, not nowhere: the stairs go down to it.
        let density = (share / width).max(1e-9);
        [[left, density], [left + width, density]]
    });
    let stroke = Stroke {
        marked: false,
        ..solid(color)
    };
    Line {
        name: name.into(),
        stroke,
        points: stairs.collect(),
    }
}
