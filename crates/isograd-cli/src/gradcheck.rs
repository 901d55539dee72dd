//! `isograd gradcheck`: gradients against finite differences, as a table.

use std::path::Path;

use isograd::gradcheck::{Difference, GradientCheck, Motion, Options, Row, gradcheck};
use isograd::{PointCloud, Verdict};
use isograd_io::Attributes;
use serde::Serialize;

use crate::args;
use crate::error::Error;
use crate::outputs::{check_extension, check_not_input, write_report};
use crate::progress::Progress;
use crate::streams::to_stdout;

/// Fraction of the derivative of uniform growth below which a derivative is negligible, and its ratio is not shown.
const NEGLIGIBLE: f64 = 0.005;

/// Relative deviation of a step of the size that an optimizer takes from the pullback, above which it is to be looked at.
const TOLERATED_STEP: f64 = 0.1;

/// The loss that is differentiated: see [`isograd::gradcheck`].
const LOSS: &str = "volume of the body, with an edge that is soft over 6 cells outside and weights that rise from one end to \
the other; a motion moves the fastest point by 1";

/// Runs the command, in double precision.
///
/// # Errors
/// See [`Error`]; [`Error::Gradients`] if the tolerance is exceeded.
pub fn run(args: &args::Gradcheck) -> Result<(), Error> {
    let file = args.cloud.display().to_string();
    if let Some(report) = &args.report {
        check_extension(report, &["json"])?;
        check_not_input(report, &args.cloud)?;
        isograd_io::check_output(report, &["json"])?;
    }
    let options = args.reading.options(Attributes::Sensors);
    let geometry = options.read_geometry(&args.cloud)?;
    args.method.normals.check()?;
    let cloud = geometry.cloud();
    let cloud = cloud.and_then(|cloud| args.method.normals.with_sensors(cloud));
    let cloud: PointCloud<f64> = cloud.map_err(Error::input(&args.cloud))?;
    let grid = args.grid.grid(&cloud).map_err(Error::input(&args.cloud))?;
    let options = Options {
        reconstruction: args.method.options(args.grid.outliers),
        step: args.step,
        seed: args.seed,
        ..Options::default()
    };
    let mut progress = Progress::new(Motion::ALL.len(), args.running);
    let mut observer = |motion: Motion| progress.step(motion.name());
    let check = gradcheck(&cloud, grid, &options, &mut observer);
    progress.finish();
    let check = check.map_err(Error::input(&args.cloud))?;
    if !args.running.quiet {
        let [nx, ny, nz] = grid.shape();
        to_stdout(&format!(
            "{} points, {nx} × {ny} × {nz} cells of {:.4e}",
            cloud.len(),
            grid.spacing()
        ));
        to_stdout(&format!("loss: {LOSS}"));
        table(&check, args.step).lines().for_each(to_stdout);
        to_stdout(&conclusion(&check, args));
    }
    if let Some(report) = &args.report {
        write(report, &file, &check, verdict(&check, args.tolerance))?;
    }
    check_tolerance(&check, args.tolerance, file)
}

/// The table and its notes.
fn table(check: &GradientCheck, step: f64) -> String {
    let mut lines = vec![format!(
        "{:<14} {:>12} {:>12} {:>9} {:>12} {:>7}   {}",
        "motion",
        "pullback",
        "small step",
        "error",
        format!("±{step} cell"),
        "ratio",
        "changes over ± that step"
    )];
    lines.extend(check.rows.iter().map(line));
    let far = check.rows.iter().filter(|row| is_relevant(row));
    let far = far.max_by(|a, b| off(a.large_ratio()).total_cmp(&off(b.large_ratio())));
    if let Some(row) = far {
        let [x, y, z] = row.parting.place;
        lines.push(format!(
            "pullback and large step differ most for {} ({:+.1} %), mainly near ({x:.4}, {y:.4}, {z:.4}): {:.0} % of the difference",
            row.motion.name(),
            100.0 * (row.large_ratio() - 1.0),
            100.0 * row.parting.share
        ));
    }
    lines.extend(notes(check));
    lines.join("\n")
}

/// Whether the pullback is the derivative, and real steps follow it: bad beyond the tolerance.
fn verdict(check: &GradientCheck, tolerance: f64) -> Verdict {
    if !(worst(check) <= tolerance) {
        return Verdict::Bad;
    }
    match check.rows.iter().any(|row| far(row) > TOLERATED_STEP) {
        true => Verdict::Check,
        false => Verdict::Good,
    }
}

/// The last line: the verdict, with its figures.
fn conclusion(check: &GradientCheck, args: &args::Gradcheck) -> String {
    let (step, tolerance) = (args.step, args.tolerance);
    let relevant = check.rows.iter().filter(|row| is_relevant(row));
    let is_within = |row: &&Row| off(row.large_ratio()) <= 0.02;
    let within = relevant.clone().filter(is_within).count();
    let surface = match check.half_cells {
        Some(size) => format!("a surface that is marched on half cells (--surface {size:.2e})"),
        None => "a finer surface (--surface)".to_owned(),
    };
    let advice = match verdict(check, tolerance) {
        Verdict::Good => String::new(),
        Verdict::Check => format!(
            "; larger steps differ: take smaller ones, {surface} or known normals (--orient signs)"
        ),
        Verdict::Bad => {
            "; what the row counts as changed has no derivative: try --orient signs, --radius or --surface".to_owned()
        }
    };
    format!(
        "verdict: {}: the pullback is within {:.1e} of small steps (tolerance {tolerance:.1e}); {within} of {} motions are within 2 % over ±{step} cell{advice}",
        verdict(check, tolerance),
        worst(check),
        relevant.count()
    )
}

/// Largest error of the pullback against the small step.
fn worst(check: &GradientCheck) -> f64 {
    let errors = check.rows.iter().map(error);
    errors.max_by(f64::total_cmp).unwrap_or(0.0)
}

/// Deviation of the large step from the pullback, relative to the derivative or, of a small one, to a tenth of that of uniform
/// growth.
fn far(row: &Row) -> f64 {
    let size = row.pullback.abs().max(0.1 * row.scale);
    match size > 0.0 {
        true => (row.pullback - row.large.value).abs() / size,
        false => 0.0,
    }
}

/// Notes below the table.
fn notes(check: &GradientCheck) -> Vec<String> {
    let mut lines = Vec::new();
    if check.rows.iter().any(|row| !row.small.is_smooth()) {
        let note = "* the small step also changes a neighborhood, a sign or the cell of a sample: there is no derivative";
        lines.push(note.into());
    }
    let ridges = check.rows.iter().map(|row| row.ridges).max().unwrap_or(0);
    if ridges > 0 {
        lines.push(format!(
            "up to {ridges} cells of a row are ignored: the small step moves them across the medial axis, where φ has no derivative"
        ));
    }
    if check.guarded > 0 {
        lines.push(format!(
            "{} derivatives are undefined or unbounded and were replaced by bounded ones",
            check.guarded
        ));
    }
    lines
}

fn line(row: &Row) -> String {
    let Difference {
        neighborhoods,
        normals,
        edges,
        ..
    } = row.large;
    let ratio = match is_relevant(row) {
        true => format!("{:.4}", row.large_ratio()),
        false => "≈ 0".into(),
    };
    let neighborhoods = match neighborhoods {
        0 => String::new(),
        changed => format!("{changed} neighborhoods, "),
    };
    let unsmooth = if row.small.is_smooth() { "" } else { " *" };
    format!(
        "{:<14} {:>12.5e} {:>12.5e} {:>9.1e} {:>12.5e} {ratio:>7}   {neighborhoods}{normals} normals, {edges} edges{unsmooth}",
        row.motion.name(),
        row.pullback,
        row.small.value,
        error(row),
        row.large.value,
    )
}

/// Whether the derivative is more than that of a surface that moves along itself.
fn is_relevant(row: &Row) -> bool {
    row.pullback.abs() > NEGLIGIBLE * row.scale
}

fn off(ratio: f64) -> f64 {
    (ratio - 1.0).abs()
}

/// Error of the pullback against the small step, relative to the derivative or to the negligible one.
fn error(row: &Row) -> f64 {
    let size = row.pullback.abs().max(NEGLIGIBLE * row.scale);
    match size > 0.0 {
        true => (row.pullback - row.small.value).abs() / size,
        false => 0.0,
    }
}

fn check_tolerance(check: &GradientCheck, tolerance: f64, file: String) -> Result<(), Error> {
    let worst = check
        .rows
        .iter()
        .max_by(|a, b| error(a).total_cmp(&error(b)));
    match worst {
        Some(row) if !(error(row) <= tolerance) => Err(Error::Gradients {
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
    loss: &'static str,
    verdict: Verdict,
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
    edges: usize,
    crossings: usize,
}

impl From<Difference> for StepReport {
    fn from(of: Difference) -> Self {
        Self {
            step: of.step,
            value: of.value,
            neighborhoods: of.neighborhoods,
            normals: of.normals,
            edges: of.edges,
            crossings: of.crossings,
        }
    }
}

fn write(path: &Path, file: &str, check: &GradientCheck, verdict: Verdict) -> Result<(), Error> {
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
        loss: LOSS,
        verdict,
        guarded: check.guarded,
        motions: motions.collect(),
    };
    write_report(path, &report)
}
