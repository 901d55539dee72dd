//! `isograd sdf`: signed distance field of a mesh.

use std::time::Instant;

use isograd::distance::lattice::{Scratch, forward_of_mesh};
use isograd::distance::{Distance, Sign};
use isograd::{Field, Grid, Outliers, PointCloud, Real, check_distance_memory};
use isograd_io::{Dtype, FIELD_EXTENSIONS, Geometry};

use crate::args;
use crate::error::Error;
use crate::outputs::{check_extension, check_not_input};
use crate::progress::Progress;

/// Warning for a mesh that is not closed.
const NOT_CLOSED: &str = "the mesh is not closed, or neighboring faces are wound against each other; the sign is that of the generalized winding number, and changes inside holes without φ passing 0";

/// Runs the command in the number type of the file, or in double precision where single does not resolve the grid.
///
/// # Errors
/// See [`Error`]; then no file has been left incomplete.
pub fn run(args: &args::Sdf) -> Result<(), Error> {
    check_extension(&args.output, FIELD_EXTENSIONS)?;
    check_not_input(&args.output, &args.mesh)?;
    isograd_io::check_output(&args.output, FIELD_EXTENSIONS)?;
    let mut progress = Progress::new(3, args.running);
    progress.step("read");
    let geometry = args.memory.options().read_mesh(&args.mesh)?;
    if geometry.dtype == Dtype::F32 && grid::<f32>(args, &geometry).is_ok() {
        solve::<f32>(args, &geometry, progress)
    } else {
        solve::<f64>(args, &geometry, progress)
    }
}

/// The grid: between `--bounds`, or around the vertices of the faces.
fn grid<T: Real>(args: &args::Sdf, geometry: &Geometry) -> Result<Grid<T>, Error> {
    let mut is_used = vec![false; geometry.points.len()];
    for &vertex in geometry.faces.as_flattened() {
        is_used[vertex as usize] = true;
    }
    let used = geometry
        .points
        .iter()
        .zip(is_used)
        .filter(|(_, used)| *used);
    let used = used.map(|(point, _)| point.map(T::of)).collect();
    let cloud = PointCloud::new(used).map_err(Error::input(&args.mesh))?;
    // Few, far vertices may span large faces.
    let grid = args.cells.grid(&cloud, Outliers::Keep);
    grid.map_err(Error::input(&args.mesh))
}

fn solve<T: Distance>(
    args: &args::Sdf,
    geometry: &Geometry,
    mut progress: Progress,
) -> Result<(), Error> {
    let start = Instant::now();
    let mesh = geometry.mesh::<T>().map_err(Error::input(&args.mesh))?;
    let grid = grid::<T>(args, geometry)?;
    check_distance_memory(&grid).map_err(Error::input(&args.mesh))?;
    progress.step("distance");
    let mut phi = Field::zeros(grid);
    let scratch = &mut Scratch::default();
    let sign = forward_of_mesh(&mesh, args.band, scratch, &mut phi, &mut Vec::new());
    let sign = sign.map_err(Error::input(&args.mesh))?;
    if sign == Sign::WindingNumber {
        progress.warn(NOT_CLOSED);
    }
    progress.step("write");
    isograd_io::write_field(&args.output, &phi)?;
    progress.finish();
    progress.print(&format!("wrote {}", args.output.display()));
    let [nx, ny, nz] = grid.shape();
    progress.print(&format!(
        "{} faces, {nx} × {ny} × {nz} cells of {:.4e}, sign: {}, {:.2} s",
        mesh.faces().len(),
        grid.spacing(),
        sign.name(),
        start.elapsed().as_secs_f64()
    ));
    Ok(())
}
