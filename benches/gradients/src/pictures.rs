//! The pictures of the page.

use std::path::Path;

use isograd_cli::plot::canvas::{Canvas, WHITE};
use isograd_cli::plot::write;
use isograd_page::bars::{Bars, Group, legend};
use isograd_page::chart::LETTERS;
use isograd_page::layout::{COLORS, HEIGHT, WIDTH, places};

use crate::Outcome;
use crate::body::Draw;
use crate::functional::Functional;
use crate::motion::Motion;
use crate::parameters::Row;
use crate::ratios::{Choice, Ratio};
use crate::study::Results;

/// Writes all of them into `folder`.
///
/// # Errors
/// What the operating system says.
pub fn draw(results: &Results, folder: &Path) -> Outcome {
    let pictures = [
        ("gradients-parameters.png", parameters(results)),
        ("gradients-cost.png", cost(results)),
        ("gradients-ratios.png", ratios(results)),
    ];
    for (name, picture) in pictures {
        write(&folder.join(name), &picture)?;
    }
    Ok(())
}

/// Bars side by side, one chart for each title.
fn side_by_side(
    charts: Vec<(String, Vec<Group>)>,
    across: &'static str,
    up: &'static str,
    names: &[&str],
) -> Canvas {
    let mut canvas = Canvas::new(WIDTH as usize, HEIGHT as usize, WHITE);
    for (place, (title, groups)) in places(charts.len()).into_iter().zip(charts) {
        let bars = Bars {
            place,
            title,
            across,
            up,
            groups,
        };
        bars.draw(&mut canvas, &COLORS);
    }
    let entries: Vec<_> = names.iter().copied().zip(COLORS).collect();
    let rows = names.len() as f32;
    let below = [0.5 * WIDTH - 60.0, HEIGHT - (0.2 + 1.4 * rows) * LETTERS];
    legend(&mut canvas, &entries, below);
    canvas
}

/// The pullback beside what it differentiates, with the relative error above.
fn parameters(results: &Results) -> Canvas {
    let rows = &results.parameters.rows;
    let group = |row: &Row| Group {
        name: row.name.trim_start_matches(char::is_alphabetic).into(),
        values: vec![row.pullback, row.held],
        note: format!("{:.0e}", row.relative()),
    };
    let of = |kind: &str| {
        let rows = rows.iter().filter(|row| row.name.starts_with(kind));
        rows.map(group).collect()
    };
    let charts = vec![
        ("widths".into(), of("width")),
        ("heights".into(), of("height")),
    ];
    let names = ["pullback", "differences"];
    side_by_side(charts, "control value", "∂L/∂p", &names)
}

/// Forward beside backward, with their ratio above.
fn cost(results: &Results) -> Canvas {
    let of = |body: &str| {
        let costs = results.costs.iter().filter(|cost| cost.body == body);
        let groups = costs.map(|cost| Group {
            name: format!("{}, {} thr.", cost.precision, cost.threads),
            values: vec![cost.forward, cost.backward],
            note: format!("{:.2}", cost.ratio),
        });
        groups.collect()
    };
    let charts = bodies(results.costs.iter().map(|cost| cost.body));
    let charts = charts.into_iter().map(|body| (body.into(), of(body)));
    let names = ["forward", "backward"];
    side_by_side(charts.collect(), "", "seconds", &names)
}

/// Pullback over differences across a cell, for both weights of the splat.
fn ratios(results: &Results) -> Canvas {
    let paper = Choice {
        paper_weights: true,
        ..Choice::ALL[0]
    };
    let of = |body: &str, motion: Motion, choice: Choice| {
        let wanted = |r: &&Ratio| {
            let (same, random) = (r.body == body && r.motion == motion, r.draw == Draw::Random);
            same && random && r.choice == choice && r.functional == Functional::Volume
        };
        let found = results.ratios.iter().find(wanted);
        found.map_or(f64::NAN, Ratio::ratio)
    };
    let group = |body: &str, motion: Motion| {
        let values = vec![of(body, motion, Choice::ALL[0]), of(body, motion, paper)];
        Group {
            name: short(motion).into(),
            note: format!("{:.3}, {:.3}", values[0], values[1]),
            values,
        }
    };
    let charts = bodies(results.ratios.iter().map(|ratio| ratio.body));
    let charts = charts
        .into_iter()
        .map(|body| (body.into(), Motion::ALL.map(|m| group(body, m)).into()));
    let names = ["B-spline", "paper's weights"];
    side_by_side(charts.collect(), "", "pullback / differences", &names)
}

/// Each name once, in order.
fn bodies(names: impl Iterator<Item = &'static str>) -> Vec<&'static str> {
    let mut found: Vec<&str> = names.collect();
    found.dedup();
    found
}

/// The name of a motion, where there is little room.
fn short(motion: Motion) -> &'static str {
    match motion {
        Motion::Along => "along x",
        Motion::Oblique => "oblique",
        Motion::Offset => "offset",
        Motion::Scaling => "scaling",
        Motion::Bending => "bending",
    }
}
