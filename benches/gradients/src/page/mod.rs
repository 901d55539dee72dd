//! The page: a text whose numbers come from the results, and tables.

mod findings;
mod sections;
#[cfg(test)]
mod tests;

use isograd_page::table::number;
use isograd_page::text::thousands;

use crate::Outcome;
use crate::study::{Results, Study};

/// The demands of this page: what a value must not exceed, or fall below.
mod demand {
    /// Relative difference of a component of the gradient to differences of what it differentiates.
    pub const RELATIVE: f64 = 1e-3;
    /// Seconds backward over seconds forward.
    pub const COST: f64 = 1.2;
    /// Times that the pullback is faster than differences.
    pub const SPEEDUP: f64 = 20.0;
    /// Fields kept for the pullback.
    pub const FIELDS: f64 = 3.0;
    /// Difference to 1 of pullback over differences across a cell.
    pub const RATIO: f64 = 0.02;
    /// Relative error of a closed form at 64 cells.
    pub const CLOSED: f64 = 0.01;
}

/// The whole page.
///
/// # Errors
/// Something that was not measured.
pub fn page(study: &Study, results: &Results) -> Outcome<String> {
    let parts = [
        introduction(study, results),
        findings::findings(results)?,
        sections::parameters(results),
        sections::cost(results),
        sections::memory(results),
        sections::ratios(results),
        sections::spheres(results),
    ];
    Ok(parts.join("\n"))
}

/// `338 × 120 × 151`.
fn cells(shape: [usize; 3]) -> String {
    shape.map(|n| n.to_string()).join(" × ")
}

/// What is measured, and on what.
fn introduction(study: &Study, results: &Results) -> String {
    format!(
        "# Gradients

`Reconstruction::pullback` turns the slope of a loss in φ (or in the mesh, the normals, the indicator) into its slope
in every sample. This page compares it with finite differences and closed forms, and says what it costs.
`cargo xtask gradients` writes the page, its pictures and [all numbers](gradients.json). The seed is fixed: all but
seconds and bytes come out the same again.

**What the pullback holds constant**: which samples are neighbors of which and within what radius, the side that
each normal points to, which cells are inside, and which face is closest to a cell. All else is differentiated. So
there are two kinds of differences here:

- **held**: a step so small that no neighborhood changes, with the radii and sides of the start
  (`Reconstructor::reconstruct_held`). This is the map that the pullback differentiates; they must agree.
- **across a cell**: the fastest sample moves half a cell to either side, and everything is found anew
  (`Reconstructor::reconstruct`). This is what an optimizer meets when it takes a step.

Bodies: the fish of `isograd-shapes`, {fish_samples} samples on {fish} cells; its torus, {torus_samples} samples on
{torus} cells. The longest side of a grid is 1.2 times that of its body. All options have their defaults unless said
otherwise (points alone, no normals given); numbers are f64 except where costs are compared. **Cell** is the side `h` of
one grid cell: {cell} of the fish's length, which makes its tail fin, 0.034 thick at its root, {thick} cells there
and none at its edge.
",
        fish = cells(study.fish.shape),
        fish_samples = thousands(study.fish.samples),
        torus = cells(study.torus.shape),
        torus_samples = thousands(study.torus.samples),
        cell = number(results.parameters.setting.cell),
        thick = number(0.034 / results.parameters.setting.cell),
    )
}
