//! The pictures of the page: clouds whose samples are colored by what became of their signs.

use std::path::Path;

use isograd::orient::{Method, ParityOptions};
use isograd_cli::plot::canvas::{Anchor, Canvas, Color, WHITE};
use isograd_cli::plot::{Camera, Scene, View, write};
use isograd_element::vector;
use isograd_page::bars::legend;
use isograd_page::chart::LETTERS;
use isograd_page::layout::WIDTH;
use isograd_page::program::Outcome;

use crate::body::Body;
use crate::measure::{Measured, measure};
use crate::suite;

/// Clouds that tell something: thin, gappy, noisy, with a cavity, open.
const SHOWN: [&str; 5] = [
    "airliner",
    "wing 0.02",
    "knot holes",
    "vessels noise 0.005",
    "hemisphere",
];

const RIGHT: Color = [0.62, 0.68, 0.74];
const DOUBTFUL: Color = [0.93, 0.66, 0.12];
const WRONG: Color = [0.80, 0.10, 0.16];

/// Height of one cloud, and of the words above them all, in pixels.
const PANEL: usize = 330;
const HEAD: usize = 90;

/// More can't be told apart; those that are wrong or doubtful are shown all.
const MOST_RIGHT: usize = 20_000;

/// Writes `orientation.png`: every cloud by the automatic method, and by parity.
///
/// # Errors
/// What the operating system says.
pub fn draw(folder: &Path) -> Outcome {
    let width = WIDTH as usize;
    let mut canvas = Canvas::new(width, HEAD + SHOWN.len() * PANEL, WHITE);
    let entries = [("right", RIGHT), ("doubtful", DOUBTFUL), ("wrong", WRONG)];
    legend(&mut canvas, &entries, [12.0, 0.8 * LETTERS]);
    let methods = [
        ("auto", Method::Auto),
        (
            "parity (the paper's)",
            Method::Parity(ParityOptions::default()),
        ),
    ];
    for (column, (title, _)) in methods.iter().enumerate() {
        let middle = 0.5 * WIDTH * (column as f32 + 0.5);
        canvas.text(title, [middle, 1.2 * LETTERS], Anchor::Middle, LETTERS);
    }
    for (row, name) in SHOWN.into_iter().enumerate() {
        let Some(cloud) = suite::by_name(name) else {
            return Err(format!("the suite has no cloud '{name}'").into());
        };
        let body = cloud.body();
        let top = HEAD + row * PANEL;
        for (column, (_, method)) in methods.iter().enumerate() {
            let found = measure(&body, method, 1);
            let picture = panel(&body, &found, width / 2 - 40, PANEL - 40);
            canvas.paste(&picture, column * width / 2 + 20, top + 10);
            let words = format!(
                "{name}: {:.2} % wrong, {:.2} % doubtful",
                found.errors.wrong, found.errors.doubtful
            );
            let middle = 0.5 * WIDTH * (column as f32 + 0.5);
            let below = (top + PANEL) as f32 - 0.8 * LETTERS;
            canvas.text(&words, [middle, below], Anchor::Middle, 0.9 * LETTERS);
        }
    }
    Ok(write(&folder.join("orientation.png"), &canvas)?)
}

/// One cloud. Samples on its far side are left out, as the body would hide them.
fn panel(body: &Body, found: &Measured, width: usize, height: usize) -> Canvas {
    let mut scene = Scene::new(width, height, &View::new(Camera::default(), &body.points));
    let color = |i: usize| {
        let cosine = vector::dot(
            vector::to_f64(found.orientation.normals[i]),
            body.normals[i],
        );
        if cosine < -0.5 {
            WRONG
        } else if found.orientation.is_doubtful(i) {
            DOUBTFUL
        } else {
            RIGHT
        }
    };
    let colors: Vec<Color> = (0..body.points.len()).map(color).collect();
    let stride = body.points.len().div_ceil(MOST_RIGHT).max(1);
    for (wanted, radius) in [(RIGHT, 1.3), (DOUBTFUL, 1.8), (WRONG, 1.8)] {
        let shown = (0..colors.len())
            .filter(|&i| colors[i] == wanted && (wanted != RIGHT || i % stride == 0));
        let (points, normals): (Vec<_>, Vec<_>) =
            shown.map(|i| (body.points[i], body.normals[i])).unzip();
        scene.points(&points, Some(&normals), radius, wanted);
    }
    scene.finish()
}
