//! Arguments of `fit`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use isograd::Backend;
use isograd_fit::Band;

use super::{
    GridArgs, ReadingArgs, Running, STATUS, finite, name_and_value, not_negative, positive,
};

/// Arguments of `fit`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Fit {
    /// Target: a signed distance field, a closed mesh, or a cloud
    #[arg(long, value_name = "FILE")]
    pub target: PathBuf,
    /// Kind of the target file (`cloud` takes the vertices of a mesh)
    #[arg(long, value_name = "KIND", default_value = "auto")]
    pub target_kind: TargetKind,
    /// Fit the parameters of this body (`isograd sample --list` lists all)
    #[arg(long, value_name = "NAME", required_unless_present = "points")]
    pub shape: Option<String>,
    /// Fit the points of this cloud independently
    #[arg(long, value_name = "CLOUD", conflicts_with_all = ["shape", "parameters", "only", "random_start",
        "samples", "resample"])]
    pub points: Option<PathBuf>,
    /// Folder of the outputs: history.json, fit.json, cloud.ply, mesh.ply, sdf.vti, loss.png, epoch_N.png
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Initial value of a parameter; constant where it is not fitted
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = name_and_value,
        allow_hyphen_values = true, help_heading = "Variables")]
    pub parameters: Vec<(String, f64)>,
    /// Fit only these parameters: comma-separated names, or prefixes with a `*`
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        help_heading = "Variables"
    )]
    pub only: Vec<String>,
    /// Random start: each value is multiplied or divided by a factor of up to 1 + SPREAD
    #[arg(long, value_name = "SPREAD", value_parser = not_negative, help_heading = "Variables")]
    pub random_start: Option<f64>,
    /// Seed of the samples and of the random start
    #[arg(
        long,
        value_name = "S",
        default_value = "1",
        help_heading = "Variables"
    )]
    pub seed: u64,
    /// Number of samples of the body [default: 20000]
    #[arg(short = 'n', long = "samples", value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..), help_heading = "Variables")]
    pub samples: Option<u32>,
    /// Draw new samples every K epochs
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..),
        help_heading = "Variables")]
    pub resample: Option<u32>,
    /// Weight of the smoothness of the points' displacement, without unit [default: 0.01]
    #[arg(long, value_name = "W|off", value_parser = off_or, conflicts_with = "shape",
        help_heading = "Variables")]
    pub smoothness: Option<f64>,

    /// Arguments of the grid, in the target's unit; a field as target has its own.
    #[command(flatten)]
    pub grid: GridArgs,

    /// Arguments of the inputs; columns are those of --points if it is there, otherwise of --target.
    #[command(flatten)]
    pub reading: ReadingArgs,

    /// Compare the fields up to this distance from the surface of the target, in the target's unit; auto: 8 cells
    #[arg(
        long,
        value_name = "H|auto|full",
        default_value = "auto",
        help_heading = "Descent"
    )]
    pub band: Band,
    /// Optimizer
    #[arg(long, default_value = "lbfgs", help_heading = "Descent")]
    pub optimizer: Method,
    /// Maximum number of epochs
    #[arg(
        long,
        value_name = "N",
        default_value = "500",
        help_heading = "Descent"
    )]
    pub epochs: u32,
    /// Length of the first steps, relative to the parameters, or in cells for points [default: 0.02 for
    /// adam, 0.05 for lbfgs]
    #[arg(long, value_name = "R", value_parser = positive, help_heading = "Descent")]
    pub rate: Option<f64>,
    /// Decay of the rate of adam: constant, a cosine over all epochs, or a half-life of a tenth of them
    #[arg(long, default_value = "cosine", help_heading = "Descent")]
    pub decay: Decay,
    /// Mean difference of the fields, in cells, at which the fit ends
    #[arg(long, value_name = "CELLS", default_value = "1e-6", value_parser = not_negative,
        help_heading = "Descent")]
    pub tolerance: f64,

    /// Epochs to draw, comma-separated; the last one is always drawn
    #[arg(
        long,
        value_name = "N,…",
        value_delimiter = ',',
        default_value = "0,20,100,500",
        help_heading = "Outputs"
    )]
    pub pictures_at: Vec<u32>,
    /// Azimuth and elevation of the camera, in degrees
    #[arg(long, value_name = "DEGREES", num_args = 2, allow_negative_numbers = true,
        value_parser = finite, help_heading = "Outputs")]
    pub view: Option<Vec<f64>>,
    /// File of the checkpoint [default: checkpoint.json in DIR, written when the run is
    /// stopped]
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub checkpoint: Option<PathBuf>,
    /// Write the checkpoint every K epochs
    #[arg(long, value_name = "K", default_value = "10",
        value_parser = clap::value_parser!(u32).range(1..), help_heading = "Outputs")]
    pub checkpoint_every: u32,
    /// Resume from a checkpoint of a run with the same target, variables and options
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub resume: Option<PathBuf>,
    /// Backend, as for `reconstruct`; the device must support f64
    #[arg(long, default_value = "cpu", help_heading = "Running")]
    pub backend: Backend,
    /// Arguments of the run.
    #[command(flatten)]
    pub running: Running,
}

/// Kind of a target file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TargetKind {
    /// From its content: a field, else a mesh if it has faces, else a cloud
    Auto,
    /// A signed distance field
    Sdf,
    /// A closed mesh
    Mesh,
    /// Points
    Cloud,
}

/// See [`isograd_fit::Optimizer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Limited-memory BFGS: fewest epochs
    Lbfgs,
    /// Adam: slower, and more robust against kinks
    Adam,
}

/// See [`isograd_fit::Decay`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Decay {
    /// No decay
    Constant,
    /// Half a cosine over all epochs
    Cosine,
    /// Half-life of a tenth of the epochs
    Exponential,
}

/// A number, or `off`, which is 0.
fn off_or(text: &str) -> Result<f64, String> {
    match text {
        "off" => Ok(0.0),
        _ => not_negative(text),
    }
}
