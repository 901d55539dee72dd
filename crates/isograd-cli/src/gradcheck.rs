//! `isograd gradcheck`: gradients against finite differences, as a table.

use std::path::Path;

use isograd::PointCloud;
use isograd::gradcheck::{Difference, GradientCheck, Motion, Options, Row, gradcheck};
use serde::Serialize;

use crate::args;
use crate::error::Error;
use crate::outputs::{check_ending, write_report};
use crate::progress::{Progress, to_stdout};

/// Share of the derivative of a body that grows all over below which a derivative counts as nothing: its ratio
/// is not shown.
const NOTHING: f64 = 0.005;

/// Runs the command, in double precision.
///
/// # Errors
/// See [`Error`]; [`Error::Gradients`] where a tolerance is given and not kept.
pub fn run(args: &args::Gradcheck) -> Result<(), Error> {
    let file = args.cloud.display().to_string();
    if let Some(report) = &args.report {
        check_ending(report, &["json"])?;
        isograd_io::check_output(report, &["json"])?;
    }
    let cloud_error = |source| Error::Cloud {
        file: file.clone(),
        source,
    };
    let geometry = isograd_io::read_geometry(&args.cloud)?;
    args.method.normals.check()?;
    let cloud = geometry.cloud();
    let cloud = cloud.and_then(|cloud| args.method.normals.with_sensors(cloud));
    let cloud: PointCloud<f64> = cloud.map_err(cloud_error)?;
    let grid = args.grid.grid(&cloud).map_err(|source| Error::Grid {
        file: file.clone(),
        source,
    })?;
    let options = Options {
        reconstruction: args.method.options(),
        step: args.step,
        seed: args.seed,
        ..Options::default()
    };
    let mut progress = Progress::new(Motion::ALL.len(), args.running);
    let mut observer = |motion: Motion| progress.step(motion.name());
    let check = gradcheck(&cloud, grid, &options, &mut observer);
    progress.finish();
    let check = check.map_err(|source| Error::Gradcheck {
        file: file.clone(),
        source,
    })?;
    if !args.running.quiet {
        let [nx, ny, nz] = grid.shape();
        to_stdout(&format!(
            "{} points, {nx} × {ny} × {nz} cells of {:.4e}",
            cloud.len(),
            grid.spacing()
        ));
        to_stdout(&table(&check, args.step));
    }
    if let Some(report) = &args.report {
        write(report, &file, &check)?;
    }
    judge(&check, args.tolerance, file)
}

/// The table and what it means.
fn table(check: &GradientCheck, step: f64) -> String {
    let mut lines = vec![format!(
        "{:<14} {:>12} {:>12} {:>9} {:>12} {:>7}   {}",
        "motion",
        "pullback",
        "small step",
        "off by",
        format!("±{step} cell"),
        "ratio",
        "what changed over ± that step"
    )];
    lines.extend(check.rows.iter().map(line));
    let far = check.rows.iter().filter(|row| counts(row));
    let far = far.max_by(|a, b| off(a.large_ratio()).total_cmp(&off(b.large_ratio())));
    if let Some(row) = far {
        let [x, y, z] = row.parting.place;
        lines.push(format!(
            "pullback and large step part most for {} ({:+.1} %), there most near ({x:.4}, {y:.4}, {z:.4}): {:.0} % of what differs",
            row.motion.name(),
            100.0 * (row.large_ratio() - 1.0),
            100.0 * row.parting.share
        ));
    }
    lines.extend(notes(check));
    lines.join("\n")
}

/// What else there is to know.
fn notes(check: &GradientCheck) -> Vec<String> {
    let mut lines = Vec::new();
    if check.rows.iter().any(|row| !row.small.is_smooth()) {
        let tells = "* the small step, too, changes a neighborhood, a sign or the cell of a sample: no derivative there";
        lines.push(tells.into());
    }
    let ridges = check.rows.iter().map(|row| row.ridges).max().unwrap_or(0);
    if ridges > 0 {
        lines.push(format!(
            "up to {ridges} cells of a row are left out: the small step takes them across the medial axis, where φ has no derivative"
        ));
    }
    if check.guarded > 0 {
        lines.push(format!(
            "{} places have no derivative or one without bound; a bounded one was taken",
            check.guarded
        ));
    }
    lines
}

fn line(row: &Row) -> String {
    let Difference {
        neighborhoods,
        normals,
        cells,
        ..
    } = row.large;
    let ratio = match counts(row) {
        true => format!("{:.4}", row.large_ratio()),
        false => "≈ 0".into(),
    };
    let unsmooth = if row.small.is_smooth() { "" } else { " *" };
    format!(
        "{:<14} {:>12.5e} {:>12.5e} {:>9.1e} {:>12.5e} {ratio:>7}   {neighborhoods} neighborhoods, {normals} normals, {cells} cells{unsmooth}",
        row.motion.name(),
        row.pullback,
        row.small.value,
        error(row),
        row.large.value,
    )
}

/// Whether the derivative is more than what is left where the surface moves along itself.
fn counts(row: &Row) -> bool {
    row.pullback.abs() > NOTHING * row.scale
}

fn off(ratio: f64) -> f64 {
    (ratio - 1.0).abs()
}

/// Pullback against the small step, relative to the derivative, or to what counts as nothing.
fn error(row: &Row) -> f64 {
    let size = row.pullback.abs().max(NOTHING * row.scale);
    match size > 0.0 {
        true => (row.pullback - row.small.value).abs() / size,
        false => 0.0,
    }
}

fn judge(check: &GradientCheck, tolerance: Option<f64>, file: String) -> Result<(), Error> {
    let worst = check
        .rows
        .iter()
        .max_by(|a, b| error(a).total_cmp(&error(b)));
    match (worst, tolerance) {
        (Some(row), Some(tolerance)) if !(error(row) <= tolerance) => Err(Error::Gradients {
            file,
            motion: row.motion.name(),
            off: error(row),
            tolerance,
        }),
        _ => Ok(()),
    }
}

/// The report. Scripts depend on these names.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    path: &'a str,
    guarded: usize,
    motions: Vec<MotionReport>,
}

#[derive(Serialize)]
struct MotionReport {
    name: &'static str,
    pullback: f64,
    scale: f64,
    small: StepReport,
    large: StepReport,
    parting: [f64; 3],
    ridges: usize,
}

#[derive(Serialize)]
struct StepReport {
    step: f64,
    value: f64,
    neighborhoods: usize,
    normals: usize,
    cells: usize,
    crossings: usize,
}

impl From<Difference> for StepReport {
    fn from(of: Difference) -> Self {
        Self {
            step: of.step,
            value: of.value,
            neighborhoods: of.neighborhoods,
            normals: of.normals,
            cells: of.cells,
            crossings: of.crossings,
        }
    }
}

fn write(path: &Path, file: &str, check: &GradientCheck) -> Result<(), Error> {
    let motions = check.rows.iter().map(|row| MotionReport {
        name: row.motion.name(),
        pullback: row.pullback,
        scale: row.scale,
        small: row.small.into(),
        large: row.large.into(),
        parting: row.parting.place,
        ridges: row.ridges,
    });
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        path: file,
        guarded: check.guarded,
        motions: motions.collect(),
    };
    write_report(path, &report)
}
