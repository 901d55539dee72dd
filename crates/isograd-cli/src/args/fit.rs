//! Arguments of `fit`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use isograd::Backend;

use super::{FullOr, GridArgs, Running, STATUS, finite, name_and_value, not_negative, positive};

/// Arguments of `fit`.
#[derive(Debug, Args)]
#[command(after_help = STATUS)]
pub struct Fit {
    /// The target: a signed distance field, a closed mesh, or a cloud
    #[arg(long, value_name = "FILE")]
    pub target: PathBuf,
    /// What the target file is: by its content, or as named (a mesh as `cloud` is its vertices)
    #[arg(long, value_name = "KIND", default_value = "auto")]
    pub target_kind: TargetKind,
    /// Fit the parameters of this body (`isograd sample --list` lists all)
    #[arg(long, value_name = "NAME", required_unless_present = "points")]
    pub shape: Option<String>,
    /// Fit the points of this cloud, each by itself
    #[arg(long, value_name = "CLOUD", conflicts_with_all = ["shape", "parameters", "only", "random_start",
        "samples", "resample"])]
    pub points: Option<PathBuf>,
    /// Folder for what comes out: history.json, fit.json, cloud.ply, mesh.ply, sdf.vti, loss.png, epoch_N.png
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Value of a parameter at the start, or for good where it is not fitted
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = name_and_value,
        allow_hyphen_values = true, help_heading = "Variables")]
    pub parameters: Vec<(String, f64)>,
    /// Fit these alone: names, or beginnings of names with a `*`, with commas between
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        help_heading = "Variables"
    )]
    pub only: Vec<String>,
    /// Begin at random: each value times up to 1 + SPREAD, or divided by it
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
    /// Weight of the smoothness of the points' displacement [default: 0.01]
    #[arg(
        long,
        value_name = "W|off",
        conflicts_with = "shape",
        help_heading = "Variables"
    )]
    pub smoothness: Option<OffOr>,

    /// The grid, in the target's unit; a field as target brings its own.
    #[command(flatten)]
    pub grid: GridArgs,

    /// Compare the fields where the target is within so many cells of its surface
    #[arg(
        long,
        value_name = "CELLS|full",
        default_value = "8",
        help_heading = "Descent"
    )]
    pub band: FullOr,
    /// The method
    #[arg(long, default_value = "lbfgs", help_heading = "Descent")]
    pub optimizer: Method,
    /// The most epochs
    #[arg(
        long,
        value_name = "N",
        default_value = "500",
        help_heading = "Descent"
    )]
    pub epochs: u32,
    /// Length of the first steps, as a share of the parameters, or in cells for points [default: 0.02 for
    /// adam, 0.05 for lbfgs]
    #[arg(long, value_name = "R", value_parser = positive, help_heading = "Descent")]
    pub rate: Option<f64>,
    /// How the rate of adam falls: not, as a cosine over all epochs, or by half in every tenth of them
    #[arg(long, default_value = "cosine", help_heading = "Descent")]
    pub decay: Decay,
    /// The fit is done when the fields differ by less than this, in cells, in the mean
    #[arg(long, value_name = "CELLS", default_value = "1e-6", value_parser = not_negative,
        help_heading = "Descent")]
    pub tolerance: f64,

    /// Epochs to draw, with commas between; the last one is drawn too
    #[arg(
        long,
        value_name = "N,…",
        value_delimiter = ',',
        default_value = "0,20,100,500",
        help_heading = "Outputs"
    )]
    pub pictures_at: Vec<u32>,
    /// Turn and height of the viewer, in degrees
    #[arg(long, value_name = "DEGREES", num_args = 2, allow_negative_numbers = true,
        value_parser = finite, help_heading = "Outputs")]
    pub view: Option<Vec<f64>>,
    /// Keep the state in this file, to go on from [default: checkpoint.json in DIR, written when the run is
    /// stopped]
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub checkpoint: Option<PathBuf>,
    /// Write the checkpoint every K epochs
    #[arg(long, value_name = "K", default_value = "10",
        value_parser = clap::value_parser!(u32).range(1..), help_heading = "Outputs")]
    pub checkpoint_every: u32,
    /// Go on from a checkpoint of a run with the same target, variables and options
    #[arg(long, value_name = "FILE", help_heading = "Outputs")]
    pub resume: Option<PathBuf>,
    /// Where to reconstruct, as for `reconstruct`; the device must have f64
    #[arg(long, default_value = "cpu", help_heading = "Running")]
    pub backend: Backend,
    /// How to run.
    #[command(flatten)]
    pub running: Running,
}

/// What a target file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TargetKind {
    /// By its content: a field, else a mesh if it has faces, else a cloud
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
    /// Adam: longer, and less troubled by kinks
    Adam,
}

/// See [`isograd_fit::Decay`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Decay {
    /// It stays
    Constant,
    /// As half a cosine over all epochs
    Cosine,
    /// By half in every tenth of the epochs
    Exponential,
}

/// A number, or `off`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffOr(pub f64);

impl std::str::FromStr for OffOr {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "off" => Ok(Self(0.0)),
            _ => not_negative(text).map(Self),
        }
    }
}
