//! One section for each question.

use isograd_page::table::{Table, number, percent};
use isograd_page::text::thousands;

use crate::Outcome;
use crate::case::{Case, Draw, Normals, Precision, Splat};
use crate::measure::{FieldErrors, Measured, Slope};
use crate::spread::{pair, triple};
use crate::study::{Results, SMOOTHINGS, Study, WAYS};

/// The grids of a body at the defaults, the finest once more with as many samples per cell as on the
/// middle one.
fn default_cases(study: &Study, body: &'static str) -> Vec<Case> {
    let mut cases: Vec<Case> = study
        .cells
        .iter()
        .map(|&cells| study.default_case(body, cells))
        .collect();
    let finest = study.cells[study.cells.len() - 1];
    cases.push(study.proportional_case(body, Draw::Random, finest));
    cases
}

fn grid(study: &Study, case: &Case) -> String {
    if case.samples == study.samples {
        case.cells.to_string()
    } else {
        format!("{}, {} samples", case.cells, thousands(case.samples))
    }
}

fn head(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.into()).collect()
}

/// Observed order of the mean error at the vertices between two grids.
pub fn order(coarse: &Measured, fine: &Measured) -> f64 {
    let length = |m: &Measured| m.surface.vertices.mean * m.cell;
    (length(coarse) / length(fine)).ln() / (coarse.cell / fine.cell).ln()
}

/// The zero set of every body on every grid.
pub fn surfaces(study: &Study, results: &Results) -> Outcome<String> {
    let names = [
        "samples apart, cells",
        "vertices",
        "order",
        "faces",
        "exact φ: vertices",
        "exact φ: faces",
        "area, %",
        "volume, %",
    ];
    let mut table = Table::new(&["body", "cells"], head(&names));
    for &body in &study.bodies {
        let mut before: Option<&Measured> = None;
        for case in default_cases(study, body) {
            let row = results.row(&case)?;
            let floor = &results.floor(body, case.cells)?.surface;
            // The last row is on the grid of the one before it.
            let coarse = before.filter(|coarse| coarse.cell > row.cell);
            table.row(vec![
                body.into(),
                grid(study, &case),
                number(row.sample_spacing),
                pair(&row.surface.vertices),
                coarse.map_or(String::new(), |coarse| number(order(coarse, row))),
                pair(&row.surface.faces),
                pair(&floor.vertices),
                pair(&floor.faces),
                percent(row.surface.area),
                percent(row.surface.volume),
            ]);
            before = Some(row);
        }
    }
    Ok(format!(
        "## The zero set

![Mean error of the zero set over the number of cells](images/accuracy-convergence.png)

{table}"
    ))
}

fn field<'a>(results: &'a Results, case: &Case) -> Outcome<&'a FieldErrors> {
    let field = results.row(case)?.field.as_ref();
    Ok(field.ok_or("only cases at the defaults have a field")?)
}

/// φ and ∇φ of every body on every grid.
pub fn fields(study: &Study, results: &Results) -> Outcome<String> {
    let mut columns: Vec<String> = study
        .cells
        .iter()
        .map(|cells| format!("φ, {cells} cells"))
        .collect();
    columns.extend(study.cells.iter().map(|cells| format!("∇φ, {cells} cells")));
    let mut table = Table::new(&["body"], columns);
    for &body in &study.bodies {
        let mut row = vec![body.to_string()];
        let cases = || {
            study
                .cells
                .iter()
                .map(|&cells| study.default_case(body, cells))
        };
        for case in cases() {
            row.push(pair(&results.row(&case)?.band));
        }
        for case in cases() {
            row.push(pair(&field(results, &case)?.gradient));
        }
        table.row(row);
    }
    Ok(format!(
        "## φ within 3 cells of the surface, and its gradient there\n\n{table}"
    ))
}

/// Estimated normals of every body.
pub fn normals(study: &Study, results: &Results) -> Outcome<String> {
    let mut columns = Vec::new();
    for draw in Draw::ALL {
        columns.extend([draw.to_string(), "wrong sign, %".into()]);
    }
    let mut table = Table::new(&["body"], columns);
    for &body in &study.bodies {
        let mut row = vec![body.to_string()];
        for draw in Draw::ALL {
            let measured = results.row(&study.normals_case(body, draw))?;
            let errors = measured
                .normals
                .as_ref()
                .ok_or("normals were not estimated")?;
            row.extend([triple(&errors.degrees), number(100.0 * errors.wrong_signs)]);
        }
        table.row(row);
    }
    Ok(format!(
        "## Estimated normals

Angle between the axis found by D-PCA and the exact normal, in degrees: mean / 99th percentile / maximum; and the
share of the samples whose sign came out wrong. No grid is involved.

{table}"
    ))
}

/// Columns of mean and maximum for each grid.
fn over_grids(study: &Study, labels: &[&str]) -> Table {
    Table::new(
        labels,
        study.cells.iter().map(|cells| format!("{cells} cells")),
    )
}

fn row_over_grids(
    study: &Study,
    results: &Results,
    labels: Vec<String>,
    case: impl Fn(usize) -> Case,
) -> Outcome<Vec<String>> {
    let mut row = labels;
    for &cells in &study.cells {
        row.push(pair(&results.row(&case(cells))?.surface.vertices));
    }
    Ok(row)
}

/// Ways of drawing samples, normals and smoothing.
pub fn sampling(study: &Study, results: &Results) -> Outcome<String> {
    let mut table = over_grids(study, &["samples", "normals", "smoothing"]);
    for draw in Draw::ALL {
        for normals in [Normals::Exact, Normals::Estimated] {
            for smoothing in SMOOTHINGS {
                let labels = vec![draw.to_string(), normals.to_string(), width(smoothing)];
                let case = |cells| study.sampling_case(draw, normals, smoothing, cells);
                table.row(row_over_grids(study, results, labels, case)?);
            }
        }
    }
    let per_cell = [Draw::Random, Draw::Even];
    for draw in per_cell {
        let labels = vec![
            format!("{draw}, as many per cell"),
            "estimated".into(),
            width(None),
        ];
        let case = |cells| study.proportional_case(study.first(), draw, cells);
        table.row(row_over_grids(study, results, labels, case)?);
    }
    let counts: Vec<String> = study
        .cells
        .iter()
        .map(|&cells| thousands(study.proportional_samples(cells)))
        .collect();
    Ok(format!(
        "## Samples, normals and smoothing

The {body}: error of the zero set at the vertices, in cells. *10:1 density*: ten times as many samples per area at
one end as at the other. *Smoothing*: width of the Gaussian in the Poisson solve, in cells; auto is 0.8 of the distance
between samples. *As many per cell*: {counts} samples.

{table}",
        body = study.first(),
        counts = counts.join(", "),
    ))
}

/// The width of the smoothing, as it stands in a table.
fn width(smoothing: Option<f64>) -> String {
    smoothing.map_or("auto".into(), |cells| cells.to_string())
}

/// Ways to the level of the surface.
pub fn levels(study: &Study, results: &Results) -> Outcome<String> {
    let mut columns: Vec<String> = study
        .cells
        .iter()
        .map(|cells| format!("{cells} cells"))
        .collect();
    columns.extend(study.cells.iter().map(|cells| format!("φ, {cells} cells")));
    let mut table = Table::new(&["level", "smoothing", "screening"], columns);
    for way in &WAYS {
        let labels = vec![
            way.level.to_string(),
            width(way.smoothing),
            way.screening.to_string(),
        ];
        let case = |cells| study.level_case(way, cells);
        let mut row = row_over_grids(study, results, labels, case)?;
        for &cells in &study.cells {
            row.push(pair(&results.row(&case(cells))?.band));
        }
        table.row(row);
    }
    Ok(format!(
        "## Level, smoothing and screening

The {body}, random samples, exact normals: error of the zero set at the vertices, and of φ within 3 cells, in cells.
*Level*: the value of the indicator that the surface is at, one for all of it (the mean at the samples) or what it is
at the samples near by. *Screening*: α of the screened equation.

{table}",
        body = study.first()
    ))
}

/// Splat weights and area weights.
pub fn weights(study: &Study, results: &Results) -> Outcome<String> {
    let mut table = over_grids(study, &["samples", "splat", "area weights"]);
    for draw in Draw::ALL {
        for splat in Splat::ALL {
            for area in [true, false] {
                let on = if area { "on" } else { "off" };
                let labels = vec![draw.to_string(), splat.to_string(), on.into()];
                let case = |cells| study.splat_case(draw, splat, area, cells);
                table.row(row_over_grids(study, results, labels, case)?);
            }
        }
    }
    Ok(format!(
        "## Splat and area weights

The {body}, exact normals, one level for the whole surface, no smoothing: error of the zero set at the vertices, in
cells. The paper's choice is `paper` without area weights.

![Mean error for each choice of the weights](images/accuracy-weights.png)

{table}",
        body = study.first()
    ))
}

/// `|∇φ|`, which is 1 for a distance.
pub fn gradient(study: &Study, results: &Results) -> Outcome<String> {
    let cells = study.middle_cells();
    let names = ["all: mean", "5 %", "95 %", "near: mean", "5 %", "95 %"];
    let mut table = Table::new(&["body", "cells"], head(&names));
    for &body in &study.bodies {
        for &cells in &study.cells {
            let field = field(results, &study.default_case(body, cells))?;
            let mut row = vec![body.to_string(), cells.to_string()];
            let shown =
                |slope: &Slope| [slope.mean, slope.p05, slope.p95].map(|v| format!("{v:.4}"));
            row.extend(shown(&field.slope_all));
            row.extend(shown(&field.slope_near));
            table.row(row);
        }
    }
    Ok(format!(
        "## |∇φ|

Of a distance it is 1. Central differences see less where the closest point jumps within their reach: on the medial
axis, which every body has inside, and inside an edge that is thinner than a few cells. The paper shows the same for
its fish (its figure 6). *Near* are the cells with |φ| below 3 cells; 5 % and 95 % are percentiles. In the picture there
are {cells} cells on the longest side.

![Density of |∇φ| over all cells and near the surface](images/accuracy-gradient.png)

{table}"
    ))
}

/// Single and double precision.
pub fn precision(study: &Study, results: &Results) -> Outcome<String> {
    let names = [
        "vertices",
        "faces",
        "φ",
        "∇φ",
        "normals",
        "area, %",
        "volume, %",
    ];
    let mut table = Table::new(&["type"], head(&names));
    for (name, precision) in [("f32", Precision::F32), ("f64", Precision::F64)] {
        let case = study.precision_case(precision);
        let row = results.row(&case)?;
        let field = field(results, &case)?;
        let normals = row.normals.as_ref().ok_or("normals were not estimated")?;
        table.row(vec![
            name.into(),
            pair(&row.surface.vertices),
            pair(&row.surface.faces),
            pair(&row.band),
            pair(&field.gradient),
            pair(&normals.degrees),
            percent(row.surface.area),
            percent(row.surface.volume),
        ]);
    }
    Ok(format!(
        "## Number type\n\nThe {}, {} cells.\n\n{table}",
        study.first(),
        study.middle_cells()
    ))
}
