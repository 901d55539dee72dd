//! What the tables say, in a few sentences with their figures.

use isograd_page::table::{number, percent};
use isograd_page::text::{item, thousands};

use crate::Outcome;
use crate::case::{Draw, Normals, Precision, Splat};
use crate::measure::Measured;
use crate::page::sections::order;
use crate::spread::pair;
use crate::study::{Results, Study, WAYS};

/// The short answer.
pub fn findings(study: &Study, results: &Results) -> Outcome<String> {
    let parts = [
        surface(study, results)?,
        convergence(study, results)?,
        normals(study, results)?,
        weights(study, results)?,
        level(study, results)?,
        smoothing(study, results)?,
        thin(study, results)?,
        precision(study, results)?,
    ];
    let items: Vec<String> = parts.iter().map(|part| item(part)).collect();
    Ok(format!("## What is seen\n\n{}", items.concat()))
}

fn surface(study: &Study, results: &Results) -> Outcome<String> {
    let cells = study.middle_cells();
    let of = |draw| results.row(&study.sampling_case(draw, Normals::Exact, None, cells));
    let floor = results.floor(study.first(), cells)?;
    Ok(format!(
        "**{body}, {cells} cells, exact normals**: the zero set is off by {} cells (mean / maximum) with random \
         samples, {} with even ones, {} with 10:1 density; marching cubes of the exact φ by {}.",
        pair(&of(Draw::Random)?.surface.vertices),
        pair(&of(Draw::Even)?.surface.vertices),
        pair(&of(Draw::Density10)?.surface.vertices),
        pair(&floor.surface.vertices),
        body = study.first(),
    ))
}

fn convergence(study: &Study, results: &Results) -> Outcome<String> {
    let body = study.first();
    let (coarsest, finest) = (study.cells[0], study.cells[study.cells.len() - 1]);
    let mean = |row: &Measured| number(row.surface.vertices.mean);
    let growing = |cells| results.row(&study.proportional_case(body, Draw::Random, cells));
    let mut orders = Vec::new();
    for pair in study.cells.windows(2) {
        orders.push(number(order(growing(pair[0])?, growing(pair[1])?)));
    }
    let fixed = results.row(&study.default_case(body, finest))?;
    Ok(format!(
        "**Order**: with as many samples per cell on every grid the mean falls from {} to {} cells between {coarsest} \
         and {finest} cells; as a length, with orders {}. {} samples are {} cells apart at \
         {finest} cells, and leave {}; {} leave {}.",
        mean(growing(coarsest)?),
        mean(growing(finest)?),
        orders.join(", "),
        thousands(study.samples),
        number(fixed.sample_spacing),
        mean(fixed),
        thousands(study.proportional_samples(finest)),
        mean(growing(finest)?),
    ))
}

fn normals(study: &Study, results: &Results) -> Outcome<String> {
    let cells = study.middle_cells();
    let of = |normals| results.row(&study.sampling_case(Draw::Random, normals, None, cells));
    let (exact, estimated) = (of(Normals::Exact)?, of(Normals::Estimated)?);
    let degrees = estimated
        .normals
        .as_ref()
        .ok_or("normals were not estimated")?
        .degrees
        .mean;
    Ok(format!(
        "**Estimated normals** are off by {}° in the mean. The zero set is off by {} cells with them, by {} with exact \
         ones ({}, {cells} cells, random samples).",
        number(degrees),
        number(estimated.surface.vertices.mean),
        number(exact.surface.vertices.mean),
        study.first(),
    ))
}

fn weights(study: &Study, results: &Results) -> Outcome<String> {
    let cells = study.middle_cells();
    let of = |draw, splat, area| {
        let row = results.row(&study.splat_case(draw, splat, area, cells))?;
        Ok::<_, Box<dyn std::error::Error>>(number(row.surface.vertices.mean))
    };
    Ok(format!(
        "**Area weights** are needed where the density varies: at 10:1 the mean is {} cells with them and {} without. \
         **The quadratic B-spline** leaves {} where the paper's weights leave {} (random samples, {cells} cells).",
        of(Draw::Density10, Splat::Bspline, true)?,
        of(Draw::Density10, Splat::Bspline, false)?,
        of(Draw::Random, Splat::Bspline, true)?,
        of(Draw::Random, Splat::Paper, true)?,
    ))
}

fn level(study: &Study, results: &Results) -> Outcome<String> {
    let cells = study.middle_cells();
    let of = |way: usize| results.row(&study.level_case(&WAYS[way], cells));
    let (plain, local) = (of(0)?, of(1)?);
    let (screened, floor) = (of(5)?, results.floor(study.first(), cells)?);
    Ok(format!(
        "**The local level** and the smoothing that goes with it take the error at the vertices from {} to {}, and that of \
         φ within 3 cells from {} to {} ({cells} cells, exact normals). The screened equation with α = 4 leaves {} and {}. \
         Marching cubes of the exact φ, whose triangles cut below what is curved, leaves {} at the middles of faces, and \
         the default {}: its vertices lie a little outside, as samples lie anywhere in their cells.",
        pair(&plain.surface.vertices),
        pair(&local.surface.vertices),
        pair(&plain.band),
        pair(&local.band),
        pair(&screened.surface.vertices),
        pair(&screened.band),
        pair(&floor.surface.faces),
        pair(&local.surface.faces),
    ))
}

fn smoothing(study: &Study, results: &Results) -> Outcome<String> {
    let (coarsest, finest) = (study.cells[0], study.cells[study.cells.len() - 1]);
    let of = |smoothing, cells| {
        let case = study.sampling_case(Draw::Random, Normals::Estimated, smoothing, cells);
        let row = results.row(&case)?;
        Ok::<_, Box<dyn std::error::Error>>(number(row.surface.vertices.mean))
    };
    Ok(format!(
        "**Smoothing** by 0.8 of the distance between samples averages what is between them: at {finest} cells, where \
         samples are few, it turns {} into {}, at {coarsest} cells {} into {}.",
        of(Some(0.0), finest)?,
        of(None, finest)?,
        of(Some(0.0), coarsest)?,
        of(None, coarsest)?,
    ))
}

/// The body whose zero set is furthest off: on this page the one with a sharp edge.
fn thin(study: &Study, results: &Results) -> Outcome<String> {
    let cells = study.middle_cells();
    let mut worst = None::<(&str, &Measured)>;
    for &body in &study.bodies {
        let row = results.row(&study.default_case(body, cells))?;
        if worst.is_none_or(|(_, w)| row.surface.vertices.max > w.surface.vertices.max) {
            worst = Some((body, row));
        }
    }
    let (body, row) = worst.ok_or("no body")?;
    Ok(format!(
        "**The largest errors** are those of the {body} ({} cells at {cells} cells, area {} %). What is thinner than \
         about a cell is cut off, as no grid value lies inside; a sharp trailing edge always has such a part.",
        pair(&row.surface.vertices),
        percent(row.surface.area),
    ))
}

fn precision(study: &Study, results: &Results) -> Outcome<String> {
    let of = |precision| {
        let row = results.row(&study.precision_case(precision))?;
        Ok::<_, Box<dyn std::error::Error>>(row.surface.vertices.mean)
    };
    let difference = (of(Precision::F32)? - of(Precision::F64)?).abs();
    // A rounded difference of zero says less than a bound that holds.
    let bound = [1e-6, 1e-5, 1e-4, 1e-3]
        .into_iter()
        .find(|&bound| difference < bound);
    let size = bound.map_or_else(|| number(difference), |bound| format!("less than {bound}"));
    Ok(format!(
        "**f32 and f64** differ by {size} cells in the mean of the zero set."
    ))
}
