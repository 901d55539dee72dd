//! Verdicts on real clouds, clean and degraded, against the meshes that they were sampled from (`../shared/data`).
//!
//! `cargo test -p isograd-cli --test cli real_verdicts -- --nocapture` prints the table.

use std::path::Path;

use isograd::distance::Query;
use isograd::isosurface::Level;
use isograd::{Grid, Mesh, Options, PointCloud, Reconstructor, Report, Resolution, Verdict};
use isograd_element::vector;
use isograd_io::{read_geometry, read_mesh};

use crate::shared_data;

const CELLS: usize = 48;
/// Of all samples, one in this many is used.
const STRIDE: usize = 3;
/// Number of places on a surface where its distance from the other is looked at.
const PLACES: usize = 5000;
/// Share of a surface that may be further from the other than the limit.
const TOLERATED: f64 = 0.01;

/// Places on a mesh, evenly spread over its area.
fn places(mesh: &Mesh<f64>) -> Vec<[f64; 3]> {
    let area = |f: usize| {
        let [a, b, c] = mesh.corners(f);
        vector::norm(vector::cross(vector::sub(b, a), vector::sub(c, a))) / 2.0
    };
    let all: f64 = (0..mesh.faces().len()).map(area).sum();
    let (mut passed, mut found) = (0.0, Vec::new());
    for f in 0..mesh.faces().len() {
        passed += area(f);
        let corners = mesh.corners(f);
        while (found.len() as f64 + 0.5) * all / (PLACES as f64) < passed {
            // Low-discrepancy numbers, folded into the triangle.
            let k = found.len() as f64;
            let (u, v) = ((k * 0.754_877_666).fract(), (k * 0.569_840_290).fract());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            let weights = [1.0 - u - v, u, v];
            found.push([0, 1, 2].map(|a| (0..3).map(|k| weights[k] * corners[k][a]).sum()));
        }
    }
    found
}

/// Shares of the places that are further from a surface than 1 and 2 cells.
fn beyond(places: &[[f64; 3]], surface: &Query<f64>, h: f64) -> [f64; 2] {
    let hits = surface.query(places, None);
    [1.0, 2.0].map(|cells| {
        let count = hits.iter().filter(|hit| hit.distance.abs() > cells * h);
        count.count() as f64 / places.len() as f64
    })
}

/// Verdict of one who knows the truth: by the parts of the true surface that are missing, and by those of the
/// reconstruction that should not be there.
fn known(truth: &Query<f64>, made: &Mesh<f32>, h: f64) -> (Verdict, [f64; 4]) {
    let vertices = made.vertices().iter().map(|&v| vector::to_f64(v)).collect();
    let made = Mesh::new(vertices, made.faces().to_vec()).expect("the same mesh in f64");
    let false_parts = beyond(&places(&made), truth, h);
    let missing = beyond(&places(truth.mesh()), &Query::new(made).expect("faces"), h);
    let verdict = match [
        false_parts[0].max(missing[0]),
        false_parts[1].max(missing[1]),
    ] {
        [_, far] if far > TOLERATED => Verdict::Bad,
        [near, _] if near > TOLERATED => Verdict::Check,
        _ => Verdict::Good,
    };
    (
        verdict,
        [missing[0], missing[1], false_parts[0], false_parts[1]],
    )
}

fn reasons(report: &Report) -> String {
    let codes: Vec<_> = report.reasons().iter().map(|w| w.code()).collect();
    codes.join(" ")
}

/// Prints a row, and returns a line if the verdict is wrong.
fn wrong(path: &Path, level: Level) -> Option<String> {
    let file = path.file_name()?.to_str()?;
    let name = file.strip_suffix(".points.ply")?;
    let shape = name.split('.').next()?;
    let geometry = read_geometry(path).expect("a cloud");
    let points = geometry.points.iter().step_by(STRIDE);
    let points = points.map(|p| p.map(|x| x as f32)).collect();
    let cloud = PointCloud::<f32>::new(points).expect("finite points");
    let truth = read_mesh(&path.with_file_name(format!("{shape}.mesh.ply"))).expect("a mesh");
    let truth = Query::new(truth.mesh::<f64>().expect("a mesh")).expect("faces");

    let grid = Grid::fit(&cloud, Resolution::Cells(CELLS), 0.1).expect("fits");
    let mut plan = Reconstructor::new(grid, Options::default().level(level)).expect("options");
    let result = plan.reconstruct(&cloud).expect("reconstructs");
    let (expected, shares) = known(&truth, result.mesh(), f64::from(grid.spacing()));
    let verdict = result.report().verdict().expect("a verdict");
    let row = format!(
        "{name:20} {level:?}: {verdict}, in truth {expected} {shares:.4?}: {}",
        reasons(result.report())
    );
    println!("{row}");
    let is_right = match expected {
        Verdict::Good => verdict < Verdict::Bad || name.contains("missing"),
        Verdict::Check | Verdict::Bad => verdict >= expected,
    };
    (!is_right).then_some(row)
}

#[test]
fn verdicts_agree_with_the_truth() {
    println!(
        "cloud, level: verdict, and share of the true surface that is 1 and 2 cells away, and the reverse"
    );
    let mut failures = Vec::new();
    for path in shared_data::clouds() {
        for level in [Level::Local, Level::Thin] {
            failures.extend(wrong(&path, level));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
