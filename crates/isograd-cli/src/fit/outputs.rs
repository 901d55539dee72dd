//! The files of a fit and its summary.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use isograd_fit::{Epoch, Fit, Outcome};
use serde::Serialize;

use crate::args;
use crate::error::Error;
use crate::outputs::{check_extension, check_not_input};
use crate::plot;
use crate::progress::Progress;

/// The folder of `-o`.
pub struct Folder {
    path: PathBuf,
}

/// `history.json`. Scripts depend on these names.
#[derive(Serialize)]
struct History<'a> {
    /// Version of the program.
    version: &'static str,
    /// Why the run ended.
    outcome: Outcome,
    /// Names of the fitted parameters, in the order of each epoch's.
    parameters: &'a [&'static str],
    /// Every epoch, the start first.
    epochs: &'a [Epoch],
}

/// `fit.json`: the end of the fit.
#[derive(Serialize)]
struct Result<'a> {
    version: &'static str,
    outcome: Outcome,
    /// Name of the backend: `cpu`, or a backend and its device.
    backend: &'a str,
    seconds: f64,
    /// The last epoch, without its parameters' names.
    epoch: Option<&'a Epoch>,
    /// The shape; `null` for raw points.
    shape: Option<&'static str>,
    /// All parameters of the shape.
    parameters: BTreeMap<&'static str, f64>,
}

impl Folder {
    /// Checks all paths before the work begins.
    pub fn new(args: &args::Fit) -> std::result::Result<Self, Error> {
        if args.output.exists() && !args.output.is_dir() {
            return Err(Error::Usage(format!(
                "{} is a file; -o takes a folder",
                args.output.display()
            )));
        }
        if let Some(path) = &args.checkpoint {
            check_extension(path, &["json"])?;
            // Its folder may be the one that is created later.
            if path.parent() != Some(&args.output) {
                isograd_io::check_output(path, &["json"])?;
            }
        }
        for name in ["cloud.ply", "mesh.ply", "sdf.vti"] {
            for input in args.points.iter().chain([&args.target]) {
                check_not_input(&args.output.join(name), input)?;
            }
        }
        Ok(Self {
            path: args.output.clone(),
        })
    }

    /// Creates it.
    pub fn create(&self) -> std::result::Result<(), Error> {
        std::fs::create_dir_all(&self.path).map_err(|source| {
            Error::File(isograd_io::Error::Write {
                file: self.path.display().to_string(),
                source,
            })
        })
    }

    /// A file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Everything but pictures of epochs.
    pub fn write_results(
        &self,
        fit: &mut Fit,
        outcome: Outcome,
        seconds: f64,
    ) -> std::result::Result<(), Error> {
        let version = env!("CARGO_PKG_VERSION");
        let history = History {
            version,
            outcome,
            parameters: &fit.parameter_names(),
            epochs: fit.history(),
        };
        write_json(&self.path("history.json"), &history)?;
        let shape = fit.shape();
        let values = shape.iter().flat_map(|shape| shape.parameters());
        let result = Result {
            version,
            outcome,
            backend: fit.backend(),
            seconds,
            epoch: fit.history().last(),
            shape: shape.as_ref().map(|shape| shape.name()),
            parameters: values.map(|(p, value)| (p.name, value)).collect(),
        };
        write_json(&self.path("fit.json"), &result)?;
        isograd_io::write_cloud(&self.path("cloud.ply"), &fit.cloud()?)?;
        plot::write(&self.path("loss.png"), &plot::losses(&losses(fit)))?;
        let result = fit.reconstruction()?;
        let sdf = result.sdf().map_err(isograd_fit::Error::from)?;
        isograd_io::write_field(&self.path("sdf.vti"), sdf)?;
        let mesh = result.mesh().map_err(isograd_fit::Error::from)?;
        isograd_io::write_mesh(&self.path("mesh.ply"), mesh)?;
        Ok(())
    }
}

/// Loss and mean error of each epoch.
fn losses(fit: &Fit) -> Vec<[f64; 2]> {
    let epochs = fit.history().iter();
    epochs.map(|epoch| [epoch.loss, epoch.mean_error]).collect()
}

/// Writes JSON; the file appears whole or not at all.
pub fn write_json(path: &Path, value: &impl Serialize) -> std::result::Result<(), Error> {
    isograd_io::atomic::write(path, |out| {
        serde_json::to_writer(&mut *out, value)?;
        out.write_all(b"\n")
    })?;
    Ok(())
}

/// Prints a summary.
pub fn summarize(fit: &Fit, outcome: Outcome, seconds: f64, args: &args::Fit, progress: &Progress) {
    let Some(last) = fit.history().last() else {
        return;
    };
    let why = match outcome {
        Outcome::Met => "the fields agree",
        Outcome::Minimum => "no lower point was found",
        Outcome::Epochs => "maximum number of epochs",
        Outcome::Stopped => "stopped",
    };
    progress.print(&format!(
        "epoch {}: loss {:.4e}, mean error {:.5} cells; {why} ({seconds:.1} s)",
        last.epoch, last.loss, last.mean_error
    ));
    if args.running.quiet {
        return;
    }
    let first = &fit.history()[0];
    let names = fit.parameter_names();
    for ((name, start), end) in names.iter().zip(&first.parameters).zip(&last.parameters) {
        progress.print(&format!("    {name:<14} {start:<12.6} → {end:.6}"));
    }
}
