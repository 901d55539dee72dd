//! `isograd isosurface`: surface of a field.

use isograd::isosurface::{Measures, Report, Scratch, forward};
use isograd::{Field, Mesh, Real};
use isograd_io::{Dtype, FIELD_EXTENSIONS, MESH_EXTENSIONS};

use crate::args;
use crate::error::Error;
use crate::outputs::{check_extension, check_not_input};
use crate::progress::{Progress, decimal};

/// Runs the command in the number type of the file.
///
/// # Errors
/// See [`Error`]; then no file has been left incomplete.
pub fn run(args: &args::Isosurface) -> Result<(), Error> {
    check_extension(&args.output, MESH_EXTENSIONS)?;
    check_extension(&args.field, FIELD_EXTENSIONS)?;
    check_not_input(&args.output, &args.field)?;
    isograd_io::check_output(&args.output, MESH_EXTENSIONS)?;
    let mut progress = Progress::new(3, args.running);
    progress.step("read");
    let file = args.memory.options().read_field(&args.field)?;
    let single = (file.dtype == Dtype::F32).then(|| file.convert::<f32>());
    match single.flatten() {
        Some(field) => extract(args, &field, progress),
        None => extract(args, &file.field, progress),
    }
}

fn extract<T: Real>(
    args: &args::Isosurface,
    field: &Field<T>,
    mut progress: Progress,
) -> Result<(), Error> {
    progress.step("isosurface");
    let mut mesh = Mesh::default();
    let report = forward(field, T::of(args.level), &mut Scratch::default(), &mut mesh);
    let report = report.map_err(Error::input(&args.field))?;
    if report.touches_wall {
        progress.warn(&format!(
            "the surface reaches the {} of the grid, where it is left open",
            walls(&report)
        ));
    }
    progress.step("write");
    isograd_io::write_mesh(&args.output, &mesh)?;
    progress.finish();
    progress.print(&format!("wrote {}", args.output.display()));
    let measures = Measures::of(&mesh);
    progress.print(&format!(
        "surface: {} faces, {}, components: {}, area {}, volume {}",
        measures.faces,
        if measures.closed {
            "closed"
        } else {
            "not closed"
        },
        measures.components,
        decimal(measures.area),
        decimal(measures.volume)
    ));
    Ok(())
}

/// Names of the walls that the surface reaches.
fn walls(report: &Report) -> String {
    let ends = report.walls.as_flattened().iter().enumerate();
    let reached = ends.filter(|(_, reached)| **reached).map(|(wall, _)| {
        let end = if wall % 2 == 0 { "low" } else { "high" };
        format!("{end} {}", ["x", "y", "z"][wall / 2])
    });
    let names: Vec<String> = reached.collect();
    match names.len() {
        1 => format!("{} wall", names[0]),
        _ => format!("{} walls", names.join(", ")),
    }
}
