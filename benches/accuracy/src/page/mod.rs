//! The page: a text whose numbers come from the results, and tables.

mod findings;
mod sections;
#[cfg(test)]
mod tests;

use isograd_page::text::thousands;

use crate::Outcome;
use crate::study::{Results, Study};

/// The whole page.
///
/// # Errors
/// A case that was not measured.
pub fn page(study: &Study, results: &Results) -> Outcome<String> {
    let parts = [
        introduction(study)?,
        findings::findings(study, results)?,
        sections::surfaces(study, results)?,
        sections::fields(study, results)?,
        sections::normals(study, results)?,
        sections::sampling(study, results)?,
        sections::levels(study, results)?,
        sections::weights(study, results)?,
        sections::gradient(study, results)?,
        sections::precision(study, results)?,
    ];
    Ok(parts.join("\n"))
}

/// What is measured, and on what.
fn introduction(study: &Study) -> Outcome<String> {
    let mut bodies = Vec::new();
    for &body in &study.bodies {
        let shape = isograd_shapes::by_name(body)?;
        let values: Vec<String> = shape
            .parameters()
            .map(|(parameter, value)| format!("{} {value}", parameter.name))
            .collect();
        bodies.push(format!("- **{body}**: {}", values.join(", ")));
    }
    Ok(format!(
        "# Accuracy

Bodies whose signed distance is known exactly are sampled, the samples are reconstructed, and the result is
compared with the truth. `cargo xtask accuracy` writes this page, its pictures and
[all numbers](accuracy.json); the seed is fixed, so it writes the same again.

{bodies}

There are {samples} samples on each body, unless another number is given, and grids of {low} to {high} cells on
the longest side, of which the body takes 5 in 6. All options have their defaults (f32, estimated normals) unless
said otherwise. **Cell** is the side `h` of one grid cell. Where two figures stand together they are mean and
maximum of absolute errors:

- **zero set**: exact distance of the vertices of the surface, and of the middles of its faces, in cells. Beside it
  stands the same for marching cubes of the *exact* φ, which is what flat triangles cost, whatever made them;
- **order**: of the mean at the vertices, as a length, from the grid before to this one;
- **φ**: difference to the exact distance at every cell center where that is below 3 cells, in cells;
- **∇φ**: angle between the gradient of φ and the exact normal, at the samples, in degrees;
- **area, volume**: relative error of the surface, in percent.
",
        bodies = bodies.join("\n"),
        samples = thousands(study.samples),
        low = study.cells[0],
        high = study.cells[study.cells.len() - 1],
    ))
}
