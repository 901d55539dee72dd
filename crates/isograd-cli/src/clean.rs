//! `isograd clean`: a cloud without duplicates and outliers, thinned.

use isograd::Real;
use isograd::clean::clean;
use isograd_io::{Attributes, CLOUD_EXTENSIONS, Geometry};

use crate::args;
use crate::error::Error;
use crate::orient::is_single;
use crate::outputs::{check_extension, check_not_input};
use crate::progress::Progress;

/// Runs the command. Numbers are written in the type of the file.
///
/// # Errors
/// See [`Error`]; then no file has been left incomplete.
pub fn run(args: &args::Clean) -> Result<(), Error> {
    check_extension(&args.output, CLOUD_EXTENSIONS)?;
    check_not_input(&args.output, &args.cloud)?;
    isograd_io::check_output(&args.output, CLOUD_EXTENSIONS)?;
    let mut progress = Progress::new(3, args.running);
    progress.step("read");
    let options = args.reading.options(Attributes::All);
    let geometry = options.read_geometry(&args.cloud)?;
    match is_single(&geometry) {
        true => run_on::<f32>(args, &geometry, progress),
        false => run_on::<f64>(args, &geometry, progress),
    }
}

fn run_on<T: Real>(
    args: &args::Clean,
    geometry: &Geometry,
    mut progress: Progress,
) -> Result<(), Error> {
    let cloud = geometry.cloud::<T>().map_err(Error::input(&args.cloud))?;
    progress.step("clean");
    let cleaned = clean(cloud.points(), &args.options()).map_err(Error::input(&args.cloud))?;
    let kept = cleaned.apply(&cloud).map_err(Error::input(&args.cloud))?;
    if kept.is_empty() {
        let steps = cleaned.removed.iter();
        let steps: Vec<String> = steps.map(|(name, n)| format!("{name} {n}")).collect();
        let problem = format!(
            "no point of {} is left (removed: {}); use a larger radius or fewer neighbors",
            cloud.len(),
            steps.join(", ")
        );
        return Err(Error::input(&args.cloud)(problem));
    }
    progress.step("write");
    isograd_io::write_cloud(&args.output, &kept)?;
    progress.finish();
    progress.print(&format!("wrote {}", args.output.display()));
    for (name, removed) in &cleaned.removed {
        progress.print(&format!("{}: {removed} removed", name.replace('_', "-")));
    }
    progress.print(&format!("{} of {} points kept", kept.len(), cloud.len()));
    Ok(())
}
