//! `isograd clean`: a cloud without duplicates, outliers and points that are not finite, thinned.

use isograd::Real;
use isograd::clean::clean;
use isograd_io::{Attributes, CLOUD_EXTENSIONS, Geometry, NotFinite, ReadOptions};

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
    let options = ReadOptions {
        not_finite: NotFinite::Keep,
        ..args.reading.options(Attributes::All)
    };
    let mut geometry = options.read_geometry(&args.cloud)?;
    let removed = geometry.drop_not_finite();
    match is_single(&geometry) {
        true => run_on::<f32>(args, &geometry, removed, progress),
        false => run_on::<f64>(args, &geometry, removed, progress),
    }
}

fn run_on<T: Real>(
    args: &args::Clean,
    geometry: &Geometry,
    not_finite: usize,
    mut progress: Progress,
) -> Result<(), Error> {
    let cloud = geometry.cloud::<T>().map_err(Error::input(&args.cloud))?;
    progress.step("clean");
    let mut cleaned = clean(cloud.points(), &args.options()).map_err(Error::input(&args.cloud))?;
    if not_finite > 0 {
        cleaned.removed.insert(0, ("not_finite", not_finite));
    }
    let all = not_finite + cloud.len();
    let kept = cleaned.apply(&cloud).map_err(Error::input(&args.cloud))?;
    if kept.is_empty() {
        let steps = cleaned.removed.iter();
        let steps: Vec<String> = steps.map(|(name, n)| format!("{name} {n}")).collect();
        let remedy = match cloud.is_empty() {
            true => "correct them, or write the file without its normals",
            false => "use a larger radius or fewer neighbors",
        };
        let problem = format!(
            "no point of {all} is left (removed: {}); {remedy}",
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
    progress.print(&format!("{} of {all} points kept", kept.len()));
    Ok(())
}
